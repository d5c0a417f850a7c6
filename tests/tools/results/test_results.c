/* results.json's schema, exit codes, verdict table and JUnit XML. Expected strings are written by
 * hand from the numbers in the claims; the JUnit file is read back by libxml2's own parser. */
#include "tools/results/results_table.h"

#include "renderer/base/fs.h"
#include "tools/results/claim_result.h"
#include "tests/support/test.h"

#include <libxml/parser.h>

static const char judged_claim[] =
    "{\"scene\": \"41_cornell\", \"title\": \"Cornell box\", \"detects\": \"colour bleeding\","
    " \"blind_to\": \"glass\", \"quantity\": \"mean\", \"a\": \"pathtracer\", \"b\": \"cycles\","
    " \"class\": \"exact\", \"alpha\": 1e-4, \"margin_global\": 0.005, \"margin_tile\": 0.02,"
    " \"tile\": 16, \"expected\": \"EQUIVALENT\", \"verdict\": \"EQUIVALENT\", \"passed\": true,"
    " \"reason\": \"inside\", \"difference\": 0.0003, \"ci\": [-0.001, 0.002],"
    " \"channel_difference\": [0.0001, 0.0002, 0.0003], \"log10_p\": -0.3, \"mdb_global\": 0.004,"
    " \"mdb_tile\": 0.03, \"num_tests\": 123,"
    " \"worst_tile\": {\"x\": 16, \"y\": 0, \"difference\": 0.01, \"ci\": [0, 0.02], \"t\": 2.5},"
    " \"worst\": {\"x\": 0, \"y\": 0, \"width\": 2, \"height\": 2, \"channel\": 1,"
    "             \"difference\": 0.1, \"ci\": [-0.1, 0.3], \"t\": 3},"
    " \"rms_bias\": 0.001, \"extra_factor\": 1, \"skew_limited\": false,"
    " \"tiles_x\": 2, \"tiles_y\": 1, \"tile_log10_p\": [-0.1, null], \"tile_t\": [0.5, null],"
    " \"statistics\": [{\"name\": \"image\", \"share\": 0.28, \"num_tests\": 4, \"log10_p\": -0.1,"
    "   \"what\": \"the image (red)\"}],"
    " \"direction\": {\"name\": \"shift by x\", \"explained\": 0.9, \"amount\": 0.5, \"ci\": [0.4, 0.6],"
    "   \"unit\": \"px\"}, \"variance_ratio\": {\"ratio\": 1.9, \"ci\": [1.8, 2]},"
    " \"n_a\": 2048, \"n_b\": 16, \"unit_b\": \"replicate\", \"spp_b\": 256, \"seconds_a\": 1.5,"
    " \"seconds_b\": 120, \"seed_a\": 1, \"seeds_b\": [7, 8], \"version_b\": \"Blender 3.4.1\","
    " \"files\": {\"a\": \"a.exr\", \"b\": \"b.exr\", \"z\": \"z.exr\", \"relative\": \"r.exr\"},"
    " \"rerun\": \"assay validate --only 41_cornell\"}";

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
    json_t *c = parse(judged_claim);
    json_object_set_new(c, "verdict", json_string(verdict));
    json_object_set_new(c, "expected", json_string(expected));
    json_object_set_new(c, "passed", json_boolean(strcmp(verdict, expected) == 0));
    return c;
}

struct place {
    char dir[64], path[128];
};

static struct place temp_place(const char *file)
{
    struct place p;
    strcpy(p.dir, "/tmp/test_results_XXXXXX");
    assert_non_null(mkdtemp(p.dir));
    snprintf(p.path, sizeof p.path, "%s/%s", p.dir, file);
    return p;
}

static void remove_place(const struct place *p)
{
    struct err e;
    assert_true(fs_remove_tree(p->dir, &e));
}

static void write_text(const char *path, const char *text)
{
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_true(fputs(text, f) >= 0);
    assert_int_equal(fclose(f), 0);
}

/* Reads `text` as results.json; it must fail with a line that has the file's name and `wanted`. */
static void expect_rejected(const char *text, const char *wanted)
{
    struct place p = temp_place("results.json");
    write_text(p.path, text);
    json_t *root = NULL;
    struct err e = {""};
    if (results_read(p.path, &root, &e))
        fail_msg("accepted, though: %s", wanted);
    if (strstr(e.msg, wanted) == NULL || strstr(e.msg, p.path) != e.msg ||
        strchr(e.msg, '\n') != NULL)
        fail_msg("got '%s', wanted '%s'", e.msg, wanted);
    assert_null(root);
    remove_place(&p);
}

static void expect_root_rejected(json_t *root, const char *wanted)
{
    char *text = json_dumps(root, 0);
    assert_non_null(text);
    expect_rejected(text, wanted);
    free(text);
    json_decref(root);
}

static void expect_claim_rejected(json_t *claim, const char *wanted)
{
    expect_root_rejected(results_of(1, &claim), wanted);
}

TEST(round_trip)
{
    struct place p = temp_place("new/results.json");
    json_t *root = results_of(2, (json_t *[]){parse(judged_claim), parse(error_claim)});
    struct err e = {""};
    MUST(json_write(p.path, root, &e));
    json_t *back = NULL;
    MUST(results_read(p.path, &back, &e));
    assert_true(json_equal(root, back));

    FILE *f = fopen(p.path, "rb");
    assert_non_null(f);
    assert_int_equal(fseek(f, -2, SEEK_END), 0);
    assert_int_equal(fgetc(f), '}');
    assert_int_equal(fgetc(f), '\n');
    fclose(f);
    json_decref(back);
    json_decref(root);
    remove_place(&p);
}

/* Every member that the header promises is missed by name when it is absent, and refused when it is
 * of another type. No member promised here is of type object-or-true, so `true` is wrong for all
 * but the two booleans, for which a string is. */
TEST(missing_or_mistyped_member)
{
    static const char *const required[] = {"scene",
                                           "a",
                                           "b",
                                           "expected",
                                           "passed",
                                           "quantity",
                                           "verdict",
                                           "reason",
                                           "alpha",
                                           "margin_global",
                                           "margin_tile",
                                           "tile",
                                           "difference",
                                           "ci",
                                           "channel_difference",
                                           "log10_p",
                                           "mdb_global",
                                           "mdb_tile",
                                           "num_tests",
                                           "worst_tile",
                                           "worst",
                                           "rms_bias",
                                           "extra_factor",
                                           "skew_limited",
                                           "tiles_x",
                                           "tiles_y",
                                           "tile_log10_p",
                                           "tile_t",
                                           "statistics",
                                           "files"};
    static const char *const optional[] = {"title",     "detects",   "blind_to",  "class",
                                           "n_a",       "n_b",       "unit_b",    "spp_b",
                                           "seconds_a", "seconds_b", "seed_a",    "seeds_b",
                                           "version_b", "rerun",     "direction", "variance_ratio"};
    char wanted[128];
    for (size_t i = 0; i < sizeof required / sizeof *required; i++) {
        json_t *claim = parse(judged_claim);
        assert_int_equal(json_object_del(claim, required[i]), 0);
        snprintf(wanted, sizeof wanted, "'%s' is missing", required[i]);
        expect_claim_rejected(claim, wanted);

        claim = parse(judged_claim);
        bool boolean = json_is_boolean(json_object_get(claim, required[i]));
        json_object_set_new(claim, required[i], boolean ? json_string("yes") : json_true());
        snprintf(wanted, sizeof wanted, "'%s' is not ", required[i]);
        expect_claim_rejected(claim, wanted);
    }
    for (size_t i = 0; i < sizeof optional / sizeof *optional; i++) {
        json_t *claim = parse(judged_claim);
        json_object_set_new(claim, optional[i], json_true());
        snprintf(wanted, sizeof wanted, "'%s' is not ", optional[i]);
        expect_claim_rejected(claim, wanted);

        struct place p = temp_place("results.json");
        claim = parse(judged_claim);
        assert_int_equal(json_object_del(claim, optional[i]), 0);
        json_t *root = results_of(1, &claim), *back = NULL;
        struct err e = {""};
        assert_true(json_write(p.path, root, &e));
        MUST(results_read(p.path, &back, &e));
        json_decref(back);
        json_decref(root);
        remove_place(&p);
    }
}

TEST(nested_members)
{
    static const char *const member[][2] = {{"worst_tile", "x"},
                                            {"worst_tile", "y"},
                                            {"worst_tile", "difference"},
                                            {"worst_tile", "ci"},
                                            {"worst_tile", "t"},
                                            {"worst", "width"},
                                            {"worst", "height"},
                                            {"worst", "channel"},
                                            {"files", "a"},
                                            {"files", "b"},
                                            {"files", "z"},
                                            {"files", "relative"},
                                            {"direction", "name"},
                                            {"direction", "explained"},
                                            {"direction", "amount"},
                                            {"direction", "ci"},
                                            {"direction", "unit"},
                                            {"variance_ratio", "ratio"},
                                            {"variance_ratio", "ci"}};
    for (size_t i = 0; i < sizeof member / sizeof *member; i++) {
        json_t *claim = parse(judged_claim);
        assert_int_equal(json_object_del(json_object_get(claim, member[i][0]), member[i][1]), 0);
        char wanted[128];
        snprintf(wanted, sizeof wanted, "'%s.%s' is missing", member[i][0], member[i][1]);
        expect_claim_rejected(claim, wanted);
    }
    static const char *const statistic[] = {"name", "share", "num_tests", "log10_p", "what"};
    for (size_t i = 0; i < sizeof statistic / sizeof *statistic; i++) {
        json_t *claim = parse(judged_claim);
        json_t *first = json_array_get(json_object_get(claim, "statistics"), 0);
        assert_int_equal(json_object_del(first, statistic[i]), 0);
        char wanted[128];
        snprintf(wanted, sizeof wanted, "'statistics.%s' is missing", statistic[i]);
        expect_claim_rejected(claim, wanted);
    }
    json_t *claim = parse(judged_claim);
    json_array_clear(json_object_get(claim, "statistics"));
    expect_claim_rejected(claim, "'statistics' is not an array with at least one");
    claim = parse(judged_claim);
    json_array_set_new(json_object_get(claim, "statistics"), 0, json_integer(1));
    expect_claim_rejected(claim, "'statistics' has an element 0 that is not an object");
}

static void set(json_t *claim, const char *name, const char *json)
{
    json_error_t error;
    json_t *v = json_loads(json, JSON_DECODE_ANY, &error);
    assert_non_null(v);
    json_object_set_new(claim, name, v);
}

TEST(values_out_of_order)
{
    static const char *const bad[][3] = {
        {"ci", "[2, 1]", "'ci' is not an array of two numbers, the lower first"},
        {"ci", "[1]", "'ci' is not an array of two numbers"},
        {"channel_difference", "[1, 2]", "'channel_difference' is not an array of three numbers"},
        {"tile", "-16", "'tile' is not a whole number"},
        {"tile", "1.5", "'tile' is not a whole number"},
        {"seeds_b", "[1, \"2\"]", "'seeds_b' is not an array of whole numbers"},
        {"tiles_x", "0", "'tiles_x' or 'tiles_y' is not from 1 to 65536"},
        {"tiles_x", "3", "'tile_log10_p' is not an array of tiles_x * tiles_y = 3 numbers"},
        {"tile_t", "[1, \"x\"]", "'tile_t' has an element 1 that is not a number"},
        {"verdict", "\"SAME\"", "'verdict' is unknown: 'SAME'"},
        {"expected", "\"SAME\"", "'expected' is unknown"},
        {"verdict", "\"DIFFERENT\"", "'passed' contradicts 'verdict' and 'expected'"},
        {"passed", "false", "'passed' contradicts 'verdict' and 'expected'"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        json_t *claim = parse(judged_claim);
        set(claim, bad[i][0], bad[i][1]);
        expect_claim_rejected(claim, bad[i][2]);
    }
    json_t *claim = parse(judged_claim);
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
    claim = parse(judged_claim);
    set(claim, "looks", "[{\"n_a\": 1, \"n_b\": 1, \"alpha\": 0.1, \"stage\": 1}]");
    expect_claim_rejected(claim, "'looks.verdict' is missing");
    claim = parse(judged_claim);
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

    json_t *root = results_of(1, (json_t *[]){parse(judged_claim)});
    set(root, "assay", "2");
    expect_root_rejected(root, "'assay' is not 1");
    root = results_of(1, (json_t *[]){parse(judged_claim)});
    json_object_del(root, "alpha");
    expect_root_rejected(root, "'alpha' is missing");
    root = results_of(1, (json_t *[]){parse(judged_claim)});
    json_object_del(root, "claims");
    expect_root_rejected(root, "'claims' is not an array with at least one claim");
    expect_root_rejected(results_of(0, NULL), "'claims' is not an array with at least one claim");
    root = results_of(0, NULL);
    set(root, "consistency", "[]");
    expect_root_rejected(root, "'claims' is not an array with at least one claim");

    json_t *out = NULL;
    struct err e = {""};
    assert_false(results_read("/nonexistent/results.json", &out, &e));
    assert_non_null(strstr(e.msg, "/nonexistent/results.json"));

    root = json_object();
    assert_false(json_write("/proc/no/results.json", root, &e));
    assert_non_null(strstr(e.msg, "/proc/no"));
    json_decref(root);
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
        {{NULL}, {"EQUIVALENT"}, 3},
        {{"EQUIVALENT", "DIFFERENT", "EQUIVALENT"}, {"EQUIVALENT", "DIFFERENT", "EQUIVALENT"}, 0},
        {{"EQUIVALENT", "INCONCLUSIVE", "DIFFERENT"},
         {"EQUIVALENT", "EQUIVALENT", "EQUIVALENT"},
         1},
        {{"EQUIVALENT", "INCONCLUSIVE"}, {"EQUIVALENT", "EQUIVALENT"}, 2},
        {{"DIFFERENT", NULL, "EQUIVALENT"}, {"EQUIVALENT", "EQUIVALENT", "EQUIVALENT"}, 3},
        {{NULL}, {NULL}, 3},
    };
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        json_t *claim[3];
        size_t num = 0;
        for (; num < 3 && row[i].expected[num] != NULL; num++)
            claim[num] = row[i].verdict[num] == NULL
                             ? parse(error_claim)
                             : claim_with(row[i].verdict[num], row[i].expected[num]);
        json_t *root = results_of(num, claim);
        if (results_exit_code(root) != row[i].code)
            fail_msg("row %zu: %d, not %d", i, results_exit_code(root), row[i].code);
        json_decref(root);
    }
    /* Without time it is inconclusive: worse than a pass, better than a difference. */
    json_t *late = parse(error_claim);
    set(late, "verdict", "\"INCONCLUSIVE\"");
    json_t *root = results_of(2, (json_t *[]){parse(judged_claim), late});
    assert_int_equal(results_exit_code(root), 2);
    json_array_append_new(json_object_get(root, "claims"), claim_with("DIFFERENT", "EQUIVALENT"));
    assert_int_equal(results_exit_code(root), 1);
    json_decref(root);
    /* Nothing but a claim of consistency. */
    root = results_of(0, NULL);
    set(root, "consistency", "[{\"verdict\": \"EQUIVALENT\"}]");
    assert_int_equal(results_exit_code(root), 0);
    set(root, "consistency", "[{\"verdict\": \"DIFFERENT\"}]");
    assert_int_equal(results_exit_code(root), 1);
    json_decref(root);
}

/* Four claims that need every width rule: a scene name with a two-byte letter, a value that rounds
 * to zero from below, a large one, and one without numbers. */
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
    return results_of(4, (json_t *[]){a, b, c, parse(error_claim)});
}

static char *printed_table(const json_t *results, bool markdown)
{
    char *text = NULL;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    assert_non_null(f);
    results_table_print(f, results, markdown);
    assert_int_equal(fclose(f), 0);
    return text;
}

/* Widths by the rule: 10, 10, 7, 26, 7, 8, 12, 10 columns, two spaces between. */
TEST(table_for_a_terminal)
{
    /* clang-format off */
    static const char wanted[] =
        "scene       tested      against     difference % [interval]    MDB %  margin %  verdict       expected    ok\n"
        "41_cornell  pathtracer  cycles      +0.030 [-0.100, +0.200]    0.400     0.500  EQUIVALENT    EQUIVALENT  ok\n"
        "91_l\xc3\xa4ngs    pathtracer  truth    -25.000 [-26.000, -23.990]    1.230     2.000  DIFFERENT     DIFFERENT   ok\n"
        "a|b         pathtracer  cycles    +0.000 [-50.000, +50.000]  125.000     0.500  INCONCLUSIVE  EQUIVALENT  WRONG\n"
        "12_furnace  pathtracer  povray                            -        -         -  NOT JUDGED    EQUIVALENT  ERROR\n"
        "12_furnace against povray: povray: not installed\n";
    /* clang-format on */
    json_t *root = table_results();
    char *text = printed_table(root, false);
    assert_string_equal(text, wanted);
    free(text);
    json_decref(root);
}

TEST(table_in_markdown)
{
    static const char wanted[] =
        "| scene | tested | against | difference % [interval] | MDB % | margin % | verdict | expected | ok "
        "|\n"
        "|---|---|---|--:|--:|--:|---|---|---|\n"
        "| 41\\_cornell | pathtracer | cycles | +0.030 [-0.100, +0.200] | 0.400 | 0.500 | EQUIVALENT | "
        "EQUIVALENT | ok |\n"
        "| 91\\_l\xc3\xa4ngs | pathtracer | truth | -25.000 [-26.000, -23.990] | 1.230 | 2.000 | DIFFERENT | "
        "DIFFERENT | ok |\n"
        "| a\\|b | pathtracer | cycles | +0.000 [-50.000, +50.000] | 125.000 | 0.500 | INCONCLUSIVE | "
        "EQUIVALENT | **wrong** |\n"
        "| 12\\_furnace | pathtracer | povray | - | - | - | NOT JUDGED | EQUIVALENT | **error** |\n"
        "\n- 12\\_furnace against povray: povray: not installed\n";
    json_t *root = table_results();
    char *text = printed_table(root, true);
    assert_string_equal(text, wanted);
    free(text);
    json_decref(root);
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
    json_t *root = results_of(4, (json_t *[]){claim_with("EQUIVALENT", "EQUIVALENT"), wrong,
                                              claim_with("INCONCLUSIVE", "EQUIVALENT"), error});
    struct place p = temp_place("deep/er/junit.xml");
    struct err e = {""};
    MUST(junit_write(p.path, root, &e));

    xmlDoc *doc = xmlReadFile(p.path, NULL, XML_PARSE_NONET | XML_PARSE_NOERROR);
    assert_non_null(doc);
    xmlNode *suite = xmlDocGetRootElement(doc);
    assert_string_equal((const char *)suite->name, "testsuite");
    assert_attribute(suite, "tests", "4");
    assert_attribute(suite, "failures", "2");
    assert_attribute(suite, "errors", "1");
    assert_attribute(suite, "time", "98.125");
    assert_attribute(suite, "timestamp", "2026-01-02T03:04:05Z");
    assert_int_equal(count_children(suite, "testcase"), 4);

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
    json_decref(root);
    remove_place(&p);
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
    json_t *root = claim_result_new_results(3, argv, 0.01, &e);
    assert_non_null(root);
    json_decref(root);
}

static int clean_parser(void **state)
{
    (void)state;
    xmlCleanupParser();
    return 0;
}

TEST_GROUP(NULL, clean_parser)
