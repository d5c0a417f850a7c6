#include "student.h"

#include "../renderer/sha256.h"
#include "curve.h"
#include "picture.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double clip_sd = 5; /* of the clipping point, where nothing is compared */

static bool check_header(const char *path, int width, int height, struct image_info *info,
                         struct err *e)
{
    if (!image_inspect(path, info, e))
        return false;
    if (info->width != width || info->height != height)
        return err_set(e, "the picture is %d x %d pixels, not %d x %d", info->width, info->height,
                       width, height);
    return info->channels <= 64 || err_set(e, "the picture has %d channels", info->channels);
}

static bool allocate(struct student *s, struct err *e)
{
    size_t n = 3 * (size_t)s->width * (size_t)s->height;
    s->mean = calloc(n, sizeof *s->mean);
    s->tolerance = calloc(n, sizeof *s->tolerance);
    s->rounding = calloc(n, sizeof *s->rounding);
    s->clipped = calloc(n, 1);
    return (s->mean != NULL && s->tolerance != NULL && s->rounding != NULL && s->clipped != NULL) ||
           err_set(e, "out of memory for %d x %d pixels", s->width, s->height);
}

static void set_code(struct student *s, size_t i, const struct curve *curve, int k, int steps)
{
    double lo, hi;
    curve_bin(curve, k, steps, &lo, &hi);
    s->clipped[i] = k == steps;
    s->mean[i] = k == steps ? s->clip : (lo + hi) / 2;
    s->tolerance[i] = k == steps ? 0 : (hi - lo) / 2;
    s->rounding[i] = k == steps ? 0 : (hi - lo) * (hi - lo) / 12;
}

/* Half floats are rounded, RGBE may be cut off. */
static double float_step(const struct picture *pic, float v, const float *px)
{
    if (pic->info.type == IMAGE_HALF)
        return fmax(ldexp(fabs((double)v), -10), 0x1p-24);
    double brightest = fmax(px[0], fmax(px[1], px[2]));
    int exponent;
    frexp(brightest, &exponent);
    return strcmp(pic->info.format, "hdr") == 0 && brightest > 0 ? 2 * ldexp(1, exponent - 8) : 0;
}

static bool fill(struct student *s, const struct picture *pic, const struct curve *curve,
                 struct err *e)
{
    size_t n = 3 * (size_t)s->width * (size_t)s->height;
    int steps = pic->info.type == IMAGE_INT8 ? 255 : pic->info.type == IMAGE_INT16 ? 65535 : 0;
    double lo, hi;
    s->clip = INFINITY;
    if (steps > 0) {
        curve_bin(curve, steps, steps, &lo, &hi);
        s->clip = lo;
    }
    for (size_t i = 0; i < n; i++) {
        float v = pic->rgb[i];
        if (!(v >= 0))
            return err_set(e, "the picture has negative numbers");
        if (steps > 0) {
            set_code(s, i, curve, (int)lround((double)v * steps), steps);
            continue;
        }
        double step = float_step(pic, v, pic->rgb + i / 3 * 3);
        s->mean[i] = (double)v;
        s->tolerance[i] = step / 2;
        s->rounding[i] = step * step / 12;
    }
    return true;
}

bool student_read(const char *path, const char *curve, int width, int height, struct student *out,
                  struct err *e)
{
    struct picture pic;
    struct image_info info;
    struct curve c;
    *out = (struct student){.width = width, .height = height};
    if (!check_header(path, width, height, &info, e) || !curve_parse(curve, &c, e) ||
        !picture_read(path, &pic, e))
        return false;
    bool ok = allocate(out, e) && fill(out, &pic, &c, e);
    picture_free(&pic);
    if (!ok)
        student_free(out);
    else
        ok = sha256_file(path, out->sha256, e);
    return ok;
}

void student_free(struct student *s)
{
    free(s->mean);
    free(s->tolerance);
    free(s->rounding);
    free(s->clipped);
    *s = (struct student){0};
}

void student_add(struct student *dst, const struct student *src)
{
    for (size_t i = 0; i < 3 * (size_t)dst->width * (size_t)dst->height; i++) {
        dst->mean[i] += src->mean[i];
        dst->tolerance[i] += src->tolerance[i];
        dst->rounding[i] += src->rounding[i];
        dst->clipped[i] |= src->clipped[i];
    }
}

double student_expected_sd(const struct moments *reference, size_t i, double spp)
{
    double n = reference->n[i / 3], paths = fmax(1, reference->spp);
    return n > 1 ? sqrt(reference->m2[i] / (n - 1) * paths / spp) : 0;
}

bool student_comparable(const struct student *s, const struct moments *reference, double spp,
                        size_t p)
{
    if (reference != NULL) {
        for (size_t i = 3 * p; i < 3 * p + 3; i++)
            if (fabs(reference->mean[i] - s->clip) <
                clip_sd * student_expected_sd(reference, i, spp) + s->tolerance[i])
                return false;
        return true;
    }
    int x = (int)(p % (size_t)s->width), y = (int)(p / (size_t)s->width);
    for (int v = y - 1; v <= y + 1; v++)
        for (int u = x - 1; u <= x + 1; u++) {
            if (u < 0 || v < 0 || u >= s->width || v >= s->height)
                continue;
            const unsigned char *c = s->clipped + 3 * ((size_t)v * (size_t)s->width + (size_t)u);
            if (c[0] || c[1] || c[2])
                return false;
        }
    return true;
}
