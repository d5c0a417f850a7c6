/* Exact bounds for the rates that tests measure. */
#ifndef ASSAY_TESTS_RATES_H
#define ASSAY_TESTS_RATES_H

#include <gsl/gsl_cdf.h>

/* Clopper-Pearson: the lower bound x solves P(Binomial(n, x) >= k) = I_x(k, n-k+1) = 0.001. (GSL's
 * own inverse gives up near 1.) */
static inline double lower_bound(int k, int n)
{
    double lo = 0, hi = 1;
    for (int i = 0; i < 60 && k > 0; i++) {
        double x = (lo + hi) / 2;
        *(gsl_cdf_beta_P(x, k, n - k + 1) < 0.001 ? &lo : &hi) = x;
    }
    return lo;
}

static inline double upper_bound(int k, int n)
{
    return 1 - lower_bound(n - k, n);
}

#endif
