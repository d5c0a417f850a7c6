/* The page's table of verdicts, a row for each claim. */
#include "report_internal.h"

#include "tools/base/text.h"
#include "tools/compare/region.h"
#include "tools/html/csv_link.h"
#include "tools/html/html.h"
#include "tools/plots/plot_interval.h"
#include "tools/results/plain_words.h"
#include "tools/results/results_table.h"

#include <assert.h>
#include <math.h>
#include <string.h>

void report_reference(FILE *f, const struct claim_ref *claim)
{
    html_text(f, member_text(claim->json, "b"));
    const char *quantity = member_text(claim->json, "quantity");
    if (quantity != NULL && strcmp(quantity, "mean") != 0)
        html_print(f, ", %s", quantity);
}

void report_badge(FILE *f, const struct claim_ref *claim)
{
    static const char *const style[] = {"error", "bad", "error", "good"};
    static const char *const mark[] = {"!", "✗", "?", "✓"};
    bool judged = claim->outcome != OUTCOME_NOT_JUDGED || results_claim_lacks_time(claim->json);
    html_print(f, "<span class=\"badge %s\"><span aria-hidden=\"true\">%s</span> %s</span>",
               style[claim->outcome], mark[claim->outcome],
               judged ? member_text(claim->json, "verdict") : "not judged");
}

static void write_cell(FILE *f, const struct column *column, const struct claim_ref *claim)
{
    const json_t *c = claim->json;
    const char *key = column->key;
    const bool is_name = column->kind == COLUMN_TESTED || column->kind == COLUMN_REFERENCE;
    if (column->kind == COLUMN_SCENE) {
        fprintf(f, "<th scope=\"row\"><a href=\"#claim-%zu\">", claim->index);
        html_name(f, member_text(c, key));
        fputs("</a></th>", f);
        return;
    }
    /* Cells repeat the heading, for narrow windows, where each claim is shown as a card. */
    if (column->kind == COLUMN_VERDICT || column->kind == COLUMN_PLOT)
        fputs("<td>", f);
    else
        html_print(f, "<td class=\"%s\" data-label=\"%s\">",
                   is_name                       ? "name"
                   : column->kind == COLUMN_TEXT ? "text"
                                                 : "num",
                   column->page);
    switch (column->kind) {
    case COLUMN_VERDICT: report_badge(f, claim); break;
    case COLUMN_TESTED: html_name(f, member_text(c, key)); break;
    case COLUMN_REFERENCE: report_reference(f, claim); break;
    case COLUMN_TEXT: html_text(f, member_text(c, key)); break;
    case COLUMN_PLOT:
        plot_interval(f, c);
        if (strcmp(member_text(c, "verdict"), "DIFFERENT") == 0 &&
            fabs(member_end(c, "ci", 0)) < member_number(c, "margin_global") &&
            fabs(member_end(c, "ci", 1)) < member_number(c, "margin_global"))
            fprintf(f, "<small>because of %s</small>",
                    plain_words_noise(c).s[0] != '\0' ? "its noise" : "a part of it");
        break;
    case COLUMN_DIFFERENCE: fputs(html_percent_column(member_number(c, key)).s, f); break;
    case COLUMN_INTERVAL:
        fprintf(f, "%s to %s", html_percent_column(member_end(c, key, 0)).s,
                html_percent_column(member_end(c, key, 1)).s);
        break;
    case COLUMN_PERCENT:
        fputs(member_number(c, key) >= region_mdb_none ? "none"
                                                       : html_number(100 * member_number(c, key)).s,
              f);
        break;
    case COLUMN_SECONDS:
    case COLUMN_NUMBER:
        if (json_object_get(c, key) != NULL)
            fputs((column->kind == COLUMN_SECONDS ? html_duration
                                                  : html_number)(member_number(c, key))
                      .s,
                  f);
        break;
    case COLUMN_SCENE:
    case COLUMN_MARK: break;
    }
    fputs("</td>", f);
}

static void write_row(FILE *f, const struct claim_ref *claim)
{
    size_t left = 0;
    fprintf(f, "<tr%s>", claim->outcome == OUTCOME_AS_EXPECTED ? "" : " class=\"bad\"");
    for (size_t i = 0; i < results_num_columns; i++) {
        const struct column *column = &results_columns[i];
        if (column->page == NULL)
            continue;
        if (claim->outcome == OUTCOME_NOT_JUDGED && column->kind >= COLUMN_PLOT)
            left++;
        else
            write_cell(f, column, claim);
    }
    if (left > 0)
        html_print(f, "<td colspan=\"%zu\" class=\"error-cell\">%s</td>", left,
                   member_text(claim->json, "error"));
    fputs("</tr>\n", f);
}

/* Headings of the page, for html_table_open(), or of CSV. */
static const char *headings(bool is_page, char out[512])
{
    out[0] = '\0';
    for (size_t i = 0; i < results_num_columns; i++) {
        const struct column *c = &results_columns[i];
        const char *name = is_page ? c->page : c->csv, *between = is_page ? "|" : ",";
        if (name != NULL)
            text_append(out, 512, "%s%s%s", out[0] != '\0' ? between : "",
                        is_page && column_is_number(c) ? ">" : "", name);
    }
    assert(strlen(out) < 511);
    return out;
}

static void write_csv(FILE *f, const struct claim_ref *claim, size_t num)
{
    char header[512];
    struct csv csv = csv_link_open(f, "claims.csv", headings(false, header));
    for (size_t i = 0; i < num; i++) {
        for (size_t k = 0; k < results_num_columns; k++) {
            const struct column *c = &results_columns[k];
            if (c->csv == NULL)
                continue;
            if (c->kind == COLUMN_INTERVAL)
                csv_link_interval(&csv, claim[i].json, c->key);
            else if (column_is_number(c))
                csv_link_member(&csv, claim[i].json, c->key);
            else
                csv_link_text(&csv, member_text(claim[i].json, c->key));
        }
        csv_link_line(&csv);
    }
    csv_link_close(&csv);
}

void report_table(FILE *f, const struct claim_ref *claim, size_t num, bool folded)
{
    char header[512];
    fputs("<section id=\"table\">\n<h2>The claims</h2>\n", f);
    if (folded)
        fprintf(f, "<details class=\"rows\"><summary>All %zu, row by row</summary>\n", num);
    fputs("<details class=\"help\"><summary>What the columns mean</summary>\n<p class=\"caption\">",
          f);
    for (size_t i = 0; i < results_num_columns; i++)
        if (results_columns[i].help != NULL)
            fputs(results_columns[i].help, f);
    fputs("</p></details>\n", f);
    html_table_open(f, "claims", "Table of claims", headings(true, header));
    for (size_t i = 0; i < num; i++)
        write_row(f, &claim[i]);
    html_table_close(f);
    fputs("<p class=\"caption\">What did not come out as expected comes first. The table as a "
          "file: ",
          f);
    write_csv(f, claim, num);
    fputs(folded ? "</p>\n</details>\n</section>\n" : "</p>\n</section>\n", f);
}
