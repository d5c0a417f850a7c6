/* By how much two images differ, as confidence intervals; points are a function of these. */
#ifndef ASSAY_DIFFERENCE_H
#define ASSAY_DIFFERENCE_H

#include "tools/compare/pyramid.h"
#include "tools/submission/submitted_image.h"

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
                1];       /* of these, then of `tile`: share of half the width due to rounding */
    struct interval tile; /* of the tile furthest from agreeing, luminance */
    int tile_x, tile_y;   /* pixels */
    int tiles;            /* number of tiles judged */
    double compared;      /* share of the pixels */
    double kappa;         /* noise variance over that of our renderer */
    bool skewed;          /* rare bright pixels make an interval of the image wide */
    double *relative;     /* per tile, difference in luminance; NAN where not judged */
};

/* A against B over the pixels with use[p] != 0; means elsewhere are not looked at.
 *
 * Noise, one run. A student's file does not state its noise. Two things are known: the variance of
 * each pixel in a render of ours with as many samples (struct submitted_image: variance), and that
 * second differences r of A - B (noise_estimate.h) consist of noise alone where the images agree. So
 * E[r^2] = kappa m + c, with m from those variances and c from rounding and from a B whose variance is
 * known. kappa, the student's noise over ours, is the weighted least squares slope, at least 0.05. The
 * image has one; a tile has that of the 3 x 3 tiles around it if that is larger and known well enough
 * (30 degrees of freedom). Var(kappa) comes from the residuals, times 4 as the r overlap and times 3 as
 * the channels are correlated; it gives the degrees of freedom of Student's t. Errors as fine as a
 * pixel count as noise, and make the interval wide.
 *
 * Noise, several runs. If A has several runs and B is a reference, r is the difference of successive
 * runs at one pixel, in which errors common to both cancel (1.5 in place of the 4). If A has several
 * runs and B is a reference or has several, too, intervals need no kappa: variances are measured pixel
 * by pixel from run to run. A tile has at least a quarter of the variance of the tiles around it, in
 * proportion to its light.
 *
 * Skewness is that of our samples. Where it may change a tail probability by more than a factor of e
 * (tools/docs/background/verdict.md, "EQUIVALENT"), the interval is one for tails that are at most
 * exponential, and a tile is judged only if that interval excludes 0.
 *
 * Differences are relative to B's mean in the same place, but to no less than a quarter of the image's
 * luminance. alpha is that of all intervals together. A tile with less than a quarter of its pixels in
 * use is not judged. Fails where less than a quarter of the image can be compared, or B is black, with
 * a line fit for the student. The caller frees with difference_free(). */
NODISCARD bool difference_measure(const struct submitted_image *a, const struct submitted_image *b,
                                  const unsigned char *use, double alpha, struct difference *out,
                                  struct err *e);
void difference_free(struct difference *a);

/* kappa of the image: its noise variance over that of our renderer. */
double difference_kappa(const struct submitted_image *a, const struct submitted_image *reference,
                        const unsigned char *use);

/* kappa of each whole tile, by rows, pooled over the 3 x 3 tiles around it, or that of the image
 * where these say too little. *sd: standard deviation of ln kappa of the image. Fails only out of
 * memory. */
NODISCARD bool difference_kappas(const struct submitted_image *a,
                                 const struct submitted_image *reference, const unsigned char *use,
                                 double *kappa, double *sd, struct err *e);

/* Are the errors of two runs, in second differences, correlated by more than 6 standard deviations?
 * (For independent runs the correlation has the variance 1/n, times 4 for overlap and 3 for correlated
 * channels; what the noise of the reference adds to both is subtracted.) Errors as fine as a
 * pixel that both runs make have the same effect; either way the mean of the two is worth no more than
 * one run. */
NODISCARD bool difference_correlated(const struct submitted_image *a,
                                     const struct submitted_image *b,
                                     const struct submitted_image *reference,
                                     const unsigned char *use);

/* Is an image's green channel correlated, pixel by pixel, with that of another image of the same scene,
 * by more than 5 standard deviations? */
bool difference_related(const struct submitted_image *s, const struct submitted_image *right,
                        const unsigned char *use);

/* ln(kappa of P over kappa of Q), each against its reference and over the square of how many times as bright it is:
 * whether the noise of a program falls from P to Q as that of ours does. A factor of an estimator is one of its noise, too,
 * and is no matter of this. Fails where there is no noise in one of them. */
NODISCARD bool difference_noise(const struct submitted_image *p,
                                const struct submitted_image *reference_p,
                                const struct submitted_image *q,
                                const struct submitted_image *reference_q, const unsigned char *use,
                                double alpha, struct interval *out, struct err *e);

#endif
