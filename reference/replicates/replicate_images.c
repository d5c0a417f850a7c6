#include "replicate_images.h"

#include "renderer/base/sha256.h"
#include "renderer/image/image_oiio.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const names[] = {"R", "G", "B"};

void replicate_images_path(const char *dir, const char *prefix, int number,
                           char path[REPLICATE_IMAGE_PATH])
{
    assert(strlen(dir) + strlen(prefix) + 32 < REPLICATE_IMAGE_PATH);
    snprintf(path, REPLICATE_IMAGE_PATH, "%s/%s_%04d.exr", dir, prefix, number);
}

/* half not NULL: any format that image_read() takes; NULL: EXR of 32 bits. */
static float *read_rgb(const char *path, int width, int height, bool below_zero, double scale,
                       bool *half, struct err *e)
{
    struct image im = {0};
    bool fewer_bits = false;
    if (!(half != NULL ? image_read : image_read_exr)(path, &im, &fewer_bits, e))
        return NULL;
    const size_t values = 3 * (size_t)im.width * (size_t)im.height;
    const int at[3] = {image_channel(&im, "R"), image_channel(&im, "G"), image_channel(&im, "B")};
    const bool has_rgb = at[0] >= 0 && at[1] >= 0 && at[2] >= 0;
    bool ok =
        (im.width == width && im.height == height) ||
        err_set(e, "%s: %d x %d pixels, not %d x %d", path, im.width, im.height, width, height);
    if (ok && half != NULL)
        ok = has_rgb || err_set(e, "%s: no channels R, G and B", path);
    else if (ok)
        ok = (has_rgb && !fewer_bits) ||
             err_set(e, "%s: not the 32-bit R, G, B that was asked for", path);
    float *rgb_out = ok ? malloc(values * sizeof *rgb_out) : NULL;
    ok = ok && (rgb_out != NULL || err_set(e, "%s: out of memory", path));
    for (size_t i = 0; ok && i < values; i++) {
        rgb_out[i] =
            (float)(scale * (double)im.data[i / 3 * (size_t)im.channels + (size_t)at[i % 3]]);
        ok = (isfinite(rgb_out[i]) && (rgb_out[i] >= 0 || below_zero)) ||
             err_set(e, "%s: pixel %d,%d is %s", path, (int)(i / 3 % (size_t)im.width),
                     (int)(i / 3 / (size_t)im.width),
                     below_zero ? "not finite" : "negative or not finite");
    }
    if (half != NULL)
        *half |= fewer_bits;
    image_free(&im);
    if (ok)
        return rgb_out;
    free(rgb_out);
    return NULL;
}

float *replicate_images_read(const char *path, int width, int height, bool below_zero,
                             struct err *e)
{
    return read_rgb(path, width, height, below_zero, 1, NULL, e);
}

float *replicate_images_read_any(const char *path, int width, int height, double scale, bool *half,
                                 struct err *e)
{
    return read_rgb(path, width, height, true, scale, half, e);
}

bool replicate_images_write(const char *path, int width, int height, const float *pixels_rgb,
                            struct err *e)
{
    struct image im;
    if (!image_alloc(&im, width, height, 3, names, e))
        return err_prefix(e, "%s", path);
    memcpy(im.data, pixels_rgb, 3 * (size_t)width * (size_t)height * sizeof *im.data);
    bool ok = image_write_exr(path, &im, e);
    image_free(&im);
    return ok;
}

bool replicate_repeats_alloc(struct replicate_repeats *r, int capacity, struct err *e)
{
    *r = (struct replicate_repeats){.capacity = capacity, .same = -1, .without_noise = true};
    r->sha256 = malloc((size_t)capacity * sizeof *r->sha256);
    return r->sha256 != NULL || err_set(e, "hashes of images: out of memory");
}

static bool is_constant(const float *pixels_rgb, size_t pixels)
{
    for (size_t i = 3; i < 3 * pixels; i++)
        if (pixels_rgb[i] != pixels_rgb[i - 3])
            return false;
    return true;
}

int replicate_repeats_add(struct replicate_repeats *r, const float *pixels_rgb, size_t pixels)
{
    int k = 0;
    assert(r->num < r->capacity);
    sha256_bytes(pixels_rgb, 3 * pixels * sizeof *pixels_rgb, r->sha256[r->num]);
    while (memcmp(r->sha256[k], r->sha256[r->num], sizeof *r->sha256) != 0)
        k++;
    if (k < r->num && r->same < 0)
        r->same = r->num;
    r->without_noise = r->without_noise && k == 0 && is_constant(pixels_rgb, pixels);
    r->num++;
    return k;
}

void replicate_repeats_free(struct replicate_repeats *r)
{
    free(r->sha256);
    *r = (struct replicate_repeats){0};
}
