/* A claim on the page: heading, images, maps, plots and evidence. */
#include "report_internal.h"

#include "tools/html/csv_link.h"
#include "tools/html/html.h"
#include "tools/plots/plot_interval.h"
#include "tools/plots/plot_power.h"
#include "tools/results/plain_words.h"

#include <stdlib.h>
#include <string.h>

/* "A against B", and the verdict. */
static void write_heading(FILE *f, const struct claim_ref *claim)
{
    html_print(f, "<h3>%s against ", member_text(claim->json, "a"));
    report_reference(f, claim);
    fputs(" ", f);
    report_badge(f, claim);
}

void report_claim_error(struct page *p, const struct claim_ref *claim)
{
    FILE *f = p->f;
    fprintf(f, "<article class=\"claim\" id=\"claim-%zu\">\n", claim->index);
    write_heading(f, claim);
    html_print(f, "</h3>\n<p class=\"error-line\">This claim could not be judged: %s",
               member_text(claim->json, "error"));
    fputs(results_claim_lacks_time(claim->json)
              ? "</p>\n<p class=\"caption\">It counts as inconclusive. A larger budget would "
                "judge it.</p>\n"
              : "</p>\n<p class=\"caption\">That is neither a pass nor a failure of the "
                "renderer. It makes the exit code 3 until the cause is gone.</p>\n",
          f);
    const char *rerun = member_text(claim->json, "rerun");
    if (rerun != NULL)
        html_print(f,
                   "<p>To judge this claim again:</p>\n<pre tabindex=\"0\"><code>%s</code></pre>\n",
                   rerun);
    fputs("</article>\n", f);
}

static void write_histogram(FILE *f, const json_t *claim)
{
    int count[20];
    struct p_histogram h = plot_p_histogram(claim, count);
    fputs("<figure class=\"map\">", f);
    if (h.num_tiles == 0) {
        fputs("<figcaption><b>No p-values.</b> No tile has any noise, so there is nothing to test; "
              "the differences are exact.</figcaption></figure>\n",
              f);
        return;
    }
    plot_p_values(f, &h, count);
    fprintf(
        f,
        "<figcaption><b>p-values of the %d tiles.</b> If both have the same mean the bars stay near the dashed line "
        "(%.3g tiles), each in the band 99 times of 100; a pile at the left is a real difference%s. Here %d "
        "tiles are below 0.05, where chance alone would put %.1f. ",
        h.num_tiles, h.expected,
        strcmp(member_text(claim, "verdict"), "EQUIVALENT") == 0 ? ", here one inside the margin"
                                                                 : "",
        h.below_5_percent, 0.05 * h.num_tiles);
    struct csv csv = csv_link_open(f, "p_values.csv", "p_from,p_to,tiles");
    for (int b = 0; b < h.bins; b++)
        csv_link_row(&csv, "nnn", (double)b / h.bins, (double)(b + 1) / h.bins, (double)count[b]);
    csv_link_close(&csv);
    fputs("</figcaption></figure>\n", f);
}

/* An attribute with a claim's list of numbers, three digits, null where there is none. */
static void write_list(FILE *f, const char *attribute, const json_t *list)
{
    fprintf(f, " %s=\"[", attribute);
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *v = json_array_get(list, i);
        fputs(i > 0 ? "," : "", f);
        if (json_is_number(v))
            fprintf(f, "%.3g", json_number_value(v));
        else
            fputs("null", f);
    }
    fputs("]\"", f);
}

/* What had to be assumed about the inputs. */
static void write_notes(FILE *f, const json_t *claim)
{
    const json_t *notes = json_object_get(claim, "notes");
    if (json_array_size(notes) == 0)
        return;
    fputs("<ul class=\"notes\">\n", f);
    for (size_t i = 0; i < json_array_size(notes); i++)
        html_print(f, "<li>%s</li>\n", json_string_value(json_array_get(notes, i)));
    fputs("</ul>\n", f);
}

bool report_claim(struct page *p, const struct claim_ref *claim, const struct claim_side *a,
                  const struct claim_side *b, double white, struct err *e)
{
    FILE *f = p->f;
    const json_t *json = claim->json;
    fprintf(f,
            "<article class=\"claim\" id=\"claim-%zu\" data-a=\"%zu\" data-b=\"%zu\" "
            "data-tile=\"%.0f\"",
            claim->index, a->layer, b->layer, member_number(json, "tile"));
    write_list(f, "data-tile-p", json_object_get(json, "tile_log10_p"));
    write_list(f, "data-tile-t", json_object_get(json, "tile_t"));
    html_print(f, " data-name=\"%s against ", member_text(json, "a"));
    report_reference(f, claim);
    const bool expected = claim->outcome == OUTCOME_AS_EXPECTED,
               is_comparison = strcmp(member_text(json, "scene"), "files") == 0;
    fprintf(f, "\">\n<details class=\"evidence\"%s>\n<summary>",
            expected && p->folded ? "" : " open");
    write_heading(f, claim);
    html_print(f, " <small>%s%s</small></h3><span class=\"reason\">%s</span></summary>\n",
               is_comparison ? ""
               : expected    ? "as expected"
                             : "expected ",
               expected || is_comparison ? "" : member_text(json, "expected"),
               member_text(json, "reason"));
    if (strcmp(member_text(json, "verdict"), "DIFFERENT") == 0)
        html_print(f, "<p>%s.</p>\n", plain_words_claim(json).s);
    write_notes(f, json);
    if (!report_similarity(p, claim, a->m, b->m, white, e))
        return false;
    if (expected && p->folded) {
        fputs("<div class=\"maps\"></div>\n", f); /* for the script's maps */
    } else {
        fputs("<div class=\"maps\">\n", f);
        write_histogram(f, json);
        if (!plot_qq(f, json, e))
            return false;
        plot_power(f, json);
        fputs("</div>\n", f);
        report_evidence_tiles(f, json);
    }
    report_evidence(f, json, !expected);
    fputs("</details>\n</article>\n", f);
    return true;
}
