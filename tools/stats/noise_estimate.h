/* The noise of two images that come without any: from how their difference varies from pixel to
 * pixel. The difference of two unbiased renders is nothing but noise; if they differ by more, that
 * is taken to be smooth, which second differences do not see.
 *
 * r = the 3 x 3 kernel (1 -2 1; -2 4 -2; 1 -2 1)/6 on D = A - B: its mean square is the variance of
 * independent noise [Immerkaer96], and no sum f(x) + g(y) contributes. Blocks of 8 x 8 pixels share
 * one estimate. Its level is set by the same kernel on means of 4 x 4 pixels, which respond to noise that
 * neighbouring pixels share (filters wider than a pixel): the blocks' variances are multiplied by the
 * upper end of a one-sided 99.9 % interval of that factor, plus what still larger squares would add, but
 * at least by 1. The factor is computed from D clipped at 2.5 standard deviations, which keeps
 * independence but not heavy tails. If it is more than 1.5 times that of means of 2 x 2, squares of twice
 * the side are used while it rises steeply (up to 16 for a filter of 7 pixels), by medians of squared
 * differences of neighbouring squares, which are robust against a region in which the images differ.
 *
 * Where sums over rows or columns (line_noise.h) vary by more than that, they set the factor.
 *
 * Degrees of freedom: Var(sum r^2) is at most 4 sum r^4, for normal noise (2.52: neighbouring r are
 * correlated) and for the heaviest tails alike; an image of N pixels of normal noise has N/6.
 * Skewness of D: 6 sum r^3 (the kernel cubed sums to 1/6), one coefficient for the image, with its
 * jackknife error over the blocks on top.
 *
 * What this cannot see: an error as fine as a pixel or two looks like noise and hides itself, and so does what differs
 * in most of the image's larger squares. */
#ifndef ASSAY_NOISE_ESTIMATE_H
#define ASSAY_NOISE_ESTIMATE_H

#include "renderer/image/moments.h"

/* What was found, per channel. */
struct noise_estimate {
    double factor[3];   /* variance of means over squares, over that of independent pixels */
    double skewness[3]; /* of D in one pixel */
    double skew_error[3];
};

/* Sets n, M2 and M3 of both from their means, in units "picture": half of the variance to each side,
 * written as 3 observations so that the comparison finds the variance, the degrees of freedom and
 * the skewness above; n is no count of anything. more_a, more_b (3 per pixel, or NULL): further
 * variance of that side. Pixels with censored[p] != 0 are ignored and get no noise. independent: pixels are known to
 * share no noise, so that all that larger squares show is a difference. Fails with a line where the images are the
 * same, smaller than 32 x 32, or too much is censored. */
NODISCARD bool noise_estimate_variance(struct moments *a, struct moments *b, const double *more_a,
                                       const double *more_b, const unsigned char *censored,
                                       bool independent, struct noise_estimate *out, struct err *e);

#endif
