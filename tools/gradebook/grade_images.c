#include "grade_images.h"

#include "renderer/image/tone.h"
#include "tools/html/html.h"
#include "tools/images/image_file.h"
#include "tools/images/tone_curve.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* 3 codes per pixel. */
struct codes {
    int width, height;
    uint8_t *rgb;
};

static bool codes_alloc(int width, int height, struct codes *out, struct err *e)
{
    *out = (struct codes){width, height, malloc(3 * (size_t)width * (size_t)height)};
    return out->rgb != NULL || err_set(e, "out of memory");
}

/* Codes as they are, floats by sRGB. */
static bool codes_of_file(const struct image_file *file, struct codes *out, struct err *e)
{
    bool coded = file->info.type == IMAGE_INT8 || file->info.type == IMAGE_INT16;
    if (!codes_alloc(file->width, file->height, out, e))
        return false;
    for (size_t i = 0; i < 3 * (size_t)out->width * (size_t)out->height; i++)
        out->rgb[i] = coded ? (uint8_t)lround(255 * (double)file->rgb[i])
                            : tone_map(TONE_SRGB, (double)file->rgb[i]);
    return true;
}

/* The brightest code that stands for no more than the radiance. */
static uint8_t code_of(const struct curve *c, double radiance)
{
    int lo = 0, hi = 255;
    while (lo < hi) {
        int k = (lo + hi + 1) / 2;
        double from, to;
        tone_curve_bin(c, k, 255, &from, &to);
        if (radiance >= from)
            lo = k;
        else
            hi = k - 1;
    }
    return (uint8_t)lo;
}

static bool codes_of_reference(const struct moments *m, const struct curve *c, struct codes *out,
                               struct err *e)
{
    if (!codes_alloc(m->width, m->height, out, e))
        return false;
    for (size_t i = 0; i < 3 * (size_t)m->width * (size_t)m->height; i++)
        out->rgb[i] = code_of(c, m->mean[i]);
    return true;
}

/* White where they are alike, red where a is brighter, blue where it is darker; full colour from 64 codes. */
static bool codes_of_difference(const struct codes *a, const struct codes *b, struct codes *out,
                                struct err *e)
{
    if (!codes_alloc(a->width, a->height, out, e))
        return false;
    for (size_t p = 0; p < (size_t)a->width * (size_t)a->height; p++) {
        int d = 0;
        for (size_t i = 3 * p; i < 3 * p + 3; i++)
            d += a->rgb[i] - b->rgb[i];
        int other = 255 - (abs(d) < 192 ? 255 * abs(d) / 192 : 255);
        out->rgb[3 * p] = (uint8_t)(d > 0 ? 255 : other);
        out->rgb[3 * p + 1] = (uint8_t)other;
        out->rgb[3 * p + 2] = (uint8_t)(d > 0 ? other : 255);
    }
    return true;
}

static bool show(FILE *f, const struct codes *c, int width, const char *what, const char *whose,
                 struct err *e)
{
    uint8_t *bytes;
    size_t size;
    if (!image_encode_png(c->width, c->height, c->rgb, &bytes, &size, e))
        return false;
    html_print(f, "<figure><img width=\"%d\" alt=\"%s, %s\" src=\"data:image/png;base64,", width,
               what, whose);
    html_base64(f, bytes, size);
    html_print(f, "\"><figcaption>%s, %s</figcaption></figure>\n", what, whose);
    free(bytes);
    return true;
}

/* The tile with its neighbours, enlarged: three by three of them, fewer at the rim. */
static bool show_crop(FILE *f, const struct codes *c, const json_t *tile, const char *whose,
                      struct err *e)
{
    char what[160];
    struct codes crop;
    if (json_array_size(tile) != 2)
        return true;
    int x = (int)json_number_value(json_array_get(tile, 0)) - GRADE_TILE,
        y = (int)json_number_value(json_array_get(tile, 1)) - GRADE_TILE;
    int right = x + 3 * GRADE_TILE < c->width ? x + 3 * GRADE_TILE : c->width,
        bottom = y + 3 * GRADE_TILE < c->height ? y + 3 * GRADE_TILE : c->height;
    x = x > 0 ? x : 0;
    y = y > 0 ? y : 0;
    if (right <= x || bottom <= y)
        return true;
    if (!codes_alloc(right - x, bottom - y, &crop, e))
        return false;
    for (int row = 0; row < crop.height; row++)
        memcpy(crop.rgb + 3 * (size_t)(row * crop.width),
               c->rgb + 3 * ((size_t)(y + row) * (size_t)c->width + (size_t)x),
               3 * (size_t)crop.width);
    snprintf(what, sizeof what, "pixels %d,%d to %d,%d, around what differs most", x, y, right - 1,
             bottom - 1);
    bool ok = show(f, &crop, 8 * crop.width, what, whose, e);
    free(crop.rgb);
    return ok;
}

/* Shows the reference and, if the sizes agree, the difference. */
static bool show_reference(FILE *f, const struct codes *seen, const struct codes *right,
                           const char *name, struct err *e)
{
    struct codes difference = {0};
    bool same = right->width == seen->width && right->height == seen->height,
         ok = show(f, right, GRADE_SHOWN, name, "the reference", e) &&
              (!same ||
               (codes_of_difference(seen, right, &difference, e) &&
                show(f, &difference, GRADE_SHOWN, name,
                     "the difference: red too bright, blue too dark, full colour from 64 codes",
                     e)));
    free(difference.rgb);
    return ok;
}

bool grade_images(FILE *f, const char *path, const char *name, const json_t *tile,
                  const struct moments *reference, const char *curve, struct err *e)
{
    const char *whose = curve == NULL ? "yours" : "the student's";
    struct image_file file;
    struct codes seen, right = {0};
    struct curve c;
    struct err why;
    if (!image_file_read(path, &file, &why)) /* what is wrong with it has been said */
        return !err_is_of_memory(&why) || err_set(e, "%s", why.msg);
    bool coded = file.info.type == IMAGE_INT8 || file.info.type == IMAGE_INT16,
         beside = curve != NULL && reference != NULL,
         ok = codes_of_file(&file, &seen, e) && show(f, &seen, GRADE_SHOWN, name, whose, e);
    ok = ok && (!beside || (tone_curve_parse(coded ? curve : "srgb", &c, e) &&
                            codes_of_reference(reference, &c, &right, e) &&
                            show_reference(f, &seen, &right, name, e)));
    ok = ok && show_crop(f, &seen, tile, whose, e) &&
         (!beside || show_crop(f, &right, tile, "the reference", e));
    free(seen.rgb);
    free(right.rgb);
    image_file_free(&file);
    return ok;
}
