#include "anchor_rules.h"

#include "tools/stats/distributions.h"

#include <gsl/gsl_sf_erf.h>
#include <gsl/gsl_sort.h>
#include <math.h>
#include <stdlib.h>

void anchor_xyz(const double light[3], double xyz[3])
{
    static const double m[3][3] = {{0.412391, 0.357584, 0.180481},
                                   {0.212639, 0.715169, 0.072192},
                                   {0.019331, 0.119195, 0.950532}};
    for (int k = 0; k < 3; k++)
        xyz[k] = m[k][0] * light[0] + m[k][1] * light[1] + m[k][2] * light[2];
}

void mitsuba_z(const struct moments *a, const struct mitsuba_reference *r, double *z)
{
    size_t pixels = (size_t)a->width * (size_t)a->height;
    for (size_t p = 0; p < pixels; p++) {
        double xyz[3];
        anchor_xyz(&a->mean[3 * p], xyz);
        for (size_t k = 0; k < 3; k++) {
            double var = fmax(r->var[3 * p + k], MITSUBA_FLOOR);
            z[3 * p + k] = fabs(xyz[k] - r->mean[3 * p + k]) * sqrt(a->n[p] / var);
        }
    }
}

double mitsuba_critical_z(double level, size_t pixels)
{
    return stats_normal_quantile(-expm1(log1p(-level) / (double)pixels) / 2);
}

size_t mitsuba_failures(const double *z, size_t pixels, double critical_z)
{
    size_t failures = 0;
    for (size_t i = 0; i < 3 * pixels; i++)
        failures += z[i] >= critical_z;
    return failures;
}

size_t mitsuba_allowed(double share, size_t pixels)
{
    size_t allowed = 0;
    while ((double)(3 * pixels - allowed - 1) / 3 >= share * (double)pixels)
        allowed++;
    return allowed;
}

double mitsuba_score(const double *z, size_t pixels, size_t allowed)
{
    double *largest = calloc(allowed + 1, sizeof *largest);
    gsl_sort_largest(largest, allowed + 1, z, 1, 3 * pixels);
    double score = largest[allowed];
    free(largest);
    return score;
}

double welch_log10_p(const struct moments *a, const struct moments *b)
{
    size_t pixels = (size_t)a->width * (size_t)a->height, tested = 0;
    double best_z = 0, smallest = 0;
    for (size_t p = 0; p < pixels; p++)
        for (int c = 0; c < 3; c++) {
            double va = moments_var_of_mean(a, p, c), vb = moments_var_of_mean(b, p, c);
            if (!(va + vb > 0))
                continue;
            tested++;
            double t =
                fabs(a->mean[3 * p + (size_t)c] - b->mean[3 * p + (size_t)c]) / sqrt(va + vb);
            double nu = stats_welch_dof(va, a->n[p], vb, b->n[p]), z = stats_z_of_t(t, nu);
            /* The exact p only where it may be the smallest: the equivalent is good to 3 %. */
            if (z < 0.94 * best_z)
                continue;
            best_z = fmax(best_z, z);
            smallest = fmin(smallest, stats_t_log10_p(t, nu));
        }
    if (tested == 0)
        return 0;
    if (smallest < -15) /* 1 - (1-p)^n = n p to the last digit */
        return smallest + log10((double)tested);
    return log10(-expm1((double)tested * log1p(-pow(10, smallest))));
}

double tiles_log10_p(const struct moments *a, const struct moments *b, int side)
{
    double largest = 0, tested = 0;
    for (int y0 = 0; y0 < a->height; y0 += side)
        for (int x0 = 0; x0 < a->width; x0 += side)
            for (int c = 0; c < 3; c++) {
                double d = 0, v = 0;
                for (int y = y0; y < y0 + side && y < a->height; y++)
                    for (int x = x0; x < x0 + side && x < a->width; x++) {
                        size_t p = (size_t)y * (size_t)a->width + (size_t)x;
                        d += a->mean[3 * p + (size_t)c] - b->mean[3 * p + (size_t)c];
                        v += moments_var_of_mean(a, p, c) + moments_var_of_mean(b, p, c);
                    }
                if (!(v > 0))
                    continue;
                tested++;
                largest = fmax(largest, fabs(d) / sqrt(v));
            }
    return tested > 0 ? fmin(0, gsl_sf_log_erfc(largest * M_SQRT1_2) * M_LOG10E + log10(tested))
                      : 0;
}

double relative_rmse(const struct moments *a, const struct moments *b)
{
    size_t values = 3 * (size_t)a->width * (size_t)a->height;
    double square = 0, sum = 0;
    for (size_t i = 0; i < values; i++) {
        square += (a->mean[i] - b->mean[i]) * (a->mean[i] - b->mean[i]);
        sum += b->mean[i];
    }
    return sqrt(square * (double)values) / sum;
}

int idiff_fail_score(const size_t count[256], size_t pixels, double percent)
{
    for (int d = 0;; d++)
        if (!idiff_differs(count, pixels, d / 255.0, percent))
            return d;
}
