/* A student's image, prepared for comparison: radiance of each pixel, decoded by the course's tone curve
 * if the file has codes. Such files do not state their noise; how much there should be is known from
 * renders of ours.
 *
 * Clipping. A code of 255 means "at least so much". To drop pixels because they are saturated would
 * select them by their noise, and would hide an image that is white where it should not be. So the
 * reference decides: where it lies within 5 standard errors of the clipping point (of a render with as
 * many samples, from the reference's own variance of a sample) nothing is compared; elsewhere both sides
 * are clipped at that point. */
#ifndef ASSAY_SUBMITTED_IMAGE_H
#define ASSAY_SUBMITTED_IMAGE_H

#include "renderer/image/moments.h"

struct submitted_image {
    int width, height;
    double *mean, *tolerance,
        *rounding;    /* 3 per pixel: radiance; half a bin, by which a flat area may be
                      * off; variance of the rounding */
    double *variance; /* 3 per pixel: expected of the mean, 0 until submitted_image_expect() */
    double *k3;       /* 3 per pixel: third cumulant of the mean, likewise */
    unsigned char *clipped; /* 3 per pixel: at the brightest code */
    double clip;            /* the radiance of that code; INFINITY of floats */
    char sha256[65];        /* of the file */
    bool known; /* variance is that of the mean itself: of references, not of students' images */
    double spp; /* samples a pixel of all its runs; 0: as many as the rubric asks for */
    double *measured; /* 4 per pixel, R G B luminance: variance of the mean from run to run */
    double runs_dof;  /* degrees of freedom of each; 0: one run, nothing is measured */
    struct submitted_image *run; /* runs whose weighted mean it is; NULL: one run */
    int num_runs;
};

/* curve: of integer files (tone_curve.h). Fails, with a line fit for the student, on a file that is no
 * image of that size. The header is checked before anything is decoded. The caller frees with
 * submitted_image_free(). */
NODISCARD bool submitted_image_read(const char *path, const char *curve, int width, int height,
                                    struct submitted_image *out, struct err *e);
void submitted_image_free(struct submitted_image *s);

/* Adds a run and takes it over: s becomes the mean of its runs, weighted by their samples (spp of both is
 * set). A run with less than a third of the samples of the largest is freed, not part of the mean: it
 * adds little, and its noise reaches the clipping point sooner. Fails, and leaves *more to the caller,
 * if memory is short. */
NODISCARD bool submitted_image_add_run(struct submitted_image *s, struct submitted_image *more,
                                       struct err *e);

/* Is it black, as far as its codes can tell? */
bool submitted_image_is_black(const struct submitted_image *s);
/* Are they the same values, pixel by pixel? */
bool submitted_image_same(const struct submitted_image *a, const struct submitted_image *b);

/* Sets variance and k3 to those of a render of ours with spp samples, by the moments m of one: averages
 * over 3 x 3 pixels, as rare samples may be missing in one. A pixel beyond the clipping point does not
 * vary. For an image of several runs the spp of each run counts, not the argument. */
void submitted_image_expect(struct submitted_image *s, const struct moments *m, double spp);

/* Makes an image of the same size and clipping as `like` from m, with the known variance of its
 * mean; m NULL: black. The caller frees it with submitted_image_free(). */
NODISCARD bool submitted_image_from(const struct moments *m, const struct submitted_image *like,
                                    struct submitted_image *out, struct err *e);

/* Copies s without its runs, but with what they measured. The caller frees it with submitted_image_free(). */
NODISCARD bool submitted_image_copy(const struct submitted_image *s, struct submitted_image *out,
                                    struct err *e);

/* Sets `measured` of an image of one run: kappa times its expected variance, plus its rounding; kappa 0:
 * nothing is measured. */
void submitted_image_model(struct submitted_image *s, double kappa);

/* Scales k3, expected of our samples, to each tile's measured variance, so that skewness stays that
 * of ours. */
void submitted_image_scale_skewness(struct submitted_image *s, const unsigned char *use);

/* dst += src; clipped where either is; runs_dof is the smaller (INFINITY in a black image made from
 * NULL). */
void submitted_image_add(struct submitted_image *dst, const struct submitted_image *src);

/* Clears use[p] where s cannot be compared with a render of spp samples per pixel, judged by the
 * moments of one of ours: within 5 standard errors of the clipping point (measured: also by the
 * standard errors from run to run, of the smallest run); beside such pixels and beside clipped
 * ones, whose variance says nothing about their neighbours; and where the variance is more than 20
 * times the image's mean. The caller sets use[] to nonzero before. */
NODISCARD bool submitted_image_comparable(const struct submitted_image *s, const struct moments *m,
                                          double spp, bool measured, unsigned char *use,
                                          struct err *e);

/* The same without a reference: use[p] becomes 0 where s is clipped and beside such pixels;
 * elsewhere it stays as it is. */
void submitted_image_unclipped(const struct submitted_image *s, unsigned char *use);

/* Standard deviation of channel i (3 per pixel) in a render of spp samples, by the reference's samples. */
double submitted_image_expected_sd(const struct moments *reference, size_t i, double spp);

#endif
