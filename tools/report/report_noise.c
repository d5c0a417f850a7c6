/* The page's section on noise: variance of a sample, slope of the error, efficiency. */
#include "report_internal.h"

#include "tools/html/html.h"
#include "tools/results/noise_results.h"

/* The number of judged rows; good: only of those as expected. */
static size_t count(const json_t *noise, bool good)
{
    size_t n = 0;
    json_each(row, noise) {
        bool judged = member_text(row, "against") != NULL || member_text(row, "error") != NULL;
        n += judged && (!good || results_row_outcome(row) == OUTCOME_AS_EXPECTED);
    }
    return n;
}

void report_noise_headline(FILE *f, const json_t *noise)
{
    size_t num = count(noise, false), good = count(noise, true);
    if (num > 0)
        fprintf(f,
                "<p class=\"lede\">%sIn %zu of %zu claims noise and its fall are as they were, or "
                "less.%s</p>\n",
                good < num ? "<strong>" : "", good, num, good < num ? "</strong>" : "");
}

void report_noise(FILE *f, const json_t *noise)
{
    if (json_array_size(noise) == 0)
        return;
    fputs("<section>\n<h2>Noise</h2>\n", f);
    html_table_open(f, NULL, "Table of noise",
                    "Scene|Engine|Variance of a sample|Of the noisiest tile|Over that of|Slope|"
                    "Efficiency [1/s]|Verdict");
    json_each(row, noise) {
        html_row_open(f, results_row_outcome(row) != OUTCOME_AS_EXPECTED,
                      member_text(row, "scene"));
        for (size_t c = 1; c < NOISE_COLUMNS; c++) {
            char text[TEXT_TABLE_CELL];
            noise_results_cell(row, c, text);
            html_print(f, "<td>%s</td>", text);
        }
        fputs("</tr>\n", f);
    }
    html_table_close(f);
    fputs("<p class=\"caption\"><b>Variance of a sample</b>: mean over pixels and channels of the "
          "variance of one sample, each over the reference's value squared. <b>Over that of</b>: "
          "of ours, held against a closed form, or against a record of a former version: not a "
          "truth, and only an increase beyond the margin is DIFFERENT. <b>Slope</b> of the error "
          "against the number of samples, between renders: -1/2 for independent samples, at most "
          "that for Sobol. <b>Efficiency</b>: 1/(variance × CPU time). Other engines are measured, "
          "not judged.</p>\n</section>\n",
          f);
}
