/* results.json's schema, exit codes, verdict table and JUnit XML. Expected strings are written by
 * hand from the numbers in the claims; the JUnit file is read back by libxml2's own parser. */
#include "tools/results/results_table.h"

#include "tools/results/claim_result.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <libxml/parser.h>

static const char error_claim[] =
    "{\"scene\": \"12_furnace\", \"a\": \"pathtracer\", \"b\": \"povray\", \"title\": \"Furnace\","
    " \"expected\": \"EQUIVALENT\", \"passed\": false, \"error\": \"povray: not installed\"}";

static json_t *parse(const char *text)
{
    json_error_t error;
    json_t *v = json_loads(text, 0, &error);
    if (v == NULL)
        fail_msg("test's own JSON: %s", error.text);
    return v;
}

static json_t *judged_claim(void)
{
    json_t *v = json_load_file("tests/tools/results/claim.json", 0, NULL);
    assert_non_null(v);
    return v;
}

static json_t *results_of(size_t num, json_t **claims)
{
    json_t *root =
        parse("{\"assay\": 1, \"command\": \"assay validate\", \"version\": \"0.1\","
              " \"date\": \"2026-01-02T03:04:05Z\", \"alpha\": 1e-3, \"seconds\": 98.125,"
              " \"claims\": []}");
    for (size_t i = 0; i < num; i++)
        json_array_append_new(json_object_get(root, "claims"), claims[i]);
    return root;
}

static json_t *claim_with(const char *verdict, const char *expected)
{
    json_t *c = judged_claim();
    json_object_set_new(c, "verdict", json_string(verdict));
    json_object_set_new(c, "expected", json_string(expected));
    json_object_set_new(c, "passed", json_boolean(strcmp(verdict, expected) == 0));
    return c;
}

/* Reads `text` as results.json; it must fail with a line that has the file's name and `wanted`. */
static void expect_rejected(const char *text, const char *wanted)
{
    const char *path = test_path("results.json");
    json_t *root = NULL;
    struct err e;
    test_write(path, text, strlen(text));
    REFUSES(results_read(path, &root, &e), wanted);
    assert_ptr_equal(strstr(e.msg, path), e.msg);
    assert_null(root);
}

static void expect_root_rejected(json_t *root, const char *wanted)
{
    OWN_TEXT text = json_dumps(root, 0);
    assert_non_null(text);
    expect_rejected(text, wanted);
    json_decref(root);
}

static void expect_claim_rejected(json_t *claim, const char *wanted)
{
    expect_root_rejected(results_of(1, &claim), wanted);
}

TEST(round_trip)
{
    const char *path = test_path("new/results.json");
    json_auto_t *root = results_of(2, (json_t *[]){judged_claim(), parse(error_claim)}),
                *back = NULL;
    struct err e;
    MUST(json_write(path, root, &e));
    MUST(results_read(path, &back, &e));
    assert_true(json_equal(root, back));
    OWN_TEXT text = test_read(path);
    assert_string_equal(text + strlen(text) - 2, "}\n");
}

/* Every member that the header promises is named in an error when it is absent or of another type.
 * The wrong value is `true`, or a string for the two booleans. */
static void set(json_t *claim, const char *name, const char *json)
{
    json_error_t error;
    json_t *v = json_loads(json, JSON_DECODE_ANY, &error);
    assert_non_null(v);
    json_object_set_new(claim, name, v);
}

/* The claim without a member, or with another value there; refused with a line that says so. */
static void expect_member(const char *object, const char *member, json_t *value, const char *how)
{
    json_t *claim = judged_claim(), *owner = claim;
    char wanted[128];
    if (*object != '\0')
        owner = json_object_get(claim, object);
    if (json_is_array(owner))
        owner = json_array_get(owner, 0);
    assert_non_null(json_object_get(owner, member));
    if (value == NULL)
        json_object_del(owner, member);
    else
        json_object_set_new(owner, member, value);
    snprintf(wanted, sizeof wanted, "'%s%s%s' is %s", object, *object ? "." : "", member, how);
    expect_root_rejected(results_of(1, &claim), wanted);
}

TEST(missing_or_mistyped_member)
{
    static const char required[] =
        "scene\0a\0b\0expected\0passed\0quantity\0verdict\0reason\0alpha\0margin_global\0"
        "margin_tile\0tile\0difference\0ci\0channel_difference\0log10_p\0mdb_global\0mdb_tile\0"
        "num_tests\0worst_tile\0worst\0rms_bias\0extra_factor\0skew_limited\0tiles_x\0tiles_y\0"
        "tile_log10_p\0tile_t\0statistics\0files\0";
    static const char optional[] =
        "title\0detects\0blind_to\0class\0n_a\0n_b\0unit_b\0spp_b\0seconds_a\0seconds_b\0seed_a\0"
        "seeds_b\0version_b\0rerun\0hint\0variance_ratio\0";
    for (const char *m = required; *m != '\0'; m += strlen(m) + 1) {
        bool boolean = strcmp(m, "passed") == 0 || strcmp(m, "skew_limited") == 0;
        expect_member("", m, NULL, "missing");
        expect_member("", m, boolean ? json_string("yes") : json_true(), "not ");
    }
    for (const char *m = optional; *m != '\0'; m += strlen(m) + 1) {
        expect_member("", m, json_true(), "not ");
        const char *path = test_path("results.json");
        json_t *claim = judged_claim();
        assert_int_equal(json_object_del(claim, m), 0);
        json_auto_t *root = results_of(1, &claim), *back = NULL;
        struct err e;
        MUST(json_write(path, root, &e));
        MUST(results_read(path, &back, &e));
    }
}

TEST(nested_members)
{
    static const char *const member[][2] = {
        {"worst_tile", "x\0y\0width\0height\0difference\0ci\0t\0"},
        {"worst", "width\0height\0channel\0"},
        {"files", "a\0b\0z\0relative\0"},
        {"hint", "name\0removed\0amount\0unit\0"},
        {"variance_ratio", "ratio\0ci\0"},
        {"statistics", "name\0share\0num_tests\0log10_p\0what\0"},
    };
    for (size_t i = 0; i < COUNT(member); i++)
        for (const char *m = member[i][1]; *m != '\0'; m += strlen(m) + 1)
            expect_member(member[i][0], m, NULL, "missing");
    json_t *claim = judged_claim();
    json_array_set_new(json_object_get(claim, "statistics"), 0, json_integer(1));
    expect_claim_rejected(claim, "'statistics' has an element 0 that is not an object");
}

TEST(values_out_of_order)
{
    static const char *const bad[][3] = {
        {"ci", "[2, 1]", "'ci' is not an array of two numbers, the lower first"},
        {"ci", "[1]", "'ci' is not an array of two numbers"},
        {"channel_difference", "[1, 2]", "'channel_difference' is not an array of three numbers"},
        {"tile", "-16", "'tile' is not a whole number"},
        {"tile", "1.5", "'tile' is not a whole number"},
        {"tile", "0", "'tile' is not 1 or more"},
        {"margin_global", "-0.01", "a margin is below 0"},
        {"margin_tile", "-1", "a margin is below 0"},
        {"seeds_b", "[1, \"2\"]", "'seeds_b' is not an array of whole numbers"},
        {"tiles_x", "0", "'tiles_x' or 'tiles_y' is not from 1 to 65536"},
        {"tiles_x", "3", "'tile_log10_p' is not an array of tiles_x * tiles_y = 6 numbers"},
        {"statistics", "[]", "'statistics' is not an array with at least one"},
        {"tile_t", "[1, \"x\", 2, 3]", "'tile_t' has an element 1 that is not a number"},
        {"verdict", "\"SAME\"", "'verdict' is unknown: 'SAME'"},
        {"expected", "\"SAME\"", "'expected' is unknown"},
        {"verdict", "\"DIFFERENT\"", "'passed' contradicts 'verdict' and 'expected'"},
        {"passed", "false", "'passed' contradicts 'verdict' and 'expected'"},
    };
    for (size_t i = 0; i < COUNT(bad); i++) {
        json_t *claim = judged_claim();
        set(claim, bad[i][0], bad[i][1]);
        expect_claim_rejected(claim, bad[i][2]);
    }
    json_t *claim = judged_claim();
    set(json_object_get(claim, "worst"), "channel", "4");
    expect_claim_rejected(claim, "'worst.channel' is not from 0 to 3");

    claim = parse(error_claim);
    set(claim, "passed", "true");
    expect_claim_rejected(claim, "claim 1 (12_furnace against povray): has an 'error' and yet");
    expect_claim_rejected(json_string("x"), "claim 1 (? against ?): not an object");

    /* An error and a verdict: only for want of time. */
    claim = parse(error_claim);
    set(claim, "verdict", "\"DIFFERENT\"");
    expect_claim_rejected(claim, "has an 'error' and yet a 'verdict' that is not INCONCLUSIVE");
    claim = judged_claim();
    set(claim, "looks", "[{\"n_a\": 1, \"n_b\": 1, \"alpha\": 0.1, \"stage\": 1}]");
    expect_claim_rejected(claim, "'looks.verdict' is missing");
    claim = judged_claim();
    set(claim, "cost_s", "{\"a\": 1}");
    expect_claim_rejected(claim, "'cost_s.b' is missing");
}

TEST(bad_file)
{
    /* JSON has no NaN and no infinity; a writer that prints them is found out at the line. */
    expect_rejected("{\n \"assay\": 1,\n \"alpha\": NaN\n}", ":3: invalid token near 'NaN'");
    expect_rejected("{\"alpha\": 1e999}", ":1: ");
    expect_rejected("{\"alpha\": 1, \"alpha\": 2}", ":1: duplicate object key");
    expect_rejected("", ":1: ");
    expect_rejected("[]", "not an object");

    json_auto_t *root = results_of(1, (json_t *[]){judged_claim()});
    set(root, "assay", "2");
    expect_root_rejected(root, "'assay' is not 1");
    root = results_of(1, (json_t *[]){judged_claim()});
    json_object_del(root, "alpha");
    expect_root_rejected(root, "'alpha' is missing");
    root = results_of(1, (json_t *[]){judged_claim()});
    json_object_del(root, "claims");
    expect_root_rejected(root, "'claims' is not an array with at least one claim");
    expect_root_rejected(results_of(0, NULL), "'claims' is not an array with at least one claim");
    root = results_of(0, NULL);
    set(root, "consistency", "[]");
    expect_root_rejected(root, "'claims' is not an array with at least one claim");

    json_t *out = NULL;
    struct err e = {""};
    REFUSES(results_read("/nonexistent/results.json", &out, &e), "/nonexistent/results.json");

    root = json_object();
    REFUSES(json_write("/proc/no/results.json", root, &e), "/proc/no");
}

/* NO DIFFERENCE FOUND passes if the MDBs of the image and of a tile are at most the accepted ones; the fixture's are
 * 0.7 % and 9 %. */
TEST(accepted_mdb)
{
    static const struct {
        const char *accepted;
        bool passes;
    } row[] = {{"[0.007, 0.09]", true},
               {"[0.0069, 0.09]", false},
               {"[0.007, 0.089]", false},
               {NULL, false}};
    for (size_t i = 0; i < COUNT(row); i++)
        for (int passed = 0; passed < 2; passed++) {
            json_t *claim = claim_with("NO DIFFERENCE FOUND", "NO DIFFERENCE FOUND");
            set(claim, "mdb_global", "0.007");
            set(claim, "mdb_tile", "0.09");
            set(claim, "passed", passed ? "true" : "false");
            if (row[i].accepted != NULL)
                set(claim, "accept_mdb", row[i].accepted);
            if (passed != row[i].passes) {
                expect_claim_rejected(claim, "'passed' contradicts 'verdict' and 'expected'");
                continue;
            }
            json_auto_t *root = results_of(1, &claim), *out;
            struct err e;
            OWN_TEXT text = json_dumps(root, 0);
            test_write(test_path("results.json"), text, strlen(text));
            MUST(results_read(test_path("results.json"), &out, &e));
            assert_int_equal(results_exit_code(out), passed ? 0 : 2);
        }
}

TEST(exit_codes)
{
    static const struct {
        const char *verdict[3],
            *expected[3]; /* verdict NULL: not judged; expected NULL: no claim */
        int code;
    } row[] = {
        {{"EQUIVALENT"}, {"EQUIVALENT"}, 0},
        {{"DIFFERENT"}, {"DIFFERENT"}, 0},
        {{"DIFFERENT"}, {"EQUIVALENT"}, 1},
        {{"EQUIVALENT"}, {"DIFFERENT"}, 1},
        {{"INCONCLUSIVE"}, {"EQUIVALENT"}, 2},
        {{"INCONCLUSIVE"}, {"DIFFERENT"}, 2},
        {{"NO DIFFERENCE FOUND"}, {"EQUIVALENT"}, 2},
        {{"NO DIFFERENCE FOUND"}, {"DIFFERENT"}, 2},
        {{"DIFFERENT"}, {"NO DIFFERENCE FOUND"}, 1},
        {{NULL}, {"EQUIVALENT"}, 3},
        {{"EQUIVALENT", "DIFFERENT", "EQUIVALENT"}, {"EQUIVALENT", "DIFFERENT", "EQUIVALENT"}, 0},
        {{"EQUIVALENT", "INCONCLUSIVE", "DIFFERENT"},
         {"EQUIVALENT", "EQUIVALENT", "EQUIVALENT"},
         1},
        {{"EQUIVALENT", "INCONCLUSIVE"}, {"EQUIVALENT", "EQUIVALENT"}, 2},
        {{"DIFFERENT", NULL, "EQUIVALENT"}, {"EQUIVALENT", "EQUIVALENT", "EQUIVALENT"}, 3},
        {{NULL}, {NULL}, 3},
    };
    for (size_t i = 0; i < COUNT(row); i++) {
        json_t *claim[3];
        size_t num = 0;
        for (; num < 3 && row[i].expected[num] != NULL; num++)
            claim[num] = row[i].verdict[num] == NULL
                             ? parse(error_claim)
                             : claim_with(row[i].verdict[num], row[i].expected[num]);
        json_auto_t *root = results_of(num, claim);
        if (results_exit_code(root) != row[i].code)
            fail_msg("row %zu: %d, not %d", i, results_exit_code(root), row[i].code);
    }
    /* Without time it is inconclusive: worse than a pass, better than a difference. */
    json_t *late = parse(error_claim);
    set(late, "verdict", "\"INCONCLUSIVE\"");
    json_t *root = results_of(2, (json_t *[]){judged_claim(), late});
    assert_int_equal(results_exit_code(root), 2);
    json_array_append_new(json_object_get(root, "claims"), claim_with("DIFFERENT", "EQUIVALENT"));
    assert_int_equal(results_exit_code(root), 1);
    json_decref(root);
    /* Nothing but a claim of consistency. */
    root = results_of(0, NULL);
    set(root, "consistency", "[{\"verdict\": \"EQUIVALENT\", \"passed\": true}]");
    assert_int_equal(results_exit_code(root), 0);
    set(root, "consistency", "[{\"verdict\": \"DIFFERENT\"}]");
    assert_int_equal(results_exit_code(root), 1);
    json_decref(root);
}

/* Claims that need every width rule: a scene name with a two-byte letter, a value that rounds to zero from
 * below, a large one, one that no test covers, and two without numbers, for one reason. */
static json_t *table_results(void)
{
    json_t *a = claim_with("EQUIVALENT", "EQUIVALENT");
    json_t *b = claim_with("DIFFERENT", "DIFFERENT");
    set(b, "scene", "\"91_l\\u00e4ngs\"");
    set(b, "b", "\"truth\"");
    set(b, "difference", "-0.25");
    set(b, "ci", "[-0.26, -0.2399]");
    set(b, "mdb_global", "0.0123");
    set(b, "margin_global", "0.02");
    json_t *c = claim_with("INCONCLUSIVE", "EQUIVALENT");
    set(c, "scene", "\"a|b\"");
    set(c, "difference", "-0.000001");
    set(c, "ci", "[-0.5, 0.5]");
    set(c, "mdb_global", "1.25");
    json_t *d = claim_with("NO DIFFERENCE FOUND", "EQUIVALENT");
    set(d, "mdb_global", "1e6");
    json_t *again = parse(error_claim);
    set(again, "scene", "\"23\"");
    return results_of(6, (json_t *[]){a, b, c, d, parse(error_claim), again});
}

/* Widths by the rule: 10, 10, 7, 26, 7, 8, 19, 10 columns, two spaces between. */
TEST(tables)
{
    json_auto_t *root = table_results();
    OWN_TEXT text = NULL;
    OWN_TEXT wanted = test_read("tests/tools/results/tables.expected");
    PRINTED(text, results_table_print(f, root, false), results_table_print(f, root, true));
    assert_string_equal(text, wanted);
}

static size_t count_children(const xmlNode *parent, const char *name)
{
    size_t n = 0;
    for (const xmlNode *c = parent->children; c != NULL; c = c->next)
        n += c->type == XML_ELEMENT_NODE && strcmp((const char *)c->name, name) == 0;
    return n;
}

static void assert_attribute(xmlNode *node, const char *name, const char *wanted)
{
    assert_non_null(node);
    xmlChar *v = xmlGetProp(node, BAD_CAST name);
    assert_non_null(v);
    assert_string_equal((const char *)v, wanted);
    xmlFree(v);
}

static xmlNode *child(xmlNode *parent, const char *name, size_t index)
{
    for (xmlNode *c = parent->children; c != NULL; c = c->next)
        if (c->type == XML_ELEMENT_NODE && strcmp((const char *)c->name, name) == 0 && index-- == 0)
            return c;
    fail_msg("no <%s>", name);
    return NULL;
}

TEST(junit_reads_back)
{
    static const char nasty[] = "<b> & \"q\" 'a' ]]> \xc3\xbc \xe6\x97\xa5";
    json_t *wrong = claim_with("DIFFERENT", "EQUIVALENT");
    json_object_set_new(wrong, "scene", json_string(nasty));
    json_object_set_new(wrong, "reason", json_string(nasty));
    json_t *error = parse(error_claim);
    /* An escape and U+FFFF, which no XML 1.0 file may hold. */
    json_object_set_new(error, "error", json_string("\x1b[31m died: \"x<y\" \xef\xbf\xbf."));
    json_auto_t *root =
        results_of(4, (json_t *[]){claim_with("EQUIVALENT", "EQUIVALENT"), wrong,
                                   claim_with("INCONCLUSIVE", "EQUIVALENT"), error});
    const char *path = test_path("deep/er/junit.xml");
    struct err e;
    MUST(junit_write(path, root, &e));

    xmlDoc *doc = xmlReadFile(path, NULL, XML_PARSE_NONET | XML_PARSE_NOERROR);
    assert_non_null(doc);
    xmlNode *suite = xmlDocGetRootElement(doc);
    assert_string_equal((const char *)suite->name, "testsuite");
    assert_attribute(suite, "tests", "4");
    assert_attribute(suite, "failures", "2");
    assert_attribute(suite, "errors", "1");
    assert_attribute(suite, "time", "98.125");
    assert_attribute(suite, "timestamp", "2026-01-02T03:04:05");
    assert_attribute(suite, "hostname", "localhost");
    assert_int_equal(count_children(suite, "testcase"), 4);
    /* The order that Ant's schema asks for, and no output within a test. */
    xmlNode *first = xmlFirstElementChild(suite), *last = xmlLastElementChild(suite);
    assert_string_equal((const char *)first->name, "properties");
    assert_string_equal((const char *)last->name, "system-err");
    xmlNode *said = xmlPreviousElementSibling(last);
    assert_string_equal((const char *)said->name, "system-out");
    xmlChar *output = xmlNodeGetContent(said);
    assert_non_null(
        strstr((const char *)output, "41_cornell: pathtracer against cycles: mean: difference "));
    assert_null(
        strchr(strchr((const char *)output, '\n') + 1, '\n')); /* of the one that is as expected */
    xmlFree(output);
    for (int i = 0; i < 4; i++)
        assert_int_equal(count_children(child(suite, "testcase", i), "system-out"), 0);

    xmlNode *test = child(suite, "testcase", 0);
    assert_attribute(test, "classname", "41_cornell");
    assert_attribute(test, "name", "pathtracer against cycles: mean");
    assert_attribute(test, "time", "1.500");
    assert_int_equal(count_children(test, "failure") + count_children(test, "error"), 0);

    test = child(suite, "testcase", 1);
    assert_attribute(test, "classname", nasty);
    assert_int_equal(count_children(test, "failure"), 1);
    xmlNode *failure = child(test, "failure", 0);
    assert_attribute(failure, "type", "DIFFERENT");
    assert_attribute(failure, "message", "DIFFERENT, expected EQUIVALENT");
    xmlChar *text = xmlNodeGetContent(failure);
    assert_int_equal(strncmp((const char *)text, nasty, strlen(nasty)), 0);
    assert_non_null(strstr((const char *)text, "difference +0.0300 % [-0.1000, +0.2000]"));
    xmlFree(text);

    assert_attribute(child(child(suite, "testcase", 2), "failure", 0), "type", "INCONCLUSIVE");
    test = child(suite, "testcase", 3);
    assert_int_equal(count_children(test, "failure"), 0);
    assert_attribute(child(test, "error", 0), "message", "?[31m died: \"x<y\" ???.");
    xmlFreeDoc(doc);
}

/* A file name in Latin-1, say. */
TEST(an_argument_that_is_no_utf8_is_named)
{
    struct err e = {""};
    char *argv[] = {"compare",
                    "k\xfc"
                    "che.exr",
                    "b.exr", NULL};
    assert_null(claim_result_new_results(3, argv, 0.01, &e));
    assert_string_equal(e.msg, "argument 'k\xfc"
                               "che.exr' is no UTF-8, and results hold nothing else");
    argv[1] = "k\xc3\xbc"
              "che.exr";
    json_auto_t *root = claim_result_new_results(3, argv, 0.01, &e);
    assert_non_null(root);
}

static int clean_parser(void **state)
{
    (void)state;
    xmlCleanupParser();
    return 0;
}

TEST_GROUP(NULL, clean_parser)
