/* "noise" of results.json: what is refused, how rows come out, and what lists of claims have of them. */
#include "tools/results/noise_results.h"
#include "tests/support/test.h"

static const char good[] =
    "[{'scene': '41_cornell', 'engine': 'pathtracer', 'alpha': 1e-6, 'verdict': 'DIFFERENT', 'passed': false,"
    "  'reason': 'more', 'seconds': 3, 'against': 'record', 'ratio': 1.5, 'ratio_ci': [1.4, 1.6], 'margin': 0.1,"
    "  'ratio_verdict': 'DIFFERENT', 'variance': 0.9, 'variance_ci': [0.8, 1.0],"
    "  'worst_tile': {'x': 16, 'y': 0, 'variance': 3, 'variance_ci': null}, 'slope': -0.5, 'slope_ci': [-0.51, -0.49],"
    "  'slope_verdict': 'EQUIVALENT', 'slope_margin': 0.1, 'rungs': [{'spp': 1, 'variance': 0.9, 'variance_ci': null}],"
    "  'tile_claim': {'x': 0, 'y': 32, 'ratio': 2, 'ratio_ci': [1.7, 2.4], 'margin': 0.3, 'ratio_verdict': 'DIFFERENT'}},"
    " {'scene': '41_cornell', 'engine': 'cycles', 'alpha': 1e-6, 'verdict': 'MEASURED', 'passed': true, 'variance': 0.7,"
    "  'variance_ci': [0.5, 0.9], 'worst_tile': {'x': 0, 'y': 0, 'variance': 1, 'variance_ci': null},"
    "  'rungs': [{'spp': 1, 'variance': 0.7, 'variance_ci': null}]},"
    " {'scene': '41_cornell', 'engine': 'povray', 'passed': true, 'not_stored': 'not stored'},"
    " {'scene': '46_sky', 'engine': 'pathtracer', 'passed': false, 'error': 'no record'}]";

/* With every `from` made `to`, as JSON. */
static json_t *load(const char *from, const char *to)
{
    char text[4096] = "";
    const char *s = good;
    json_error_t why;
    while (*s != '\0') {
        bool here = from[0] != '\0' && strncmp(s, from, strlen(from)) == 0;
        size_t n = strlen(text);
        snprintf(text + n, sizeof text - n, "%.*s", here ? (int)strlen(to) : 1, here ? to : s);
        s += here ? strlen(from) : 1;
    }
    for (char *c = text; *c != '\0'; c++)
        *c = *c == '\'' ? '"' : *c;
    json_t *noise = json_loads(text, 0, &why);
    if (noise == NULL)
        fail_msg("%s: %s", why.text, text);
    return noise;
}

TEST(rows_come_out_as_they_say)
{
    static const enum outcome outcome[] = {OUTCOME_OPPOSITE, OUTCOME_AS_EXPECTED,
                                           OUTCOME_AS_EXPECTED, OUTCOME_NOT_JUDGED};
    struct err e;
    char text[TEXT_TABLE_CELL];
    json_auto_t *noise = load("", ""), *claims = noise_results_claims(noise);
    MUST(noise_results_check(noise, "x.json", &e));
    for (size_t i = 0; i < COUNT(outcome); i++)
        assert_int_equal(results_row_outcome(json_array_get(noise, i)), outcome[i]);
    noise_results_cell(json_array_get(noise, 0), 4, text);
    assert_string_equal(text,
                        "record: 1.5 [1.4, 1.6], margin 0.1; tile 0,32: 2 [1.7, 2.4], margin 0.3");
    noise_results_cell(json_array_get(noise, 2), NOISE_COLUMNS - 1, text);
    assert_string_equal(text, "not stored");
    /* Ours alone are claims. */
    assert_int_equal(json_array_size(claims), 2);
    assert_near(member_number(json_array_get(claims, 0), "difference"), 0.5, 1e-12);
    assert_int_equal(results_claim_outcome(json_array_get(claims, 0)), OUTCOME_OPPOSITE);
    assert_int_equal(results_claim_outcome(json_array_get(claims, 1)), OUTCOME_NOT_JUDGED);
}

TEST(what_is_broken_is_refused)
{
    static const struct {
        const char *from, *to, *line;
    } broken[] = {
        {"'verdict': 'DIFFERENT', 'passed': false", "'verdict': 'DIFFERENT', 'passed': true",
         "contradicts"},
        {"'verdict': 'MEASURED', 'passed': true", "'verdict': 'MEASURED', 'passed': false",
         "'passed' contradicts 'verdict'"},
        {"'passed': false, 'error'", "'passed': true, 'error'", "and yet 'passed'"},
        {"'variance_ci': [0.8, 1.0]", "'variance_ci': [1.0, 0.8]", "'variance_ci' is neither"},
        {"'x': 16", "'x': 1.5", "'worst_tile.x' is not a whole number"},
        {"'ratio': 1.5,", "", "'ratio' is missing"},
        {"'margin': 0.1", "'margin': 'much'", "'margin' is not"},
        {"'rungs': [{'spp': 1, 'variance': 0.9, 'variance_ci': null}]", "'rungs': []",
         "'rungs' is not"},
        {"'against': 'record',", "", "'against' is missing"},
        {"'engine': 'povray', ", "", "'engine' is missing"},
    };
    for (size_t i = 0; i < COUNT(broken); i++) {
        struct err e;
        json_auto_t *noise = load(broken[i].from, broken[i].to);
        REFUSES(noise_results_check(noise, "x.json", &e), broken[i].line);
    }
}
