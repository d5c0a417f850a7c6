/* The page of a history: how quantities of each claim changed from run to run. */
#include "tools/results/history.h"

#include "renderer/base/fs.h"
#include "tools/html/csv_link.h"
#include "tools/html/html.h"
#include "tools/plots/plot.h"
#include "tools/results/results.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* The quantities that are plotted against the runs. */
enum quantity { DIFFERENCE, VARIANCE, SECONDS, EFFICIENCY, NUM_QUANTITIES };
static const char *const quantity_name[NUM_QUANTITIES] = {"difference, %", "variance ratio",
                                                          "time, s", "efficiency, paths/s"};

static double value_of(const struct history_point *p, enum quantity q)
{
    switch (q) {
    case DIFFERENCE: return 100 * p->difference;
    case VARIANCE: return p->variance_ratio;
    case SECONDS: return p->seconds;
    case EFFICIENCY: return p->efficiency;
    case NUM_QUANTITIES: break;
    }
    return NAN;
}

/* The ends of the y axis: false where nothing is known. */
static bool find_ends(const struct history_series *s, enum quantity q, struct plot_axis *y)
{
    double low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < s->num; i++) {
        const struct history_point *p = &s->point[i];
        double v = value_of(p, q);
        if (!isfinite(v))
            continue;
        low = fmin(low, q == DIFFERENCE ? 100 * p->low : v);
        high = fmax(high, q == DIFFERENCE ? 100 * p->high : v);
    }
    double pad = high > low ? 0 : fmax(fabs(low), 1e-9) * 0.1;
    y->lo = low - pad;
    y->hi = high + pad;
    return y->hi > y->lo;
}

static void write_plot(FILE *f, const struct history *h, const struct history_series *s,
                       enum quantity q)
{
    assert(q < NUM_QUANTITIES);
    struct plot plot = {.f = f,
                        .style = "trend",
                        .left = 6,
                        .top = 6,
                        .width = 118,
                        .height = 42,
                        .right = 6,
                        .bottom = 6,
                        .x = {.hi = (double)h->num_runs - 1}};
    if (h->num_runs < 2) /* a lone run in the middle */
        plot.x = (struct plot_axis){.lo = -1, .hi = 1};
    if (!find_ends(s, q, &plot.y)) {
        fputs("<td></td>", f);
        return;
    }
    fputs("<td class=\"num\">", f);
    plot_open(&plot, "%s, from %s to %s", quantity_name[q], html_number(plot.y.lo).s,
              html_number(plot.y.hi).s);
    if (q == DIFFERENCE && plot.y.lo < 0 && plot.y.hi > 0)
        plot_segment(&plot, "zero", plot.x.lo, 0, plot.x.hi, 0);
    for (size_t i = 0; i < s->num; i++) {
        const struct history_point *p = &s->point[i];
        double v = value_of(p, q), run = (double)p->run;
        char version[128];
        if (!isfinite(v))
            continue;
        plot_line_to(&plot, run, v);
        if (q == DIFFERENCE)
            plot_segment(&plot, "line", run, 100 * p->low, run, 100 * p->high);
        history_version(&h->run[p->run], version, sizeof version);
        plot_point(&plot, 0, run, v, "%s, %s: %s", version,
                   html_date(member_text(h->run[p->run].results, "date")).s, html_number(v).s);
    }
    plot_close(&plot);
    const double last = value_of(&s->point[s->num - 1], q);
    fprintf(f, "last %s</td>", isfinite(last) ? html_number(last).s : "not known");
}

static void write_series(FILE *f, const struct history *h, const struct history_series *s)
{
    bool moved = fabs(s->z) > h->critical, mean = strcmp(s->quantity, "mean") == 0;
    fprintf(f, "<tr%s><td>%s</td>", moved ? " class=\"bad\"" : "",
            moved ? "<span class=\"badge bad\">✗ moved</span>" : "");
    /* Rounded to hundredths, so that rounding errors do not show; + 0.0 turns -0 into 0. */
    double z = rint(100 * s->z) / 100 + 0.0;
    html_print(f,
               "<th scope=\"row\">%s</th><td class=\"name\">%s</td><td class=\"name\">%s%s%s</td>"
               "<td class=\"num\">%s</td>",
               s->scene, s->a, s->b, mean ? "" : ", ", mean ? "" : s->quantity,
               s->num > 1 ? html_number(z).s : "");
    for (enum quantity q = 0; q < NUM_QUANTITIES; q++)
        write_plot(f, h, s, q);
    fputs("</tr>\n", f);
}

/* Rows of the CSV at most: with hundreds of runs it would be most of the page, so only the last runs go into it. */
enum { MOST_ROWS = 4000 };

static void write_csv(FILE *f, const struct history *h)
{
    const size_t runs = MOST_ROWS / (h->num_series > 0 ? h->num_series : 1),
                 from = h->num_runs > runs ? h->num_runs - runs : 0;
    if (from > 0)
        fprintf(f, "The last %zu runs: ", runs);
    struct csv csv = csv_link_open(f, "history.csv",
                                   "scene,tested,against,version,date,difference,low,high,"
                                   "variance_ratio,seconds,efficiency");
    for (size_t i = 0; i < h->num_series; i++) {
        const struct history_series *s = &h->series[i];
        for (size_t k = 0; k < s->num; k++) {
            const struct history_point *p = &s->point[k];
            char version[128];
            if (p->run < from)
                continue;
            history_version(&h->run[p->run], version, sizeof version);
            csv_link_row(&csv, "tttttnnnnnn", s->scene, s->a, s->b, version,
                         member_text(h->run[p->run].results, "date"), p->difference, p->low,
                         p->high, p->variance_ratio, p->seconds, p->efficiency);
        }
    }
    csv_link_close(&csv);
}

static void write_table(FILE *f, const struct history *h)
{
    fputs("<section><h2>The claims</h2>\n", f);
    html_table_open(
        f, "series", "Table of claims",
        "Moved|Scene|Tested|Against|>z|>difference, %|>variance ratio|>time, s|>efficiency, paths/s");
    for (size_t i = 0; i < h->num_series; i++)
        write_series(f, h, &h->series[i]);
    html_table_close(f);
    fprintf(
        f,
        "<p class=\"caption\">Each plot runs from the oldest run to the "
        "last one, whose number stands below it; upright strokes are the intervals of the "
        "differences. <b>z</b>: how far the last difference is from the mean of those before, in "
        "standard errors; beyond ±%.2f it has moved (chance of any on this page without a cause: "
        "%.3g). <b>Variance ratio</b>: of a path of the tested renderer over that of the other. "
        "<b>Efficiency</b>: paths of the other renderer that say as much as what the tested one "
        "does in a second. Times are comparable on one machine only. ",
        h->critical, h->alpha);
    write_csv(f, h);
    fputs("</p></section>\n", f);
}

static size_t num_wrong(const struct history_run *run)
{
    size_t count[OUTCOME_AS_EXPECTED + 1];
    return results_count(run->results, JUDGED_CLAIM, count) - count[OUTCOME_AS_EXPECTED];
}

static void write_runs(FILE *f, const struct history *h)
{
    fputs("<section><h2>The runs</h2>\n", f);
    html_table_open(f, "runs", "Table of runs",
                    "Date|Version|Machine|>Claims|>As expected|>Time|File");
    for (size_t r = h->num_runs; r-- > 0;) {
        const json_t *root = h->run[r].results, *claims = json_object_get(root, "claims");
        const size_t num = json_array_size(claims), good = num - num_wrong(&h->run[r]);
        char version[128];
        history_version(&h->run[r], version, sizeof version);
        html_row_open(f, good < num, html_date(member_text(root, "date")).s);
        html_print(f,
                   "<td>%s</td><td>%s</td><td class=\"num\">%zu</td><td class=\"num\">%zu</td>"
                   "<td class=\"num\">%s</td><td>%s</td></tr>\n",
                   version, member_text(root, "machine"), num, good,
                   json_object_get(root, "seconds") != NULL
                       ? html_duration(member_number(root, "seconds")).s
                       : "",
                   h->run[r].path);
    }
    html_table_close(f);
    fputs("</section>\n", f);
}

bool report_history(const struct history *h, const char *path, struct err *e)
{
    struct out_file out;
    if (!fs_make_parent_dirs(path, e) || !out_open(&out, path, e))
        return false;
    FILE *f = out.f;
    html_page_open(f, "Assay history", NULL, 0);
    fputs("<header>\n<p class=\"kicker\">Assay history</p>\n", f);
    const size_t wrong = num_wrong(&h->run[h->num_runs - 1]);
    if (h->moved == 0 && wrong > 0)
        fprintf(
            f,
            "<h1 class=\"bad\">Nothing has moved in the last of %zu runs, but %zu of its claims "
            "%s not as it should be.</h1>\n",
            h->num_runs, wrong, wrong == 1 ? "is" : "are");
    else if (h->moved == 0)
        fprintf(f, "<h1 class=\"good\">Nothing has moved in the last of %zu runs.</h1>\n",
                h->num_runs);
    else
        fprintf(f, "<h1 class=\"bad\">%zu of %zu claims have moved in the last of %zu runs.</h1>\n",
                h->moved, h->num_series, h->num_runs);
    fputs("</header>\n", f);
    if (h->num_series > 0)
        write_table(f, h);
    write_runs(f, h);
    html_page_close(f);
    return out_commit(&out, e);
}
