#include "report_table.h"

#include "tools/html/csv_link.h"
#include "tools/html/html.h"
#include "tools/plots/plot_interval.h"
#include "tools/results/results.h"

#include <math.h>
#include <string.h>

void report_reference(FILE *f, const struct claim_ref *claim)
{
    html_text(f, member_text(claim->json, "b"));
    const char *quantity = member_text(claim->json, "quantity");
    if (quantity != NULL && strcmp(quantity, "mean") != 0) {
        fputs(", ", f);
        html_text(f, quantity);
    }
}

void report_badge(FILE *f, const struct claim_ref *claim)
{
    static const char *const style[] = {"error", "bad", "bad", "good"};
    static const char *const mark[] = {"!", "✗", "✗", "✓"};
    fprintf(f, "<span class=\"badge %s\"><span aria-hidden=\"true\">%s</span> ",
            style[claim->outcome], mark[claim->outcome]);
    if (claim->outcome == OUTCOME_NOT_JUDGED && !results_claim_lacks_time(claim->json))
        fputs("not judged", f);
    else
        html_text(f, member_text(claim->json, "verdict"));
    fputs("</span>", f);
}

static void write_row(FILE *f, const struct claim_ref *claim)
{
    const json_t *c = claim->json;
    fprintf(f, "<tr%s><td>", claim->outcome == OUTCOME_AS_EXPECTED ? "" : " class=\"bad\"");
    report_badge(f, claim);
    fprintf(f, "</td><th scope=\"row\"><a href=\"#claim-%zu\">", claim->index);
    html_name(f, member_text(c, "scene"));
    fputs("</a></th><td class=\"name\">", f);
    html_name(f, member_text(c, "a"));
    fputs("</td><td class=\"name\">", f);
    report_reference(f, claim);
    fputs("</td><td>", f);
    html_text(f, member_text(c, "expected"));
    if (claim->outcome == OUTCOME_NOT_JUDGED) {
        fputs("</td><td colspan=\"6\" class=\"error-cell\">", f);
        html_text(f, member_text(c, "error"));
        fputs("</td></tr>\n", f);
        return;
    }
    const json_t *ci = json_object_get(c, "ci");
    fputs("</td><td>", f);
    plot_interval(f, c);
    fprintf(f,
            "</td><td class=\"num\">%s</td><td class=\"num\">%s to %s</td><td class=\"num\">%s</td>"
            "<td class=\"num\">%s</td>",
            html_percent_column(member_number(c, "difference")).s,
            html_percent_column(json_number_value(json_array_get(ci, 0))).s,
            html_percent_column(json_number_value(json_array_get(ci, 1))).s,
            html_number(100 * member_number(c, "mdb_global")).s,
            html_number(100 * member_number(c, "margin_global")).s);
    fputs("<td class=\"num\">", f);
    if (json_object_get(c, "seconds_a") != NULL)
        fputs(html_duration(member_number(c, "seconds_a")).s, f);
    fputs("</td></tr>\n", f);
}

static void write_csv(FILE *f, const struct claim_ref *claim, size_t num)
{
    static const char *const text[] = {"scene", "a", "b", "verdict", "expected", "error"};
    static const char *const number[] = {"difference", "mdb_global", "margin_global", "alpha",
                                         "seconds_a"};
    struct csv csv =
        csv_link_open(f, "claims.csv",
                      "scene,tested,against,verdict,expected,error,difference,mdb,margin,"
                      "alpha,seconds,low,high");
    for (size_t i = 0; i < num; i++) {
        const json_t *c = claim[i].json, *ci = json_object_get(c, "ci");
        for (size_t k = 0; k < sizeof text / sizeof *text; k++)
            csv_link_text(&csv, member_text(c, text[k]));
        for (size_t k = 0; k < sizeof number / sizeof *number; k++)
            csv_link_number(&csv,
                            json_object_get(c, number[k]) ? member_number(c, number[k]) : NAN);
        for (size_t k = 0; k < 2; k++)
            csv_link_number(&csv, ci != NULL ? json_number_value(json_array_get(ci, k)) : NAN);
        csv_link_line(&csv);
    }
    csv_link_close(&csv);
}

void report_table(FILE *f, const struct claim_ref *claim, size_t num)
{
    fputs(
        "<section id=\"table\">\n<h2>The claims</h2>\n"
        "<details class=\"help\"><summary>What the columns mean</summary>\n<p class=\"caption\">"
        "<b>Difference</b>: how much brighter (+) or darker (−) the tested image "
        "is than the reference, on average. <b>Interval</b>: where the true difference lies, "
        "given the noise of both. <b>Margin</b>: a difference up to this size counts as equal; "
        "it is declared for each scene before anything is rendered. <b>MDB</b>, the minimum "
        "detectable bias: a true difference of this size would have come out DIFFERENT with a "
        "probability of 95 %. In the drawing the band is the margin, the line is the interval "
        "and the dot is the difference; an arrow head points to what lies outside. A verdict is "
        "EQUIVALENT only where the intervals of the image and of every tile lie inside their "
        "margins, DIFFERENT where one lies outside, and INCONCLUSIVE where there are too few "
        "samples to tell.</p></details>\n"
        "<div class=\"wide\" tabindex=\"0\" role=\"region\" aria-label=\"Table of claims\">\n"
        "<table id=\"claims\"><thead><tr><th scope=\"col\">Verdict</th><th scope=\"col\">Scene</th>"
        "<th scope=\"col\">Tested</th><th scope=\"col\">Against</th><th scope=\"col\">Expected</th>"
        "<th scope=\"col\">In margin</th><th scope=\"col\" class=\"num\">Difference %</th><th "
        "scope=\"col\" class=\"num\">Interval %</th><th scope=\"col\" class=\"num\">MDB %</th><th "
        "scope=\"col\" class=\"num\">Margin %</th><th scope=\"col\" class=\"num\">Time</th></tr>"
        "</thead>\n"
        "<tbody>\n",
        f);
    for (size_t i = 0; i < num; i++)
        write_row(f, &claim[i]);
    fputs(
        "</tbody></table>\n</div>\n<p class=\"caption\">What did not come out as expected comes first. The table as a "
        "file: ",
        f);
    write_csv(f, claim, num);
    fputs("</p>\n</section>\n", f);
}
