/* Images without moments: their noise is estimated from neighbouring pixels, and rounding is
 * taken into account. */
#include "tools/images/tone_curve.h"
#include "input_internal.h"
#include "tools/images/image_file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What one stored number can stand for. */
struct bin {
    double mean;
    double step;      /* width */
    double tolerance; /* how far a whole area may be off in the same direction */
    bool saturated;
};

/* RGBE: 8 bits of mantissa under the exponent of the brightest channel; some writers round, some cut
 * off, so that a whole step may be missing. */
static double rgbe_step(const float *px)
{
    double brightest = fmaxf(px[0], fmaxf(px[1], px[2]));
    int exponent;
    frexp(brightest, &exponent);
    return brightest > 0 ? ldexp(1, exponent - 8) : 0;
}

static struct bin bin_of(const struct image_file *pic, const struct curve *curve, const float *px,
                         float v)
{
    struct bin b = {.mean = v};
    switch (pic->info.type) {
    case IMAGE_INT8:
    case IMAGE_INT16: {
        int steps = pic->info.type == IMAGE_INT8 ? 255 : 65535, k = (int)lround((double)v * steps);
        double lo, hi;
        tone_curve_bin(curve, k, steps, &lo, &hi);
        hi = isinf(hi) ? lo : hi; /* it is saturated: how bright it is is not known anyway */
        b = (struct bin){(lo + hi) / 2, hi - lo, (hi - lo) / 2, k == steps};
        break;
    }
    case IMAGE_HALF: /* 11 bits, to the nearest; 2^-24 is the smallest step */
        b.step = fmax(ldexp(fabs((double)v), -10), 0x1p-24);
        b.tolerance = b.step / 2;
        break;
    case IMAGE_FLOAT:
    case IMAGE_OTHER:
        if (strcmp(pic->info.format, "hdr") == 0)
            b.step = b.tolerance = rgbe_step(px);
        break;
    }
    return b;
}

static bool is_coded(const struct image_file *pic)
{
    return pic->info.type == IMAGE_INT8 || pic->info.type == IMAGE_INT16;
}

static void tell(const char *path, const struct image_file *pic, const char *curve,
                 struct notes *notes)
{
    if (is_coded(pic))
        input_notes_add(notes,
                        "%s: %d bits by the curve %s; within a code any radiance is taken to be as "
                        "likely, and half a code is allowed for everywhere",
                        path, pic->info.type == IMAGE_INT8 ? 8 : 16, curve);
    else if (pic->info.type == IMAGE_HALF)
        input_notes_add(notes, "%s: half floats; their rounding, 0.05 %%, is allowed for", path);
    else if (strcmp(pic->info.format, "hdr") == 0)
        input_notes_add(
            notes, "%s: RGBE; its rounding, 0.4 to 0.8 %% of the brightest channel, is allowed for",
            path);
    input_note_crop(notes, path, &pic->info);
    if (pic->num_other > 0)
        input_notes_add(notes, "%s: %d more channels are not looked at", path, pic->num_other);
}

static bool check_options(const char *path, char side, const struct image_file *pic,
                          const struct input_options *opt, struct err *e)
{
    if (opt->spp > 0)
        return err_set(e, "%s: --spp-%c is for an image with variance, this one has none", path,
                       side);
    if (is_coded(pic) && opt->curve == NULL)
        return err_set(e,
                       "%s: has %d bits, what light is a code? (--curve: one of " TONE_CURVES ")",
                       path, pic->info.type == IMAGE_INT8 ? 8 : 16);
    return true;
}

bool plain_image_take(const char *path, char side, const struct image_file *pic,
                      const struct input_options *opt, struct input *out, struct notes *notes,
                      struct err *e)
{
    struct curve curve = {.kind = CURVE_LINEAR};
    size_t pixels = (size_t)pic->width * (size_t)pic->height;
    bool rounded = pic->info.type != IMAGE_FLOAT || strcmp(pic->info.format, "hdr") == 0;
    if (!check_options(path, side, pic, opt, e) ||
        (is_coded(pic) && !tone_curve_parse(opt->curve, &curve, e)) ||
        !moments_alloc(&out->m, pic->width, pic->height, e))
        return false;
    if (rounded) {
        out->m.tolerance = calloc(3 * pixels, sizeof *out->m.tolerance);
        out->rounding = calloc(3 * pixels, sizeof *out->rounding);
        out->censored = is_coded(pic) ? calloc(pixels, 1) : NULL;
        if (out->m.tolerance == NULL || out->rounding == NULL ||
            (out->censored == NULL && is_coded(pic)))
            return err_set(e, "%s: out of memory for %zu pixels", path, pixels);
    }
    for (size_t i = 0; i < 3 * pixels; i++) {
        struct bin b = bin_of(pic, &curve, pic->rgb + i / 3 * 3, pic->rgb[i]);
        out->m.mean[i] = b.mean;
        if (rounded) {
            out->m.tolerance[i] = b.tolerance;
            out->rounding[i] = b.step * b.step / 12;
        }
        if (b.saturated && out->censored != NULL)
            out->censored[i / 3] |= (unsigned char)(1 << i % 3);
    }
    out->kind = INPUT_IMAGE;
    tell(path, pic, opt->curve, notes);
    return true;
}

bool plain_image_input(const char *path, char side, const struct input_options *opt,
                       struct input *out, struct notes *notes, struct err *e)
{
    struct image_file pic;
    if (!image_file_read(path, &pic, e))
        return false;
    bool ok = plain_image_take(path, side, &pic, opt, out, notes, e);
    image_file_free(&pic);
    return ok;
}
