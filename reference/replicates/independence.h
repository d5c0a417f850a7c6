/* Are the replicates of an engine independent of each other? Moments cannot tell: they hold sums. So
 * this looks at the replicates themselves, before they are folded.
 *
 * Let e[k](p) be the standardised residual of replicate k in pixel p: its luminance minus the mean over the K
 * replicates, divided by their standard deviation; pixels without noise are left out. For each square block b of
 * pixels, G_b[i][j] = sum over p in b of e[i](p) e[j](p). The sum of G_b over all blocks, N pixels, is N times the
 * matrix of correlations r[i][j].
 *
 * H0: in each block the replicates are exchangeable, and blocks are independent. Then the labels of the replicates
 * may be permuted in each block by itself, and for any fixed symmetric weights w (0 on the diagonal) the
 * mean and variance of T = sum over i, j of w[i][j] G[i][j] over all permutations are exact, whatever the distribution
 * of the noise [Mantel67, by the moments of CliffOrd81]. T is a sum over many blocks, so z = (T - mean)/sd is
 * compared with the normal distribution. As residuals are taken from the mean of the same replicates, every r has
 * the expectation -1/K under H0, and the average of all r is -1/K always: an error that all replicates share is
 * their bias, and only another image (a closed form, another engine, the same engine with other seeds) can show it.
 *
 * Tests, each with a quarter of alpha, the first three two-sided:
 *   pair        the largest |z| of a single r, over K (K-1)/2 pairs: finds a copy or a seed used twice
 *   neighbours  the mean r of replicates k, k+1: finds seeds that are too close to each other
 *   batches     B Var(mean of B successive replicates) / Var, B near sqrt K; 1 under H0: finds slow drifts
 *   pixels      H0: the variance between replicates of the sum over a square of side 2, 4, 8 or 16, over two rows or
 *               columns, or over one place in tiles that repeat, is at most SQUARES_VARY_MOST times the
 *               sum of its pixels' variances. Half of this alpha is for squares. Independent replicates may violate
 *               it, but compare_moments() assumes independent pixels: its intervals would then be too narrow,
 *               and the tests above, which assume independent blocks, would be off, too.
 * If a known filter makes pixels share samples ("sharing"), squares may vary by that factor more, and limits of |z|
 * widen by its square root: correlations r between blocks add at most the sum of r^2 < sum of r = sharing to the
 * variance of T. */
#ifndef ASSAY_INDEPENDENCE_H
#define ASSAY_INDEPENDENCE_H

#include "shared_noise.h"

#include <jansson.h>

/* Chance that independent replicates fail any of the four tests. Small, as a whole suite with both engines is
 * rendered again and again, and a replicate that was used twice is found at any alpha. */
#define INDEPENDENCE_ALPHA 1e-6

/* While the test passes, an interval is too narrow by at most about the square root of this. */
#define SQUARES_VARY_MOST 1.5

enum { NUM_SQUARES = 4 };
struct independence {
    bool tested;    /* false: fewer than 4 replicates or 64 noisy pixels */
    bool passed;    /* true also where not tested */
    int replicates; /* K */
    int pixels;     /* N */
    int block;      /* side, pixels */
    double pair_r, pair_z;
    int pair[2];       /* the two replicates */
    double pair_limit; /* of |z|; the other two have `limit` */
    double neighbours_r, neighbours_z;
    int batch; /* B */
    double batches_ratio, batches_z;
    double limit;        /* of |z|, for neighbours and batches */
    double square_limit; /* one-sided */
    /* Squares of side 2, 4, 8, 16: the mean correlation of two pixels in one square and its standard error under
     * independence; the ratio of variances is 1 + (pixels in it - 1) x that. */
    double square_r[NUM_SQUARES], square_se[NUM_SQUARES];
    int square_failed; /* side of the square whose ratio is shown to be too large; 0: none */
    /* The group (shared_noise.h) that shows this most, its ratio and its tile's side; -1: none */
    int group_failed, group_side;
    double group_ratio;
};

/* shared: what their pixels share (shared_noise_measure()); not read of fewer than 4. False only out of memory. */
NODISCARD bool independence_test(const struct replicates *r, const struct shared_noise *shared,
                                 double alpha, struct independence *out, struct err *e);
/* The same, and adds all of it to the manifest as "independence"; a failed test is an error that says which. */
NODISCARD bool independence_check(const struct replicates *r, json_t *manifest, struct err *e);

#endif
