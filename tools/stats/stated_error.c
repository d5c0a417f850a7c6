#include "stated_error.h"

#include "distributions.h"

#include <assert.h>
#include <gsl/gsl_cdf.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Sums over pixels of one render. */
struct totals {
    double mean[3], stated[3];
};

static bool check(const struct moments *m, const struct moments *first, struct err *e)
{
    size_t pixels = (size_t)first->width * (size_t)first->height;
    if (m->width != first->width || m->height != first->height)
        return err_set(e, "renders of %d x %d and %d x %d pixels", first->width, first->height,
                       m->width, m->height);
    if (strcmp(m->unit, "sample") != 0)
        return err_set(e, "a render holds moments over its %ss, not over its samples", m->unit);
    for (size_t p = 0; p < pixels; p++)
        if (m->n[p] != first->n[p] || m->n[p] < 2)
            return err_set(e, "pixel %zu has %g samples in one render and %g in another", p,
                           first->n[p], m->n[p]);
    return true;
}

static struct totals sum(const struct moments *m)
{
    struct totals t = {{0}, {0}};
    size_t pixels = (size_t)m->width * (size_t)m->height;
    for (size_t p = 0; p < pixels; p++)
        for (size_t c = 0; c < 3; c++) {
            t.mean[c] += m->mean[3 * p + c];
            t.stated[c] += moments_var_of_mean(m, p, (int)c);
        }
    return t;
}

/* Sum over pixels and channels of var_k x_k(p), without render number `out` (num: with all
 * renders). */
static double variance_between(const struct moments *render, int num, int out)
{
    size_t values = 3 * (size_t)render[0].width * (size_t)render[0].height;
    int kept = num - (out < num);
    double sum = 0;
    for (size_t i = 0; i < values; i++) {
        double mean = 0, squares = 0;
        for (int k = 0; k < num; k++)
            mean += k == out ? 0 : render[k].mean[i] / kept;
        for (int k = 0; k < num; k++)
            squares += k == out ? 0 : pow(render[k].mean[i] - mean, 2);
        sum += squares / (kept - 1);
    }
    return sum;
}

/* ln R without render number `out` (num: with all renders). */
static double log_ratio(const struct moments *render, const struct totals *t, int num, int out)
{
    double stated = 0;
    int kept = num - (out < num);
    for (int k = 0; k < num; k++)
        for (int c = 0; c < 3; c++)
            stated += k == out ? 0 : t[k].stated[c] / kept;
    return log(variance_between(render, num, out) / stated);
}

static bool any_equal(const struct moments *render, int num)
{
    size_t size = 3 * (size_t)render[0].width * (size_t)render[0].height * sizeof(double);
    for (int i = 0; i < num; i++)
        for (int k = 0; k < i; k++)
            if (memcmp(render[i].mean, render[k].mean, size) == 0)
                return true;
    return false;
}

static bool judge_pixels(const struct moments *render, const struct totals *t, int num,
                         double alpha, struct stated_error *out)
{
    double all = log_ratio(render, t, num, num), mean = 0, squares = 0;
    double *without = malloc((size_t)num * sizeof *without);
    if (without == NULL)
        return false;
    for (int k = 0; k < num; k++)
        mean += (without[k] = log_ratio(render, t, num, k)) / num;
    for (int k = 0; k < num; k++)
        squares += pow(without[k] - mean, 2);
    free(without);
    double half = stats_t_quantile(alpha / 2, num - 1) * sqrt(squares * (num - 1) / num);
    out->pixels = exp(all);
    out->pixels_lo = exp(all - half);
    out->pixels_hi = exp(all + half);
    return true;
}

/* Keeps S of the channel with the smallest p, and the range that is expected of S. */
static void judge_image(const struct totals *t, int num, double alpha, struct stated_error *out)
{
    double smallest = 1;
    out->image = 1;
    for (int c = 0; c < 3; c++) {
        double mean = 0, squares = 0, stated = 0;
        for (int k = 0; k < num; k++) {
            mean += t[k].mean[c] / num;
            stated += t[k].stated[c] / num;
        }
        for (int k = 0; k < num; k++)
            squares += pow(t[k].mean[c] - mean, 2);
        if (stated == 0)
            continue;
        double p = fmin(gsl_cdf_chisq_P(squares / stated, num - 1),
                        gsl_cdf_chisq_Q(squares / stated, num - 1));
        if (p < smallest) {
            smallest = p;
            out->image = squares / stated / (num - 1);
        }
    }
    out->image_lo = gsl_cdf_chisq_Pinv(alpha / 6, num - 1) / (num - 1);
    out->image_hi = gsl_cdf_chisq_Qinv(alpha / 6, num - 1) / (num - 1);
}

static void decide(struct stated_error *c, double margin)
{
    double lo = 1 / (1 + margin), hi = 1 + margin;
    bool outside = c->pixels_hi < lo || c->pixels_lo > hi;
    bool inside = c->pixels_lo >= lo && c->pixels_hi <= hi;
    bool dependent = !outside && (c->image < c->image_lo || c->image > c->image_hi);
    c->verdict = outside || dependent ? VERDICT_DIFFERENT
                 : inside             ? VERDICT_EQUIVALENT
                                      : VERDICT_INCONCLUSIVE;
    if (dependent)
        snprintf(c->reason, sizeof c->reason,
                 "pixels depend on each other: the image's sum has %.3g times the variance of "
                 "independent pixels (%.2g to %.2g)",
                 c->image, c->image_lo, c->image_hi);
    else
        snprintf(c->reason, sizeof c->reason,
                 "the variance between renders is %.3g [%.3g, %.3g] of what they state%s",
                 c->pixels, c->pixels_lo, c->pixels_hi,
                 c->verdict == VERDICT_INCONCLUSIVE ? ": more renders are needed" : "");
}

bool stated_error_judge(const struct moments *render, int num, double margin, double alpha,
                        struct stated_error *out, struct err *e)
{
    assert(num >= 4 && margin > 0 && alpha > 0 && alpha < 0.5);
    *out = (struct stated_error){.renders = num};
    double stated = 0;
    struct totals *t = calloc((size_t)num, sizeof *t);
    if (t == NULL)
        return err_set(e, "out of memory");
    bool ok = true;
    for (int k = 0; ok && k < num; k++) {
        ok = check(&render[k], &render[0], e);
        if (ok) {
            t[k] = sum(&render[k]);
            stated += t[k].stated[0] + t[k].stated[1] + t[k].stated[2];
        }
    }
    if (ok && !(stated > 0))
        ok = err_set(e, "no render has any noise");
    if (ok && any_equal(render, num)) {
        out->verdict = VERDICT_DIFFERENT;
        snprintf(out->reason, sizeof out->reason,
                 "two renders with seeds of their own are the same: the seed has no effect");
    } else if (ok) {
        ok = judge_pixels(render, t, num, alpha, out) || err_set(e, "out of memory");
        judge_image(t, num, alpha, out);
        decide(out, margin);
    }
    free(t);
    return ok;
}
