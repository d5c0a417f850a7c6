/* What the moments of both sides say about the noise itself (tools/docs/background/verdict.md, "Noise"). For compare.c,
 * input_checks.c and compare_job.c. */
#ifndef ASSAY_VARIANCE_RATIO_H
#define ASSAY_VARIANCE_RATIO_H

#include "region.h"

/* The ratio of variances, and log10 of the two-sided p of "within the factor 1 + margin_variance of 1
 * either way"; *testable is false where there is no ratio or it is too skewed for a p. */
struct variance_ratio variance_ratio_test(const struct moments *a, const struct moments *b,
                                          const struct judge *j, double *log10_p, bool *testable);

/* What it is the variance of: "path" or "render". */
const char *variance_ratio_of(const struct variance_ratio *v);

/* In how many pixels A and B hold the same observations (all moments agree bit by bit, and there is
 * noise), or 0 if that many can agree by chance. */
size_t variance_ratio_shared(const struct moments *a, const struct moments *b);
/* Adds what helps there to the line by which compare_moments() refused that. */
void variance_ratio_advise(const struct moments *a, const struct moments *b, const char *advice,
                           struct err *e);

/* The mean of (A - B)^2 over its stated variance, over pixels with noise and in the channel where it is largest: 1 for
 * equal and independent sides, less where they share their noise. Also 1 if it is more than 1/4, or if
 * independent sides have as little with a chance above 1e-6 (left tail of chi-square). */
double variance_ratio_of_difference(const struct moments *a, const struct moments *b);

#endif
