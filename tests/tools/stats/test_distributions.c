/* tools/stats/distributions.c against closed forms (nu = 1, 2, 4), against GSL's incomplete beta function, and
 * against asymptotic series where nothing else reaches. */
#include "tools/stats/distributions.h"
#include "tests/support/test.h"

#include <gsl/gsl_cdf.h>
#include <gsl/gsl_math.h>
#include <gsl/gsl_sf_erf.h>
#include <gsl/gsl_sf_gamma.h>

static void assert_close(double got, double want, double tolerance)
{
    if (!(fabs(got - want) <= tolerance * fmax(1, fabs(want))))
        fail_msg("got %.17g, want %.17g", got, want);
}

/* ln P(|T| >= t), t > 0, integrated by hand from the density:
 *   nu = 1: 1 - (2/pi) atan t = (2/pi) atan(1/t)
 *   nu = 2: 1 - t/sqrt(2 + t^2) = 2 / (s (s + t)), s = sqrt(2 + t^2)
 *   nu = 4: 1 - (3/2) u + (1/2) u^3 with u = t/sqrt(4 + t^2), which is (1-u)^2 (2+u)/2, and
 *           1 - u = 4 / (s (s + t)), s = sqrt(4 + t^2).
 * The right-hand forms do not cancel. */
static double closed_log10_p(double t, int nu)
{
    if (nu == 1)
        return log10(2 / M_PI) + log10(atan(1 / t));
    double s = hypot(sqrt(nu), t);
    if (nu == 2)
        return log10(2 / s) - log10(s + t);
    double u = t / s;
    return 2 * (log10(4 / s) - log10(s + t)) + log10((2 + u) / 2);
}

TEST(test_p_closed_forms)
{
    for (int nu = 1; nu <= 4; nu *= 2)
        for (double t = 1e-6; t < 1e120; t *= 1.7)
            assert_close(stats_t_log10_p(t, nu), closed_log10_p(t, nu), 1e-10);
    assert_true(stats_t_log10_p(1e120, 4) < -470); /* beyond what a double p can hold */
}

/* GSL's cdf switches to a truncated expansion for nu > 30, so the reference here is its incomplete
 * beta function, which does not. */
TEST(test_p_gsl_beta)
{
    const double dof[] = {0.7, 1.5, 3, 7.25, 15, 30.5, 100, 210, 1000, 20000};
    int compared = 0;
    for (size_t i = 0; i < sizeof dof / sizeof *dof; i++)
        for (double z = 0.1; z < 30; z *= 1.3) {
            double nu = dof[i], t = stats_t_of_z(z, nu);
            double p = gsl_sf_beta_inc(nu / 2, 0.5, nu / (nu + t * t));
            if (p < 1e-290)
                continue;
            assert_close(stats_t_log10_p(t, nu), log10(p), 2e-9);
            assert_close(stats_t_log10_p(-t, nu), log10(p), 2e-9);
            compared++;
        }
    assert_true(compared > 150);
    /* Below nu = 30 its Student function is exact as well. */
    for (double t = 0.5; t < 1e6; t *= 3)
        assert_close(stats_t_log10_p(t, 11), log10(2 * gsl_cdf_tdist_Q(t, 11)), 1e-10);
}

/* t much larger than sqrt(nu): P(|T| >= t) = 2 nu^(nu/2) t^-nu / (nu B(nu/2, 1/2)) (1 +
 * O(nu^2/t^2)), the first term of the integral of the density. */
TEST(test_p_power_tail)
{
    for (double nu = 5; nu < 3000; nu *= 3.3) {
        double t = 1e9;
        double want =
            (M_LN2 + nu / 2 * log(nu) - nu * log(t) - log(nu) - gsl_sf_lnbeta(nu / 2, 0.5)) /
            M_LN10;
        assert_close(stats_t_log10_p(t, nu), want, 1e-10);
    }
    assert_true(stats_t_log10_p(1e9, 3000) < -20000);
}

/* Normal limit: log erfc from GSL. At nu = 1e11 ln p differs by t^4/(4 nu) (expand
 * -(nu+1)/2 ln(1 + t^2/nu)): at t = 100 by 2.5e-4 of 5000, a relative 5e-8. */
TEST(test_p_normal_limit)
{
    for (double t = 0.1; t < 100; t *= 1.5) {
        double want = gsl_sf_log_erfc(t / sqrt(2)) / M_LN10;
        assert_close(stats_t_log10_p(t, INFINITY), want, 1e-13);
        assert_close(stats_t_log10_p(t, 1e11), want, 1e-7);
    }
    assert_true(stats_t_log10_p(1e5, INFINITY) < -2e9);
    assert_close(stats_t_log10_p(0, 5), 0, 0);
}

/* The two methods meet at nu = 1e6, where the relative step of 2e-9 in nu moves ln p by only
 * 2e-9 t^4/(4 nu). */
TEST(test_p_methods_meet)
{
    for (double t = 1; t < 1000; t *= 1.5)
        assert_close(stats_t_log10_p(t, 1e6 * (1 + 1e-9)), stats_t_log10_p(t, 1e6 * (1 - 1e-9)),
                     1e-9);
}

/* p falls strictly, also where two ways of computing it meet. */
TEST(test_p_monotone)
{
    const double dof[] = {1, 2.5, 9, 29, 31, 64, 1e3, 1e5, 0.99e6, 1.01e6, 1e8};
    for (size_t i = 0; i < sizeof dof / sizeof *dof; i++) {
        double last = 0;
        for (double t = 0.01; t < 60; t += 0.01) {
            double p = stats_t_log10_p(t, dof[i]);
            assert_true(p < last);
            last = p;
        }
    }
}

/* t(1) = cot(pi q); t(2) = (1-2q) / sqrt(2 q (1-q)); both from inverting the closed forms. */
TEST(test_quantile_closed_forms)
{
    for (double q = 0.49; q > 1e-300; q *= 0.3) {
        double t1 = stats_t_quantile(q, 1), t2 = stats_t_quantile(q, 2);
        assert_true(fabs(t1 * tan(M_PI * q) - 1) < 1e-9);
        assert_true(fabs(t2 * sqrt(2 * q * (1 - q)) / (1 - 2 * q) - 1) < 1e-9);
    }
    assert_true(stats_t_quantile(0.5, 3) == 0);
}

/* The quantile's own tail, by GSL's incomplete beta function, is q again. */
TEST(test_quantile_gsl)
{
    const double dof[] = {0.8, 3, 7.5, 15, 63, 500, 20000};
    for (size_t i = 0; i < sizeof dof / sizeof *dof; i++)
        for (double q = 0.4; q > 1e-13; q *= 0.13) {
            double nu = dof[i], t = stats_t_quantile(q, nu);
            double p = gsl_sf_beta_inc(nu / 2, 0.5, nu / (nu + t * t));
            assert_true(fabs(p / (2 * q) - 1) < 1e-8);
        }
    assert_close(stats_t_quantile(1e-12, INFINITY), gsl_cdf_ugaussian_Qinv(1e-12), 1e-10);
    assert_close(stats_normal_quantile(0.025), 1.959963984540054, 1e-12);
    assert_close(stats_normal_quantile(0.9), -1.2815515655446004, 1e-12);
}

/* Wallace's approximation: z has the p of t to within 3 % of z, and stats_t_of_z() inverts it. */
TEST(test_normal_equivalent)
{
    for (double nu = 3; nu < 1e6; nu *= 3)
        for (double t = 0.5; t < 30; t *= 1.4) {
            double z = stats_z_of_t(t, nu);
            assert_close(stats_t_of_z(z, nu), t, 1e-9);
            double p = gsl_sf_beta_inc(nu / 2, 0.5, nu / (nu + t * t));
            assert_close(z, stats_normal_quantile(p / 2), 0.03);
        }
}

/* Chi-square tails. Even k in closed form: e^-y sum_{i < k/2} y^i/i!, in logarithms, far beyond what a
 * double p can hold; k = 1 is 2 Q(sqrt x) of the normal law; and GSL near the centre of large k. */
TEST(test_chi2)
{
    for (int k = 2; k <= 8; k += 2)
        for (double x = 0.01; x < 1e7; x *= 1.9) {
            double y = x / 2, term = 1, sum = 1;
            for (int i = 1; i < k / 2; i++)
                sum += term *= y / i;
            assert_close(stats_chi2_log10_p(x, k), log10(sum) - y / M_LN10, 1e-10);
        }
    assert_true(stats_chi2_log10_p(1e7, 8) < -1e6);
    for (double x = 0.01; x < 1e7; x *= 1.9)
        assert_close(stats_chi2_log10_p(x, 1), gsl_sf_log_erfc(sqrt(x / 2)) / M_LN10, 1e-9);
    for (double k = 10; k <= 1e6; k *= 10)
        for (double z = -5; z <= 5; z += 0.5) {
            double x = k + z * sqrt(2 * k);
            if (x > 0)
                assert_close(stats_chi2_log10_p(x, k), log10(gsl_cdf_chisq_Q(x, k)), 1e-7);
        }
}

/* Hill's equivalent has the p of t: relative 1e-4 of ln p for nu >= 20, t up to 8. */
TEST(test_hill)
{
    for (double nu = 20; nu < 1e7; nu *= 7)
        for (double t = -8; t <= 8; t += 0.5)
            assert_close(stats_t_log10_p(stats_hill_z(t, nu), INFINITY), stats_t_log10_p(t, nu),
                         1e-4);
    assert_true(stats_hill_z(-2, 20) == -stats_hill_z(2, 20));
    assert_true(stats_hill_z(3, INFINITY) == 3);
}

/* The first by hand: va = 4/10, vb = 9/5 of n = 10 and 5: V = 2.2, nu = 4.84 / (.16/9 + 3.24/4) = 5.84698... */
TEST(test_dof)
{
    assert_close(stats_welch_dof(0.4, 10, 1.8, 5), 4.84 / (0.16 / 9 + 3.24 / 4), 1e-14);
    /* Equal variances and n: 2 (n - 1). One side without noise: n - 1 of the other. */
    assert_close(stats_welch_dof(3, 8, 3, 8), 14, 1e-14);
    assert_close(stats_welch_dof(0, 100, 3, 8), 7, 1e-14);
    assert_true(isinf(stats_welch_dof(0, 3, 0, 3)));
    assert_close(stats_dof(3, 2), 9, 1e-14);
}
