/* The closed-form variance of a sample against simulation, and the checks built on it: renders that waste
 * samples, adaptive sampling that stops too early or too late. Seeds and trials are fixed; nothing is retried. */
#include "reference/truth/truth_lamps.h"
#include "reference/truth/truth_noise.h"
#include "renderer/math/sampler.h"
#include "tools/stats/sample_efficiency.h"
#include "tools/sequential/adaptive_stop.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

static double uniform(uint32_t stream, uint32_t i, int k)
{
    return (double)sampler_get(77, stream, i, 0, 0).u[k] + 0x1p-25;
}

/* The estimators that may be simulated. */
enum estimator { POWER, BALANCE, UNIFORM_DIRECTIONS, ONE_TECHNIQUE };

static double weight(enum estimator how, double a, double b)
{
    return how == ONE_TECHNIQUE ? 1 : how == BALANCE ? a / (a + b) : a * a / (a * a + b * b);
}

/* Radiance estimate of one sample at (x, 0, z) below the lamp, by its own route: random points and directions. */
static double simulate(const struct truth_lamp *l, double x, double z, enum estimator how,
                       uint32_t stream, uint32_t i)
{
    double area = (l->ex[1] - l->ex[0]) * (l->ez[1] - l->ez[0]), y = 0;
    double dx = l->ex[0] + (l->ex[1] - l->ex[0]) * uniform(stream, i, 0) - x;
    double dz = l->ez[0] + (l->ez[1] - l->ez[0]) * uniform(stream, i, 1) - z;
    double d2 = dx * dx + dz * dz + l->height * l->height, cosine = l->height / sqrt(d2);
    double p_l = d2 / (area * cosine);
    double p_b = how == UNIFORM_DIRECTIONS ? 0.5 / M_PI : cosine / M_PI;
    y += cosine / M_PI / p_l * weight(how, p_l, p_b);
    if (how == ONE_TECHNIQUE)
        return y;
    double u = uniform(stream, i, 2), phi = 2 * M_PI * uniform(stream, i, 3);
    cosine = how == UNIFORM_DIRECTIONS ? u : sqrt(u);
    double slope = sqrt(1 - cosine * cosine) / cosine;
    double hit_x = x + l->height * slope * cos(phi), hit_z = z + l->height * slope * sin(phi);
    if (hit_x < l->ex[0] || hit_x > l->ex[1] || hit_z < l->ez[0] || hit_z > l->ez[1])
        return y;
    p_l = l->height * l->height / (cosine * cosine) / (area * cosine);
    p_b = how == UNIFORM_DIRECTIONS ? 0.5 / M_PI : cosine / M_PI;
    return y + cosine / M_PI / p_b * weight(how, p_b, p_l);
}

static const struct {
    struct truth_lamp lamp;
    double x, z;
} places[] = {
    {{0.6, {0.15, 0.65}, {-0.35, -0.05}}, 0.4, -0.2},
    {{0.6, {0.15, 0.65}, {-0.35, -0.05}}, -1.2, 1.1},
    {{0.5, {-0.5, 1.1}, {-0.7, 0.5}}, 0.3, 0.1},
};

/* The first moment is the irradiance over pi, known in closed form: to 1e-8 relative, quadrature order 48. */
TEST(first_moment_is_the_mean)
{
    for (size_t i = 0; i < COUNT(places); i++) {
        const struct truth_lamp *l = &places[i].lamp;
        double moment[2];
        truth_sample_moments(l, places[i].x, places[i].z, 48, moment);
        double mean =
            truth_rectangle_irradiance(l->height, l->ex, l->ez, places[i].x, places[i].z) / M_PI;
        assert_true(fabs(moment[0] - mean) <= 1e-8 * mean);
    }
}

/* H0: simulated samples have the second moment of the closed form. n = 4e5 samples at each of three
 * places: |z| < 4.4 with probability 1 - 1e-5. Control: other estimators of the same mean have
 * |z| > 10 at the place where the two techniques are equally good. */
TEST(second_moment_is_that_of_samples)
{
    enum { SAMPLES = 400000 };
    for (size_t i = 0; i < COUNT(places); i++)
        for (enum estimator how = POWER; how <= ONE_TECHNIQUE; how++) {
            double moment[2], mean = 0, squares = 0;
            truth_sample_moments(&places[i].lamp, places[i].x, places[i].z, 48, moment);
            for (uint32_t k = 0; k < SAMPLES; k++) {
                double y = simulate(&places[i].lamp, places[i].x, places[i].z, how,
                                    (uint32_t)(4 * i + how), k);
                mean += y * y / SAMPLES;
                squares += pow(y, 4) / SAMPLES;
            }
            double z = (mean - moment[1]) / sqrt((squares - mean * mean) / SAMPLES);
            print_message("place %zu, estimator %d: %.5f of the form, z = %.1f\n", i, (int)how,
                          mean / moment[1], z);
            if (how == POWER)
                assert_true(fabs(z) < 4.4);
            else if (i == 2)
                assert_true(fabs(z) > 10);
        }
}

enum { SIDE = 8, PIXELS = SIDE * SIDE, RENDERS = 8 };

/* Exponential samples of mean 1, the same in all channels; takes only asked/every samples a pixel. */
static struct moments render(int k, int asked, int every)
{
    struct moments m;
    struct err e;
    assert_true(moments_alloc(&m, SIDE, SIDE, &e));
    for (uint32_t p = 0; p < PIXELS; p++)
        for (int s = 0; s < asked / every; s++) {
            double y = -log(uniform((uint32_t)k * PIXELS + p, (uint32_t)s, 0));
            moments_add(&m, p, (const double[]){y, y, y});
        }
    return m;
}

static struct sample_efficiency judge(int every, double margin)
{
    struct moments m[RENDERS];
    double variance[3 * PIXELS];
    struct sample_efficiency f;
    struct err e;
    for (int k = 0; k < RENDERS; k++)
        m[k] = render(k, 256, every);
    for (size_t i = 0; i < COUNT(variance); i++)
        variance[i] = 1;
    MUST(sample_efficiency_judge(m, RENDERS, 256, variance, margin, 1e-4, &f, &e));
    for (int k = 0; k < RENDERS; k++)
        moments_free(&m[k]);
    return f;
}

/* The sample variance of 64 x 256 exponential samples has a relative sd of sqrt(8/16384) = 2.2 % in
 * one render, 0.8 % over 8, so the interval is about +-0.8 % x t(7, 5e-5) = 6 %. */
TEST(wasted_samples_are_found)
{
    struct sample_efficiency f = judge(1, 0.2);
    assert_int_equal(f.verdict, VERDICT_EQUIVALENT);
    assert_true(f.lo < 1 && f.hi > 1);
    f = judge(2, 0.2);
    assert_int_equal(f.verdict, VERDICT_DIFFERENT);
    assert_true(f.lo < 2 && f.hi > 2);
    assert_int_equal(judge(1, 0.001).verdict, VERDICT_INCONCLUSIVE);
    struct moments none[4];
    double variance[12] = {1};
    struct err e;
    for (int k = 0; k < 4; k++)
        assert_true(moments_alloc(&none[k], 2, 2, &e));
    assert_false(sample_efficiency_judge(none, 4, 16, variance, 0.1, 0.01, &f, &e));
    for (int k = 0; k < 4; k++)
        moments_free(&none[k]);
}

/* Adaptive sampling of exponential samples, mean 3 p in pixel p: the assignment's stopping rule, and the
 * mistakes seen in implementations of it. */
enum rule { AS_ASKED, ONE_SIGMA, ABSOLUTE, WITHOUT_ROOT, NEVER, NO_BATCH };

static bool holds(enum rule rule, double s1, double s2, double n, double tolerance)
{
    double mean = s1 / n, v = (s2 - s1 * s1 / n) / (n - 1);
    switch (rule) {
    case AS_ASKED:
    case NO_BATCH: return 1.96 * sqrt(v / n) <= tolerance * mean;
    case ONE_SIGMA: return sqrt(v / n) <= tolerance * mean;
    case ABSOLUTE: return 1.96 * sqrt(v / n) <= tolerance;
    case WITHOUT_ROOT: return 1.96 * sqrt(v) / n <= tolerance * mean;
    case NEVER: return false;
    }
    return false;
}

static struct adaptive_stop adapt(enum rule rule)
{
    enum { BATCH = 16, MOST = 4096 };
    const double tolerance = 0.1;
    OWN(moments) m;
    struct err e;
    assert_true(moments_alloc(&m, SIDE, SIDE, &e));
    for (uint32_t p = 0; p < PIXELS; p++) {
        double s1 = 0, s2 = 0;
        for (uint32_t s = 0; s < MOST; s++) {
            double y = -3.0 * p * log(uniform(9000 + p, s, 0));
            moments_add(&m, p, (const double[]){0.2 * y, 0.5 * y, y});
            s1 += y;
            s2 += y * y;
            if ((rule == NO_BATCH ? s > BATCH : (s + 1) % BATCH == 0) &&
                holds(rule, s1, s2, s + 1, tolerance))
                break;
        }
    }
    struct adaptive_stop r = adaptive_stop_check(&m, BATCH, tolerance, MOST);
    return r;
}

TEST(stop_rules_are_told_apart)
{
    struct adaptive_stop r = adapt(AS_ASKED);
    assert_int_equal(r.too_early, 0);
    assert_int_equal(r.too_late, 0);
    assert_true(adapt(ONE_SIGMA).too_early > PIXELS / 2);
    assert_true(adapt(ABSOLUTE).too_late > PIXELS / 2);
    assert_true(adapt(WITHOUT_ROOT).too_early > PIXELS / 2);
    assert_true(adapt(NEVER).too_late > PIXELS / 2);
    assert_true(adapt(NO_BATCH).too_early > PIXELS / 2);
}
