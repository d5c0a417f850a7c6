#include "matched_filter.h"

#include "error_modes.h"
#include "tools/stats/distributions.h"

#include <math.h>
#include <string.h>

/* sums over pixels p and channels c with weights w = d/v */
struct sums {
    struct cell cell; /* w A and w B, as if they were a region */
    double unit;      /* |w| unit of B */
    double size;      /* |w| max(A, B) */
    double same;      /* w same, less the noise of d */
};

/* A or B in one pixel, its channels weighted. Their correlation is unknown: see pyramid_pixel_estimate(). Where
 * weights have both signs the third cumulants of the channels are added all the same: that they cancel if
 * the channels are perfectly correlated is no permission. */
static struct estimate weighted(const struct error_modes_base *base, int side, size_t i,
                                const double w[3], double n)
{
    const struct moments *m = side == 0 ? base->a : base->b;
    double mean = 0, deviation = 0, root = 0, sign = 0;
    for (size_t c = 0; c < 3; c++) {
        mean += w[c] * m->mean[i + c];
        deviation += fabs(w[c]) * base->sd[side][i + c];
        root += fabs(w[c]) * base->root[side][i + c];
        sign += w[c] * base->sd[side][i + c];
    }
    root = copysign(root, sign * root);
    struct estimate est = pyramid_estimate_from(mean, deviation * deviation, root * root * root, n);
    /* With weights of both signs the third cumulants of a skewed law can cancel in the sample and not in
     * truth, or the reverse; their own squares bound the variance of each if it is of rare events. */
    est.var_k3 = fmax(est.var_k3, est.k3 * est.k3);
    return est;
}

static struct sums sum_up(const struct judge *j, const struct error_modes_base *base,
                          enum error_mode_kind kind)
{
    struct sums s = {0};
    for (int y = 0; y < base->height; y++)
        for (int x = 0; x < base->width; x++) {
            struct error_change dif = error_mode_at(base, kind, x, y);
            size_t p = (size_t)y * (size_t)base->width + (size_t)x, i = 3 * p;
            double w[3];
            for (size_t c = 0; c < 3; c++) {
                double mean_a = base->a->mean[i + c], mean_b = base->b->mean[i + c];
                w[c] = base->weight[i + c] * dif.d[c];
                s.unit += fabs(w[c]) * fmax(mean_b, j->floor);
                s.size += fabs(w[c]) * fmax(mean_a, mean_b);
                s.same += w[c] * dif.same[c] - base->weight[i + c] * dif.noise[c];
            }
            struct estimate a = weighted(base, 0, i, w, base->a->n[p]);
            struct estimate b = weighted(base, 1, i, w, base->b->n[p]);
            b.v += dif.coupled;
            pyramid_add_pixel(&s.cell, &a, &b);
        }
    return s;
}

/* sum (D^2 - v)/v: the squared bias that there is to be explained, in the metric of the weights */
static double squared_bias(const struct error_modes_base *base)
{
    double sum = 0;
    size_t n = 3 * (size_t)base->width * (size_t)base->height;
    for (size_t i = 0; i < n; i++) {
        double d = base->a->mean[i] - base->b->mean[i];
        double v = pow(base->sd[0][i], 2) + pow(base->sd[1][i], 2);
        sum += (d * d - v) * base->weight[i];
    }
    return sum;
}

static struct error_mode describe(const struct judge *j, enum error_mode_kind kind,
                                  const struct sums *s, const struct measured *m, double squared)
{
    struct error_mode found = {.name = error_mode_name[kind], .unit = ""};
    if (s->same > 0 && squared > 0)
        found.explained = fmin(1, m->d / s->same * (m->d / squared));
    if (!error_mode_has_amount(kind) || !(s->same > 0))
        return found;
    double scale = 1 / s->same;
    found.unit = "px";
    if (kind == ERROR_SCALE) {
        found.unit = "%";
        scale *= 100;
    } else if (kind == ERROR_OFFSET) {
        found.unit = "% of the mean";
        scale *= 100 / j->mean_b;
    } else if (kind == ERROR_GAMMA) {
        found.unit = "in the exponent";
    }
    double half = stats_t_quantile(j->opt.alpha, m->dof) * sqrt(m->v);
    found.amount = scale * m->d;
    found.lo = scale * (m->d - half);
    found.hi = scale * (m->d + half);
    return found;
}

bool matched_filter_test(const struct moments *a, const struct moments *b, struct judge *j,
                         struct error_mode *found, double *log10_p, struct err *e)
{
    struct error_modes_base base;
    *found = (struct error_mode){.unit = ""};
    *log10_p = 0;
    if (!error_modes_base_build(a, b, &base, e))
        return false;
    double squared = squared_bias(&base);
    for (int k = 0; k < NUM_ERROR_MODES; k++) {
        if (!error_mode_applies(&base, k))
            continue;
        struct sums s = sum_up(j, &base, k);
        struct measured m = region_measure_weighted(j, &s.cell, s.unit, s.size);
        if (m.noise_free || !region_testable(j, &m))
            continue;
        j->num_tests[STATISTIC_MATCHED_FILTER]++;
        double p = region_log10_p(j, &m, CHANNEL_LUMINANCE);
        if (found->name == NULL || p < *log10_p) {
            *log10_p = p;
            *found = describe(j, k, &s, &m, squared);
        }
    }
    error_modes_base_free(&base);
    return true;
}
