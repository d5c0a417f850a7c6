#include "distributions.h"

#include <assert.h>
#include <gsl/gsl_cdf.h>
#include <gsl/gsl_math.h>
#include <gsl/gsl_sf_erf.h>
#include <gsl/gsl_sf_gamma.h>
#include <math.h>

/* Above this the fraction below loses digits (they are in 1 - x, about t^2/nu), and Hill's normal
 * equivalent has none left to lose. */
static const double large_dof = 1e6;

/* ln of the factor F in I_x(a,b) = x^a (1-x)^b / (a B(a,b)) F, by the modified Lentz algorithm on
 * [DLMF 8.17.22]. Converges fast where x < (a+1)/(a+b+2). */
static double log_fraction(double a, double b, double x)
{
    const double tiny = 1e-300;
    double c = 1, d = 1 - (a + b) * x / (a + 1);
    d = 1 / (fabs(d) < tiny ? tiny : d);
    double f = d;
    for (int m = 1; m < 100000; m++) {
        double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
        double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
        double step = 1;
        for (int half = 0; half < 2; half++) {
            double coefficient = half == 0 ? even : odd;
            d = 1 + coefficient * d;
            d = 1 / (fabs(d) < tiny ? tiny : d);
            c = 1 + coefficient / c;
            c = fabs(c) < tiny ? tiny : c;
            step = c * d;
            f *= step;
        }
        if (fabs(step - 1) < 1e-15)
            break;
    }
    return log(f);
}

/* ln B(a, 1/2). For large a the difference of log-gammas has lost its digits; the series of
 * Gamma(a + 1/2)/Gamma(a) [DLMF 5.11.13] has not: at a = 100 its next term is 2e-13. */
static double log_beta_half(double a)
{
    if (a < 100)
        return gsl_sf_lnbeta(a, 0.5);
    return 0.5 * log(M_PI / a) + 1 / (8 * a) - 1 / (192 * a * a * a);
}

/* ln(1 + t^2/nu), also where t^2 overflows */
static double log_ratio(double t, double nu)
{
    double ratio = t * t / nu;
    return isfinite(ratio) ? log1p(ratio) : 2 * log(t) - log(nu);
}

/* z with P(|Z| >= z) = P(|T| >= t) up to O(nu^-4) [Hill70]. */
static double hill_z(double t, double nu)
{
    if (isinf(nu))
        return t;
    double a = nu - 0.5, b = 48 * a * a, z = sqrt(a * log_ratio(t, nu));
    return z + (z * z * z + 3 * z) / b;
}

/* ln P(|T| >= t), t >= 0 */
static double log_p(double t, double nu)
{
    assert(nu > 0 && t >= 0);
    if (t == 0)
        return 0;
    if (nu > large_dof)
        return gsl_sf_log_erfc(hill_z(t, nu) / sqrt(2));
    double ratio = t * t / nu, a = nu / 2, b = 0.5, x = 1 / (1 + ratio);
    if (x >= (a + 1) / (a + b + 2))
        return log(2 * gsl_cdf_tdist_Q(t, nu));
    return -a * log_ratio(t, nu) - b * log1p(1 / ratio) - log(a) - log_beta_half(a) +
           log_fraction(a, b, x);
}

double stats_t_log10_p(double t, double nu)
{
    return log_p(fabs(t), nu) / M_LN10;
}

/* ln of the density of |T| at t */
static double log_density(double t, double nu)
{
    if (isinf(nu))
        return M_LN2 - 0.5 * t * t - 0.5 * log(2 * M_PI);
    return M_LN2 - log_beta_half(nu / 2) - 0.5 * log(nu) - (nu + 1) / 2 * log_ratio(t, nu);
}

/* Newton on ln p as a function of s = ln t. It falls and is concave there (the slope -t f/p runs
 * from 0 to -nu), so after one step every iterate lies beyond the root and they come down to it. */
double stats_t_quantile(double q, double nu)
{
    assert(q > 0 && q <= 0.5 && nu > 0);
    if (q == 0.5)
        return 0;
    double target = log(2 * q), s = log(stats_t_of_z(stats_normal_quantile(q), nu));
    for (int i = 0; i < 200; i++) {
        double t = exp(s), lp = log_p(t, nu);
        double step = (lp - target) / exp(s + log_density(t, nu) - lp);
        s += step;
        if (fabs(step) < 1e-13)
            break;
    }
    return exp(s);
}

double stats_normal_quantile(double q)
{
    assert(q > 0 && q < 1);
    return gsl_cdf_ugaussian_Qinv(q);
}

double stats_z_of_t(double t, double nu)
{
    if (isinf(nu))
        return t;
    return copysign((8 * nu + 1) / (8 * nu + 3) * sqrt(nu * log1p(t * t / nu)), t);
}

double stats_t_of_z(double z, double nu)
{
    if (isinf(nu))
        return z;
    double w = z * (8 * nu + 3) / (8 * nu + 1);
    /* The cap keeps tiny nu finite; the result only starts an iteration or trips a guard. */
    return copysign(sqrt(nu * expm1(fmin(w * w / nu, 600))), z);
}

double stats_hill_z(double t, double nu)
{
    return copysign(hill_z(fabs(t), nu), t);
}

/* ln of Gamma(a, y) / (y^a e^-y) = 1/(y+1-a - 1(1-a)/(y+3-a - ..)), y > a + 1, modified Lentz. */
static double log_gamma_fraction(double a, double y)
{
    double b = y + 1 - a, c = INFINITY, d = 1 / b, f = d;
    for (int i = 1; i < 100000; i++) {
        double an = -i * (i - a);
        b += 2;
        d = 1 / (an * d + b);
        c = b + an / c;
        double step = c * d;
        f *= step;
        if (fabs(step - 1) < 1e-15)
            break;
    }
    return log(f);
}

double stats_chi2_log10_p(double x, double k)
{
    assert(x >= 0 && k > 0);
    double a = k / 2, y = x / 2;
    if (y <= a + 1)
        return log10(gsl_cdf_chisq_Q(x, k));
    return (a * log(y) - y - gsl_sf_lngamma(a) + log_gamma_fraction(a, y)) / M_LN10;
}

double stats_dof(double v, double var_v)
{
    assert(v >= 0 && var_v >= 0);
    return var_v > 0 ? 2 * v * v / var_v : INFINITY;
}

double stats_welch_dof(double va, double na, double vb, double nb)
{
    assert(na >= 2 && nb >= 2);
    return stats_dof(va + vb, 2 * va * va / (na - 1) + 2 * vb * vb / (nb - 1));
}
