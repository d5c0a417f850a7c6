#include "bug_fit.h"

#include <math.h>
#include <stdlib.h>

/* Student's law instead of the normal one: a cell with a firefly costs a hypothesis a few units, not
 * hundreds [Lange89]. */
static const double cell_dof = 5;
/* Facts are sums over whole images: no firefly decides them. */
static const double fact_dof = 30;
/* Relative error of an effect at another image size. */
const double bug_fit_model_error = 0.01;
static const double fact_error[NUM_FACTS] = {
    [FACT_SAMPLES] = 0.01, [FACT_SPREAD] = 0.05, [FACT_PIXELS] = 0.05, [FACT_IMAGE] = 0.05};
/* If all pixels take the same number of samples, as by a rule that never stops, any other number speaks against the
 * bug. */
static const double exact_samples = 1e-3;
/* Relative error of floats, stored or rendered. */
const double bug_fit_rounding = 1e-5;
/* A free amplitude costs this much log likelihood: about half the logarithm of the number of values. */
static const double amplitude_cost = 6;
static const double least_amplitude = 0.1, largest_amplitude = 4;
const double bug_fit_largest_excess = 6;
/* Factors are formed only where the correct radiance is more than this share of the image's mean. */
static const double least_light = 1e-3;
/* Two bugs that each add more than this many times the correct light are summed. */
static const double much_light = 2;
/* Uncertainty of the joint effect of two bugs, as a share of the difference between product and sum. */
static const double unsure = 0.5;

/* fmin() and fmax() for numbers (not NaN), inlined; those of the library are calls. */
static inline double at_most(double x, double most)
{
    return x < most ? x : most;
}

static inline double at_least(double x, double least)
{
    return x > least ? x : least;
}

/* The variance of the difference from "correct" in value i, if the bug makes it `factor` times noisier than stated: at
 * least the correct renderer's at the same number of samples, as a cell may state less by luck. */
static inline double variance_of(const struct signature *seen, const struct signature *correct,
                                 int i, double factor)
{
    return at_least(factor * seen->var[i], correct->var[i] * (correct->n / seen->n)) +
           correct->var[i];
}

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

/* A cell counts once, as the mean over its channels; for speed, one logarithm is taken, of their product. */
static void add_cells(const struct observation *clue, const struct effect *e, double amplitude,
                      double factor, struct tally *t)
{
    static const struct effect nothing;
    const struct signature *a = &clue->seen, *c = &clue->view->correct;
    const double scale = signature_mean(c);
    struct tally sum = {.cells = a->columns * a->rows};
    e = e != NULL ? e : &nothing;
    for (int i = 0; i < 3 * a->columns * a->rows;) {
        double tails = 1, vars = 1;
        for (int k = 0; k < 3; k++, i++) {
            double effect = amplitude * (double)e->mean[i], d = a->mean[i] - c->mean[i];
            double noise =
                variance_of(a, c, i, factor) + factor * amplitude * amplitude * (double)e->var[i];
            double fuzz = pow(bug_fit_rounding * (a->mean[i] + c->mean[i] + scale), 2);
            double var = noise + fuzz + pow(bug_fit_model_error * effect, 2), weight = 1 / var;
            double z2 = pow(d - effect, 2) * weight, expected = noise * weight;
            tails *= 1 + z2 / cell_dof;
            vars *= var;
            sum.chi2 += at_most(z2, 100);
            sum.chi2_mean += expected;
            sum.left += at_most(z2, 1e4) - expected;
            sum.all += at_most(d * d * weight, 1e4) - expected;
        }
        sum.log_likelihood -= 0.5 * ((cell_dof + 1) * log(tails) + log(vars));
    }
    t->log_likelihood += sum.log_likelihood / 3;
    t->chi2 += sum.chi2 / 3;
    t->chi2_mean += sum.chi2_mean / 3;
    t->left += sum.left / 3;
    t->all += sum.all / 3;
    t->cells += sum.cells;
}

/* What a bug makes of S at the size of the image at hand: where all pixels depend on each other, S grows with their number. */
static double image_fact(const struct effect *e, const struct observation *clue)
{
    double s = e->fact[FACT_IMAGE];
    if (s > log(10))
        s += 2 * log((double)clue->seen.cell / clue->view->correct.cell);
    return s;
}

/* The excess of chi-square over its mean for this many values if it is more than noise, else 0. */
static double beyond_noise(double excess, double values)
{
    const double noise =
        values > 1 ? 20 : 3; /* standard deviations; of cells as of views that are clearly off */
    return excess > noise * sqrt(2 * values) ? excess : 0;
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
        bool is_full = e == NULL || amplitude == 1 || e->fact[f] == c->fact[f];
        bool is_exact = f == FACT_SAMPLES && sd == 0 && is_full;
        double var = pow(clue->seen.fact_sd[f], 2) + sd * sd + fact_error[f] * fact_error[f];
        if (is_exact)
            var = exact_samples * exact_samples;
        double z2 = pow(clue->seen.fact[f] - fact, 2) / var;
        double all = pow(clue->seen.fact[f] - c->fact[f], 2) / var;
        t->log_likelihood += student(z2, var, fact_dof);
        t->chi2 += fmin(z2, 100);
        t->fact = fmax(t->fact, z2);
        t->left += beyond_noise(fmin(z2, 1e4) - 1, 1);
        t->all += beyond_noise(fmin(all, 1e4) - 1, 1);
        t->chi2_mean++;
        t->cells++;
    }
}

/* e NULL: the bug does nothing here, or "correct". factor: inflation() of the bug. */
static void add_view(const struct observation *clue, const struct effect *e, double amplitude,
                     double factor, struct tally *t)
{
    add_cells(clue, e, amplitude, factor, t);
    t->left = beyond_noise(t->left, t->cells);
    t->all = beyond_noise(t->all, t->cells);
    add_facts(clue, e, amplitude, t);
}

static double value_of_two(double c, double a, double b, double least, bool adds, double clip)
{
    adds = adds || c <= least || (a > much_light * c && b > much_light * c);
    double both = adds ? c + a + b : fmax((c + a) * (c + b) / c, 0);
    return (clip > 0 ? fmin(both, clip) : both) - c;
}

const struct effect *bug_fit_effect(const struct view *v, int bug, int second, bool adds,
                                    double clip, struct effect *room)
{
    const struct effect *a = v->effect[bug], *b = second >= 0 ? v->effect[second] : NULL;
    const struct signature *c = &v->correct;
    if (a == NULL || b == NULL)
        return a != NULL ? a : b;
    double least = least_light * signature_mean(c);
    *room = (struct effect){.pixels = a->pixels || b->pixels};
    for (int i = 0; i < 3 * c->columns * c->rows; i++) {
        double light = c->mean[i], x = (double)a->mean[i], y = (double)b->mean[i];
        double product = value_of_two(light, x, y, least, false, clip),
               both = adds ? value_of_two(light, x, y, least, true, clip) : product;
        bool is_product = light > least && !adds;
        room->mean[i] = (float)both;
        room->var[i] = (float)((double)a->var[i] * (is_product ? pow(1 + y / light, 2) : 1) +
                               (double)b->var[i] * (is_product ? pow(1 + x / light, 2) : 1) +
                               pow(unsure * (product - x - y), 2));
    }
    for (int f = 0; f < NUM_FACTS; f++) {
        room->fact[f] = a->fact[f] + b->fact[f] - c->fact[f];
        room->fact_sd[f] = hypot(a->fact_sd[f], b->fact_sd[f]);
    }
    return room;
}

/* The largest over all views of the catalogue, as only some show how pixels depend on each other. If a bug makes all
 * renders the same, their average is no more precise than one of them. */
static double inflation_of(const struct catalogue *c, int bug, const struct observation *clue)
{
    double factor = 1, repeats = 1;
    for (int v = 0; bug >= 0 && v < c->num_views; v++) {
        const struct effect *e = c->view[v].effect[bug];
        if (e == NULL)
            continue;
        factor = fmax(factor, inflation(e, &clue->seen));
        if (e->fact[FACT_PIXELS] <= SIGNATURE_SAME)
            repeats = clue->view->renders;
    }
    return factor * repeats;
}

static void sum_up(struct tally *to, const struct tally *t)
{
    to->log_likelihood += t->log_likelihood;
    to->chi2 += t->chi2;
    to->chi2_mean += t->chi2_mean;
    to->cells += t->cells;
    to->fact = fmax(to->fact, t->fact);
    to->left += t->left;
    to->all += t->all;
}

/* The effect of bugs on a view: of two, the likelier of product and sum, in `room`, with its tally in *t; for a single
 * bug *t is not changed. */
static const struct effect *likelier(const struct bug_fit *f, int clue, const struct candidate *b,
                                     double factor, struct effect room[2], struct tally *t)
{
    const struct observation *seen = &f->clue[clue];
    struct tally sum = {0};
    const struct effect *e =
        bug_fit_effect(seen->view, b->bug, b->second, false, f->clip, &room[0]);
    if (e != &room[0])
        return e;
    add_view(seen, &room[0], b->amplitude, factor, t);
    bug_fit_effect(seen->view, b->bug, b->second, true, f->clip, &room[1]);
    add_view(seen, &room[1], b->amplitude, factor, &sum);
    if (t->log_likelihood >= sum.log_likelihood)
        return &room[0];
    *t = sum;
    return &room[1];
}

/* share: exponent of the noise inflation that is applied. *largest is raised to the whole inflation. */
static struct tally view_with(const struct bug_fit *f, int clue, const struct candidate *b,
                              double share, double *largest)
{
    struct effect room[2];
    struct tally t = {0};
    const struct observation *seen = &f->clue[clue];
    double factor = fmax(inflation_of(f->c, b->bug, seen), inflation_of(f->c, b->second, seen));
    const struct effect *e = likelier(f, clue, b, pow(factor, share), room, &t);
    *largest = fmax(*largest, factor);
    if (e == &room[0] || e == &room[1])
        t.log_likelihood -= log(2); /* both were equally likely beforehand */
    else if (e == NULL && factor == 1 && f->correct != NULL)
        return f->correct[clue];
    else
        add_view(seen, e, b->amplitude, pow(factor, share), &t);
    return t;
}

struct tally bug_fit_view(const struct bug_fit *f, int clue, const struct candidate *candidate)
{
    double largest = 1;
    struct tally t = {0};
    if (candidate != NULL)
        return view_with(f, clue, candidate, 1, &largest);
    add_view(&f->clue[clue], NULL, 1, 1, &t);
    return t;
}

static struct tally total_with(const struct bug_fit *f, const struct candidate *b, double share,
                               double *largest)
{
    struct tally sum = {0};
    *largest = 1;
    for (int k = 0; k < f->num_clues; k++) {
        struct tally t = view_with(f, k, b, share, largest);
        sum_up(&sum, &t);
    }
    return sum;
}

/* The noise inflation of a bug is known from some views only; in the others none of it, its square root or all of it
 * are equally likely a priori, and the likeliest stands for the mean of the three. The residual is judged with all of
 * it. */
static struct tally total(const struct bug_fit *f, const struct candidate *b)
{
    static const double share[] = {0, 0.5};
    const double choices = 3;
    double largest, best = -INFINITY;
    struct tally sum = total_with(f, b, 1, &largest);
    if (largest == 1)
        return sum;
    for (int i = 0; i < 2; i++)
        best = fmax(best, total_with(f, b, share[i], &largest).log_likelihood);
    sum.log_likelihood = fmax(best, sum.log_likelihood) - log(choices);
    return sum;
}

/* norm^-1/2 is the standard deviation of along/norm. The catalogue's own noise adds to the squares of an effect and not to
 * the product with what is seen, so along/signal is the strength. */
struct projection {
    double along, norm, signal;
};

static inline void project_value(struct projection *p, double effect, double effect_var,
                                 double seen, double var)
{
    const double weighed = effect / var;
    p->along += weighed * seen;
    p->norm += weighed * effect;
    p->signal += weighed * effect - effect_var / var;
}

/* base: the effect that is there in any case; NULL: none. */
static void project_facts(const struct observation *clue, const struct effect *e,
                          const struct effect *base, struct projection *p)
{
    const struct signature *a = &clue->seen, *c = &clue->view->correct;
    for (int f = 0; f < NUM_FACTS; f++) {
        double there = base != NULL ? base->fact[f] : c->fact[f];
        double effect = (f == FACT_IMAGE ? image_fact(e, clue) : e->fact[f]) - there;
        double var = pow(a->fact_sd[f], 2) + pow(e->fact_sd[f], 2) + pow(fact_error[f], 2);
        if (isnan(a->fact[f]) || isnan(effect))
            continue;
        project_value(p, effect, 0, a->fact[f] - there, var);
    }
}

/* Least squares with the weights of "correct". given: a bug that is taken to be there, so that only what bug and second
 * add to its effect is judged; -1: none. */
static struct projection project(const struct bug_fit *f, int bug, int second, int given)
{
    struct projection p = {0};
    for (int k = 0; k < f->num_clues; k++) {
        struct effect room[2];
        struct tally t = {0};
        const struct view *v = f->clue[k].view;
        const struct candidate both = {.bug = bug, .second = second, .amplitude = 1};
        const struct effect *e = likelier(f, k, &both, 1, room, &t),
                            *base = given >= 0 ? v->effect[given] : NULL;
        const struct signature *a = &f->clue[k].seen, *c = &v->correct;
        double tiny = bug_fit_rounding * signature_mean(c);
        for (int i = 0; e != NULL && i < 3 * a->columns * a->rows; i++) {
            double there = base != NULL ? (double)base->mean[i] : 0;
            double effect = (double)e->mean[i] - there;
            double var = variance_of(a, c, i, 1) + (double)e->var[i] + tiny * tiny +
                         pow(bug_fit_model_error * (double)e->mean[i], 2);
            double noise = f->states_error && base == NULL ? (double)e->var[i] : 0;
            project_value(&p, effect, noise, a->mean[i] - c->mean[i] - there, var);
        }
        if (e != NULL)
            project_facts(&f->clue[k], e, base, &p);
    }
    return p;
}

static double strength_of(const struct projection *p)
{
    return p->signal > 0 ? p->along / p->signal : 0;
}

static bool is_full_strength(const struct projection *p)
{
    static const double least_t = 8, strength_error = 0.1, deviations = 3;
    return p->signal > 0 && p->along / sqrt(p->norm) >= least_t &&
           fabs(strength_of(p) - 1) <= strength_error + deviations * sqrt(p->norm) / p->signal;
}

bool bug_fit_is_full(const struct bug_fit *f, const struct candidate *c)
{
    bool is_pair = c->second >= 0;
    struct projection first = project(f, c->bug, c->second, is_pair ? c->bug : -1),
                      other = project(f, c->bug, c->second, is_pair ? c->second : -1);
    return is_full_strength(&first) && is_full_strength(&other);
}

double bug_fit_amplitude(const struct bug_fit *f, int bug)
{
    struct projection p = project(f, bug, -1, -1);
    return p.signal > 0 ? fmin(fmax(strength_of(&p), least_amplitude), largest_amplitude) : 1;
}

static double likelihood_at(const struct bug_fit *f, int bug, double amplitude)
{
    return total(f, &(struct candidate){.bug = bug, .second = -1, .amplitude = amplitude})
        .log_likelihood;
}

/* Golden-section search: one of the two inner points is reused from the step before. */
double bug_fit_refine(const struct bug_fit *f, int bug, double at)
{
    const double golden = 0.6180339887498949, reach = 1.5;
    double lo = fmax(at / reach, least_amplitude), hi = fmin(at * reach, largest_amplitude);
    double low = hi - golden * (hi - lo), high = lo + golden * (hi - lo);
    double of_low = likelihood_at(f, bug, low), of_high = likelihood_at(f, bug, high);
    for (int i = 0; i < 12; i++) {
        if (of_low > of_high) {
            hi = high, high = low, of_high = of_low;
            low = hi - golden * (hi - lo);
            of_low = likelihood_at(f, bug, low);
        } else {
            lo = low, low = high, of_low = of_high;
            high = lo + golden * (hi - lo);
            of_high = likelihood_at(f, bug, high);
        }
    }
    return 0.5 * (lo + hi);
}

struct candidate bug_fit_at(const struct bug_fit *f, int bug, int second, double amplitude)
{
    struct candidate out = {.bug = bug, .second = second, .amplitude = amplitude};
    struct tally t = total(f, &out), none = {0};
    for (int k = 0; k < f->num_clues; k++)
        sum_up(&none, &f->correct[k]);
    out.log_likelihood =
        t.log_likelihood - none.log_likelihood - (amplitude != 1 ? amplitude_cost : 0);
    out.explained = t.all > 0 ? 1 - fmax(t.left, 0) / t.all : NAN;
    out.excess = (t.chi2 - t.chi2_mean) / sqrt(2 * t.cells);
    return out;
}

double bug_fit_t(const struct bug_fit *f, const struct candidate *c)
{
    const struct projection p = project(f, c->bug, c->second, -1);
    return p.norm > 0 ? p.along / sqrt(p.norm) : 0;
}

double bug_fit_worst(const struct bug_fit *f, const struct candidate *c, int *clue)
{
    static const double clear =
        20; /* standard deviations: edges of lamps differ between correct programs */
    double worst = 0;
    *clue = -1;
    for (int k = 0; k < f->num_clues; k++) {
        struct tally t = bug_fit_view(f, k, c);
        bool is_noise = t.chi2 - t.chi2_mean <= clear * sqrt(2 * t.cells) &&
                        t.fact <= pow(bug_fit_largest_excess, 2);
        double left = is_noise ? 0 : t.all > 0 ? t.left / t.all : 1;
        if (left > worst) {
            worst = left;
            *clue = k;
        }
    }
    return worst;
}

bool bug_fit_start(const struct catalogue *c, const struct observation *clue, int num_clues,
                   double clip, struct bug_fit *out, struct err *e)
{
    *out = (struct bug_fit){.c = c,
                            .clue = clue,
                            .num_clues = num_clues,
                            .clip = clip,
                            .correct = calloc((size_t)num_clues, sizeof(struct tally))};
    if (out->correct == NULL)
        return err_set(e, "out of memory");
    for (int k = 0; k < num_clues; k++)
        out->correct[k] = bug_fit_view(out, k, NULL);
    return true;
}

void bug_fit_end(struct bug_fit *f)
{
    free(f->correct);
}
