/* All checks of a submission, with the set of accepted deviations that leaves the most points. */
#include "grade_checks.h"
#include "rubric_bugs.h"
#include "tools/base/text.h"

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

static bool changes_image(const struct grading *g, const struct rubric_check *c, int set)
{
    for (int i = 0; i < c->num_images; i++)
        if (rubric_bugs_set(g->a, set, c->images[i]) != 0)
            return true;
    return false;
}

void grade_checks_accept(const struct grading *g, const struct rubric_check *c, int set,
                         struct result *out)
{
    const struct rubric *r = g->r;
    out->accepted[0] = '\0';
    for (int a = 0; set < 1 << r->num_accepted && a < r->num_accepted; a++) {
        const struct accepted *by = &r->accept[a];
        if (set >> a & 1 && changes_image(g, c, 1 << a))
            text_append(out->accepted, sizeof out->accepted, "%s%s",
                        out->accepted[0] != '\0' ? "; " : "",
                        by->words[0] != '\0' ? by->words : by->name);
    }
    if (out->accepted[0] == '\0')
        snprintf(out->accepted, sizeof out->accepted, "%s", r->set[set].name);
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
            grade_checks_accept(g, &g->r->check[i], *set, &out[i]);
    free(tried);
    return ok;
}
