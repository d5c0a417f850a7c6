#include "mistake.h"

#include "carried.h"
#include "carried_ratio.h"

#include <stdio.h>
#include <stdlib.h>

/* Grades the checks that lost points again, with the deviations of `set`, and keeps what is better:
 * a bug can spoil every image that shows the deviations, so that they were not recognised before. */
static bool grade_with(const struct grading *g, int set, struct result *result, struct err *e)
{
    for (int i = 0; i < g->r->num_checks; i++) {
        struct result other;
        if (result[i].share == 1)
            continue;
        if (!grade_checks_run(g, &g->r->check[i], set, &other, e))
            return false;
        bool better = other.share > result[i].share;
        result_free(better ? &result[i] : &other);
        if (better) {
            result[i] = other;
            grade_checks_accept(g, &g->r->check[i], set, &result[i]);
        }
    }
    return true;
}

static bool is_seen(const struct grading *g)
{
    for (int i = 0; g->bugs != NULL && i < g->r->num_images; i++)
        if (rubric_bugs_can_observe(g, 0, i))
            return true;
    return false;
}

/* Each part that lost points by itself. Only a bug of that part's own code is believed: images that are
 * wrong by a mistake of an earlier part resemble many others. */
static bool diagnose_parts(const struct grading *g, int set, const double *share,
                           struct mistake *out, struct err *e)
{
    bool right[RUBRIC_IMAGES];
    for (int k = 0; k < RUBRIC_IMAGES; k++)
        right[k] = true;
    for (int i = 0; i < g->r->num_checks; i++)
        for (int k = 0; k < g->r->check[i].num_images; k++)
            right[g->r->check[i].images[k]] &= share[i] == 1;
    for (int p = 0; out->looked && p < g->r->num_parts; p++) {
        struct diagnosis *d = &out->of_part[p];
        bool lost = false;
        for (int i = 0; i < g->r->num_checks; i++)
            lost = lost || (g->r->check[i].part == p && share[i] < 1);
        if (lost && !rubric_bugs_diagnose_part(g, set, p, right, d, e))
            return false;
        for (int i = 0; i < d->num_named; i++)
            if (carried_part_of(g->r, &g->bugs->catalogue.bug[d->candidate[i].bug]) != p)
                d->num_named = 0;
    }
    return true;
}

/* Names the mistake, or says where it shows; costs nobody a point. */
static bool find(const struct grading *g, int set, const double *share, struct mistake *out,
                 struct err *e)
{
    struct err why;
    *out = (struct mistake){.judged = true, .looked = is_seen(g), .with = set, .located.image = -1};
    if (out->looked && !rubric_bugs_diagnose(g, set, NULL, &out->found, &out->with, &why)) {
        if (err_is_of_memory(&why))
            return err_set(e, "%s", why.msg);
        out->looked = false;
        snprintf(out->why, sizeof out->why, "%.190s", why.msg);
    }
    if (out->looked && out->found.num_named > 0)
        return true;
    /* The checks found something wrong: FINDING_CORRECT only means that no known bug is likelier than
     * none. */
    if (out->looked && out->found.finding == FINDING_CORRECT)
        snprintf(out->found.gate, sizeof out->found.gate,
                 "no known bug, nor two of them, explains the images");
    out->found.finding = FINDING_UNKNOWN;
    if (!diagnose_parts(g, set, share, out, e))
        return false;
    out->located = located_by(g, share);
    return true;
}

bool mistake_judge(const struct grading *g, int *set, struct result *result, struct mistake *out,
                   struct err *e)
{
    double share[RUBRIC_CHECKS];
    bool paid[RUBRIC_PARTS] = {false};
    for (int i = 0; i < g->r->num_checks; i++)
        share[i] = result[i].share;
    if (!find(g, *set, share, out, e))
        return false;
    if (out->looked && out->found.num_named > 0) {
        if (out->with != *set && !grade_with(g, out->with, result, e))
            return false;
        *set = out->with;
        if (!carried_by_name(g, out->with, &out->found, result, paid, e))
            return false;
    }
    return carried_by_ratio(g, *set, share, paid, result, e);
}

/* What is left where only the checks that students may see are asked. */
struct shown {
    struct rubric rubric;
    struct rubric_bugs bugs;
    double share[RUBRIC_CHECKS];
};

/* Leaves out the other checks, and what is known of images that none of these looks at. Is anything lost? */
static bool leave_shown(const struct grading *g, const double *share, struct shown *out)
{
    struct rubric *r = &out->rubric;
    bool lost = false;
    *r = *g->r;
    r->num_checks = 0;
    for (int i = 0; i < g->r->num_checks; i++)
        if (rubric_is_shown(&g->r->check[i])) {
            out->share[r->num_checks] = share[i];
            r->check[r->num_checks++] = g->r->check[i];
            lost = lost || share[i] < 1;
        }
    for (int i = 0; g->bugs != NULL && i < r->num_images; i++)
        for (int k = 0; k < RUBRIC_SETS && !rubric_bugs_sees(r, i); k++)
            out->bugs.view[k][i] = -1;
    return lost;
}

bool mistake_shown(const struct grading *g, int set, const double *share, struct mistake *out,
                   struct err *e)
{
    struct shown *shown = calloc(1, sizeof *shown);
    *out = (struct mistake){.located.image = -1};
    if (shown == NULL)
        return err_set(e, "out of memory");
    if (g->bugs != NULL)
        shown->bugs = *g->bugs;
    const struct grading only = {&shown->rubric, g->a, g->h, g->alpha,
                                 g->bugs != NULL ? &shown->bugs : NULL};
    bool ok = !leave_shown(g, share, shown) || find(&only, set, shown->share, out, e);
    free(shown);
    return ok;
}
