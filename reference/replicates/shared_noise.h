/* How much of their noise do the pixels of a render share? Samples that reach several pixels (a reconstruction
 * filter wider than one), a denoiser or a photon map make the noise of neighbours alike: sums over squares then vary
 * more than sums of independent pixels, and every interval that takes pixels for independent is too narrow.
 *
 * With e[k](p) as in replicates_residuals(): for a square of n noisy pixels, sum over k of (sum over p of e[k](p))^2 is n (K - 1)
 * on average if its pixels are independent, whatever the law. */
#ifndef ASSAY_SHARED_NOISE_H
#define ASSAY_SHARED_NOISE_H

#include "replicates.h"

enum { MOST_SQUARE_SIZES = 24, SHARED_NOISE_FEWEST = 3 };
/* Squares of one side that cut up the image, or groups of pixels. */
struct square_noise {
    int side; /* 2, 4, 8, .. until one square is the image */
    double r, se; /* the mean correlation of two pixels in one square; its standard error if independent */
    double ratio;   /* the variance of a square's sum over the sum of its pixels' variances */
    double dof;     /* of that variance: K - 1 a square */
    double log10_p; /* of as large a ratio if pixels are independent: chi-square, about */
};
struct shared_noise {
    int width, height, num;
    struct square_noise square[MOST_SQUARE_SIZES];
    /* Of pairs of rows and of columns, side 0 (noise drawn once for a line), then of pixels (2 x 2) at the same place in
     * tiles of side 8, 16, .. (a pattern that repeats: a mask, or buckets that start with the same seed). */
    int num_groups;
    struct square_noise group[MOST_SQUARE_SIZES + 2];
};

/* Of at least SHARED_NOISE_FEWEST replicates. False only out of memory. */
NODISCARD bool shared_noise_measure(const struct replicates *r, struct shared_noise *out,
                                    struct err *e);

/* Is it shown, with a p of 10^log10_p, that sums over these vary more than `ratio` times as much as independent pixels? */
bool shared_noise_exceeds(const struct square_noise *q, double ratio, double log10_p);

/* By how much the variance of large sums exceeds that of independent pixels; 1 unless squares of a size, or a group, show
 * more with a p of at most alpha over their number. It is extrapolated from the largest squares of which there are enough (a
 * fixed reach leaves out a part of the sum that falls as 1/side), plus three standard errors of their ratio.
 * *unlimited: NULL or, where no such factor is known, the size of squares that shows it: there the ratio still grows
 * too fast, or the largest squares exceed it. The whole image shares noise then, or there are too few pixels. Where
 * rows, columns or tiles explain what squares show, the factor is theirs. */
double shared_noise_factor(const struct shared_noise *s, double alpha,
                           const struct square_noise **unlimited);

#endif
