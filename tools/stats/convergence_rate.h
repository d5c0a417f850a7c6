/* Convergence and variance of an engine, from K replicates at each rung of a ladder of sample counts.
 * Statistics only: no engine, no file. The procedure: tools/docs/background/convergence.md.
 *
 * An image is `size` values (3 a pixel, linear radiance). Each is divided by a unit of its own, the
 * reference's value there or 5 % of its mean if that is more, so that all errors are relative and a few
 * bright pixels do not make up the whole error. Below, x_k is replicate k in these units, m the mean of
 * all K, r the reference with the variance v of its own mean; N = size. Per rung
 *   V    = sum |x_k - m|^2 / (N (K-1))                    variance of one replicate
 *   MSE  = sum |x_k - r|^2 / (N K) - mean(v)              squared error of one replicate, bias included
 *   B^2  = sum_{j != k} (x_j - r)(x_k - r) / (N K (K-1)) - mean(v)     squared bias
 * All three are unbiased, B^2 may come out negative, and MSE = B^2 + V. Standard errors are delete-one
 * jackknives over the replicates [EfronStein81], which need no independence of pixels or channels and
 * are too large rather than too small on average (B^2 without a bias: sqrt 2 times), plus what the
 * reference's own noise can do. */
#ifndef ASSAY_CONVERGENCE_RATE_H
#define ASSAY_CONVERGENCE_RATE_H

#include "reference/suite/suite.h"
#include "renderer/image/moments.h"

struct converge_reference {
    size_t size;
    double *unit;       /* radiance; what values are divided by, > 0 */
    double *mean, *var; /* in units; var: of the mean, 0 where the reference is exact */
    double noise;       /* mean of var */
    double noise_var; /* variance of mean((mean - truth)^2) - noise, over references; channels of a
                           pixel taken as fully correlated, pixels as independent */
};

/* The reference for images `shrink` times smaller on both sides: box averages, which with a box
 * filter of one pixel are the smaller image exactly. Fails where shrink does not divide the size or pixels share
 * samples, on stratified moments, on fewer than two observations, and on a black image. */
NODISCARD bool convergence_rate_reference_init(struct converge_reference *r,
                                               const struct moments *m, int shrink, struct err *e);
void convergence_rate_reference_free(struct converge_reference *r);

/* An estimate with its standard error and the degrees of freedom of that. */
struct estimate {
    double value, se, dof;
};

struct interval {
    double lo, hi;
};

/* value -+ t se with the two-sided level 1 - alpha. */
struct interval estimate_interval(struct estimate x, double alpha);

/* What is known of one rung. Logarithms are natural. */
struct rung {
    double spp;
    int replicates;
    double cpu_s; /* of one replicate, its share of the engine's start included */
    struct estimate log_mse, log_variance, bias2;
};

/* Judges `count` >= 3 replicates, one after the other in `images`. Fails where two replicates are the
 * same (the seed has no effect), where there is no noise at all, and where the reference is so noisy
 * that MSE is not positive. */
NODISCARD bool convergence_rate_rung(const float *images, int count, double spp,
                                     const struct converge_reference *ref, struct rung *out,
                                     struct err *e);

/* Slope of ln RMSE on ln spp over num >= 2 rungs with replicates of their own. Weighted least squares:
 * the weights are 1/(own + mean squared standard error), so that a rung whose few replicates happen to
 * agree does not rule the fit; the standard error holds for any weights, sum c_i^2 se_i^2. The degrees of
 * freedom are the smallest of any rung, not the larger number that their sum would have: squared errors are
 * skewed, and that makes up for it (tests/tools/stats/test_converge.c). */
struct estimate convergence_rate_slope(const struct rung *rung, int num);
/* The slope's degrees of freedom as a sum [Satterthwaite46], for rungs whose own are conservative already
 * (variance_ladder.h). */
double convergence_rate_slope_dof(const struct rung *rung, int num);

/* Is the slope -1/2, as of independent samples? DIFFERENT if the 1 - alpha interval does not contain it,
 * INCONCLUSIVE if it does but is wider than +-half_width, else EQUIVALENT. */
enum verdict convergence_rate_slope_verdict(struct estimate slope, double alpha, double half_width);
/* Is it at most -1/2, as of any samples without a bias? DIFFERENT if the whole interval lies above, EQUIVALENT if
 * it lies below -1/2 + half_width, else INCONCLUSIVE. */
enum verdict convergence_rate_slope_at_most(struct estimate slope, double alpha, double half_width);

/* The interval of the bias that is left at a rung: sqrt of the 1 - 2 alpha interval of B^2, cut at 0. */
struct interval convergence_rate_floor(const struct rung *r, double alpha);
/* Two one-sided tests at alpha of "RMS bias <= margin": DIFFERENT if the interval lies above,
 * EQUIVALENT if it lies below, else INCONCLUSIVE. */
enum verdict convergence_rate_floor_verdict(const struct rung *r, double margin, double alpha);

/* ln(variance of a / variance of b); Welch's degrees of freedom. The replicates are independent. */
struct estimate convergence_rate_log_ratio(const struct rung *a, const struct rung *b);

/* CPU seconds of a replicate = start + per_spp x spp, by least squares of the relative residuals over num
 * >= 2 rungs, so that the engine's start-up time can be left out. */
struct cost {
    double start_s;
    struct estimate per_spp; /* se is INFINITY with two rungs */
};
struct cost convergence_rate_cost(const struct rung *rung, int num);

/* ln(1/(variance x CPU seconds)), in 1/s, of one replicate without the start. NAN where the cost is
 * not positive (too short to be timed). */
struct estimate convergence_rate_log_efficiency(const struct rung *r, const struct cost *c);

#endif
