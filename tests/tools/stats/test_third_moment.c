/* tools/stats/third_moment.c: bounds against known third moments, and verdicts where only the bound is known. */
#include "tests/support/simulate.h"
#include "tests/support/own.h"
#include "tests/support/test.h"
#include "tools/compare/compare.h"
#include "tools/stats/third_moment.h"

#include <string.h>

static struct err e;

static void forget(struct moments *m)
{
    memset(m->m3, 0, 3 * (size_t)m->width * (size_t)m->height * sizeof *m->m3);
}

/* Sum over pixels of the red k3A - k3B and of (vA + vB)^1.5. */
static void sum_up(const struct moments *a, const struct moments *b, double *k3, double *cube)
{
    *k3 = *cube = 0;
    for (size_t p = 0; p < (size_t)a->width * (size_t)a->height; p++) {
        double na = a->n[p], nb = b->n[p], v = a->m2[3 * p] / (na * (na - 1));
        *k3 += a->m3[3 * p] / (na * (na - 1) * (na - 2));
        if (nb >= 3) {
            v += b->m2[3 * p] / (nb * (nb - 1));
            *k3 -= b->m3[3 * p] / (nb * (nb - 1) * (nb - 2));
        }
        *cube += v * sqrt(v);
    }
}

/* Exponential samples, 48 x 48 pixels, n = 64. Against the exact mean: k3 = 2/n^2 is 2/sqrt n = 0.25 of v^1.5; as
 * E[v^1.5] exceeds E[v]^1.5 by a factor of 1 + 3/8 x 8/n = 1.05, the ratio of sums is 0.24. The standard error of a
 * window is 2/17 of sd(v)/v = sqrt(8/64) and of its kurtosis, 0.04 to 0.1. Against another such image k3A - k3B = 0.
 * Against 1024 samples it is 0.25 (1 - 1/256)/(1 + 1/16)^1.5 = 0.23, less the same few per cent 0.22. The bound has
 * to lie between the truth less 15 % (4 standard errors of 9 windows) and the truth plus 0.15. */
TEST(test_bound_meets_the_truth)
{
    uint64_t seed = 31;
    static const int n[3] = {0, 64, 1024};
    static const double truth[3] = {0.24, 0, 0.22};
    for (int i = 0; i < 3; i++) {
        struct moments a = new_moments(48, 48, "sample"),
                       b = new_moments(48, 48, n[i] > 0 ? "sample" : "exact");
        double k3, cube;
        simulate(&a, LAW_EXPONENTIAL, 1, 64, true, &seed);
        if (n[i] > 0)
            simulate(&b, LAW_EXPONENTIAL, 1, n[i], true, &seed);
        else
            constant(&b, 1, 1);
        forget(&a);
        forget(&b);
        assert_true(third_moment_bound(&a, &b, true, n[i] > 0, &e));
        sum_up(&a, &b, &k3, &cube);
        assert_true(k3 / cube >= 0.85 * truth[i] && k3 / cube <= truth[i] + 0.15);
        moments_free(&a);
        moments_free(&b);
    }
}

/* With fewer than 16 noisy pixels nothing can be estimated: the bound is V^1.5, whatever the sides look like. Here
 * 15 of 16 x 16, n = 100, vA = 1/99, vB = 3/99: k3A - k3B = (4/99)^1.5, and k3A^2/vA + k3B^2/vB = V^2. */
TEST(test_too_few_pixels)
{
    OWN(moments) a = new_moments(16, 16, "sample"), b = new_moments(16, 16, "sample");
    constant(&a, 1, 100);
    constant(&b, 1, 100);
    for (size_t i = 0; i < 45; i++) {
        a.m2[17 * 3 + i] = 100;
        b.m2[17 * 3 + i] = 300;
    }
    assert_true(third_moment_bound(&a, &b, true, true, &e));
    double per = 100.0 * 99 * 98, k3a = a.m3[17 * 3] / per, k3b = b.m3[17 * 3] / per;
    assert_near(k3a - k3b, pow(4.0 / 99, 1.5), 1e-12);
    assert_near(k3a * k3a * 99 + k3b * k3b * 33, pow(4.0 / 99, 2), 1e-12);
    assert_true(a.m3[0] == 0 && b.m3[0] == 0);
}

/* Number of DIFFERENT among pairs of equal means, 16 x 16, tiles of 8, with M3 bounded or set to 0. */
static int count_different(enum law law, int n_a, int n_b, int pairs, bool is_bounded,
                           uint64_t seed)
{
    OWN(moments) a = new_moments(16, 16, "sample"), b = new_moments(16, 16, "sample");
    struct compare_options opt = {.alpha = 0.01, .tile = 8};
    int different = 0;
    for (int i = 0; i < pairs; i++) {
        OWN(comparison) c;
        simulate(&a, law, 1, n_a, true, &seed);
        simulate(&b, law, 1, n_b, true, &seed);
        forget(&a);
        forget(&b);
        if (is_bounded)
            assert_true(third_moment_bound(&a, &b, true, true, &e));
        assert_true(compare_moments(&a, &b, &opt, &c, &e));
        different += c.verdict == VERDICT_DIFFERENT;
    }
    return different;
}

/* H0: equal means. alpha 1 %, 100 pairs a law: 8 or more have a probability of 1e-5 at a true rate of 1 %. Control:
 * 90 % black, 64 samples against 1024, with M3 = 0: a pixel's mean in A has a skewness of 6.5/sqrt 64 = 0.8, and
 * 0.9^64 = 0.1 % of A's pixels are black with variance 0, so that B's mean lies 1/sqrt(19/1024) = 7 standard errors
 * off. */
TEST(test_level_without_third_moments)
{
    assert_true(count_different(LAW_BLACK, 64, 1024, 100, true, 41) < 8);
    assert_true(count_different(LAW_LOGNORMAL, 64, 64, 100, true, 42) < 8);
    assert_true(count_different(LAW_PARETO, 64, 1024, 100, true, 43) < 8);
    assert_true(count_different(LAW_BLACK, 64, 1024, 100, false, 41) >= 8);
}

/* Dark pixels that few bright samples reach: 0.5, and 500 more in 0.1 % of the samples (mean 1, sd 15.8), n = 4096,
 * 32 x 32, tiles of 16. The difference has a standard error of 1.1 % (image) and 2.2 % (tile): EQUIVALENT at 8 and
 * 20 %. Bounded as a log-normal law a sample's skewness would be 4000 and the image's 1.4: no number of samples
 * would be enough. */
TEST(test_dark_pixels)
{
    OWN(moments) a = new_moments(32, 32, "sample"), b = new_moments(32, 32, "sample");
    struct compare_options opt = {
        .alpha = 1e-3, .margin_global = 0.08, .margin_tile = 0.2, .tile = 16};
    struct comparison c;
    uint64_t seed = 51;
    simulate(&a, LAW_FIREFLY, 1, 4096, true, &seed);
    simulate(&b, LAW_FIREFLY, 1, 4096, true, &seed);
    forget(&a);
    forget(&b);
    assert_true(third_moment_bound(&a, &b, true, true, &e));
    assert_true(compare_moments(&a, &b, &opt, &c, &e));
    assert_int_equal(c.verdict, VERDICT_EQUIVALENT);
    comparison_free(&c);
    simulate(&a, LAW_FIREFLY, 1.3, 4096, true, &seed);
    forget(&a);
    assert_true(third_moment_bound(&a, &b, true, true, &e));
    assert_true(compare_moments(&a, &b, &opt, &c, &e));
    assert_int_equal(c.verdict, VERDICT_DIFFERENT);
    comparison_free(&c);
}
