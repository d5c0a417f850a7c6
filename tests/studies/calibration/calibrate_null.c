#include "calibrate_null.h"

#include "tests/support/rates.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

const double null_level[NUM_LEVELS] = {1e-2, 1e-3, 1e-4};
static const double largest_excess = 0.01; /* of a rate over its p, where p is not small */
static const double smallest_ks_p = 1e-3;
static const double margin_variance = 1e-3; /* as good as none, so that the test is at its level */

bool null_init(struct null_run *r, enum weakness weakness, const size_t pairs[NUM_LEVELS],
               struct err *e)
{
    *r = (struct null_run){.weakness = weakness};
    r->mean_t = malloc((pairs[LEVEL_SHAPE] + 1) * sizeof *r->mean_t);
    bool ok = r->mean_t != NULL;
    for (int l = 0; l < NUM_LEVELS; l++) {
        r->pairs[l] = pairs[l];
        r->log10_p[l] = malloc((pairs[l] + 1) * NUM_COLUMNS * sizeof *r->log10_p[l]);
        ok = ok && r->log10_p[l] != NULL;
    }
    if (ok)
        return true;
    null_free(r);
    return err_set(e, "out of memory for the p-values of %zu pairs", pairs[LEVEL_SHAPE]);
}

void null_free(struct null_run *r)
{
    for (int l = 0; l < NUM_LEVELS; l++)
        free(r->log10_p[l]);
    free(r->mean_t);
    *r = (struct null_run){0};
}

bool null_pair(struct null_run *r, size_t i, const struct moments *a, const struct moments *b,
               int tile, struct err *e)
{
    for (int l = 0; l < NUM_LEVELS; l++) {
        struct compare_options opt = {
            .alpha = null_level[l], .tile = tile, .margin_variance = margin_variance};
        struct outcome o;
        if (i >= r->pairs[l])
            continue;
        if (!tester_run(r->weakness, a, b, &opt, &o, e))
            return err_prefix(e, "pair %zu", i);
        for (int c = 0; c < NUM_COLUMNS; c++)
            r->log10_p[l][i * NUM_COLUMNS + (size_t)c] = (float)o.log10_p[c];
        /* The verdict must be what the gate's p says. */
        bool different = o.log10_p[COLUMN_GATE] <= log10(opt.alpha);
        if (different != (o.verdict == VERDICT_DIFFERENT))
            return err_set(e, "pair %zu: the verdict is %s, its p is 10^%.4f at alpha %g", i,
                           verdict_name(o.verdict), o.log10_p[COLUMN_GATE], opt.alpha);
        if (l == LEVEL_SHAPE)
            r->mean_t[i] = (float)o.mean.t;
    }
    return true;
}

/* Sorted p of one column at LEVEL_SHAPE; 1 where nothing was tested. */
static void sorted_p(const struct null_run *r, int column, double *p)
{
    for (size_t i = 0; i < r->pairs[LEVEL_SHAPE]; i++)
        p[i] = pow(10, fmin(0, r->log10_p[LEVEL_SHAPE][i * NUM_COLUMNS + (size_t)column]));
    sort_numbers(p, r->pairs[LEVEL_SHAPE]);
}

/* Sign and two-sided p make a one-sided one. */
static size_t sorted_one_sided(const struct null_run *r, double *p)
{
    size_t num = 0;
    for (size_t i = 0; i < r->pairs[LEVEL_SHAPE]; i += 2) {
        double log10_p = r->log10_p[LEVEL_SHAPE][i * NUM_COLUMNS + COLUMN_MEAN];
        if (log10_p > 0)
            continue;
        double half = fmax(1e-16, pow(10, log10_p) / 2);
        p[num++] = r->mean_t[i] > 0 ? half : 1 - half;
    }
    sort_numbers(p, num);
    return num;
}

bool null_summary(const struct null_run *r, const char *name, bool is_exact,
                  struct null_result *out, struct err *e)
{
    *out = (struct null_result){.is_exact = is_exact};
    snprintf(out->name, sizeof out->name, "%s", name);
    double *p = malloc((r->pairs[LEVEL_SHAPE] + 1) * sizeof *p);
    if (p == NULL)
        return err_set(e, "out of memory for the p-values of %s", name);
    for (int l = 0; l < NUM_LEVELS; l++) {
        int at = r->pairs[l] > 0 ? l : LEVEL_SHAPE;
        out->pairs[l] = (double)r->pairs[at];
        for (size_t i = 0; i < r->pairs[at]; i++)
            for (size_t c = 0; c < NUM_COLUMNS; c++) {
                double log10_p = r->log10_p[at][i * NUM_COLUMNS + c];
                out->tested[c][l] += log10_p <= 0;
                out->rejected[c][l] += log10_p <= log10(null_level[l]);
            }
    }
    for (int c = 0; c < NUM_COLUMNS; c++) {
        size_t num = r->pairs[LEVEL_SHAPE], below = num;
        if (out->tested[c][LEVEL_SHAPE] == 0)
            continue;
        sorted_p(r, c, p);
        out->above[c] = ks_above(p, num);
        for (int i = 0; i < CURVE_POINTS; i++) {
            while (below > 0 && p[below - 1] > pow(10, -i / 8.0))
                below--;
            out->curve[c][i] = (double)below / (double)num;
        }
    }
    out->num_one_sided = sorted_one_sided(r, p);
    if (out->num_one_sided > 0) {
        out->ks = ks_distance(p, out->num_one_sided);
        out->ks_p = ks_p(out->ks, out->num_one_sided);
        out->ad = ad_statistic(p, out->num_one_sided);
        out->ad_p = ad_p(out->ad);
    }
    free(p);
    return true;
}

void null_pool(const struct null_result *part, int num, const char *name, struct null_result *out)
{
    *out = (struct null_result){0};
    snprintf(out->name, sizeof out->name, "%s", name);
    for (int i = 0; i < num; i++) {
        for (int l = 0; l < NUM_LEVELS; l++)
            out->pairs[l] += part[i].pairs[l];
        double weight = part[i].pairs[LEVEL_SHAPE] / fmax(1, out->pairs[LEVEL_SHAPE]);
        for (int c = 0; c < NUM_COLUMNS; c++) {
            out->above[c] = -1;
            for (int l = 0; l < NUM_LEVELS; l++) {
                out->tested[c][l] += part[i].tested[c][l];
                out->rejected[c][l] += part[i].rejected[c][l];
            }
            for (int k = 0; k < CURVE_POINTS; k++)
                out->curve[c][k] += (part[i].curve[c][k] - out->curve[c][k]) * weight;
        }
    }
}

void null_check(const struct null_result *r, struct checks *c)
{
    for (int column = 0; column < COLUMN_TILE; column++) {
        for (int l = 0; l < NUM_LEVELS; l++)
            if (r->pairs[l] > 0)
                check_at_most(c, r->rejected[column][l], r->pairs[l], null_level[l], "%s: %s at %g",
                              r->name, column_name[column], null_level[l]);
        /* 1.95 / sqrt n: the largest distance in 99.9 % of uniform samples. */
        if (r->tested[column][LEVEL_SHAPE] > 0 && r->above[column] >= 0)
            check_that(c, r->above[column] <= largest_excess + 1.95 / sqrt(r->pairs[LEVEL_SHAPE]),
                       "%s: %s: the rate exceeds p by at most %.4f", r->name, column_name[column],
                       r->above[column]);
    }
    if (r->is_exact) {
        check_that(c, r->num_one_sided > 0 && r->ks_p > smallest_ks_p,
                   "%s: one-sided p of the mean, Kolmogorov-Smirnov p %.3g", r->name, r->ks_p);
        check_that(c, r->num_one_sided > 0 && r->ad_p > smallest_ks_p,
                   "%s: one-sided p of the mean, Anderson-Darling p %.3g", r->name, r->ad_p);
    }
}
