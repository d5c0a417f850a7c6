/* Are the replicates of an engine independent of each other? Moments cannot tell: they hold sums. So
 * this looks at the replicates themselves, before they are folded.
 *
 * e[k](p): luminance of replicate k in pixel p, less the mean over the K replicates, over their standard
 * deviation; pixels without noise are left out. Pixels are taken together in square blocks. For each block b the
 * matrix G_b[i][j] = sum over p in b of e[i](p) e[j](p); their sum over N pixels is N times the matrix
 * of correlations r[i][j].
 *
 * H0: in each block the replicates are exchangeable, and blocks are independent. Then the labels of the replicates
 * may be permuted in each block by itself, and for any fixed symmetric weights w (0 on the diagonal) the
 * mean and variance of T = sum over i, j of w[i][j] G[i][j] over all permutations are exact, whatever the law of
 * the noise [Mantel67, by the moments of CliffOrd81]. T is a sum over many blocks, so
 * z = (T - mean)/sd is compared with the normal law. As residuals are taken from the mean of the same
 * replicates, every r has the mean -1/K under H0, and so has the mean of all of them, always: an error that
 * all replicates share is their bias, and only another image (a closed form, another engine, the same
 * engine with other seeds) can show it.
 *
 * Tests, each with a quarter of alpha, the first three two-sided:
 *   pair        the largest |z| of a single r, over K (K-1)/2 pairs: a copy, a seed used twice
 *   neighbours  the mean r of replicates k, k+1: seeds that are too near each other
 *   batches     B Var(mean of B successive replicates) / Var, B near sqrt K; 1 under H0: anything that
 *               comes and goes slowly
 *   pixels      the variance between replicates of the sum over a square of 2, 4, 8 or 16 pixels is no more than
 *               SQUARES_VARY_MOST times the sum of its pixels' variances, H0. Replicates may be independent
 *               without it, but compare_moments() takes pixels for independent: with more, its intervals
 *               would be too narrow, and tests above that take blocks to be independent are off, too.
 * Where pixels are known to share samples ("sharing"), squares may vary as much more, and limits of |z| are wider by its square
 * root, as correlations r between blocks add at most the sum of r^2 < sum of r = sharing to the variance of T. */
#ifndef ASSAY_INDEPENDENCE_H
#define ASSAY_INDEPENDENCE_H

#include "renderer/base/err.h"

#include <jansson.h>

/* Luminance of replicates; at most MOST_REPLICATES of them are kept, the first. */
enum { MOST_REPLICATES = 1024, NUM_SQUARES = 4 };
struct replicates {
    int width, height, num, capacity;
    float *luminance; /* num images of width*height */
    double
        sharing; /* how many times the sum of pixels' variances their sum has by a filter that is known; 0: once */
};

NODISCARD bool replicates_alloc(struct replicates *r, int width, int height, int count,
                                struct err *e);
void replicates_add(struct replicates *r, const float *pixels_rgb);
void replicates_free(struct replicates *r);

/* Chance that independent replicates fail, over all four tests. Small, as a whole suite with both engines is
 * rendered again and again, and a replicate that was used twice is seen at any alpha. */
#define INDEPENDENCE_ALPHA 1e-6

/* An interval may be too narrow by at most the square root of this before the test fails. */
#define SQUARES_VARY_MOST 1.5

struct independence {
    bool tested;    /* false: fewer than 4 replicates, or than 64 noisy blocks */
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
};

/* False only out of memory. */
NODISCARD bool independence_test(const struct replicates *r, double alpha, struct independence *out,
                                 struct err *e);
/* The same, and adds all of it to the manifest as "independence"; a failed test is an error that says which. */
NODISCARD bool independence_check(const struct replicates *r, json_t *manifest, struct err *e);

#endif
