#include "variance_ratio.h"

#include "tools/stats/distributions.h"

#include <gsl/gsl_cdf.h>
#include <math.h>
#include <string.h>

static const double skew_limit_widened = 1; /* as for regions */
/* The chance that two independent renders agree in all moments of a pixel in which either has noise.
 * Two-valued laws agree most: for n = 3 observations, at even odds, 2 (3/8)^2 / (1 - 1/16) = 0.3, less for
 * more observations. */
static const double shared_by_chance = 1.0 / 3;
static const double shared_level = 1e-6;
/* Largest ratio of squared difference and variance that counts as shared noise: bounds of the variance for any
 * correlation of channels can alone bring it near this. */
static const double least_shared = 0.25;

/* Paths per observation, in a unit that both sides have (paths, or else observations of one kind); 0 if there is
 * none. */
static double paths(const struct moments *m, const struct moments *other)
{
    if (moments_noise_is_unknown(m))
        return 0;
    if (m->spp > 0 && other->spp > 0)
        return m->spp;
    return strcmp(m->unit, other->unit) == 0 && m->spp == other->spp ? 1 : 0;
}

/* Sums over pixels of a = variance of one observation of A, RGB together, times its paths; b likewise. */
struct pixels {
    double num; /* those with noise on either side */
    double a, b, aa, ab, bb;
    double aaa, aab, abb, bbb;
};

static double variance(const struct moments *m, size_t p)
{
    return (moments_m2(m, 3 * p) + moments_m2(m, 3 * p + 1) + moments_m2(m, 3 * p + 2)) /
           ((moments_n(m, p) - 1) * (m->sharing > 1 ? m->sharing : 1));
}

static struct pixels sum_pixels(const struct moments *a, const struct moments *b, double paths_a,
                                double paths_b)
{
    struct pixels s = {0};
    size_t pixels = (size_t)a->width * (size_t)a->height;
    for (size_t p = 0; p < pixels; p++) {
        double x = paths_a * variance(a, p), y = paths_b * variance(b, p);
        s.num += x > 0 || y > 0;
        s.a += x;
        s.b += y;
        s.aa += x * x;
        s.ab += x * y;
        s.bb += y * y;
        s.aaa += x * x * x;
        s.aab += x * x * y;
        s.abb += x * y * y;
        s.bbb += y * y * y;
    }
    return s;
}

/* sum (a - r b) over its root sum of squares: Student's t of the hypothesis that the ratio is r in
 * expectation, each pixel's difference having its own variance, about 0 [Efron69]. */
static double student(const struct pixels *s, double r)
{
    double square = s->aa - 2 * r * s->ab + r * r * s->bb, u = s->a - r * s->b;
    if (!(square > 0))
        return u == 0 ? 0 : copysign(INFINITY, u);
    double left = s->num * square - u * u;
    return left > 0 ? u * sqrt((s->num - 1) / left) : copysign(INFINITY, u);
}

/* Skewness of sum (a - r b), for the r at which the sum is 0: elsewhere its mean would count as skewness. */
static double skewness(const struct pixels *s, double r)
{
    double cube = s->aaa - 3 * r * s->aab + 3 * r * r * s->abb - r * r * r * s->bbb;
    double square = s->aa - 2 * r * s->ab + r * r * s->bb;
    return square > 0 ? fabs(cube) / pow(square, 1.5) : 0;
}

/* Standard error of that: the root of the sum of sixth powers. Where few pixels have most of the noise, their cubes may
 * cancel by luck. */
static double skewness_se(const struct moments *a, const struct moments *b, double paths_a,
                          double paths_b, double r)
{
    double square = 0, sixth = 0;
    size_t pixels = (size_t)a->width * (size_t)a->height;
    for (size_t p = 0; p < pixels; p++) {
        double u = paths_a * variance(a, p) - r * paths_b * variance(b, p);
        square += u * u;
        sixth += u * u * u * u * u * u;
    }
    return square > 0 ? sqrt(sixth) / pow(square, 1.5) : 0;
}

/* Fieller's interval: all r that are not rejected. |t| <= x is u^2 <= k square, a quadratic in r. */
static bool interval(const struct pixels *s, double x, struct variance_ratio *out)
{
    double k = x * x * s->num / (s->num - 1 + x * x);
    double c2 = s->b * s->b - k * s->bb, c1 = s->a * s->b - k * s->ab;
    double c0 = s->a * s->a - k * s->aa, root = c1 * c1 - c2 * c0;
    if (!(c2 > 0 && root >= 0))
        return false;
    out->lo = fmax(0, (c1 - sqrt(root)) / c2);
    out->hi = (c1 + sqrt(root)) / c2;
    return true;
}

struct variance_ratio variance_ratio_test(const struct moments *a, const struct moments *b,
                                          const struct judge *j, double *log10_p, bool *testable)
{
    struct variance_ratio out = {.of_paths = a->spp > 0 && b->spp > 0,
                                 .is_shared = a->sharing > 1 || b->sharing > 1};
    double paths_a = paths(a, b), paths_b = paths(b, a);
    *log10_p = 0;
    *testable = false;
    if (moments_is_exact(a) || moments_is_exact(b) || paths_a == 0 || paths_b == 0)
        return out;
    struct pixels s = sum_pixels(a, b, paths_a, paths_b);
    if (!(s.a > 0 && s.b > 0) || s.num < 3)
        return out;
    out.ratio = out.lo = out.hi = s.a / s.b;
    if (out.is_shared) /* the pixels' variances depend on each other */
        return out;
    double g = skewness(&s, out.ratio), x = 0, factor = 0;
    for (int i = 0; i < 4; i++) {
        x = stats_t_quantile(j->opt.alpha * exp(-factor), s.num - 1);
        factor = fmin(skew_limit_widened, g * x * x * x / 3);
    }
    out.valid = factor < skew_limit_widened && interval(&s, x, &out);

    double limit = 1 + j->opt.margin_variance;
    double r = out.ratio > limit ? limit : out.ratio < 1 / limit ? 1 / limit : out.ratio;
    const double guard = stats_t_of_z(j->z_guard[STATISTIC_VARIANCE], s.num - 1),
                 t = fmin(1e9, fabs(student(&s, r)));
    bool raised;
    *testable = region_skew_is_testable(g, guard, &raised);
    if (*testable && raised) {
        g += skewness_se(a, b, paths_a, paths_b, out.ratio);
        *testable = region_skew_is_testable(g, guard, &raised);
    }
    if (*testable)
        *log10_p = region_raised_log10_p(t, s.num - 1, raised ? g : 0);
    return out;
}

const char *variance_ratio_of(const struct variance_ratio *v)
{
    return v->of_paths ? "path" : "render";
}

static bool same_pixel(const struct moments *a, const struct moments *b, size_t p)
{
    bool same = moments_n(a, p) == moments_n(b, p);
    for (size_t i = 3 * p; same && i < 3 * p + 3; i++)
        same = moments_mean(a, i) == moments_mean(b, i) && moments_m2(a, i) == moments_m2(b, i) &&
               moments_m3(a, i) == moments_m3(b, i);
    return same;
}

size_t variance_ratio_shared(const struct moments *a, const struct moments *b)
{
    size_t pixels = (size_t)a->width * (size_t)a->height, noisy = 0, same = 0;
    for (size_t p = 0; p < pixels; p++)
        if (variance(a, p) > 0 || variance(b, p) > 0) {
            noisy++;
            same += same_pixel(a, b, p);
        }
    if (same == 0)
        return 0;
    double p = gsl_cdf_binomial_Q((unsigned)(same - 1), shared_by_chance, (unsigned)noisy);
    return p <= shared_level ? same : 0;
}

void variance_ratio_advise(const struct moments *a, const struct moments *b, const char *advice,
                           struct err *e)
{
    const struct err why = *e;
    if (a->width == b->width && a->height == b->height && variance_ratio_shared(a, b) > 0)
        err_set(e, "%s (%s)", why.msg, advice);
}

double variance_ratio_of_difference(const struct moments *a, const struct moments *b)
{
    size_t pixels = (size_t)a->width * (size_t)a->height;
    double largest = 0, log10_p = 0;
    for (int c = 0; c < 3; c++) {
        double sum = 0, num = 0;
        for (size_t p = 0; p < pixels; p++) {
            size_t i = 3 * p + (size_t)c;
            double v = moments_var_of_mean(a, p, c) + moments_var_of_mean(b, p, c);
            if (v > 0) { /* and not unknown, as of stratified samples */
                double d = moments_mean(a, i) - moments_mean(b, i);
                sum += d * d / v;
                num++;
            }
        }
        if (num > 0 && sum / num >= largest) {
            largest = sum / num;
            log10_p = log10(gsl_cdf_chisq_P(sum, num));
        }
    }
    return largest <= least_shared && log10_p <= log10(shared_level) ? largest : 1;
}
