#include "image_file.h"

#include "renderer/base/fs.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The next number of a PPM's header, after blanks and comments; 0 if there is none. */
static int next_number(FILE *f)
{
    int c, number = 0;
    while (isspace(c = fgetc(f)) || c == '#')
        for (bool in_comment = c == '#'; in_comment; in_comment = c != '\n' && c != EOF)
            c = fgetc(f);
    ungetc(c, f);
    return fscanf(f, "%9d", &number) == 1 ? number : 0;
}

/* Codes up to another number than 255 or 65535 are spread over these when they are read, so that nothing would tell how
 * coarse they were. */
static bool has_all_codes(const char *path, const struct image_info *info)
{
    int brightest = 0;
    FILE *f = fs_open(path);
    if (f == NULL)
        return false;
    fseek(f, 2, SEEK_SET);      /* after "P3" or the like */
    for (int i = 0; i < 3; i++) /* width, height, brightest code */
        brightest = next_number(f);
    fclose(f);
    return brightest == (info->type == IMAGE_INT8 ? 255 : 65535);
}

static bool check_file(const char *path, const struct image_info *info, struct err *e)
{
    bool integer = info->type == IMAGE_INT8 || info->type == IMAGE_INT16;
    bool is_float = info->type == IMAGE_HALF || info->type == IMAGE_FLOAT;
    bool known = (strcmp(info->format, "png") == 0 && integer) ||
                 ((strcmp(info->format, "openexr") == 0 || strcmp(info->format, "hdr") == 0 ||
                   strcmp(info->format, "pnm") == 0) &&
                  is_float);
    if (strcmp(info->format, "pnm") == 0 && !is_float) {
        if (!has_all_codes(path, info)) /* then OpenImageIO 2.5 calls it neither 8 nor 16 bits */
            return err_set(e, "%s: the brightest code of a PPM must be 255 or 65535", path);
        known = integer;
    }
    if (!known)
        return err_set(e,
                       "%s: an image to compare is an EXR, HDR or PFM of floats or a PNG or PPM of "
                       "8 or 16 bits, this is %s",
                       path, info->format);
    if (info->parts > 1)
        return err_set(e, "%s: has %d images in one file, which of them?", path, info->parts);
    if (info->orientation != 1)
        return err_set(e, "%s: is stored rotated or mirrored (orientation %d)", path,
                       info->orientation);
    if (info->is_cropped && strcmp(info->format, "openexr") != 0)
        return err_set(e, "%s: stores another rectangle than the image", path);
    return true;
}

static bool is_stored(const struct image_info *info, size_t x, size_t y)
{
    int right = (int)x - info->data_x, down = (int)y - info->data_y;
    return right >= 0 && right < info->data_width && down >= 0 && down < info->data_height;
}

static bool channels_of(const char *path, const struct image *im, int at[3], int *alpha,
                        struct err *e)
{
    static const char *const rgb[3] = {"R", "G", "B"};
    int y = image_channel(im, "Y");
    *alpha = image_channel(im, "A");
    bool has_all = true;
    for (int c = 0; c < 3; c++) {
        at[c] = image_channel(im, rgb[c]);
        has_all = has_all && at[c] >= 0;
    }
    if (has_all)
        return true;
    bool grey = y >= 0 && im->channels == 1 + (*alpha >= 0);
    for (int c = 0; c < 3; c++)
        at[c] = y;
    return grey ||
           err_set(e, "%s: has no channels R, G, B, nor is it grey; its first is '%s' of %d", path,
                   im->names[0], im->channels);
}

/* Paths per pixel, mean over the image, that a moments EXR states; else 0. */
static double paths_of(const struct image *im)
{
    const int n = image_channel(im, "n");
    const char *each = image_get_attr(im, "assay:spp");
    if (n < 0 || each == NULL || image_channel(im, "M2.R") < 0)
        return 0;
    const size_t pixels = (size_t)im->width * (size_t)im->height;
    double sum = 0;
    for (size_t p = 0; p < pixels; p++)
        sum += im->data[(size_t)im->channels * p + (size_t)n];
    return fmax(0, sum / (double)pixels * atof(each));
}

/* image_file_from_image() of a file that check_file() has passed. */
static bool take_pixels(const char *path, const struct image *im, const struct image_info *info,
                        struct image_file *out, struct err *e)
{
    int at[3], alpha;
    *out = (struct image_file){.width = im->width, .height = im->height, .info = *info};
    if (!channels_of(path, im, at, &alpha, e))
        return false;
    out->spp = paths_of(im);
    out->num_other = im->channels - (at[0] == at[1] ? 1 : 3) - (alpha >= 0);
    size_t pixels = (size_t)im->width * (size_t)im->height;
    out->rgb = malloc(3 * pixels * sizeof *out->rgb);
    if (out->rgb == NULL)
        return err_set(e, "%s: out of memory for %zu pixels", path, pixels);
    for (size_t p = 0; p < pixels; p++) {
        const float *px = im->data + (size_t)im->channels * p;
        size_t x = p % (size_t)im->width, y = p / (size_t)im->width;
        bool ok = true;
        if (alpha >= 0 && px[alpha] != 1 && is_stored(info, x, y))
            ok = err_set(e, "%s: pixel %zu,%zu is not opaque (alpha %g)", path, x, y,
                         (double)px[alpha]);
        for (size_t c = 0; ok && c < 3; c++) {
            float v = px[at[c]];
            if (!isfinite(v))
                ok = err_set(e, "%s: pixel %zu,%zu is %s", path, x, y,
                             isnan(v) ? "not a number" : "infinite");
            out->rgb[3 * p + c] = v;
        }
        if (!ok) {
            image_file_free(out);
            return false;
        }
    }
    return true;
}

bool image_file_from_image(const char *path, const struct image *im, const struct image_info *info,
                           struct image_file *out, struct err *e)
{
    return check_file(path, info, e) && take_pixels(path, im, info, out, e);
}

bool image_file_read(const char *path, struct image_file *out, struct err *e)
{
    struct image_info info;
    return image_inspect(path, &info, e) && image_file_read_inspected(path, &info, out, e);
}

bool image_file_read_inspected(const char *path, const struct image_info *info,
                               struct image_file *out, struct err *e)
{
    struct image im = {0};
    if (!check_file(path, info, e) || !image_read(path, &im, NULL, e))
        return false;
    bool ok = image_uncrop(info, &im, e) && take_pixels(path, &im, info, out, e);
    image_free(&im);
    return ok;
}

void image_file_free(struct image_file *p)
{
    free(p->rgb);
    *p = (struct image_file){0};
}
