/* The page's section on stated errors ("consistency" in results.json). */
#include "report_internal.h"

#include "tools/results/stated_error_results.h"
#include "tools/html/html.h"

static size_t count_good(const json_t *consistency)
{
    size_t good = 0;
    for (size_t i = 0; i < json_array_size(consistency); i++)
        good += results_row_outcome(json_array_get(consistency, i)) == OUTCOME_AS_EXPECTED;
    return good;
}

void report_stated_error_headline(FILE *f, const json_t *consistency)
{
    size_t num = json_array_size(consistency), good = count_good(consistency);
    if (num == 0)
        return;
    fprintf(f, "<p class=\"lede\">%s%zu of %zu scenes were rendered with errors as stated.%s</p>\n",
            good < num ? "<strong>" : "", good, num, good < num ? "</strong>" : "");
}

static void write_row(FILE *f, const json_t *c)
{
    bool good = results_row_outcome(c) == OUTCOME_AS_EXPECTED;
    html_row_open(f, !good, member_text(c, "scene"));
    if (member_text(c, "error") != NULL) {
        html_print(f, "<td colspan=\"7\" class=\"error-cell\">%s</td></tr>\n",
                   member_text(c, "error"));
        return;
    }
    html_print(f,
               "<td>%s</td><td class=\"num\">%.0f × %.0f</td><td class=\"num\">%.3f</td><td "
               "class=\"num\">%.3f to %.3f</td><td class=\"num\">%.2f</td>",
               member_text(c, "verdict"), member_number(c, "renders"), member_number(c, "spp"),
               member_number(c, "pixels"), member_end(c, "pixels_ci", 0),
               member_end(c, "pixels_ci", 1), member_number(c, "image"));
    if (json_object_get(c, "noise_ci") != NULL)
        fprintf(f, "<td class=\"num\">%.3f (%.3f to %.3f)</td>", member_number(c, "noise"),
                member_end(c, "noise_ci", 0), member_end(c, "noise_ci", 1));
    else
        fputs("<td></td>", f);
    if (json_object_get(c, "too_early") != NULL)
        fprintf(f, "<td class=\"num\">%.0f + %.0f</td>", member_number(c, "too_early"),
                member_number(c, "too_late"));
    else
        fputs("<td></td>", f);
    fputs("</tr>\n", f);
}

void report_stated_error(FILE *f, const json_t *consistency)
{
    if (json_array_size(consistency) == 0)
        return;
    fputs("<section>\n<h2>Stated errors</h2>\n", f);
    html_table_open(
        f, NULL, "Table of stated errors",
        "Scene|Verdict|>Renders × samples|>Pixels|>Interval|>Sum of pixels|>Noise|>Stopped wrong");
    for (size_t i = 0; i < json_array_size(consistency); i++)
        write_row(f, json_array_get(consistency, i));
    html_table_close(f);
    fputs(
        "<p class=\"caption\">The scene is rendered several times with "
        "seeds of their own. <b>Pixels</b>: variance between the renders over the variance that "
        "they state; 1 if samples are independent, 2 if each is computed twice, 0 if the seed has "
        "no effect. <b>Sum of pixels</b>: the same of the whole image's sum; large if pixels "
        "share their random numbers. <b>Noise</b>: what is stated over the closed form of this "
        "estimator's noise; 2 if every other sample is wasted. <b>Stopped wrong</b>: pixels that "
        "adaptive sampling stopped too early + too late.</p>\n</section>\n",
        f);
}
