#include "results_table.h"

#include "noise_results.h"
#include "stated_error_results.h"

#include "tools/base/text_table.h"
#include "tools/compare/region.h"

#include <math.h>
#include <string.h>

const struct column results_columns[] = {
    {"verdict", COLUMN_VERDICT, NULL, "Verdict", NULL,
     "A <b>verdict</b> is EQUIVALENT only where the intervals of the image and of every tile lie inside their "
     "margins, DIFFERENT where one lies outside, NO DIFFERENCE FOUND where no margin was declared and nothing stood out, "
     "and INCONCLUSIVE where there are too few samples to tell. "},
    {"scene", COLUMN_SCENE, "scene", "Scene", "scene", NULL},
    {"a", COLUMN_TESTED, "tested", "Tested", "tested", NULL},
    {"b", COLUMN_REFERENCE, "against", "Against", "against", NULL},
    {"verdict", COLUMN_TEXT, NULL, NULL, "verdict", NULL},
    {"expected", COLUMN_TEXT, NULL, "Expected", "expected", NULL},
    {"error", COLUMN_TEXT, NULL, NULL, "error", NULL},
    {"ci", COLUMN_PLOT, NULL, "In margin", NULL,
     "In the drawing the band is the margin, the line is the interval and the dot is the difference; an arrow head "
     "points to what lies outside. "},
    {"difference", COLUMN_DIFFERENCE, "difference % [interval]", "Difference %", "difference",
     "<b>Difference</b>: how much brighter (+) or darker (−) the tested image is than the reference, on average. "},
    {"ci", COLUMN_INTERVAL, NULL, "Interval %", NULL,
     "<b>Interval</b>: where the true difference lies, given the noise of both. "},
    {"mdb_global", COLUMN_PERCENT, "MDB %", "MDB %", "mdb",
     "<b>MDB</b>, the minimum detectable bias: a true difference of this size would have come out DIFFERENT with a "
     "probability of 95 %. "},
    {"margin_global", COLUMN_PERCENT, "margin %", "Margin %", "margin",
     "<b>Margin</b>: a difference up to this size counts as equal; it is declared for each scene before anything "
     "is rendered. "},
    {"alpha", COLUMN_NUMBER, NULL, NULL, "alpha", NULL},
    {"seconds_a", COLUMN_SECONDS, NULL, "Time", "seconds", NULL},
    {"verdict", COLUMN_VERDICT, "verdict", NULL, NULL, NULL},
    {"expected", COLUMN_TEXT, "expected", NULL, NULL, NULL},
    {NULL, COLUMN_MARK, "ok", NULL, NULL, NULL},
    {"ci", COLUMN_INTERVAL, NULL, NULL, "low,high", NULL},
};
enum { NUM_COLUMNS = sizeof results_columns / sizeof *results_columns };
const size_t results_num_columns = NUM_COLUMNS;

bool column_is_number(const struct column *c)
{
    return c->kind > COLUMN_PLOT;
}

/* What rounds to zero is printed as zero, never as -0.000. */
static double percent(double fraction)
{
    double v = 100 * fraction;
    return fabs(v) < 0.0005 ? 0 : v;
}

static const char *cell_text(const struct column *c, const json_t *claim, bool markdown,
                             char buffer[TEXT_TABLE_CELL])
{
    static const char *const mark[2][4] = {
        [false] = {"ERROR", "WRONG", "undecided", "ok"},
        [true] = {"**error**", "**wrong**", "**undecided**", "ok"},
    };
    enum outcome outcome = results_claim_outcome(claim);
    bool lacks_time = results_claim_lacks_time(claim);
    if (c->kind == COLUMN_MARK)
        return mark[markdown][lacks_time ? OUTCOME_UNDECIDED : outcome];
    if (c->kind == COLUMN_VERDICT && outcome == OUTCOME_NOT_JUDGED)
        return lacks_time ? "INCONCLUSIVE" : "NOT JUDGED";
    if (!column_is_number(c))
        return member_text(claim, c->key);
    if (outcome == OUTCOME_NOT_JUDGED)
        return "-";
    double v = member_number(claim, c->key);
    if (c->kind == COLUMN_DIFFERENCE)
        snprintf(buffer, TEXT_TABLE_CELL, "%+.3f [%+.3f, %+.3f]", percent(v),
                 percent(member_end(claim, "ci", 0)), percent(member_end(claim, "ci", 1)));
    else if (c->kind == COLUMN_PERCENT && v >= region_mdb_none)
        return "none";
    else if (c->kind == COLUMN_PERCENT)
        snprintf(buffer, TEXT_TABLE_CELL, "%.3f", percent(v));
    else
        snprintf(buffer, TEXT_TABLE_CELL, "%.3g", v);
    return buffer;
}

/* The claims, and the columns that have a heading in text. */
struct shown {
    const json_t *claims;
    const struct column *column[NUM_COLUMNS];
};

static const char *shown_cell(const void *of, size_t row, size_t column, bool markdown,
                              char buffer[TEXT_TABLE_CELL])
{
    const struct shown *s = of;
    return cell_text(s->column[column], json_array_get(s->claims, row), markdown, buffer);
}

static void print_claims(FILE *f, const json_t *claims, bool markdown)
{
    struct shown s = {.claims = claims};
    struct text_column heading[NUM_COLUMNS];
    struct text_table t = {heading, 0, json_array_size(claims), shown_cell, &s};
    for (size_t c = 0; c < NUM_COLUMNS; c++) {
        const struct column *column = &results_columns[c];
        bool is_number = column_is_number(column);
        if (column->text == NULL)
            continue;
        heading[t.num_columns] = (struct text_column){column->text, is_number,
                                                      !is_number && column->kind != COLUMN_MARK};
        s.column[t.num_columns++] = column;
    }
    text_table_print(f, &t, markdown);
}

static void print_errors(FILE *f, const json_t *claims, bool markdown)
{
    for (size_t i = 0; i < json_array_size(claims); i++) {
        const json_t *claim = json_array_get(claims, i);
        const char *error = member_text(claim, "error");
        size_t num = error != NULL ? results_num_with_error(claims, i) : 0;
        if (num == 0)
            continue;
        char more[32] = "";
        if (num > 1)
            snprintf(more, sizeof more, " and %zu more", num - 1);
        const char *scene = member_text(claim, "scene");
        const char *b = member_text(claim, "b");
        if (!markdown) {
            fprintf(f, "%s against %s%s: %s\n", scene, b, more, error);
            continue;
        }
        fputs("\n- ", f);
        text_table_escape(f, scene);
        fputs(" against ", f);
        text_table_escape(f, b);
        fprintf(f, "%s: ", more);
        text_table_escape(f, error);
        fputc('\n', f);
    }
}

void results_table_print(FILE *f, const json_t *results, bool markdown)
{
    const json_t *claims = json_object_get(results, "claims");
    if (json_array_size(claims) > 0)
        print_claims(f, claims, markdown);
    print_errors(f, claims, markdown);
    stated_error_print(f, json_object_get(results, "consistency"), markdown);
    noise_results_print(f, json_object_get(results, "noise"), markdown);
}
