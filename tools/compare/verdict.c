#include "verdict.h"

#include "pyramid.h"
#include "region.h"
#include "variance_ratio.h"
#include "tools/stats/distributions.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

const double verdict_largest_factor = 100;
static const double worth_saying = 0.1; /* of its margin, where a difference is not noise */

static bool inside_margin(const struct region *r)
{
    return r->ci_valid && region_reach(r) <= r->margin;
}

static void place(const struct comparison *c, const struct region *r, char *text, size_t size)
{
    struct rect rect = {r->x, r->y, r->width, r->height};
    region_name(c->z.width, c->z.height, rect, r->channel, text, size);
}

/* How many times the samples would bring half + spare to `limit`. Both fall as 1/sqrt n; so does `scale`, which is a
 * factor of half, as long as it is above 1. */
static double samples_to_reach(double limit, double half, double spare, double scale)
{
    const double unscaled = pow((half / scale + spare) / limit, 2);
    if (unscaled >= scale * scale)
        return unscaled;
    /* half/n + spare/sqrt n = limit */
    return pow((spare + sqrt(spare * spare + 4 * half * limit)) / (2 * limit), 2);
}

/* How many times the samples would bring this interval inside its margin: planned for equal engines
 * and a probability of 95 % over all intervals or, if there are enough samples for that, from the
 * difference seen. */
static double factor_needed(const struct region *r, size_t num_intervals)
{
    if (!r->ci_valid)
        return fmax(4,
                    r->unskew_interval); /* 4: few degrees of freedom may be in the way instead */
    double half = (r->ci_hi - r->ci_lo) / 2;
    double spare = stats_normal_quantile(0.025 / (double)num_intervals) * r->std_error;
    double planned = samples_to_reach(r->margin, half, spare, r->ci_scale);
    if (planned > 1)
        return planned;
    double gap = fabs(fabs(r->difference) - r->margin);
    return gap > 0 ? samples_to_reach(gap, half, spare, r->ci_scale) : verdict_largest_factor;
}

static double reach_of_margin(const struct region *r)
{
    return region_reach(r) / r->margin;
}

static bool is_significant(const struct region *r, double alpha, size_t num_intervals)
{
    return r->ci_valid && r->log10_p_equal <= log10(alpha / (double)num_intervals) &&
           fmax(r->ci_lo, -r->ci_hi) > worth_saying * r->margin;
}

static void judge_equivalence(struct comparison *c, const struct compare_options *opt,
                              const struct region *tiles)
{
    size_t num_tiles = (size_t)c->tiles_x * (size_t)c->tiles_y, num = num_tiles + NUM_CHANNELS;
    const struct region *furthest = NULL, *significant = NULL;
    double factor = 1;
    for (size_t i = 0; i < num; i++) {
        const struct region *r = i < NUM_CHANNELS ? &c->global[i] : &tiles[i - NUM_CHANNELS];
        if (is_significant(r, opt->alpha, num) &&
            (significant == NULL || reach_of_margin(r) > reach_of_margin(significant)))
            significant = r;
        if (inside_margin(r))
            continue;
        factor = fmax(factor, factor_needed(r, num));
        if (furthest == NULL || (furthest->ci_valid && !r->ci_valid) ||
            (furthest->ci_valid == r->ci_valid && reach_of_margin(r) > reach_of_margin(furthest)))
            furthest = r;
    }
    if (significant != NULL)
        c->significant = *significant;
    char where[96], wide[64] = "";
    if (furthest == NULL) {
        c->verdict = VERDICT_EQUIVALENT;
        snprintf(c->reason, sizeof c->reason,
                 "the image lies within %.3g %% and each of %zu tile%s within %.3g %%",
                 100 * c->global[CHANNEL_LUMINANCE].margin, num_tiles, num_tiles == 1 ? "" : "s",
                 100 * tiles[0].margin);
        if (significant == NULL)
            return;
        const size_t used = strlen(c->reason);
        place(c, significant, where, sizeof where);
        snprintf(c->reason + used, sizeof c->reason - used,
                 "; %s: %+.3g %% to %+.3g %% is not noise", where, 100 * significant->ci_lo,
                 100 * significant->ci_hi);
        return;
    }
    place(c, furthest, where, sizeof where);
    if (furthest == significant)
        snprintf(wide, sizeof wide, ", which is not noise,");
    else if (furthest->ci_scale > 1)
        snprintf(wide, sizeof wide, ", %.2g times as wide as samples are skewed,",
                 furthest->ci_scale);
    c->verdict = VERDICT_INCONCLUSIVE;
    c->extra_factor = fmin(verdict_largest_factor, factor);
    if (!furthest->ci_valid)
        snprintf(c->reason, sizeof c->reason,
                 "%s: samples too skewed for an interval, more of them are needed", where);
    else
        snprintf(c->reason, sizeof c->reason,
                 "%s: interval %+.3g %% to %+.3g %%%s is not inside the margin of %.3g %%", where,
                 100 * furthest->ci_lo, 100 * furthest->ci_hi, wide, 100 * furthest->margin);
}

/* Without a margin equivalence cannot be shown: the reason says what error would have been
 * found. */
static void judge_search(struct comparison *c)
{
    char image[32], tile[32];
    if (c->mdb_global >= region_mdb_none) {
        c->verdict = VERDICT_INCONCLUSIVE;
        c->extra_factor =
            fmin(verdict_largest_factor, fmax(4, c->global[CHANNEL_LUMINANCE].unskew_test));
        snprintf(c->reason, sizeof c->reason,
                 "the image: samples too skewed for a test, more of them are needed");
        return;
    }
    c->verdict = VERDICT_NOTHING_FOUND;
    snprintf(c->reason, sizeof c->reason,
             "an error of %s of the image or of %s of a tile would have been seen with 95 %%",
             region_mdb_text(c->mdb_global, image), region_mdb_text(c->mdb_tile, tile));
}

/* EQUIVALENT and NO DIFFERENCE FOUND also require that the variance is inside its margin. */
static void judge_variance(struct comparison *c, const struct compare_options *opt)
{
    const struct variance_ratio *v = &c->variance;
    double limit = 1 + opt->margin_variance;
    char mean[sizeof c->reason], *text = c->reason;
    size_t size = sizeof c->reason;
    size_t used = strlen(text);
    if (v->valid && v->lo >= 1 / limit && v->hi <= limit) {
        snprintf(text + used, size - used, "; the variance is %.3g times that of B [%.3g, %.3g]",
                 v->ratio, v->lo, v->hi);
        return;
    }
    memcpy(mean, text, size);
    if (c->verdict != VERDICT_INCONCLUSIVE)
        c->extra_factor = 1;
    if (!(c->statistic[STATISTIC_VARIANCE].share > 0))
        snprintf(text, size, "the variance could not be tested, as a side has none of its own");
    else if (!(v->ratio > 0))
        snprintf(text, size,
                 "the variance could not be tested: a side has no noise, or paths that cannot be "
                 "counted");
    else if (!v->valid)
        snprintf(text, size,
                 "the variance could not be tested, %s: it is about %.3g times that of B",
                 v->is_shared ? "as pixels share noise" : "being too skewed", v->ratio);
    else
        snprintf(text, size,
                 "the variance of a %s is %.3g times that of B [%.3g, %.3g], which is not inside "
                 "the margin of %.3g %%",
                 variance_ratio_of(v), v->ratio, v->lo, v->hi, 100 * opt->margin_variance);
    used = strlen(text);
    snprintf(text + used, size - used, "; mean: %.*s", (int)(size - used - 9), mean);
    c->verdict = VERDICT_INCONCLUSIVE;
}

struct verdict_p verdict_p(double log10_p)
{
    struct verdict_p p;
    if (log10_p < -12)
        snprintf(p.s, sizeof p.s, "p < 1e-12");
    else
        snprintf(p.s, sizeof p.s, "p = %.1g", pow(10, log10_p));
    return p;
}

bool verdict_rejects(const struct comparison *c, int statistic, double alpha)
{
    const struct statistic *st = &c->statistic[statistic];
    return st->num_tests > 0 && st->log10_p <= log10(alpha * st->share);
}

/* The reason names a region that rejects, which says where; without one, the statistic furthest
 * below its level. */
static void judge_different(struct comparison *c, const struct compare_options *opt)
{
    char where[96];
    size_t size = sizeof c->reason;
    int first = -1;
    for (int s = 0; s < NUM_STATISTICS; s++)
        if (verdict_rejects(c, s, opt->alpha) &&
            (first < 0 || (first > STATISTIC_PYRAMID &&
                           c->statistic[s].log10_p - log10(c->statistic[s].share) <
                               c->statistic[first].log10_p - log10(c->statistic[first].share))))
            first = s;
    assert(first >= 0);
    const struct statistic *st = &c->statistic[first];
    c->verdict = VERDICT_DIFFERENT;
    if (first <= STATISTIC_PYRAMID) {
        place(c, &c->worst, where, sizeof where);
        snprintf(c->reason, size,
                 "%s: difference %+.3g %% (standard error %.2g %%) is beyond the margin of %.3g "
                 "%%, %s",
                 where, 100 * c->worst.difference, 100 * c->worst.std_error, 100 * c->worst.margin,
                 verdict_p(c->worst.log10_p).s);
    } else if (first == STATISTIC_CHI_SQUARE) {
        snprintf(c->reason, size,
                 "many differences, each too small to be found alone: %s are together beyond "
                 "their margins, %s",
                 st->what, verdict_p(st->log10_p).s);
    } else if (first == STATISTIC_MATCHED_FILTER) {
        snprintf(c->reason, size, "a difference like %s beyond the margin of a tile, %s", st->what,
                 verdict_p(st->log10_p).s);
    } else {
        snprintf(c->reason, size,
                 "the variance of a %s is %.3g times that of B [%.3g, %.3g], beyond the margin "
                 "of %.3g %%, %s",
                 variance_ratio_of(&c->variance), c->variance.ratio, c->variance.lo, c->variance.hi,
                 100 * opt->margin_variance, verdict_p(st->log10_p).s);
    }
}

void verdict_decide(struct comparison *c, const struct compare_options *opt,
                    const struct region *tiles)
{
    bool rejected = false;
    for (int s = 0; s < NUM_STATISTICS; s++)
        rejected = rejected || verdict_rejects(c, s, opt->alpha);
    c->extra_factor = 1;
    if (rejected)
        judge_different(c, opt);
    else if (opt->margin_global > 0)
        judge_equivalence(c, opt, tiles);
    else
        judge_search(c);
    if (!rejected && opt->margin_variance > 0)
        judge_variance(c, opt);
}

bool verdict_is_near_margin(const struct comparison *c)
{
    return c->significant.width > 0 && region_reach(&c->significant) > c->significant.margin;
}

void verdict_more_samples(double factor, const char *of_what, bool is_near_margin, char text[128])
{
    const char *other = is_near_margin ? "choose another margin, as the difference is close to it"
                                       : "raise the margin or enlarge the tile";
    if (factor < verdict_largest_factor)
        snprintf(text, 128, "about %.1f times the %s would decide", fmax(factor, 1.1), of_what);
    else
        snprintf(text, 128, "more than %.0f times the %s would be needed: %s",
                 verdict_largest_factor, of_what, other);
}
