#include "tools/results/history.h"

#include "renderer/base/fs.h"
#include "tools/html/csv_link.h"
#include "tools/html/html.h"
#include "tools/html/page_assets.h"
#include "tools/results/results.h"

#include <math.h>
#include <string.h>

enum { WIDTH = 130, HEIGHT = 54, EDGE = 6 };

/* The quantities that are drawn against the runs. */
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

struct scale {
    double low, high;
    size_t runs;
};

static double at_x(const struct scale *s, size_t run)
{
    return s->runs < 2 ? WIDTH / 2.0
                       : EDGE + (WIDTH - 2.0 * EDGE) * (double)run / (double)(s->runs - 1);
}

static double at_y(const struct scale *s, double v)
{
    return HEIGHT - EDGE - (HEIGHT - 2 * EDGE) * (v - s->low) / (s->high - s->low);
}

static struct scale scale_of(const struct history *h, const struct history_series *s,
                             enum quantity q)
{
    struct scale scale = {INFINITY, -INFINITY, h->num_runs};
    for (size_t i = 0; i < s->num; i++) {
        const struct history_point *p = &s->point[i];
        double v = value_of(p, q);
        if (!isfinite(v))
            continue;
        scale.low = fmin(scale.low, q == DIFFERENCE ? 100 * p->low : v);
        scale.high = fmax(scale.high, q == DIFFERENCE ? 100 * p->high : v);
    }
    double pad = scale.high > scale.low ? 0 : fmax(fabs(scale.low), 1e-9) * 0.1;
    scale.low -= pad;
    scale.high += pad;
    return scale;
}

static void write_title(FILE *f, const struct history *h, const struct history_point *p, double v)
{
    char commit[128];
    const struct history_run *run = &h->run[p->run];
    history_commit(run, commit, sizeof commit);
    fputs("<title>", f);
    html_text(f, commit);
    fputs(", ", f);
    html_text(f, member_text(run->results, "date"));
    fprintf(f, ": %s</title>", html_number(v).s);
}

static void write_plot(FILE *f, const struct history *h, const struct history_series *s,
                       enum quantity q)
{
    struct scale scale = scale_of(h, s, q);
    if (!(scale.high > scale.low)) {
        fputs("<td></td>", f);
        return;
    }
    fprintf(f,
            "<td class=\"num\"><svg class=\"trend\" viewBox=\"0 0 %d %d\" width=\"%d\" "
            "height=\"%d\" role=\"img\" aria-label=\"%s, from %s to %s\">",
            WIDTH, HEIGHT, WIDTH, HEIGHT, quantity_name[q], html_number(scale.low).s,
            html_number(scale.high).s);
    if (q == DIFFERENCE && scale.low < 0 && scale.high > 0)
        fprintf(f, "<path class=\"grid\" d=\"M0 %.1fH%d\"/>", at_y(&scale, 0), WIDTH);
    fputs("<path class=\"curve\" d=\"", f);
    const char *op = "M";
    for (size_t i = 0; i < s->num; i++) {
        double v = value_of(&s->point[i], q);
        if (isfinite(v)) {
            fprintf(f, "%s%.1f %.1f", op, at_x(&scale, s->point[i].run), at_y(&scale, v));
            op = "L";
        }
    }
    fputs("\"/>", f);
    for (size_t i = 0; i < s->num; i++) {
        const struct history_point *p = &s->point[i];
        double v = value_of(p, q);
        if (!isfinite(v))
            continue;
        if (q == DIFFERENCE)
            fprintf(f, "<path class=\"ci\" d=\"M%.1f %.1fV%.1f\"/>", at_x(&scale, p->run),
                    at_y(&scale, 100 * p->low), at_y(&scale, 100 * p->high));
        fprintf(f, "<circle class=\"bar\" cx=\"%.1f\" cy=\"%.1f\" r=\"2.5\">", at_x(&scale, p->run),
                at_y(&scale, v));
        write_title(f, h, p, v);
        fputs("</circle>", f);
    }
    fprintf(f, "</svg>last %s</td>", html_number(value_of(&s->point[s->num - 1], q)).s);
}

static void write_series(FILE *f, const struct history *h, const struct history_series *s)
{
    bool moved = fabs(s->z) > h->critical;
    fprintf(f, "<tr%s><td>%s</td><th scope=\"row\">", moved ? " class=\"bad\"" : "",
            moved ? "<span class=\"badge bad\">✗ moved</span>" : "");
    html_text(f, s->scene);
    fputs("</th><td class=\"name\">", f);
    html_text(f, s->a);
    fputs("</td><td class=\"name\">", f);
    html_text(f, s->b);
    if (strcmp(s->quantity, "mean") != 0) {
        fputs(", ", f);
        html_text(f, s->quantity);
    }
    /* To a hundredth, as rounding alone is no move; + 0.0: no minus sign at 0. */
    double z = rint(100 * s->z) / 100 + 0.0;
    fprintf(f, "</td><td class=\"num\">%s</td>", s->num > 1 ? html_number(z).s : "");
    for (enum quantity q = 0; q < NUM_QUANTITIES; q++)
        write_plot(f, h, s, q);
    fputs("</tr>\n", f);
}

static void write_csv(FILE *f, const struct history *h)
{
    struct csv csv = csv_link_open(f, "history.csv",
                                   "scene,tested,against,commit,date,difference,low,high,"
                                   "variance_ratio,seconds,efficiency");
    for (size_t i = 0; i < h->num_series; i++) {
        const struct history_series *s = &h->series[i];
        for (size_t k = 0; k < s->num; k++) {
            const struct history_point *p = &s->point[k];
            char commit[128];
            history_commit(&h->run[p->run], commit, sizeof commit);
            csv_link_text(&csv, s->scene);
            csv_link_text(&csv, s->a);
            csv_link_text(&csv, s->b);
            csv_link_text(&csv, commit);
            csv_link_text(&csv, member_text(h->run[p->run].results, "date"));
            const double v[] = {p->difference,     p->low,     p->high,
                                p->variance_ratio, p->seconds, p->efficiency};
            for (size_t n = 0; n < sizeof v / sizeof *v; n++)
                csv_link_number(&csv, v[n]);
            csv_link_line(&csv);
        }
    }
    csv_link_close(&csv);
}

static void write_table(FILE *f, const struct history *h)
{
    fputs("<section><h2>The claims</h2>\n<div class=\"wide\" tabindex=\"0\" role=\"region\" "
          "aria-label=\"Table of claims\">\n<table id=\"series\"><thead><tr><th scope=\"col\"></th>"
          "<th scope=\"col\">Scene</th><th scope=\"col\">Tested</th><th scope=\"col\">Against</th>"
          "<th scope=\"col\" class=\"num\">z</th>",
          f);
    for (enum quantity q = 0; q < NUM_QUANTITIES; q++)
        fprintf(f, "<th scope=\"col\" class=\"num\">%s</th>", quantity_name[q]);
    fputs("</tr></thead>\n<tbody>\n", f);
    for (size_t i = 0; i < h->num_series; i++)
        write_series(f, h, &h->series[i]);
    fprintf(
        f,
        "</tbody></table>\n</div>\n<p class=\"caption\">Each plot runs from the oldest run to the "
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

static void write_runs(FILE *f, const struct history *h)
{
    fputs(
        "<section><h2>The runs</h2>\n<div class=\"wide\" tabindex=\"0\" role=\"region\" "
        "aria-label=\"Table of runs\">\n<table id=\"runs\"><thead><tr><th scope=\"col\">Date</th><th "
        "scope=\"col\">Commit</th><th scope=\"col\">Machine</th><th scope=\"col\" "
        "class=\"num\">Claims</th><th scope=\"col\" class=\"num\">As expected</th><th "
        "scope=\"col\" class=\"num\">Time</th><th scope=\"col\">File</th></tr></thead>\n<tbody>\n",
        f);
    for (size_t r = h->num_runs; r-- > 0;) {
        const json_t *root = h->run[r].results, *claims = json_object_get(root, "claims");
        size_t good = 0, num = json_array_size(claims);
        char commit[128];
        history_commit(&h->run[r], commit, sizeof commit);
        for (size_t i = 0; i < num; i++)
            good += results_claim_outcome(json_array_get(claims, i)) == OUTCOME_AS_EXPECTED;
        fprintf(f, "<tr%s><th scope=\"row\">", good < num ? " class=\"bad\"" : "");
        html_text(f, member_text(root, "date"));
        fputs("</th><td>", f);
        html_text(f, commit);
        fputs("</td><td>", f);
        html_text(f, member_text(root, "machine"));
        fprintf(
            f,
            "</td><td class=\"num\">%zu</td><td class=\"num\">%zu</td><td class=\"num\">%s</td><td>",
            num, good,
            json_object_get(root, "seconds") != NULL
                ? html_duration(member_number(root, "seconds")).s
                : "");
        html_text(f, h->run[r].path);
        fputs("</td></tr>\n", f);
    }
    fputs("</tbody></table></div></section>\n", f);
}

bool report_history(const struct history *h, const char *path, struct err *e)
{
    struct out_file out;
    if (!fs_make_parent_dirs(path, e) || !out_open(&out, path, e))
        return false;
    FILE *f = out.f;
    fprintf(f,
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta "
            "http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
            "'unsafe-inline'\">\n<meta name=\"viewport\" content=\"width=device-width, "
            "initial-scale=1\">\n<meta name=\"color-scheme\" content=\"light dark\">\n<title>Assay "
            "history</title>\n<style>\n%s</style>\n</head>\n<body>\n<main>\n<header>\n<p "
            "class=\"kicker\">Assay history</p>\n",
            page_css);
    if (h->moved == 0)
        fprintf(f, "<h1 class=\"good\">Nothing has moved in the last of %zu runs.</h1>\n",
                h->num_runs);
    else
        fprintf(f, "<h1 class=\"bad\">%zu of %zu claims have moved in the last of %zu runs.</h1>\n",
                h->moved, h->num_series, h->num_runs);
    fputs("</header>\n", f);
    if (h->num_series > 0)
        write_table(f, h);
    write_runs(f, h);
    fputs("</main>\n</body>\n</html>\n", f);
    return out_commit(&out, e);
}
