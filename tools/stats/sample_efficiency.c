#include "sample_efficiency.h"

#include "distributions.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* ln of what one render states over what it should. */
static bool log_ratio(const struct moments *m, int spp, const double *variance, double *out,
                      struct err *e)
{
    size_t pixels = (size_t)m->width * (size_t)m->height;
    double stated = 0, expected = 0;
    for (size_t p = 0; p < pixels; p++)
        for (size_t c = 0; c < 3; c++) {
            stated += spp * moments_var_of_mean(m, p, (int)c);
            expected += variance[3 * p + c];
        }
    /* Written so that NaN, of pixels with less than two samples, fails too. */
    if (!(stated > 0 && expected > 0))
        return err_set(e, "no noise, or pixels of less than two samples");
    *out = log(stated / expected);
    return true;
}

bool sample_efficiency_judge(const struct moments *render, int num, int spp, const double *variance,
                             double margin, double alpha, struct sample_efficiency *out,
                             struct err *e)
{
    assert(num >= 4 && spp > 0 && margin > 0 && alpha > 0 && alpha < 0.5);
    double *x = calloc((size_t)num, sizeof *x), mean = 0, squares = 0;
    bool ok = x != NULL || err_set(e, "out of memory");
    for (int k = 0; ok && k < num; k++) {
        ok = log_ratio(&render[k], spp, variance, &x[k], e);
        mean += x[k] / num;
    }
    for (int k = 0; ok && k < num; k++)
        squares += (x[k] - mean) * (x[k] - mean);
    free(x);
    if (!ok)
        return false;
    double half = stats_t_quantile(alpha / 2, num - 1) * sqrt(squares / (num - 1) / num);
    *out = (struct sample_efficiency){
        .ratio = exp(mean), .lo = exp(mean - half), .hi = exp(mean + half)};
    bool outside = out->hi < 1 / (1 + margin) || out->lo > 1 + margin;
    bool inside = out->lo >= 1 / (1 + margin) && out->hi <= 1 + margin;
    out->verdict = outside ? VERDICT_DIFFERENT : inside ? VERDICT_EQUIVALENT : VERDICT_INCONCLUSIVE;
    snprintf(out->reason, sizeof out->reason,
             "the noise is %.4g [%.4g, %.4g] times that of %d samples of this estimator",
             out->ratio, out->lo, out->hi, spp);
    return true;
}
