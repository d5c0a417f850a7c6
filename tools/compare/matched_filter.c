#include "matched_filter.h"

#include <math.h>

/* sums over pixels p and channels c with weights w = d/v */
struct sums {
    struct cell cell; /* w A and w B, as if they were a region */
    double unit;      /* |w| unit of B */
    double size;      /* |w| max(A, B) */
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
            }
            struct estimate a = weighted(base, 0, i, w, base->a->n[p]);
            struct estimate b = weighted(base, 1, i, w, base->b->n[p]);
            b.v += dif.coupled;
            pyramid_add_pixel(&s.cell, &a, &b);
        }
    return s;
}

bool matched_filter_test(const struct moments *a, const struct moments *b, struct judge *j,
                         enum error_mode_kind *found, double *log10_p, struct err *e)
{
    struct error_modes_base base;
    *found = 0;
    *log10_p = 0;
    if (!error_modes_base_build(a, b, &base, e))
        return false;
    for (int k = 0; k < NUM_ERROR_MODES; k++) {
        if (!error_mode_applies(&base, k))
            continue;
        struct sums s = sum_up(j, &base, k);
        struct measured m = region_measure_weighted(j, &s.cell, s.unit, s.size);
        if (m.noise_free || !region_is_normal(j, &m))
            continue;
        j->num_tests[STATISTIC_MATCHED_FILTER]++;
        double p = region_log10_p(j, &m, CHANNEL_LUMINANCE);
        if (p < *log10_p) {
            *log10_p = p;
            *found = k;
        }
    }
    error_modes_base_free(&base);
    return true;
}
