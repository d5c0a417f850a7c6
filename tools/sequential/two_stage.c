#include "two_stage.h"

#include "tools/compare/verdict.h"

#include "tools/compare/input_checks.h"
#include "tools/compare/pyramid.h"
#include "tools/compare/region.h"
#include "tools/stats/distributions.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

double two_stage_alpha(double alpha)
{
    return sqrt(alpha);
}

static struct compare_options with_alpha(const struct compare_options *opt, double alpha)
{
    struct compare_options o = *opt;
    o.alpha = alpha;
    return o;
}

bool two_stage_first(const struct moments *a, const struct moments *b,
                     const struct compare_options *opt, struct comparison *out, struct err *e)
{
    struct compare_options stage = with_alpha(opt, two_stage_alpha(opt->alpha));
    struct compare_options half = with_alpha(opt, opt->alpha / 2);
    if (!compare_moments(a, b, &stage, out, e))
        return false;
    if (out->verdict == VERDICT_DIFFERENT)
        return true;
    comparison_free(out);
    if (!compare_moments(a, b, &half, out, e))
        return false;
    /* alpha/2 is stricter, but skewness may leave fewer tests to divide it among: what was not
     * flagged is not DIFFERENT then, but does not pass either. */
    if (out->verdict == VERDICT_DIFFERENT)
        out->verdict = VERDICT_INCONCLUSIVE;
    return true;
}

/* Sums of the region's pixels, as pyramid.c makes them. */
static struct cell cell_of(const struct moments *a, const struct moments *b, struct rect r,
                           int channel)
{
    struct cell sum = {0};
    for (int y = r.y; y < r.y + r.height; y++)
        for (int x = r.x; x < r.x + r.width; x++) {
            size_t p = (size_t)y * (size_t)a->width + (size_t)x;
            struct pixel_estimate ea = pyramid_pixel_estimate(a, p, channel),
                                  eb = pyramid_pixel_estimate(b, p, channel);
            pyramid_add_pixel(&sum, &ea, &eb);
        }
    return sum;
}

/* One-sided log10 p of the region that stage 1 found, in the direction that it found; 0 if the
 * difference has the other sign or the region is too skewed to be tested at that level. */
static bool region_again(const struct region *found, const struct moments *a,
                         const struct moments *b, const struct compare_options *opt, double level,
                         double *log10_p, double *difference, struct err *e)
{
    struct judge j;
    if (!input_checks_run(a, b, opt, &j, e))
        return false;
    j.z_guard[STATISTIC_IMAGE] = j.z_guard[STATISTIC_PYRAMID] = stats_normal_quantile(level);
    struct rect r = {found->x, found->y, found->width, found->height};
    struct cell cell = cell_of(a, b, r, found->channel);
    struct measured m = region_measure(&j, &cell, r);
    struct rect wide = {r.x > 2 * r.width ? r.x - 2 * r.width : 0,
                        r.y > 2 * r.height ? r.y - 2 * r.height : 0, 5 * r.width, 5 * r.height};
    wide.width = wide.x + wide.width < a->width ? wide.width : a->width - wide.x;
    wide.height = wide.y + wide.height < a->height ? wide.height : a->height - wide.y;
    struct cell around = cell_of(a, b, wide, found->channel);
    region_look_around(&j, &m, &around);
    *difference = m.d / m.unit;
    *log10_p = 0;
    if (region_testable(&j, &m) && m.d * found->difference > 0)
        *log10_p = fmin(0, region_log10_p(&j, &m, found->channel) - (m.noise_free ? 0 : log10(2)));
    return true;
}

bool two_stage_confirm(const struct comparison *first, const struct moments *a2,
                       const struct moments *b2, const struct compare_options *opt,
                       struct comparison *second, struct err *e)
{
    assert(first->verdict == VERDICT_DIFFERENT);
    double stage = two_stage_alpha(opt->alpha);
    struct compare_options half = with_alpha(opt, opt->alpha / 2);
    bool region = verdict_rejects(first, STATISTIC_IMAGE, stage) ||
                  verdict_rejects(first, STATISTIC_PYRAMID, stage);
    int flagged = region;
    for (int s = STATISTIC_PYRAMID + 1; s < NUM_STATISTICS; s++)
        flagged += verdict_rejects(first, s, stage);
    assert(flagged > 0);
    if (!compare_moments(a2, b2, &half, second, e))
        return false;

    double level = stage / flagged, log10_p = 0, difference = 0;
    char what[128] = "", seen[64] = "";
    bool confirmed = false;
    if (region) {
        const struct region *w = &first->worst;
        struct rect r = {w->x, w->y, w->width, w->height};
        if (!region_again(w, a2, b2, opt, level, &log10_p, &difference, e)) {
            comparison_free(second);
            return false;
        }
        region_name(a2->width, a2->height, r, w->channel, what, sizeof what);
        snprintf(seen, sizeof seen, ": %+.3g %%, then %+.3g %%", 100 * w->difference,
                 100 * difference);
        confirmed = log10_p <= log10(level);
    }
    /* In the other statistics the same test must have the smallest p again; that p is two-sided and
     * corrected for all tests of the statistic, so nothing is lost but power. */
    for (int s = STATISTIC_PYRAMID + 1; s < NUM_STATISTICS && !confirmed; s++) {
        if (!verdict_rejects(first, s, stage))
            continue;
        bool same = second->statistic[s].num_tests > 0 &&
                    strcmp(first->statistic[s].what, second->statistic[s].what) == 0;
        double p = same ? second->statistic[s].log10_p : 0;
        confirmed = p <= log10(level);
        if (confirmed || what[0] == '\0') {
            snprintf(what, sizeof what, "%s", first->statistic[s].what);
            seen[0] = '\0';
            log10_p = p;
        }
    }
    char text[1024];
    if (confirmed) {
        second->verdict = VERDICT_DIFFERENT;
        second->extra_factor = 1;
        snprintf(text, sizeof text,
                 "%s%s; found at %.2g and, with fresh seeds, confirmed at %.2g (%d flagged): "
                 "%s",
                 what, seen, stage, level, flagged, verdict_p(log10_p).s);
    } else {
        if (second->verdict == VERDICT_DIFFERENT)
            second->verdict = VERDICT_INCONCLUSIVE;
        snprintf(text, sizeof text, "%s%s; fresh seeds did not confirm it (%s); they say: %s", what,
                 seen, verdict_p(log10_p).s, second->reason);
    }
    snprintf(second->reason, sizeof second->reason, "%.255s", text);
    return true;
}

bool two_stage_check_fresh(const struct moments *first, const struct moments *again, struct err *e)
{
    if (first->width != again->width || first->height != again->height)
        return err_set(e, "is %d x %d pixels, its first render %d x %d", again->width,
                       again->height, first->width, first->height);
    if (strcmp(first->unit, again->unit) != 0)
        return err_set(e, "holds a %s, its first render a %s", again->unit, first->unit);
    size_t values = 3 * (size_t)first->width * (size_t)first->height, same = 0;
    while (same < values && moments_mean(first, same) == moments_mean(again, same))
        same++;
    if (!moments_is_exact(first) && same == values)
        return err_set(e,
                       "is the same image as its first render: a second stage needs fresh seeds");
    return true;
}
