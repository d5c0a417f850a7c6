/* Exact bounds of a measured rate, and tests of uniformity: for the programs that measure the tester.
 * Pure functions. */
#ifndef ASSAY_TESTS_RATES_H
#define ASSAY_TESTS_RATES_H

#include <stddef.h>

/* Clopper-Pearson: the x with P(Binomial(n, x) >= k) = tail, and that with P(Binomial(n, x) <= k) =
 * tail; 0 for k = 0, 1 for k = n. 0 <= k <= n, n > 0. */
double rate_lower(double k, double n, double tail);
double rate_upper(double k, double n, double tail);

/* The same, one-sided at confidence 0.999. */
static inline double lower_bound(int k, int n)
{
    return rate_lower(k, n, 0.001);
}

static inline double upper_bound(int k, int n)
{
    return rate_upper(k, n, 0.001);
}

/* Ascending. */
void sort_numbers(double *x, size_t n);

/* How far the empirical distribution function of n sorted numbers departs from that of the uniform
 * law on [0, 1]: the largest distance (Kolmogorov-Smirnov), and the largest by which it lies above. */
double ks_distance(const double *sorted, size_t n);
double ks_above(const double *sorted, size_t n);
/* P of a distance at least as large, H0: uniform; Kolmogorov's series with Stephens' small-sample
 * factor [Stephens70]. */
double ks_p(double distance, size_t n);

/* Anderson-Darling's A^2 of n sorted numbers in (0, 1) against the uniform law, and P of one at least
 * as large for large n [Marsaglia04], good to about 1e-5 (n of 8 or more: 1e-3). */
double ad_statistic(const double *sorted, size_t n);
double ad_p(double statistic);

#endif
