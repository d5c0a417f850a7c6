#include "diagnose.h"

#include "tools/compare/compare.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Student's law instead of the normal one: a cell with a firefly costs a hypothesis a few units, not
 * hundreds [Lange89]. */
static const double cell_dof = 5;
/* Facts are sums over whole images: no firefly decides them. */
static const double fact_dof = 30;
/* How well an effect is known to be the same at another size. */
static const double model_error = 0.01;
static const double fact_error[NUM_FACTS] = {
    [FACT_SAMPLES] = 0.01, [FACT_SPREAD] = 0.05, [FACT_PIXELS] = 0.05, [FACT_IMAGE] = 0.05};
/* What floats, stored and rendered, are good for. */
static const double rounding = 1e-5;
/* A free amplitude costs this much log likelihood: about half the logarithm of the number of values. */
static const double amplitude_cost = 6;
static const double least_amplitude = 0.1, largest_amplitude = 4;
/* What is left may exceed its mean by so many standard deviations and still be noise. */
static const double largest_excess = 6;
static const double least_explained = 0.95;
/* Bugs this many times less likely than the best are still named with it. */
static const double tie = 20;
/* A number of samples has to be off by so many standard deviations. */
static const double samples_z = 7;

/* The variance of the mean of value i, if the bug makes it `factor` times noisier than stated. A cell that by luck states less
 * than the correct renderer has at as many samples is not believed. */
static double variance_of(const struct observation *clue, int i, double factor)
{
    const struct signature *a = &clue->seen, *c = &clue->view->correct;
    return fmax(factor * a->var[i], c->var[i] * c->n / a->n) + c->var[i];
}

static double mean_of(const struct signature *s)
{
    double sum = 0;
    for (int i = 0; i < 3 * s->columns * s->rows; i++)
        sum += s->mean[i];
    return sum / (3 * s->columns * s->rows);
}

struct tally {
    double log_likelihood;
    double chi2, chi2_mean, cells; /* of what is left; its mean if that is noise */
    double left, all;              /* in the same weights: what is left, and without the bug */
};

static double student(double z2, double var, double dof)
{
    return -0.5 * (dof + 1) * log1p(z2 / dof) - 0.5 * log(var);
}

/* How much noisier a bug makes the mean of a cell than its pixels state. */
static double inflation(const struct effect *e, const struct signature *seen)
{
    double r = e->fact[FACT_PIXELS], s = e->fact[FACT_IMAGE], factor = 1;
    if (isfinite(r) && r > 0.25)
        factor *= exp(r);
    if (isfinite(s) && s > log(10))
        factor *= fmin(exp(s - fmax(r, 0)), (double)seen->cell * seen->cell);
    return factor;
}

static void add_cell(const struct observation *clue, const struct effect *e, double amplitude,
                     double factor, double scale, int cell, struct tally *t)
{
    const struct signature *a = &clue->seen, *c = &clue->view->correct;
    double log_likelihood = 0, chi2 = 0, chi2_mean = 0;
    for (int i = 3 * cell; i < 3 * cell + 3; i++) {
        double effect = e != NULL ? amplitude * (double)e->mean[i] : 0;
        double noise = variance_of(clue, i, factor) +
                       (e != NULL ? factor * amplitude * amplitude * (double)e->var[i] : 0);
        double fuzz = pow(rounding * (a->mean[i] + c->mean[i] + scale), 2);
        double var = noise + fuzz + pow(model_error * effect, 2);
        double d = a->mean[i] - c->mean[i], z2 = pow(d - effect, 2) / var;
        log_likelihood += student(z2, var, cell_dof) / 3;
        chi2 += fmin(z2, 100) / 3;
        chi2_mean += noise / var / 3;
        t->left += (fmin(z2, 1e4) - noise / var) / 3;
        t->all += (fmin(d * d / var, 1e4) - noise / var) / 3;
    }
    t->log_likelihood += log_likelihood;
    t->chi2 += chi2;
    t->chi2_mean += chi2_mean;
    t->cells++;
}

/* What a bug makes of S at the size of the image at hand: where all pixels depend on each other, S grows with their number. */
static double image_fact(const struct effect *e, const struct observation *clue)
{
    double s = e->fact[FACT_IMAGE];
    if (s > log(10))
        s += 2 * log((double)clue->seen.cell / clue->view->correct.cell);
    return s;
}

static void add_facts(const struct observation *clue, const struct effect *e, double amplitude,
                      struct tally *t)
{
    const struct signature *c = &clue->view->correct;
    for (int f = 0; f < NUM_FACTS; f++) {
        double fact = c->fact[f], sd = c->fact_sd[f];
        if (isnan(clue->seen.fact[f]) || isnan(fact))
            continue;
        if (e != NULL && isnan(e->fact[f]))
            continue;
        if (e != NULL) {
            double bug = f == FACT_IMAGE ? image_fact(e, clue) : e->fact[f];
            fact += amplitude * (bug - fact);
            sd = e->fact_sd[f];
        }
        double var = pow(clue->seen.fact_sd[f], 2) + sd * sd + fact_error[f] * fact_error[f];
        double z2 = pow(clue->seen.fact[f] - fact, 2) / var;
        double all = pow(clue->seen.fact[f] - c->fact[f], 2) / var;
        t->log_likelihood += student(z2, var, fact_dof);
        t->chi2 += fmin(z2, 100);
        t->left += fmin(z2, 1e4) - 1;
        t->all += fmin(all, 1e4) - 1;
        t->chi2_mean++;
        t->cells++;
    }
}

/* e NULL: the bug does nothing here, or "correct". factor: inflation() of the bug. */
static void add_view(const struct observation *clue, const struct effect *e, double amplitude,
                     double factor, struct tally *t)
{
    double scale = mean_of(&clue->view->correct);
    for (int i = 0; i < clue->seen.columns * clue->seen.rows; i++)
        add_cell(clue, e, amplitude, factor, scale, i, t);
    add_facts(clue, e, amplitude, t);
}

/* The largest over the views at hand: only some of them show how pixels depend on each other. Where a bug makes all renders
 * the same, their average is no surer than one of them. */
static double inflation_of(const struct catalogue *c, int bug, const struct observation *clue)
{
    double factor = 1, repeats = 1;
    for (int v = 0; v < c->num_views; v++) {
        const struct effect *e = c->view[v].effect[bug];
        if (e == NULL)
            continue;
        factor = fmax(factor, inflation(e, &clue->seen));
        if (e->fact[FACT_PIXELS] <= SIGNATURE_SAME)
            repeats = clue->view->renders;
    }
    return factor * repeats;
}

struct hypotheses {
    const struct catalogue *c;
    const struct observation *clue;
    int num_clues;
    struct tally *correct; /* per clue */
};

static void sum_up(struct tally *to, const struct tally *t)
{
    to->log_likelihood += t->log_likelihood;
    to->chi2 += t->chi2;
    to->chi2_mean += t->chi2_mean;
    to->cells += t->cells;
    to->left += t->left;
    to->all += t->all;
}

/* share: of the inflation, as an exponent. */
static struct tally total_with(const struct hypotheses *h, int bug, double amplitude, double share,
                               double *largest)
{
    struct tally sum = {0};
    *largest = 1;
    for (int k = 0; k < h->num_clues; k++) {
        const struct effect *e = h->clue[k].view->effect[bug];
        double factor = inflation_of(h->c, bug, &h->clue[k]);
        struct tally t = {0};
        *largest = fmax(*largest, factor);
        if (e == NULL && factor == 1)
            t = h->correct[k];
        else
            add_view(&h->clue[k], e, amplitude, pow(factor, share), &t);
        sum_up(&sum, &t);
    }
    return sum;
}

/* How much a bug adds to the noise of the other views is known from one of them only: none of it, its root or all of it are
 * equally likely beforehand, and the likeliest stands for the mean of the three. What is left is judged with all. */
static struct tally total(const struct hypotheses *h, int bug, double amplitude)
{
    static const double share[] = {0, 0.5};
    const double choices = 3;
    double largest, best = -INFINITY;
    struct tally sum = total_with(h, bug, amplitude, 1, &largest);
    if (largest == 1)
        return sum;
    for (int i = 0; i < 2; i++)
        best = fmax(best, total_with(h, bug, amplitude, share[i], &largest).log_likelihood);
    sum.log_likelihood = fmax(best, sum.log_likelihood) - log(choices);
    return sum;
}

static double log_likelihood_of(const struct hypotheses *h, int bug, double amplitude)
{
    struct tally t = total(h, bug, amplitude);
    return t.log_likelihood;
}

/* Least squares with the weights of "correct": where the search for the best amplitude begins. */
static double first_amplitude(const struct hypotheses *h, int bug)
{
    double along = 0, norm = 0;
    for (int k = 0; k < h->num_clues; k++) {
        const struct effect *e = h->clue[k].view->effect[bug];
        const struct signature *a = &h->clue[k].seen, *c = &h->clue[k].view->correct;
        double tiny = rounding * mean_of(c);
        for (int i = 0; e != NULL && i < 3 * a->columns * a->rows; i++) {
            double effect = (double)e->mean[i];
            double var = variance_of(&h->clue[k], i, 1) + (double)e->var[i] + tiny * tiny +
                         pow(model_error * effect, 2);
            along += effect * (a->mean[i] - c->mean[i]) / var;
            norm += effect * effect / var;
        }
    }
    return norm > 0 ? fmin(fmax(along / norm, least_amplitude), largest_amplitude) : 1;
}

/* Golden section for the largest likelihood around a first guess. */
static double refine_amplitude(const struct hypotheses *h, int bug, double at)
{
    const double golden = 0.6180339887498949, reach = 1.5;
    double lo = fmax(at / reach, least_amplitude), hi = fmin(at * reach, largest_amplitude);
    for (int i = 0; i < 12; i++) {
        double x1 = hi - golden * (hi - lo), x2 = lo + golden * (hi - lo);
        if (log_likelihood_of(h, bug, x1) > log_likelihood_of(h, bug, x2))
            hi = x2;
        else
            lo = x1;
    }
    return 0.5 * (lo + hi);
}

static struct candidate candidate_of(const struct hypotheses *h, int bug, double amplitude)
{
    struct tally t = total(h, bug, amplitude), none = {0};
    for (int k = 0; k < h->num_clues; k++)
        sum_up(&none, &h->correct[k]);
    struct candidate out = {.bug = bug, .amplitude = amplitude};
    out.log_likelihood =
        t.log_likelihood - none.log_likelihood - (amplitude != 1 ? amplitude_cost : 0);
    out.explained = t.all > 0 ? 1 - fmax(t.left, 0) / t.all : 0;
    out.excess = (t.chi2 - t.chi2_mean) / sqrt(2 * t.cells);
    return out;
}

static int by_likelihood(const void *a, const void *b)
{
    double x = ((const struct candidate *)a)->log_likelihood,
           y = ((const struct candidate *)b)->log_likelihood;
    return (x < y) - (x > y);
}

static bool is_explanation(const struct candidate *c)
{
    return c->excess <= largest_excess || c->explained >= least_explained;
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
    const struct compare_options opt = {
        .alpha = alpha / num_tests, .tile = greatest_divisor(clue->seen.columns, clue->seen.rows)};
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

/* A renderer that takes another number of samples than it was asked for. */
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

static int excluded(const struct catalogue *c, const struct diagnose_options *opt)
{
    return opt->without != NULL ? catalogue_bug(c, opt->without) : -1;
}

static void keep_likelier(struct candidate *c, const struct candidate *other)
{
    if (other->log_likelihood > c->log_likelihood)
        *c = *other;
}

/* Each bug at its full strength, likeliest first. */
static int rank_full(const struct hypotheses *h, const struct diagnose_options *opt,
                     struct candidate *all)
{
    int num = 0;
    for (int b = 0; b < h->c->num_bugs; b++)
        if (b != excluded(h->c, opt))
            all[num++] = candidate_of(h, b, 1);
    qsort(all, (size_t)num, sizeof *all, by_likelihood);
    return num;
}

/* Unless the best explains all at full strength, each at the amplitude that fits best, if that is likelier. */
static void rank_free(const struct hypotheses *h, struct candidate *all, int num)
{
    enum { REFINED = 6 };
    if (num > 0 && all[0].excess <= largest_excess)
        return;
    for (int i = 0; i < num; i++) {
        struct candidate free_one = candidate_of(h, all[i].bug, first_amplitude(h, all[i].bug));
        keep_likelier(&all[i], &free_one);
    }
    qsort(all, (size_t)num, sizeof *all, by_likelihood);
    for (int i = 0; i < num && i < REFINED; i++) {
        struct candidate refined =
            candidate_of(h, all[i].bug, refine_amplitude(h, all[i].bug, all[i].amplitude));
        keep_likelier(&all[i], &refined);
    }
    qsort(all, (size_t)num, sizeof *all, by_likelihood);
}

/* A bug that is so much likelier than "correct" shows that the renderer is wrong. */
static bool gate_lead(const struct hypotheses *h, const struct candidate *best, double alpha,
                      struct diagnosis *out)
{
    if (best->log_likelihood < diagnose_bound(h->c, alpha))
        return false;
    if (out->gate[0] == '\0')
        snprintf(out->gate, sizeof out->gate,
                 "a known bug explains the images 10^%.0f times better than no bug",
                 best->log_likelihood / log(10));
    return true;
}

static void name(const struct candidate *all, int num, double bound, struct diagnosis *out)
{
    double sum = 0, named = 0;
    out->num_candidates = num < DIAGNOSE_CANDIDATES ? num : DIAGNOSE_CANDIDATES;
    memcpy(out->candidate, all, (size_t)out->num_candidates * sizeof *all);
    out->finding = FINDING_UNKNOWN;
    if (num == 0 || all[0].log_likelihood < bound || !is_explanation(&all[0]))
        return;
    out->finding = FINDING_BUG;
    for (int i = 0; i < num; i++) {
        double relative = exp(all[i].log_likelihood - all[0].log_likelihood);
        sum += relative;
        if (i < out->num_candidates && relative * tie >= 1 && out->num_named == i &&
            is_explanation(&all[i])) {
            out->num_named++;
            named += relative;
        }
    }
    out->probability = named / sum;
}

static bool tally_correct(struct hypotheses *h, struct err *e)
{
    h->correct = calloc((size_t)h->num_clues, sizeof *h->correct);
    if (h->correct == NULL)
        return err_set(e, "out of memory");
    for (int k = 0; k < h->num_clues; k++)
        add_view(&h->clue[k], NULL, 0, 1, &h->correct[k]);
    return true;
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
    struct hypotheses h = {.c = c, .clue = clue, .num_clues = num_clues};
    bool differs = false, by_verdict = false, ok = true;
    for (int k = 0; ok && k < num_clues; k++)
        ok = check(&clue[k], e);
    struct candidate *all = calloc((size_t)c->num_bugs, sizeof *all);
    ok = ok && (all != NULL || err_set(e, "out of memory")) && tally_correct(&h, e) &&
         (opt->by_likelihood || gate(clue, num_clues, opt->alpha, &differs, out, e));
    for (int k = 0; ok && k < num_clues; k++)
        out->log_likelihood += h.correct[k].log_likelihood;
    int num = ok ? rank_full(&h, opt, all) : 0;
    if (ok && num > 0) {
        out->largest_lead = all[0].log_likelihood;
        by_verdict = differs;
        differs = gate_lead(&h, &all[0], opt->alpha, out) || differs;
    }
    if (ok && !differs) {
        out->finding = FINDING_CORRECT;
        snprintf(out->gate, sizeof out->gate,
                 "no difference from the correct renderer in %d view%s", num_clues,
                 num_clues == 1 ? "" : "s");
    } else if (ok) {
        rank_free(&h, all, num);
        name(all, num, by_verdict ? log(tie * c->num_bugs) : diagnose_bound(c, opt->alpha), out);
    }
    free(h.correct);
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
                    double var = a->var[i] + c->var[i] + pow(model_error * (double)e->mean[i], 2);
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
    struct tally t = {0}, none = {0};
    add_view(clue, NULL, 0, 1, &none);
    add_view(clue, e, candidate->amplitude, inflation_of(c, candidate->bug, clue), &t);
    out.log_lead = t.log_likelihood - none.log_likelihood;
    if (none.chi2 > none.chi2_mean + largest_excess * sqrt(2 * none.cells))
        out.explained = t.all > 0 ? 1 - fmax(t.left, 0) / t.all : 0;
    if (e == NULL || !e->pixels)
        return out;
    double along = 0, norm = 0, tiny = rounding * mean_of(correct);
    for (int i = 0; i < 3 * a->columns * a->rows; i++) {
        double var = a->var[i] + correct->var[i] + (double)e->var[i] + tiny * tiny;
        along += (double)e->mean[i] * (a->mean[i] - correct->mean[i]) / var;
        norm += (double)e->mean[i] * (double)e->mean[i] / var;
    }
    out.t = norm > 0 ? along / sqrt(norm) : 0;
    strongest(clue, e, candidate->amplitude, &out);
    return out;
}
