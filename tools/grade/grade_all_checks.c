/* All checks of a submission, with the set of accepted deviations that leaves the most points. */
#include "grade_checks.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void free_results(struct result *out, int num)
{
    for (int i = 0; i < num; i++)
        result_free(&out[i]);
}

/* On failure there is nothing to free. */
static bool grade_with(const struct grading *g, int set, struct result *out, double *points,
                       struct err *e)
{
    *points = 0;
    for (int i = 0; i < g->r->num_checks; i++) {
        if (!grade_checks_run(g, &g->r->check[i], set, &out[i], e)) {
            free_results(out, i);
            return false;
        }
        *points += g->r->check[i].points * out[i].share;
    }
    return true;
}

/* Did the check of an image lose points against the plain reference, and none, undecided ones
 * included, with deviations? */
static bool is_explained(const struct rubric_check *c, double plain, const struct result *with)
{
    return plain < 1 && with->share == 1 && with->more == 0 &&
           (c->kind == CHECK_EQUAL || c->kind == CHECK_EXACT);
}

static bool explains(const struct rubric *r, const double *plain, const struct result *with)
{
    for (int i = 0; i < r->num_checks; i++)
        if (is_explained(&r->check[i], plain[i], &with[i]))
            return true;
    return false;
}

bool grade_all_checks(const struct grading *g, struct result *out, int *set, struct err *e)
{
    static const double worth_telling = 0.01; /* of all points */
    double plain[RUBRIC_CHECKS], best, points, total = rubric_points(g->r);
    struct result *tried = calloc(RUBRIC_CHECKS, sizeof *tried);
    *set = 0;
    if (tried == NULL)
        return err_set(e, "out of memory");
    bool ok = grade_with(g, 0, out, &best, e);
    for (int i = 0; ok && i < g->r->num_checks; i++)
        plain[i] = out[i].share;
    if (ok && best < total)
        best += worth_telling * total;
    for (int k = 1; ok && k < g->r->num_sets && best < total; k++) {
        ok = grade_with(g, k, tried, &points, e);
        if (!ok) {
            free_results(out, g->r->num_checks);
        } else if (points > best && explains(g->r, plain, tried)) {
            free_results(out, g->r->num_checks);
            memcpy(out, tried, (size_t)g->r->num_checks * sizeof *out);
            best = points;
            *set = k;
        } else {
            free_results(tried, g->r->num_checks);
        }
    }
    for (int i = 0; ok && *set > 0 && i < g->r->num_checks; i++)
        if (out[i].share > plain[i])
            snprintf(out[i].accepted, sizeof out[i].accepted, "%s", g->r->set[*set].name);
    free(tried);
    return ok;
}
