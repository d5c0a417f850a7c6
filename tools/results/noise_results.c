#include "noise_results.h"

#include "json_shape.h"
#include "reference/suite/suite.h"
#include "tools/base/text.h"

#include <string.h>

static const struct shape row_shape = {.names = {[IS_TEXT] = "scene engine error?"}};
static const struct shape tile_shape = {.names = {[IS_ESTIMATE] = "variance", [IS_COUNT] = "x y"}};
static const struct shape rung_shape = {.names = {[IS_ESTIMATE] = "variance", [IS_COUNT] = "spp"}};
static const struct shape measured_shape = {
    .names = {[IS_NUMBER] = "alpha slope_margin?",
              [IS_ESTIMATE] = "variance slope? efficiency?",
              [IS_VERDICT] = "verdict"},
    .part = {{"worst_tile", &tile_shape, PART_OBJECT}, {"rungs", &rung_shape, PART_LIST_OF_1}}};
static const struct shape stated_shape = {
    .names = {[IS_NUMBER] = "margin", [IS_ESTIMATE] = "ratio", [IS_VERDICT] = "ratio_verdict"}};
static const struct shape tile_claim_shape = {.names = {[IS_NUMBER] = "margin",
                                                        [IS_ESTIMATE] = "ratio",
                                                        [IS_COUNT] = "x y",
                                                        [IS_VERDICT] = "ratio_verdict"}};
static const struct shape judged_shape = {.names = {[IS_TEXT] = "against reason",
                                                    [IS_NUMBER] = "seconds margin",
                                                    [IS_ESTIMATE] = "ratio",
                                                    [IS_VERDICT] = "ratio_verdict"},
                                          .part = {{"tile_claim?", &tile_claim_shape, PART_OBJECT},
                                                   {"stated?", &stated_shape, PART_OBJECT}}};

static bool check_one(const json_t *j, const char *where, struct err *e)
{
    const char *verdict = member_text(j, "verdict");
    if (!json_shape_check(j, &row_shape, where, e))
        return false;
    if (member_text(j, "not_stored") != NULL)
        return (json_is_true(json_object_get(j, "passed")) && verdict == NULL) ||
               err_set(e, "%s: is not stored and yet has a 'verdict'", where);
    return json_shape_check_row(j, &measured_shape, where, e) &&
           (verdict == NULL || strcmp(verdict, json_shape_measured) == 0 ||
            member_text(j, "error") != NULL || json_shape_check(j, &judged_shape, where, e));
}

bool noise_results_check(const json_t *noise, const char *path, struct err *e)
{
    if (!json_is_array(noise))
        return err_set(e, "%s: 'noise' is not an array", path);
    for (size_t i = 0; i < json_array_size(noise); i++) {
        char where[512];
        snprintf(where, sizeof where, "%.400s: noise %zu", path, i + 1);
        if (!check_one(json_array_get(noise, i), where, e))
            return false;
    }
    return true;
}

json_t *noise_results_claims(const json_t *noise)
{
    json_t *claims = json_array();
    json_each(row, noise) {
        const char *against = member_text(row, "against");
        if (against == NULL && member_text(row, "error") == NULL)
            continue;
        json_t *c =
            json_pack("{ss,ss,ss,ss,ss,sO,ss*,ss*,ss*,sf}", "scene", member_text(row, "scene"), "a",
                      member_text(row, "engine"), "b", against != NULL ? against : "record",
                      "quantity", "variance", "expected", verdict_name(VERDICT_EQUIVALENT),
                      "passed", json_object_get(row, "passed"), "verdict",
                      member_text(row, "verdict"), "reason", member_text(row, "reason"), "error",
                      member_text(row, "error"), "seconds_a", member_number(row, "seconds"));
        if (json_array_size(json_object_get(row, "ratio_ci")) == 2) {
            json_object_set_new(c, "difference", json_real(member_number(row, "ratio") - 1));
            json_object_set_new(c, "ci",
                                json_pack("[f,f]", member_end(row, "ratio_ci", 0) - 1,
                                          member_end(row, "ratio_ci", 1) - 1));
            json_object_set(c, "alpha", json_object_get(row, "alpha"));
        }
        json_array_append_new(claims, c);
    }
    return claims;
}

static void print_estimate(char text[TEXT_TABLE_CELL], const json_t *j, const char *name,
                           const char *format, const char *format_ci)
{
    char ci[32];
    snprintf(ci, sizeof ci, "%s_ci", name);
    if (json_object_get(j, name) == NULL)
        return;
    text_append(text, TEXT_TABLE_CELL, format, member_number(j, name));
    if (json_array_size(json_object_get(j, ci)) == 2)
        text_append(text, TEXT_TABLE_CELL, format_ci, member_end(j, ci, 0), member_end(j, ci, 1));
}

static void print_variance(char text[TEXT_TABLE_CELL], const json_t *j)
{
    if (member_number(j, "variance") > 0 && json_is_null(json_object_get(j, "variance_ci")))
        snprintf(text, TEXT_TABLE_CELL, "%.2g", member_number(j, "variance"));
    else
        print_estimate(text, j, "variance", "%.4g", " [%.4g, %.4g]");
}

/* "record: 1.002 [0.97, 1.03], margin 0.1; tile 48,16: ...", the tile where it differs. */
static void print_against(char text[TEXT_TABLE_CELL], const json_t *row)
{
    const json_t *tile = json_object_get(row, "tile_claim"), *of[2] = {row, tile};
    if (member_text(row, "against") == NULL)
        return;
    bool differs = tile != NULL &&
                   strcmp(member_text(tile, "ratio_verdict"), verdict_name(VERDICT_DIFFERENT)) == 0;
    for (int i = 0; i < 1 + differs; i++) {
        if (i == 0)
            snprintf(text, TEXT_TABLE_CELL, "%s: ", member_text(row, "against"));
        else
            text_append(text, TEXT_TABLE_CELL, "; tile %.0f,%.0f: ", member_number(tile, "x"),
                        member_number(tile, "y"));
        print_estimate(text, of[i], "ratio", "%.3g", " [%.3g, %.3g]");
        text_append(text, TEXT_TABLE_CELL, ", margin %.3g", member_number(of[i], "margin"));
    }
}

void noise_results_cell(const json_t *row, size_t column, char text[TEXT_TABLE_CELL])
{
    const char *verdict = member_text(row, "verdict"), *error = member_text(row, "error");
    text[0] = '\0';
    switch (column) {
    case 0: snprintf(text, TEXT_TABLE_CELL, "%s", member_text(row, "scene")); break;
    case 1: snprintf(text, TEXT_TABLE_CELL, "%s", member_text(row, "engine")); break;
    case 2:
        if (json_object_get(row, "variance") != NULL)
            print_variance(text, row);
        break;
    case 3:
        if (json_object_get(row, "worst_tile") != NULL)
            print_variance(text, json_object_get(row, "worst_tile"));
        break;
    case 4: print_against(text, row); break;
    case 5: print_estimate(text, row, "slope", "%.3f", " [%.3f, %.3f]"); break;
    case 6: print_estimate(text, row, "efficiency", "%.3g", " [%.3g, %.3g]"); break;
    default:
        if (member_text(row, "not_stored") != NULL)
            snprintf(text, TEXT_TABLE_CELL, "%s", member_text(row, "not_stored"));
        else if (error != NULL)
            snprintf(text, TEXT_TABLE_CELL, "%s: %s", verdict != NULL ? verdict : "NOT JUDGED",
                     error);
        else
            snprintf(text, TEXT_TABLE_CELL, "%s", verdict);
        break;
    }
}

/* The reasons of the rows that did not pass. */
static void print_reasons(FILE *f, const json_t *noise)
{
    json_each(row, noise) {
        if (!json_is_true(json_object_get(row, "passed")) && member_text(row, "reason") != NULL)
            fprintf(f, "\n%s, noise of %s: %s\n", member_text(row, "scene"),
                    member_text(row, "engine"), member_text(row, "reason"));
    }
}

static const char *cell_of(const void *noise, size_t row, size_t column, bool markdown,
                           char buffer[TEXT_TABLE_CELL])
{
    (void)markdown;
    noise_results_cell(json_array_get(noise, row), column, buffer);
    return buffer;
}

void noise_results_print(FILE *f, const json_t *noise, bool markdown)
{
    static const char *const headings[NOISE_COLUMNS] = {
        "scene",        "engine", "variance of a sample", "of the noisiest tile",
        "over that of", "slope",  "efficiency",           "verdict"};
    struct text_column column[NOISE_COLUMNS];
    const struct text_table t = {column, NOISE_COLUMNS, json_array_size(noise), cell_of, noise};
    for (size_t c = 0; c < NOISE_COLUMNS; c++)
        column[c] = (struct text_column){.heading = headings[c]};
    if (t.num_rows == 0)
        return;
    fputc('\n', f);
    text_table_print(f, &t, markdown);
    print_reasons(f, noise);
}
