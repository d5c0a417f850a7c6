/* Mitsuba 3, as its sources have it:
 *   src/integrators/moment.cpp: channels NAME.X, NAME.Y, NAME.Z (CIE XYZ of a sample of the nested
 *   integrator NAME) and m2_NAME.X .. (of its square), both averaged by the film over all samples, so
 *   that m2 - mean^2 is the variance of one sample with the divisor n, not n - 1.
 *   src/render/tests/test_renders.py: a reference NAME.exr and NAME_var.exr beside it, the second
 *   being that variance of X, Y, Z written through the XYZ to RGB matrix as if it were a colour.
 * Neither file says how many samples there were. pbrt's Variance.* channels are refused: they leave
 * out samples that hit nothing, and are in sensor colours while R, G, B are not (film.cpp). */
#include "input_internal.h"
#include "tools/images/image_file.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ITU-R BT.709 to CIE XYZ, with the digits that Mitsuba uses. */
static const double xyz_of_rgb[3][3] = {
    {0.412453, 0.357580, 0.180423}, {0.212671, 0.715160, 0.072169}, {0.019334, 0.119193, 0.950227}};

static void matrix(const double in[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = xyz_of_rgb[i][0] * in[0] + xyz_of_rgb[i][1] * in[1] + xyz_of_rgb[i][2] * in[2];
}

/* v becomes (matrix f(v))^power: of moments, with f the root of that power, a bound for any correlation
 * of the channels, which is reached if they are fully correlated. */
static void through(double *v, double (*f)(double), double power)
{
    double in[3] = {f(v[0]), f(v[1]), f(v[2])}, out[3];
    matrix(in, out);
    for (int i = 0; i < 3; i++)
        v[i] = pow(out[i], power);
}

void input_to_xyz(struct input *in)
{
    if (in->is_xyz)
        return;
    in->is_xyz = true;
    size_t pixels = (size_t)in->m.width * (size_t)in->m.height;
    for (size_t i = 0; i < 3 * pixels; i += 3) {
        double mean[3];
        matrix(in->m.mean + i, mean);
        memcpy(in->m.mean + i, mean, sizeof mean);
        through(in->m.m2 + i, sqrt, 2);
        through(in->m.m3 + i, cbrt, 3);
        if (in->rounding != NULL)
            through(in->rounding + i, sqrt, 2);
        if (in->m.tolerance != NULL) {
            matrix(in->m.tolerance + i, mean);
            memcpy(in->m.tolerance + i, mean, sizeof mean);
        }
    }
}

static bool needs(const char *path, char side, const struct image_info *info,
                  const struct input_options *opt, struct err *e)
{
    if (info->type != IMAGE_FLOAT)
        return err_set(e,
                       "%s: moments need 32-bit floats, this file has fewer bits (Mitsuba: "
                       "component_format float32)",
                       path);
    if (!(opt->spp > 0))
        return err_set(e, "%s: has a variance but not the number of samples: say it with --spp-%c",
                       path, side);
    return true;
}

/* Mean and variance of X, Y, Z of one pixel; scale: size of the numbers whose difference the variance is.
 * *below counts variances that rounding has made negative. */
static bool set_pixel(const char *path, struct moments *m, size_t p, const double mean[3],
                      const double variance[3], const double scale[3], double spp, size_t *below,
                      struct err *e)
{
    m->n[p] = spp;
    /* Below 0 by no more than a matrix there and back and a float32 sum of n terms explain: (n - 1) 2^-24 of the
     * terms' sum [Higham93], reached where all samples are the same and lose the same. */
    double rounding = 1e-5 + spp * 0x1p-24;
    for (size_t c = 0; c < 3; c++) {
        size_t x = p % (size_t)m->width, y = p / (size_t)m->width;
        if (!isfinite(mean[c]) || !isfinite(variance[c]))
            return err_set(e, "%s: pixel %zu,%zu is not finite", path, x, y);
        if (variance[c] < -rounding * scale[c])
            return err_set(e, "%s: pixel %zu,%zu has a negative variance %g", path, x, y,
                           variance[c]);
        *below += variance[c] < 0;
        double least = -rounding * (fabs(mean[0]) + fabs(mean[1]) + fabs(mean[2]));
        m->mean[3 * p + c] = mean[c] < 0 && mean[c] >= least ? 0 : mean[c];
        m->m2[3 * p + c] = spp * fmax(0, variance[c]);
    }
    return true;
}

/* "NAME.X", "m2_NAME.X": the index of m2_NAME.X, -1 if there is none, -2 if several. */
static int find_square(const struct image *im)
{
    int found = -1;
    for (int c = 0; c < im->channels; c++) {
        size_t n = strlen(im->names[c]);
        if (strncmp(im->names[c], "m2_", 3) != 0 || n < 5 ||
            strcmp(im->names[c] + n - 2, ".X") != 0)
            continue;
        if (found >= 0)
            return -2;
        found = c;
    }
    return found;
}

static bool read_integrator(const char *path, const struct image *im, int square,
                            const struct input_options *opt, struct moments *m, size_t *below,
                            struct err *e)
{
    int at[6];
    char name[32];
    snprintf(name, sizeof name, "%s", im->names[square]);
    for (int c = 0; c < 3; c++) {
        name[strlen(name) - 1] = "XYZ"[c];
        at[c] = image_channel(im, name + 3);
        at[3 + c] = image_channel(im, name);
        if (at[c] < 0 || at[3 + c] < 0)
            return err_set(e, "%s: has a channel %s but not %s", path, im->names[square],
                           at[c] < 0 ? name + 3 : name);
    }
    size_t pixels = (size_t)im->width * (size_t)im->height;
    for (size_t p = 0; p < pixels; p++) {
        const float *px = im->data + (size_t)im->channels * p;
        double mean[3], variance[3], squares[3];
        for (int c = 0; c < 3; c++) {
            mean[c] = px[at[c]];
            squares[c] = px[at[3 + c]];
            variance[c] = squares[c] - mean[c] * mean[c];
        }
        if (!set_pixel(path, m, p, mean, variance, squares, opt->spp, below, e))
            return false;
    }
    return true;
}

static bool read_pair(const char *path, const char *var_path, const struct image *im,
                      const struct image_info *info, const struct input_options *opt,
                      struct moments *m, size_t *below, struct err *e)
{
    struct image_file mean = {0}, var = {0};
    bool ok = image_file_from_image(path, im, info, &mean, e) && image_file_read(var_path, &var, e);
    if (ok && (mean.width != var.width || mean.height != var.height))
        ok = err_set(e, "%s: is %d x %d pixels, %s is %d x %d", var_path, var.width, var.height,
                     path, mean.width, mean.height);
    if (ok && var.info.type != IMAGE_FLOAT)
        ok = err_set(e, "%s: moments need 32-bit floats, this file has fewer bits", var_path);
    size_t pixels = (size_t)im->width * (size_t)im->height;
    for (size_t p = 0; ok && p < pixels; p++) {
        double colour[2][3], xyz[2][3], scale[3];
        for (int c = 0; c < 3; c++) {
            colour[0][c] = mean.rgb[3 * p + (size_t)c];
            colour[1][c] = var.rgb[3 * p + (size_t)c];
        }
        matrix(colour[0], xyz[0]);
        matrix(colour[1], xyz[1]);
        /* The variance was E[x^2] - E[x]^2 before it was written. */
        for (int c = 0; c < 3; c++)
            scale[c] =
                xyz[1][0] + xyz[1][1] + xyz[1][2] + pow(xyz[0][0] + xyz[0][1] + xyz[0][2], 2);
        ok = set_pixel(var_path, m, p, xyz[0], xyz[1], scale, opt->spp, below, e);
    }
    image_file_free(&mean);
    image_file_free(&var);
    return ok;
}

/* "NAME_var.exr" of "NAME.exr" if it is there. */
static bool variance_beside(const char *path, char *out, size_t size)
{
    size_t n = strlen(path);
    if (n < 4 || strcmp(path + n - 4, ".exr") != 0)
        return false;
    snprintf(out, size, "%.*s_var.exr", (int)(n - 4), path);
    FILE *f = fopen(out, "rb");
    if (f != NULL)
        fclose(f);
    return f != NULL;
}

bool input_mitsuba(const char *path, char side, const struct image *im,
                   const struct image_info *info, const struct input_options *opt,
                   struct input *out, bool *is_it, struct notes *notes, struct err *e)
{
    char beside[4096];
    size_t below = 0;
    int square = find_square(im);
    bool pair = square == -1 && variance_beside(path, beside, sizeof beside);
    *is_it = square != -1 || pair;
    if (image_channel(im, "Variance.R") >= 0)
        return err_set(e,
                       "%s: pbrt's Variance.* channels leave out samples that hit nothing and are "
                       "in other colours than R, G, B: give a directory of replicates",
                       path);
    if (square == -2)
        return err_set(e, "%s: has moments of several integrators, which of them?", path);
    if (!*is_it)
        return true;
    if (!needs(path, side, info, opt, e) || !moments_alloc(&out->m, im->width, im->height, e) ||
        !(pair ? read_pair(path, beside, im, info, opt, &out->m, &below, e)
               : read_integrator(path, im, square, opt, &out->m, &below, e)))
        return false;
    if (below > 0)
        input_notes_add(notes, "%s: %zu variances are below 0 by rounding and taken as 0", path,
                        below);
    out->kind = INPUT_VARIANCE;
    out->is_xyz = true;
    input_note_crop(notes, path, info);
    input_notes_add(
        notes,
        "%s: Mitsuba's variance%s%s, that of one sample with n below it, n = %g as told; its "
        "film must have a box filter of one pixel and its sampler independent samples",
        path, pair ? " in " : "", pair ? beside : "", opt->spp);
    input_notes_add(notes,
                    "%s: has no skewness; bounded by how much the variances of the sides, and of "
                    "neighbouring pixels, differ, in the direction that hurts",
                    path);
    return true;
}
