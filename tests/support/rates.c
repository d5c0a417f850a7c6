#include "rates.h"

#include <gsl/gsl_cdf.h>
#include <math.h>
#include <stdlib.h>

/* P(Binomial(n, x) >= k) = I_x(k, n-k+1). By bisection: GSL's own inverse gives up near 1. */
double rate_lower(double k, double n, double tail)
{
    double lo = 0, hi = 1;
    for (int i = 0; i < 60 && k > 0; i++) {
        double x = (lo + hi) / 2;
        *(gsl_cdf_beta_P(x, k, n - k + 1) < tail ? &lo : &hi) = x;
    }
    return lo;
}

double rate_upper(double k, double n, double tail)
{
    double lo = 0, hi = 1;
    for (int i = 0; i < 60 && k < n; i++) {
        double x = (lo + hi) / 2;
        *(gsl_cdf_beta_Q(x, k + 1, n - k) < tail ? &hi : &lo) = x;
    }
    return hi;
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void sort_numbers(double *x, size_t n)
{
    qsort(x, n, sizeof *x, by_value);
}

double ks_above(const double *sorted, size_t n)
{
    double d = 0;
    for (size_t i = 0; i < n; i++)
        d = fmax(d, (double)(i + 1) / (double)n - sorted[i]);
    return d;
}

double ks_distance(const double *sorted, size_t n)
{
    double d = ks_above(sorted, n);
    for (size_t i = 0; i < n; i++)
        d = fmax(d, sorted[i] - (double)i / (double)n);
    return d;
}

double ks_p(double distance, size_t n)
{
    double root = sqrt((double)n), lambda = distance * (root + 0.12 + 0.11 / root), p = 0;
    if (lambda < 0.2) /* the series alternates without end; P is 1 to 12 digits */
        return 1;
    for (int k = 1; k < 100; k++)
        p += (k % 2 ? 2 : -2) * exp(-2.0 * k * k * lambda * lambda);
    return fmin(1, fmax(0, p));
}

double ad_statistic(const double *sorted, size_t n)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        sum += (2 * (double)i + 1) * (log(sorted[i]) + log1p(-sorted[n - 1 - i]));
    return -(double)n - sum / (double)n;
}

double ad_p(double z)
{
    if (z <= 0)
        return 1;
    if (z < 2) {
        double poly =
            2.00012 +
            (0.247105 - (0.0649821 - (0.0347962 - (0.0116720 - 0.00168691 * z) * z) * z) * z) * z;
        return 1 - exp(-1.2337141 / z) / sqrt(z) * poly;
    }
    double poly =
        1.0776 - (2.30695 - (0.43424 - (0.082433 - (0.008056 - 0.0003146 * z) * z) * z) * z) * z;
    return -expm1(-exp(poly));
}
