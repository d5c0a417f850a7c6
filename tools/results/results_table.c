#include "results.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    SCENE,
    TESTED,
    AGAINST,
    DIFFERENCE,
    MDB,
    MARGIN,
    VERDICT,
    EXPECTED,
    MARK,
    NUM_COLUMNS,
    FIRST_OF_OURS = DIFFERENCE /* the columns before hold text that is not ours */
};

static const char *const heading[NUM_COLUMNS] = {
    "scene",   "tested",   "against", "difference % [interval]", "MDB %", "margin %",
    "verdict", "expected", "ok"};
static const bool right_aligned[NUM_COLUMNS] = {[DIFFERENCE] = true, [MDB] = true, [MARGIN] = true};

struct row {
    /* borrowed from the claim, a literal, or one of the three below */
    const char *cell[NUM_COLUMNS];
    char difference[96], mdb[32], margin[32];
};

/* What rounds to zero is printed as zero, never as -0.000. */
static double percent(const json_t *fraction)
{
    double v = 100 * json_number_value(fraction);
    return fabs(v) < 0.0005 ? 0 : v;
}

static void fill_row(struct row *r, const json_t *claim, bool markdown)
{
    static const char *const mark[2][4] = {
        [false] = {"ERROR", "WRONG", "WRONG", "ok"},
        [true] = {"**error**", "**wrong**", "**wrong**", "ok"},
    };
    enum outcome outcome = results_claim_outcome(claim);
    r->cell[SCENE] = member_text(claim, "scene");
    r->cell[TESTED] = member_text(claim, "a");
    r->cell[AGAINST] = member_text(claim, "b");
    r->cell[EXPECTED] = member_text(claim, "expected");
    r->cell[MARK] = mark[markdown][results_claim_lacks_time(claim) ? OUTCOME_UNDECIDED : outcome];
    if (outcome == OUTCOME_NOT_JUDGED) {
        r->cell[DIFFERENCE] = r->cell[MDB] = r->cell[MARGIN] = "-";
        r->cell[VERDICT] = results_claim_lacks_time(claim) ? "INCONCLUSIVE" : "NOT JUDGED";
        return;
    }
    const json_t *ci = json_object_get(claim, "ci");
    snprintf(r->difference, sizeof r->difference, "%+.3f [%+.3f, %+.3f]",
             percent(json_object_get(claim, "difference")), percent(json_array_get(ci, 0)),
             percent(json_array_get(ci, 1)));
    snprintf(r->mdb, sizeof r->mdb, "%.3f", percent(json_object_get(claim, "mdb_global")));
    snprintf(r->margin, sizeof r->margin, "%.3f", percent(json_object_get(claim, "margin_global")));
    r->cell[DIFFERENCE] = r->difference;
    r->cell[MDB] = r->mdb;
    r->cell[MARGIN] = r->margin;
    r->cell[VERDICT] = member_text(claim, "verdict");
}

/* Columns that UTF-8 text fills, taking each code point as one column wide. */
static size_t text_columns(const char *s)
{
    size_t n = 0;
    for (; *s != '\0'; s++)
        n += ((unsigned char)*s & 0xc0) != 0x80;
    return n;
}

static void print_padded(FILE *f, const char *s, size_t width, bool right)
{
    int gap = (int)(width - text_columns(s));
    fprintf(f, "%*s%s%*s", right ? gap : 0, "", s, right ? 0 : gap, "");
}

static void print_terminal(FILE *f, const json_t *claims)
{
    struct row row;
    size_t width[NUM_COLUMNS], num = json_array_size(claims);
    for (size_t c = 0; c < NUM_COLUMNS; c++)
        width[c] = text_columns(heading[c]);
    for (size_t r = 0; r < num; r++) {
        fill_row(&row, json_array_get(claims, r), false);
        for (size_t c = 0; c < NUM_COLUMNS; c++) {
            size_t w = text_columns(row.cell[c]);
            width[c] = w > width[c] ? w : width[c];
        }
    }
    for (size_t r = 0; r <= num; r++) {
        if (r > 0)
            fill_row(&row, json_array_get(claims, r - 1), false);
        const char *const *cell = r == 0 ? heading : row.cell;
        for (size_t c = 0; c + 1 < NUM_COLUMNS; c++) {
            print_padded(f, cell[c], width[c], right_aligned[c]);
            fputs("  ", f);
        }
        fprintf(f, "%s\n", cell[NUM_COLUMNS - 1]);
    }
}

/* A backslash or a character reference for what would end the cell or start markup. */
static void print_markdown_text(FILE *f, const char *s)
{
    for (; *s != '\0'; s++) {
        if (*s == '\n' || *s == '\r')
            fputc(' ', f);
        else if (*s == '<')
            fputs("&lt;", f);
        else if (*s == '&')
            fputs("&amp;", f);
        else if (strchr("|\\`*_[]", *s) != NULL)
            fprintf(f, "\\%c", *s);
        else
            fputc(*s, f);
    }
}

static void print_markdown(FILE *f, const json_t *claims)
{
    struct row row;
    for (size_t c = 0; c < NUM_COLUMNS; c++)
        fprintf(f, "| %s ", heading[c]);
    fputs("|\n", f);
    for (size_t c = 0; c < NUM_COLUMNS; c++)
        fputs(right_aligned[c] ? "|--:" : "|---", f);
    fputs("|\n", f);
    for (size_t r = 0; r < json_array_size(claims); r++) {
        fill_row(&row, json_array_get(claims, r), true);
        for (size_t c = 0; c < NUM_COLUMNS; c++) {
            fputs("| ", f);
            if (c < FIRST_OF_OURS)
                print_markdown_text(f, row.cell[c]);
            else
                fputs(row.cell[c], f);
            fputc(' ', f);
        }
        fputs("|\n", f);
    }
}

static void print_errors(FILE *f, const json_t *claims, bool markdown)
{
    for (size_t i = 0; i < json_array_size(claims); i++) {
        const json_t *claim = json_array_get(claims, i);
        const char *error = member_text(claim, "error");
        if (error == NULL)
            continue;
        const char *scene = member_text(claim, "scene");
        const char *b = member_text(claim, "b");
        if (!markdown) {
            fprintf(f, "%s against %s: %s\n", scene, b, error);
            continue;
        }
        fputs("\n- ", f);
        print_markdown_text(f, scene);
        fputs(" against ", f);
        print_markdown_text(f, b);
        fputs(": ", f);
        print_markdown_text(f, error);
        fputc('\n', f);
    }
}

void results_table_print(FILE *f, const json_t *results, bool markdown)
{
    const json_t *claims = json_object_get(results, "claims");
    if (markdown)
        print_markdown(f, claims);
    else
        print_terminal(f, claims);
    print_errors(f, claims, markdown);
}
