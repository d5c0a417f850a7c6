#include "bug_fit.h"

#include "tools/compare/compare.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Bugs this many times less likely than the best are still named with it. */
static const double tie = 20;
/* Standard deviations by which the number of samples has to be off. */
static const double samples_z = 7;

static int by_likelihood(const void *a, const void *b)
{
    double x = ((const struct candidate *)a)->log_likelihood,
           y = ((const struct candidate *)b)->log_likelihood;
    return (x < y) - (x > y);
}

double diagnose_bound(const struct catalogue *c, double alpha)
{
    return log(c->num_bugs / alpha);
}

/* ---- is it wrong at all? */

static int greatest_divisor(int a, int b)
{
    return b == 0 ? a : greatest_divisor(b, a % b);
}

static bool gate_mean(const struct observation *clue, double alpha, int num_tests, bool *differs,
                      struct diagnosis *out, struct err *e)
{
    struct moments a, b;
    struct comparison r;
    struct signature seen = signature_as_noisy_as(&clue->seen, &clue->view->correct);
    if (!signature_moments(&seen, &a, e))
        return false;
    bool ok = signature_moments(&clue->view->correct, &b, e);
    if (!ok) {
        moments_free(&a);
        return false;
    }
    const struct compare_options opt = {.alpha = alpha / num_tests,
                                        .margin_global = clue->margin,
                                        .margin_tile = clue->margin,
                                        .tile =
                                            greatest_divisor(clue->seen.columns, clue->seen.rows)};
    ok = compare_moments(&a, &b, &opt, &r, e) || err_prefix(e, "%s", clue->view->name);
    if (ok) {
        /* No test at all: everything is too skewed. */
        double log10_p =
            r.num_tests == 0
                ? 0
                : fmin(0, r.worst.log10_p + log10((double)r.num_tests) + log10((double)num_tests));
        *differs = r.verdict == VERDICT_DIFFERENT;
        if (log10_p < out->log10_p || (*differs && out->gate[0] == '\0')) {
            out->log10_p = log10_p;
            if (*differs)
                snprintf(out->gate, sizeof out->gate, "%s: %.180s", clue->view->name, r.reason);
        }
        comparison_free(&r);
    }
    moments_free(&a);
    moments_free(&b);
    return ok;
}

/* Does the renderer take another number of samples than the correct one? */
static bool takes_other_samples(const struct observation *clue)
{
    const struct signature *a = &clue->seen, *c = &clue->view->correct;
    double difference = a->fact[FACT_SAMPLES] - c->fact[FACT_SAMPLES];
    return fabs(difference) >
           samples_z * hypot(a->fact_sd[FACT_SAMPLES], c->fact_sd[FACT_SAMPLES]) + 1e-3;
}

static bool gate(const struct observation *clue, int num_clues, double alpha, bool *differs,
                 struct diagnosis *out, struct err *e)
{
    int num_tests = num_clues;
    for (int k = 0; k < num_clues; k++)
        num_tests += !isnan(clue[k].seen.fact[FACT_PIXELS]);
    for (int k = 0; k < num_clues; k++) {
        bool here = false;
        if (!gate_mean(&clue[k], alpha, num_tests, &here, out, e))
            return false;
        if (!clue[k].is_consistent) {
            here = true;
            if (out->gate[0] == '\0')
                snprintf(out->gate, sizeof out->gate,
                         "%s: renders with seeds of their own do not err as they state",
                         clue[k].view->name);
        }
        if (takes_other_samples(&clue[k])) {
            here = true;
            if (out->gate[0] == '\0')
                snprintf(out->gate, sizeof out->gate,
                         "%s: %.3g times the samples that the correct renderer takes",
                         clue[k].view->name,
                         exp(clue[k].seen.fact[FACT_SAMPLES] -
                             clue[k].view->correct.fact[FACT_SAMPLES]));
        }
        *differs = *differs || here;
    }
    return true;
}

/* ---- which one? */

enum { LEADERS = 8 }; /* of pairs */

/* Is the bug left out, as opt->without or as another way to make the same mistake? */
static bool is_excluded(const struct catalogue *c, const struct diagnose_options *opt, int bug)
{
    int without = opt->without != NULL ? catalogue_bug(c, opt->without) : -1;
    return without >= 0 && catalogue_same_mistake(&c->bug[bug], &c->bug[without]);
}

/* Do both name the same mistakes? */
static bool is_same(const struct catalogue *c, const struct candidate *a, const struct candidate *b)
{
    const struct bug *bug = c->bug;
    if (a->second < 0 || b->second < 0)
        return a->second == b->second && catalogue_same_mistake(&bug[a->bug], &bug[b->bug]);
    return (catalogue_same_mistake(&bug[a->bug], &bug[b->bug]) &&
            catalogue_same_mistake(&bug[a->second], &bug[b->second])) ||
           (catalogue_same_mistake(&bug[a->bug], &bug[b->second]) &&
            catalogue_same_mistake(&bug[a->second], &bug[b->bug]));
}

static void keep_likelier(struct candidate *c, const struct candidate *other)
{
    if (other->log_likelihood > c->log_likelihood)
        *c = *other;
}

/* Each bug at its full strength, likeliest first. */
static int rank_full(const struct bug_fit *f, const struct diagnose_options *opt,
                     struct candidate *all)
{
    int num = 0;
    for (int b = 0; b < f->c->num_bugs; b++)
        if (!is_excluded(f->c, opt, b))
            all[num++] = bug_fit_at(f, b, -1, 1);
    qsort(all, (size_t)num, sizeof *all, by_likelihood);
    return num;
}

/* Unless the best explains all at full strength, each at the amplitude that fits best, if that is likelier. */
static void rank_free(const struct bug_fit *f, struct candidate *all, int num)
{
    enum { REFINED = 6 };
    if (num > 0 && all[0].excess <= bug_fit_largest_excess)
        return;
    for (int i = 0; i < num; i++) {
        struct candidate free_one = bug_fit_at(f, all[i].bug, -1, bug_fit_amplitude(f, all[i].bug));
        keep_likelier(&all[i], &free_one);
    }
    qsort(all, (size_t)num, sizeof *all, by_likelihood);
    for (int i = 0; i < num && i < REFINED; i++) {
        struct candidate refined =
            bug_fit_at(f, all[i].bug, -1, bug_fit_refine(f, all[i].bug, all[i].amplitude));
        keep_likelier(&all[i], &refined);
    }
    qsort(all, (size_t)num, sizeof *all, by_likelihood);
}

/* Are both in one part of the assignment? Such a pair is more often a third bug that is not known. */
static bool is_of_one_part(const struct bug *a, const struct bug *b)
{
    size_t n = strcspn(a->where, ",");
    return n == strcspn(b->where, ",") && strncmp(a->where, b->where, n) == 0;
}

/* Does its effect stand out from its own noise in any view, or does it take another number of samples? Shared random
 * numbers change an image by chance: the stored effect is one realisation, and beside another bug it would explain any
 * residual. */
static bool is_reproducible(const struct bug_fit *f, int bug)
{
    static const double least = 10; /* mean square over variance; of such bugs it is 6 at most */
    for (int k = 0; k < f->num_clues; k++) {
        const struct view *v = f->clue[k].view;
        const struct effect *e = v->effect[bug];
        const int values = 3 * v->correct.columns * v->correct.rows;
        double sum = 0;
        if (e == NULL)
            continue;
        for (int i = 0; i < values; i++)
            if (e->mean[i] != 0)
                sum += pow((double)e->mean[i], 2) / (double)e->var[i];
        const double samples = e->fact[FACT_SAMPLES] - v->correct.fact[FACT_SAMPLES];
        if (sum >= least * values ||
            pow(samples, 2) >= least * (pow(e->fact_sd[FACT_SAMPLES], 2) +
                                        pow(v->correct.fact_sd[FACT_SAMPLES], 2)))
            return true;
    }
    return false;
}

/* The likeliest singles, each with every other bug of another part; likeliest first. */
static int rank_pairs(const struct bug_fit *f, const struct candidate *single, int num,
                      struct candidate *pair)
{
    int pairs = 0;
    for (int i = 0; i < num && i < LEADERS; i++)
        for (int k = i + 1; k < num; k++)
            if (!is_of_one_part(&f->c->bug[single[i].bug], &f->c->bug[single[k].bug]) &&
                is_reproducible(f, single[i].bug) && is_reproducible(f, single[k].bug))
                pair[pairs++] = bug_fit_at(f, single[i].bug, single[k].bug, 1);
    qsort(pair, (size_t)pairs, sizeof *pair, by_likelihood);
    return pairs;
}

/* A bug that is so much likelier than "correct" shows that the renderer is wrong. */
static bool gate_lead(const struct bug_fit *f, const struct candidate *best, double alpha,
                      struct diagnosis *out)
{
    if (best->log_likelihood < diagnose_bound(f->c, alpha))
        return false;
    if (out->gate[0] == '\0')
        snprintf(
            out->gate, sizeof out->gate,
            "with the effect of a known bug the images are 10^%.0f times likelier than without",
            best->log_likelihood / log(10));
    return true;
}

/* At full strength, a bug, or two at once, has to leave only noise and to remove half of the difference that stands
 * out. If nothing stands out, and images state their error, the directed statistic over all views suffices. */
static bool is_explanation(const struct bug_fit *f, const struct diagnose_options *opt,
                           const struct candidate *c)
{
    static const double least_gone = 0.5, most_left = 0.5, most_excess = 4;
    bool is_gone = isnan(c->explained) ? !opt->by_likelihood : c->explained >= least_gone;
    int clue;
    return c->amplitude == 1 && c->excess <= most_excess && is_gone && bug_fit_is_full(f, c) &&
           bug_fit_worst(f, c, &clue) <= (c->second >= 0 ? 0 : most_left);
}

/* Does the second bug explain most of the residual that `one` leaves alone? */
static bool is_needed_beside(const struct bug_fit *f, const struct candidate *two, int one)
{
    static const double most_left = 0.1;
    double alone = bug_fit_at(f, one, -1, 1).explained;
    return 1 - two->explained <= most_left * (1 - (isnan(alone) ? 0 : alone));
}

/* More than noise may be left if no other bug, or pair, comes near. By a pair: if it is little of each view, as the
 * effects of two bugs do not exactly multiply. By a single bug: if it is in no view more than correct programs leave,
 * which together may leave more than noise. */
static bool is_nearly_all(const struct bug_fit *f, const struct diagnose_options *opt,
                          const struct candidate *best, const struct candidate *next)
{
    static const double least_gone = 0.97, most_left = 0.2, near = 0.1;
    const bool is_pair = best->second >= 0;
    int clue;
    return opt->by_likelihood && best->explained >= least_gone && bug_fit_is_full(f, best) &&
           bug_fit_worst(f, best, &clue) <= (is_pair ? most_left : 0) &&
           (!is_pair ||
            (is_needed_beside(f, best, best->bug) && is_needed_beside(f, best, best->second))) &&
           (next == NULL || next->log_likelihood <= (1 - near) * best->log_likelihood);
}

/* The difference in log likelihood within which bugs are tied. Those that leave only noise differ by modelled variances
 * alone, which are accurate to this share of the lead. */
static double tie_of(const struct diagnose_options *opt, const struct candidate *best)
{
    static const double variance_error = 0.005;
    return fmax(log(tie), opt->by_likelihood ? variance_error * best->log_likelihood : 0);
}

/* Is it one of the first num candidates, or another way to make one of these mistakes? */
static bool is_among(const struct catalogue *c, const struct diagnosis *d, int num,
                     const struct candidate *one)
{
    for (int i = 0; i < num; i++)
        if (is_same(c, &d->candidate[i], one))
            return true;
    return false;
}

/* Names the likeliest bugs; of several ways to make a mistake, the likeliest stands for all. */
static void name(const struct bug_fit *f, const struct diagnose_options *opt,
                 const struct candidate *all, int num, double bound, struct diagnosis *out)
{
    double sum = 0, named = 0;
    const struct candidate *best = &all[0], *next = out->candidate;
    out->num_named = out->num_candidates = 0;
    for (int i = 0; i < num && out->num_candidates < DIAGNOSE_CANDIDATES; i++)
        if (!is_among(f->c, out, out->num_candidates, &all[i]))
            out->candidate[out->num_candidates++] = all[i];
    out->finding = FINDING_UNKNOWN;
    out->t = num > 0 ? bug_fit_t(f, best) : 0;
    if (num == 0 || best->log_likelihood < bound ||
        (!is_explanation(f, opt, best) &&
         !is_nearly_all(f, opt, best, out->num_candidates > 1 ? &next[1] : NULL)))
        return;
    do {
        out->num_named++;
        next++;
    } while (out->num_named < out->num_candidates &&
             best->log_likelihood - next->log_likelihood <= tie_of(opt, best) &&
             is_explanation(f, opt, next));
    for (int i = 0; i < num; i++) {
        double relative = exp(all[i].log_likelihood - best->log_likelihood);
        bool is_named = is_among(f->c, out, out->num_named, &all[i]);
        sum += relative;
        named += is_named ? relative : 0;
    }
    out->finding = FINDING_BUG;
    out->probability = named / sum;
}

/* Tries two bugs at once if no single one leaves only noise; a pair replaces a named single bug only if the pair
 * does. */
static bool name_pair(const struct bug_fit *f, const struct diagnose_options *opt,
                      const struct candidate *single, int num, struct diagnosis *out, struct err *e)
{
    struct diagnosis two = *out;
    bool is_single = out->num_named > 0;
    int rest;
    if (num == 0 || (is_single && bug_fit_worst(f, &out->candidate[0], &rest) == 0))
        return true;
    struct candidate *pair = calloc((size_t)num * LEADERS, sizeof *pair);
    if (pair == NULL)
        return err_set(e, "out of memory");
    int pairs = rank_pairs(f, single, num, pair);
    name(f, opt, pair, pairs, single[0].log_likelihood + diagnose_bound(f->c, opt->alpha), &two);
    if (two.num_named > 0 && (!is_single || two.candidate[0].excess <= bug_fit_largest_excess))
        *out = two;
    free(pair);
    return true;
}

/* What is explained, and what remains. */
static void tell_rest(struct diagnosis *out)
{
    const struct candidate *c = &out->candidate[0];
    if (out->num_named == 0)
        snprintf(out->gate, sizeof out->gate, "no known bug, nor two of them, explains the images");
    else if (c->excess <= bug_fit_largest_excess)
        snprintf(out->gate, sizeof out->gate, "what remains of the difference is noise");
    else
        snprintf(out->gate, sizeof out->gate,
                 "%.1f %% of the difference is explained, what remains is more than noise",
                 100 * c->explained);
}

static bool check(const struct observation *clue, struct err *e)
{
    const struct signature *a = &clue->seen, *c = &clue->view->correct;
    return (a->columns == c->columns && a->rows == c->rows) ||
           err_set(e, "%s: an image of %d x %d cells, the catalogue has %d x %d: another shape",
                   clue->view->name, a->columns, a->rows, c->columns, c->rows);
}

bool diagnose(const struct catalogue *c, const struct observation *clue, int num_clues,
              const struct diagnose_options *opt, struct diagnosis *out, struct err *e)
{
    assert(num_clues > 0 && opt->alpha > 0 && opt->alpha < 0.5);
    *out = (struct diagnosis){0};
    struct bug_fit f = {0};
    bool differs = false, by_verdict = false, ok = true;
    for (int k = 0; ok && k < num_clues; k++)
        ok = check(&clue[k], e);
    struct candidate *all = calloc((size_t)c->num_bugs, sizeof *all);
    ok = ok && (all != NULL || err_set(e, "out of memory")) &&
         bug_fit_start(c, clue, num_clues, opt->clip, &f, e) &&
         (opt->by_likelihood || gate(clue, num_clues, opt->alpha, &differs, out, e));
    f.states_error = !opt->by_likelihood;
    for (int k = 0; ok && k < num_clues; k++)
        out->log_likelihood += f.correct[k].log_likelihood;
    int num = ok ? rank_full(&f, opt, all) : 0;
    if (ok && num > 0) {
        out->largest_lead = all[0].log_likelihood;
        by_verdict = differs;
        differs = gate_lead(&f, &all[0], opt->alpha, out) || differs;
    }
    if (ok && !differs) {
        out->finding = FINDING_CORRECT;
        snprintf(out->gate, sizeof out->gate,
                 "no difference from the correct renderer in %d view%s", num_clues,
                 num_clues == 1 ? "" : "s");
    } else if (ok) {
        if (!opt->by_likelihood)
            rank_free(&f, all, num);
        name(&f, opt, all, num, by_verdict ? log(tie * c->num_bugs) : diagnose_bound(c, opt->alpha),
             out);
        ok = !opt->pairs || name_pair(&f, opt, all, num, out, e);
        if (opt->by_likelihood)
            tell_rest(out);
    }
    bug_fit_end(&f);
    free(all);
    return ok;
}

/* ---- evidence */

static void strongest(const struct observation *clue, const struct effect *e, double amplitude,
                      struct evidence *out)
{
    enum { SIDE = 4 };
    const struct signature *a = &clue->seen, *c = &clue->view->correct;
    double best = -INFINITY;
    out->columns = a->columns < SIDE ? a->columns : SIDE;
    out->rows = a->rows < SIDE ? a->rows : SIDE;
    for (int y = 0; y + out->rows <= a->rows; y++)
        for (int x = 0; x + out->columns <= a->columns; x++) {
            double says = 0, d = 0, mean = 0;
            for (int j = 0; j < out->rows; j++)
                for (int i = 3 * ((y + j) * a->columns + x);
                     i < 3 * ((y + j) * a->columns + x + out->columns); i++) {
                    double var =
                        a->var[i] + c->var[i] + pow(bug_fit_model_error * (double)e->mean[i], 2);
                    double effect = amplitude * (double)e->mean[i];
                    d += a->mean[i] - c->mean[i];
                    mean += c->mean[i];
                    says += var > 0 ? effect * (a->mean[i] - c->mean[i]) / var : 0;
                }
            if (says > best) {
                best = says;
                out->x = x;
                out->y = y;
                out->change = mean > 0 ? d / mean : 0;
            }
        }
}

struct evidence diagnose_evidence(const struct catalogue *c, const struct observation *clue,
                                  const struct candidate *candidate)
{
    const struct effect *e = clue->view->effect[candidate->bug];
    const struct signature *a = &clue->seen, *correct = &clue->view->correct;
    struct evidence out = {.explained = NAN};
    const struct bug_fit f = {.c = c, .clue = clue, .num_clues = 1};
    struct tally t = bug_fit_view(&f, 0, candidate), none = bug_fit_view(&f, 0, NULL);
    out.log_lead = t.log_likelihood - none.log_likelihood;
    if (none.chi2 > none.chi2_mean + bug_fit_largest_excess * sqrt(2 * none.cells) && t.all > 0)
        out.explained = 1 - fmax(t.left, 0) / t.all;
    if (e == NULL || !e->pixels)
        return out;
    double along = 0, norm = 0, tiny = bug_fit_rounding * signature_mean(correct);
    for (int i = 0; i < 3 * a->columns * a->rows; i++) {
        double var = a->var[i] + correct->var[i] + (double)e->var[i] + tiny * tiny;
        along += (double)e->mean[i] * (a->mean[i] - correct->mean[i]) / var;
        norm += (double)e->mean[i] * (double)e->mean[i] / var;
    }
    out.t = norm > 0 ? along / sqrt(norm) : 0;
    strongest(clue, e, candidate->amplitude, &out);
    return out;
}
