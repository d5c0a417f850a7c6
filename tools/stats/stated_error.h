/* Does a renderer's stated error hold? K >= 4 renders of one scene with seeds of their own, each with the
 * moments of its samples, are compared: the error that they state (from the spread of samples within a
 * render) with the error that they have (the spread between renders).
 *
 * Means cannot show this: a renderer whose pixels share random numbers, whose samples repeat, or whose
 * seed does nothing has the right mean. With x_k(p) the mean of render k in pixel p and channel, s2_k(p) =
 * M2/(n(n-1)) the variance that it states for that mean, and sums over pixels and channels:
 *
 *   pixels  R = sum var_k x_k(p) / mean_k sum s2_k(p)        variance between over variance stated;
 *             1 for independent samples, below for stratified ones, above for repeated ones, 0 for a
 *             seed without effect. The interval of ln R is a delete-one jackknife over the renders
 *             [EfronStein81] with K - 1 degrees of freedom.
 *   image   S = var_k (sum x_k) / mean_k sum s2_k, per channel, sums over pixels; then the mean over
 *             channels. 1 for independent pixels; as large as the number of pixels where all share
 *             their random numbers. (K-1) S of one channel is chi^2 with K-1 degrees of freedom, and as
 *             channels may be anything from equal to independent, each is tested by itself at a sixth
 *             of alpha on each side. */
#ifndef ASSAY_STATED_ERROR_H
#define ASSAY_STATED_ERROR_H

#include "reference/suite/suite.h"
#include "renderer/image/moments.h"

struct stated_error {
    enum verdict verdict;
    char reason[256]; /* one sentence: what decided */
    int renders;
    double pixels, pixels_lo, pixels_hi; /* R and its 1 - alpha interval */
    double image, image_lo,
        image_hi; /* S of the channel furthest from 1, and the 1 - alpha/3 range of
                                            S for independent pixels */
};

/* margin: R may lie in [1/(1 + margin), 1 + margin]. DIFFERENT if the interval of R lies outside, if S
 * does, or if two renders are the same; EQUIVALENT if the interval of R lies inside and S does;
 * else INCONCLUSIVE. alpha: the chance that independent samples come out DIFFERENT, and that an R
 * outside the margin comes out EQUIVALENT. Fails if sizes or n differ, if n < 2, or if there is no
 * noise in any render. */
NODISCARD bool stated_error_judge(const struct moments *render, int num, double margin,
                                  double alpha, struct stated_error *out, struct err *e);

#endif
