/* By how much two images differ, as intervals: what points are a function of. */
#ifndef ASSAY_DIFFERENCE_H
#define ASSAY_DIFFERENCE_H

#include "tools/compare/pyramid.h"
#include "submitted_image.h"

/* A quantity that should be 0 and the interval that holds its true value with 1 - alpha. */
struct interval {
    double value, lo, hi, sd;
};

/* How far the interval is from 0 (0 if it holds 0); half its width. */
double interval_distance(const struct interval *i);
double interval_half(const struct interval *i);

struct difference {
    struct interval
        image[NUM_CHANNELS]; /* relative difference of the means of R, G, B, luminance */
    double blur[NUM_CHANNELS +
                1];       /* of these, and of `tile`: the part of half the width that is no noise */
    struct interval tile; /* of the tile furthest from agreeing, luminance */
    int tile_x, tile_y;   /* pixels */
    int tiles;            /* that could be judged */
    double compared;      /* share of the pixels */
    double kappa;         /* noise variance over that of our renderer */
    bool skewed;          /* rare bright pixels make an interval of the image wide */
    double *relative;     /* per tile, difference in luminance; NAN where not judged */
};

/* A against B over the pixels with use[p] != 0; means elsewhere are not looked at.
 *
 * Noise. A student's file states none. What is known is the variance that a render of as many samples by our own
 * renderer has in each pixel (struct submitted_image: variance), and that neighbouring pixels of A - B differ by noise alone
 * where the images agree: r = second differences, as in noise_estimate.h, with E[r^2] = kappa m + c, m from those
 * variances, c from rounding and from a B whose variance is known. kappa, the noise of this program over ours, is their weighted least squares slope,
 * one for the image, and for a tile that of the 3 x 3 tiles around it if that is larger and known well enough (30 degrees of freedom); at least 0.05. Var(kappa)
 * from the residuals, times 4 for r that overlap (noise_estimate.h) and 3 for channels that one lamp makes alike, gives
 * degrees of freedom of Student's t. Errors as fine as a pixel count as noise, and make the interval wide. Where A has
 * several runs and B is a reference, r is the difference of two runs at one pixel, in which no error of both is; and where A
 * has, and B is a reference or has too, intervals need no kappa: variances are those measured pixel by pixel
 * from run to run, at least a quarter of those around a tile, by what light it has of theirs.
 * Skewness is that of our samples; where it may change a tail by more than a factor of e (tools/docs/background/verdict.md,
 * "EQUIVALENT") an interval is that of tails no longer than exponential, and a tile is judged only if that keeps away from 0.
 *
 * Differences are relative to B's mean in the same place, but to no less than a quarter of the image's luminance.
 * alpha is that of all intervals together. A tile with less than a quarter of its pixels in use is not judged. Fails
 * where less than a quarter of the image can be compared, or B is black: a line fit for the student. The caller
 * frees with difference_free(). */
NODISCARD bool difference_measure(const struct submitted_image *a, const struct submitted_image *b,
                                  const unsigned char *use, double alpha, struct difference *out,
                                  struct err *e);
void difference_free(struct difference *a);

/* kappa of the image. */
double difference_kappa(const struct submitted_image *a, const struct submitted_image *reference,
                        const unsigned char *use);

/* The same of each tile and what is around it, or of the image where that says too little; *sd: of the logarithm of that
 * of the image. kappa: by rows. */
NODISCARD bool difference_kappas(const struct submitted_image *a,
                                 const struct submitted_image *reference, const unsigned char *use,
                                 double *kappa, double *sd, struct err *e);

/* Do the errors of two runs, in second differences, go together more than those of independent runs, by 6 standard
 * deviations? (Products of independent errors: variance 1/n, times 4 for overlap and 3 for channels alike; what the noise of
 * the reference adds to both is taken off.) Errors as fine as a pixel that both runs make look the same; either way the mean of the two is worth no more than one. */
NODISCARD bool difference_correlated(const struct submitted_image *a,
                                     const struct submitted_image *b,
                                     const struct submitted_image *reference,
                                     const unsigned char *use);

/* Does green of an image go with that of another one of its scene, from pixel to pixel, beyond 5 standard deviations? */
bool difference_related(const struct submitted_image *s, const struct submitted_image *right,
                        const unsigned char *use);

/* ln(kappa of P over kappa of Q), each against its reference: whether the noise of a program falls from P to Q as
 * that of ours does. Fails where there is no noise in one of them. */
NODISCARD bool difference_noise(const struct submitted_image *p,
                                const struct submitted_image *reference_p,
                                const struct submitted_image *q,
                                const struct submitted_image *reference_q, const unsigned char *use,
                                double alpha, struct interval *out, struct err *e);

#endif
