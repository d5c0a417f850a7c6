#include "diagnose_print.h"

#include "diagnose_gather.h"
#include "reference/base/json_node.h"

#include <math.h>
#include <string.h>

enum { NEXT = 3 };
/* Less than this share of the difference is not worth a look. */
static const double least_told = 0.1;

static double log10_of(double natural)
{
    return natural / M_LN10;
}

static void print_bug(FILE *f, const struct catalogue *c, const struct candidate *k)
{
    const struct bug *b = &c->bug[k->bug];
    fprintf(f, "  %s\n    where: %s   (tests/mutants/%s.patch)\n", b->what, b->where, b->name);
    if (k->amplitude != 1)
        fprintf(f, "    with %.2f times its effect\n", k->amplitude);
}

static void print_views(FILE *f, const struct catalogue *c, const struct observation *clue,
                        int num_clues, const struct candidate *best)
{
    fprintf(f, "\n%-36s %9s %9s %10s  %s\n", "view", "T", "log10 L", "explained",
            "where it shows most (pixels)");
    for (int i = 0; i < num_clues; i++) {
        struct evidence v = diagnose_evidence(c, &clue[i], best);
        int cell = clue[i].seen.cell;
        fprintf(f, "%-36s %9.1f %9.1f ", clue[i].view->name, v.t, log10_of(v.log_lead));
        if (isnan(v.explained))
            fprintf(f, "%10s", "-");
        else
            fprintf(f, "%8.1f %%", 100 * v.explained);
        if (v.columns > 0)
            fprintf(f, "  %d x %d at %d,%d: %+.3g %%", cell * v.columns, cell * v.rows, cell * v.x,
                    cell * v.y, 100 * v.change);
        fputc('\n', f);
    }
}

static void print_bugs(FILE *f, const struct catalogue *c, const struct diagnosis *d)
{
    const struct candidate *best = &d->candidate[0];
    fputs(d->num_named == 1 ? "likely bug, or one that gives the same images:\n"
                            : "likely one of these, which look the same here:\n",
          f);
    for (int i = 0; i < d->num_named; i++)
        print_bug(f, c, &d->candidate[i]);
    fprintf(f, "  probability %.4g among %d known bugs; ", d->probability, c->num_bugs);
    if (isnan(best->explained))
        fprintf(f, "no view is clear by itself, all together show it by %.0f standard deviations",
                d->t);
    else
        fprintf(f, "explains %.1f %% of the difference", 100 * best->explained);
    if (d->num_candidates > d->num_named) {
        const double orders =
            log10_of(best->log_likelihood - d->candidate[d->num_named].log_likelihood);
        if (orders > 6)
            fputs("; more than a million times likelier than the next", f);
        else
            fprintf(f, "; %.2g times likelier than the next", pow(10, orders));
    }
    fputc('\n', f);
}

static void print_next(FILE *f, const struct catalogue *c, const struct diagnosis *d)
{
    int last = d->num_named + NEXT < d->num_candidates ? d->num_named + NEXT : d->num_candidates;
    fputs("\nnext candidates (log10 likelihood under the best, explained)\n", f);
    for (int i = d->num_named; i < last; i++) {
        const struct candidate *k = &d->candidate[i];
        if (!(k->explained >= least_told))
            continue;
        fprintf(f, "  %8.1f %6.1f %%  %s (%s)",
                log10_of(k->log_likelihood - d->candidate[0].log_likelihood), 100 * k->explained,
                c->bug[k->bug].what, c->bug[k->bug].name);
        if (k->amplitude != 1)
            fprintf(f, ", %.2f times", k->amplitude);
        fputc('\n', f);
    }
}

/* Views of scenes that were not judged, often most of them, share a line. */
static void print_skipped(FILE *f, const json_t *skipped)
{
    const char *between = "not looked at, as there is no image of them: ";
    bool any = false;
    json_each(s, skipped)
        if (strcmp(member_text(s, "reason"), DIAGNOSE_NO_IMAGE) != 0)
            fprintf(f, "not looked at: %s: %s\n", member_text(s, "view"), member_text(s, "reason"));
    json_each(s, skipped) {
        if (strcmp(member_text(s, "reason"), DIAGNOSE_NO_IMAGE) != 0)
            continue;
        fprintf(f, "%s%s", any ? ", " : between, member_text(s, "view"));
        any = true;
    }
    if (any)
        fputc('\n', f);
}

void diagnose_print(FILE *f, const struct catalogue *c, const struct observation *clue,
                    int num_clues, const struct diagnosis *d, const json_t *skipped)
{
    switch (d->finding) {
    case FINDING_CORRECT: fprintf(f, "nothing wrong found: %s\n", d->gate); break;
    case FINDING_BUG:
        print_bugs(f, c, d);
        fprintf(f, "it is wrong because %s\n", d->gate);
        break;
    case FINDING_UNKNOWN:
        fprintf(f, "wrong, but none of the %d known bugs explains it: %s\n", c->num_bugs, d->gate);
        break;
    }
    if (d->num_candidates > 0) {
        print_views(f, c, clue, num_clues, &d->candidate[0]);
        print_next(f, c, d);
    }
    print_skipped(f, skipped);
}

static json_t *view_json(const struct catalogue *c, const struct observation *clue,
                         const struct candidate *best)
{
    struct evidence v = diagnose_evidence(c, clue, best);
    int cell = clue->seen.cell;
    json_t *region = v.columns > 0
                         ? json_pack("{si,si,si,si,sf}", "x", cell * v.x, "y", cell * v.y, "width",
                                     cell * v.columns, "height", cell * v.rows, "change", v.change)
                         : json_null();
    return json_pack("{ss,so,so,so,so}", "view", clue->view->name, "t", json_finite(v.t),
                     "log10_lead", json_finite(log10_of(v.log_lead)), "explained",
                     json_finite(v.explained), "region", region);
}

json_t *diagnose_print_json(const struct catalogue *c, const struct observation *clue,
                            int num_clues, const struct diagnosis *d, const json_t *skipped)
{
    static const char *const finding[] = {
        [FINDING_CORRECT] = "correct", [FINDING_BUG] = "bug", [FINDING_UNKNOWN] = "unknown"};
    json_t *named = json_array(), *candidates = json_array(), *views = json_array();
    for (int i = 0; i < d->num_named; i++)
        json_array_append_new(named, json_string(c->bug[d->candidate[i].bug].name));
    for (int i = 0; i < d->num_candidates; i++) {
        const struct candidate *k = &d->candidate[i];
        const struct bug *b = &c->bug[k->bug];
        json_array_append_new(candidates, json_pack("{ss,ss,ss,so,so,so}", "name", b->name, "bug",
                                                    b->what, "where", b->where, "amplitude",
                                                    json_finite(k->amplitude), "log10_likelihood",
                                                    json_finite(log10_of(k->log_likelihood)),
                                                    "explained", json_finite(k->explained)));
    }
    for (int i = 0; i < num_clues; i++)
        json_array_append_new(views, d->num_candidates > 0
                                         ? view_json(c, &clue[i], &d->candidate[0])
                                         : json_pack("{ss}", "view", clue[i].view->name));
    json_t *root =
        json_pack("{ss,ss,so,si,so,so,so,sO}", "finding", finding[d->finding], "gate", d->gate,
                  "log10_p", json_finite(d->log10_p), "known_bugs", c->num_bugs, "named", named,
                  "candidates", candidates, "views", views, "skipped", skipped);
    if (root != NULL && d->finding == FINDING_BUG)
        json_object_set_new(root, "probability", json_finite(d->probability));
    return root;
}
