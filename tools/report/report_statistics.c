#include "report_statistics.h"

#include "tools/html/html.h"
#include "tools/results/results.h"

#include <math.h>

static void write_row(FILE *f, const json_t *s, double alpha)
{
    double share = member_number(s, "share"), log10_p = member_number(s, "log10_p");
    bool tested = member_number(s, "num_tests") > 0;
    bool rejects = tested && log10_p <= log10(alpha * share);
    html_row_open(f, rejects, member_text(s, "name"));
    if (!(share > 0)) {
        fputs("<td colspan=\"5\">not asked for</td></tr>\n", f);
        return;
    }
    fprintf(f, "<td class=\"num\">%.3g</td><td class=\"num\">%.0f</td>", alpha * share,
            member_number(s, "num_tests"));
    if (!tested) {
        fputs("<td colspan=\"3\">too skewed, or no noise</td></tr>\n", f);
        return;
    }
    fputs("<td class=\"num\">", f);
    html_p_value(f, log10_p);
    fprintf(f, "</td><td>%s</td><td>", rejects ? "<strong>DIFFERENT</strong>" : "nothing");
    if (log10_p < 0) /* else nothing stands out, and its place is none */
        html_text(f, member_text(s, "what"));
    fputs("</td></tr>\n", f);
}

static void write_hint(FILE *f, const json_t *h)
{
    const char *unit = member_text(h, "unit");
    html_print(f, "It looks like <b>%s</b>", member_text(h, "name"));
    if (unit[0] != '\0')
        html_print(f, " of %s %s", html_number(member_number(h, "amount")).s, unit);
    fprintf(f, ": made to B, that removes %.0f\u00a0%% of the difference. ",
            100 * member_number(h, "removed"));
}

void report_statistics(FILE *f, const json_t *claim)
{
    const json_t *all = json_object_get(claim, "statistics");
    const json_t *hint = json_object_get(claim, "hint");
    const json_t *ratio = json_object_get(claim, "variance_ratio");
    fputs("<h4>Which statistic looked</h4>\n", f);
    char label[160];
    snprintf(label, sizeof label, "Statistics of %.40s against %.40s on %.40s",
             member_or_empty(claim, "a"), member_or_empty(claim, "b"),
             member_or_empty(claim, "scene"));
    html_table_open(f, NULL, label,
                    "Statistic|>Part of alpha|>Tests|>Smallest p × tests|Found|Where or what");
    for (size_t i = 0; i < json_array_size(all); i++)
        write_row(f, json_array_get(all, i), member_number(claim, "alpha"));
    html_table_close(f);
    if (hint == NULL && ratio == NULL)
        return;
    fputs("<p class=\"caption\">", f);
    if (hint != NULL)
        write_hint(f, hint);
    if (ratio != NULL)
        fprintf(f, "The variance of one path of A is %s times that of B [%s, %s].",
                html_number(member_number(ratio, "ratio")).s,
                html_number(member_end(ratio, "ci", 0)).s,
                html_number(member_end(ratio, "ci", 1)).s);
    fputs("</p>\n", f);
}
