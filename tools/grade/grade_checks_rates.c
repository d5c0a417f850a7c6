/* What a program took for its images: samples (rates) and time (growth). */
#include "judging.h"

#include "tools/stats/distributions.h"
#include "tools/submission/rate_image.h"

#include <math.h>
#include <stdio.h>

/* Moves the interval towards 0 by what the stopping rule may do at the student's noise, and says so in note. ours: mean of
 * our counts. */
static bool allow_count(struct judging *w, double ours, struct interval *count, char note[120],
                        struct result *out, struct err *e)
{
    struct stopping rule;
    if (!judging_find_usable(w, out, e) || !judging_stopping(w, &rule, e))
        return false;
    const double more = fmax(0, rule.most / ours - 1), fewer = fmin(0, rule.least / ours - 1),
                 allowed = fmin(more, fmax(fewer, count->value));
    stopping_rule_free(&rule);
    count->value -= allowed;
    count->lo -= allowed;
    count->hi -= allowed;
    out->more = 0;
    snprintf(note, 120, "; at the noise of this image %+.2f to %+.2f %% are as right", 100 * fewer,
             100 * more);
    return true;
}

bool grade_checks_judge_rates(struct judging *w, struct result *out, struct err *e)
{
    const struct rubric_check *c = w->check;
    const struct made *made = &w->g->h->made[c->images[0]];
    struct rate_image rates;
    struct err why;
    snprintf(
        out->expected, sizeof out->expected,
        "every pixel of the rate image stands for a multiple of %d samples, and on average for as many as in our render, within %.3g %%",
        c->batch, 100 * c->count.full);
    if (made->rates[0] == '\0') {
        snprintf(out->seen, sizeof out->seen, "there is no rate image");
        return true;
    }
    if (!rate_image_read(made->rates, judging_image(w, 0), c->batch,
                         answer_key_counts(w->g->a, w->set, c->images[0]), &rates, &why)) {
        if (err_is_of_memory(&why))
            return err_set(e, "%s", why.msg);
        snprintf(out->seen, sizeof out->seen, "the rate image: %.370s", why.msg);
        return true;
    }
    double half = stats_normal_quantile(w->g->alpha / 2) * rates.sd;
    const struct interval seen = {rates.more, rates.more - half, rates.more + half, rates.sd};
    struct interval count = seen;
    char note[120] = "";
    /* A noisy program may rightly take many samples, but not all of them where there is no noise. */
    bool stops = rates.early > 0;
    if (!stops && !grade_checks_stops(w->g, &stops, e))
        return false;
    if (stops && score_share(&c->count, &count) < 1 && rubric_is_adaptive(judging_image(w, 0)) &&
        !allow_count(w, rates.mean / (1 + rates.more), &count, note, out, e))
        return false;
    out->share = score_pixels(&c->share, rates.odd, rates.pixels);
    out->chance = 0;
    if (score_share(&c->count, &count) <= out->share) {
        out->share = score_share(&c->count, &count);
        out->chance = score_chance(&c->count, &count);
    }
    snprintf(
        out->seen, sizeof out->seen,
        "%.0f of %.0f pixels stand for no multiple of %d; %.0f stopped early; %.4g samples a pixel on average, %+.2f %% from ours (%+.2f to %+.2f)%s",
        rates.odd, rates.pixels, c->batch, rates.early, rates.mean, 100 * seen.value,
        100 * fmax(-1, seen.lo), 100 * seen.hi, note); /* no count is below 0 */
    return true;
}

/* Do all samples of a pixel have the same value, but for rounding? */
static bool is_noiseless(const struct moments *m)
{
    for (size_t i = 0; i < 3 * (size_t)m->width * (size_t)m->height; i++)
        if (m->m2[i] > 1e-9 * m->n[i / 3] * m->mean[i] * m->mean[i])
            return false;
    return m->width > 0;
}

bool grade_checks_stops(const struct grading *g, bool *stops, struct err *e)
{
    bool never = false;
    for (int i = 0; i < g->r->num_checks; i++) {
        const struct rubric_check *c = &g->r->check[i];
        const int image = c->images[0];
        struct rate_image rates;
        struct err why; /* of the image: grade_checks_judge_rates() reports it */
        if (c->kind != CHECK_RATES || g->h->image[image].mean == NULL)
            continue;
        if (rate_image_read(g->h->made[image].rates, &g->r->image[image], c->batch,
                            answer_key_counts(g->a, 0, image), &rates, &why)) {
            *stops = rates.early > 0;
            never = never || is_noiseless(&g->a->of[0][image].noise);
            if (*stops)
                return true;
        } else if (err_is_of_memory(&why)) {
            return err_set(e, "%s", why.msg);
        }
    }
    *stops = !never;
    return true;
}

bool grade_checks_rates(const struct grading *g, int set, const struct rubric_check *c,
                        struct result *out, struct err *e)
{
    int image = c->images[0];
    const struct rubric_image *p = &g->r->image[image];
    struct stopping by[NUM_STOPPING_KINDS];
    struct rate_image rates;
    struct err why; /* of the image: grade_checks_judge_rates() has reported it */
    if (!rate_image_read(g->h->made[image].rates, p, c->batch, answer_key_counts(g->a, set, image),
                         &rates, &why) ||
        !judging_samples(g, set, image, by, &why))
        return !err_is_of_memory(&why) || err_set(e, "%s", why.msg);
    double least = by[STOPS_RIGHTLY].least, most = by[STOPS_RIGHTLY].most,
           odd = rates.odd / fmax(1, rates.pixels),
           half = stats_normal_quantile(g->alpha / 2) * rates.sd;
    const struct interval count = {rates.mean / sqrt(least * most) - 1,
                                   rates.mean / most - 1 - half, rates.mean / least - 1 + half,
                                   rates.sd},
                          share = {odd, odd, odd, 0};
    out->share = fmin(score_share(&c->share, &share), score_share(&c->count, &count));
    out->chance = score_chance(&c->count, &count);
    return true;
}

/* Seconds by which the CPU times of two runs of the same work may differ. */
static double timing_error(const struct made *m)
{
    return 0.01 + 0.05 * m->cpu_s;
}

void grade_checks_growth(const struct grading *g, const struct rubric_check *c, struct result *out)
{
    const struct made *made[4];
    for (int k = 0; k < 4; k++)
        made[k] = &g->h->made[c->images[k]];
    out->share = out->chance = out->more = 0;
    snprintf(out->expected, sizeof out->expected,
             "the samples of %s take at most %.3g times as long as those of %s",
             g->r->image[c->images[0]].name, exp(c->log_ratio.full),
             g->r->image[c->images[2]].name);
    if (made[0]->cpu_s <= 0) {
        snprintf(out->seen, sizeof out->seen, "no program ran that could be timed");
        return;
    }
    double large = made[0]->cpu_s - made[1]->cpu_s, small = made[2]->cpu_s - made[3]->cpu_s,
           large_error = timing_error(made[0]) + timing_error(made[1]),
           small_error = timing_error(made[2]) + timing_error(made[3]);
    double least = log(fmax(large - large_error, 1e-6) / (fmax(small, 0) + small_error));
    const struct interval i = {least, least, least, 0};
    out->share = least <= 0 ? 1 : score_share(&c->log_ratio, &i);
    snprintf(out->seen, sizeof out->seen,
             "%.3g s of CPU time against %.3g s (+- %.2g and %.2g): at least %.3g times as long",
             large, small, large_error, small_error, exp(least));
}
