/* results.json against the fields that Gradescope documents (gradescope-autograders.readthedocs.io, "Autograder specifications"):
 * names, types, values, and that there is a score or there are tests. The rules are written here from that page, not from
 * what we write. Each has a control: a file with that mistake is rejected. */

#include "renderer/base/fs.h"
#include "tools/gradebook/grade_batch.h"
#include "tools/gradebook/student_page.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <sys/stat.h>

static bool is_one_of(const char *text, const char *const *words)
{
    for (; text != NULL && *words != NULL; words++)
        if (strcmp(text, *words) == 0)
            return true;
    return false;
}

static const char *const visibilities[] = {"hidden", "after_due_date", "after_published", "visible",
                                           NULL};
static const char *const formats[] = {"text", "html", "simple_format", "md", "ansi", NULL};

enum kind { NUMBER, TEXT, TEXTS, VISIBILITY, FORMAT, STATUS, ORDER, ANY, TESTS, BOARD };
struct field {
    const char *name;
    enum kind kind;
};

static const struct field whole[] = {{"score", NUMBER},
                                     {"execution_time", NUMBER},
                                     {"output", TEXT},
                                     {"output_format", FORMAT},
                                     {"test_output_format", FORMAT},
                                     {"test_name_format", FORMAT},
                                     {"visibility", VISIBILITY},
                                     {"stdout_visibility", VISIBILITY},
                                     {"extra_data", ANY},
                                     {"tests", TESTS},
                                     {"leaderboard", BOARD},
                                     {0}};
static const struct field test[] = {{"score", NUMBER},       {"max_score", NUMBER},
                                    {"status", STATUS},      {"name", TEXT},
                                    {"name_format", FORMAT}, {"number", TEXT},
                                    {"output", TEXT},        {"output_format", FORMAT},
                                    {"tags", TEXTS},         {"visibility", VISIBILITY},
                                    {"extra_data", ANY},     {0}};
static const struct field board[] = {{"name", TEXT}, {"value", ANY}, {"order", ORDER}, {0}};

static bool valid_object(const json_t *object, const struct field *fields);

static bool valid_objects(const json_t *array, const struct field *fields)
{
    size_t i;
    json_t *v;
    json_array_foreach(array, i, v) {
        if (!valid_object(v, fields))
            return false;
    }
    return json_is_array(array);
}

static bool valid_value(const json_t *v, enum kind kind)
{
    static const char *const statuses[] = {"passed", "failed", NULL};
    static const char *const orders[] = {"asc", "desc", NULL};
    size_t i;
    json_t *each;
    switch (kind) {
    case NUMBER: return json_is_number(v) && isfinite(json_number_value(v));
    case TEXT: return json_is_string(v);
    case VISIBILITY: return is_one_of(json_string_value(v), visibilities);
    case FORMAT: return is_one_of(json_string_value(v), formats);
    case STATUS: return is_one_of(json_string_value(v), statuses);
    case ORDER: return is_one_of(json_string_value(v), orders);
    case TESTS: return valid_objects(v, test);
    case BOARD: return valid_objects(v, board);
    case ANY: return true;
    case TEXTS:
        json_array_foreach(v, i, each) {
            if (!json_is_string(each))
                return false;
        }
        return json_is_array(v);
    }
    return false;
}

static bool valid_object(const json_t *object, const struct field *fields)
{
    const char *name;
    json_t *v;
    json_object_foreach((json_t *)object, name, v) {
        const struct field *f = fields;
        while (f->name != NULL && strcmp(f->name, name) != 0)
            f++;
        if (f->name == NULL || !valid_value(v, f->kind))
            return false;
    }
    return json_is_object(object);
}

static bool valid_results(const json_t *root)
{
    return valid_object(root, whole) && (json_object_get(root, "score") != NULL ||
                                         json_array_size(json_object_get(root, "tests")) > 0);
}

static json_t *a_check(const char *name, double points, double of, const char *visibility)
{
    return json_pack("{ss, ss, ss, sf, sf, sf, sf, sb, ss, ss, ss, ss, ss, ss, ss, ss, sn, sn}",
                     "part", "3", "name", name, "title", "Light <b>\"on\"</b> a floor", "points",
                     points, "of", of, "share", points / of, "chance", 1e-7, "judged", 1,
                     "expected", "the mean within 1 %", "seen", "the mean \xc2\xb1 3 %", "hint",
                     "1/r^2", "where", "Part 3", "visibility", visibility, "accepted", "", "flag",
                     "", "picture", "floor", "tile", "relative");
}

/* One of them graded, one whose program is broken, one that we could not grade. */
static json_t *a_class(void)
{
    json_t *checks = json_array(), *grades = json_array();
    json_array_append_new(checks, a_check("falloff", 4.123456, 6, "visible"));
    json_array_append_new(checks, a_check("secret", 2, 2, "after_published"));
    json_object_set_new(json_array_get(checks, 1), "provisional", json_true());
    json_array_append_new(
        grades,
        json_pack("{ss, ss, sf, sf, sf, sn, sn, ss, so, s[{ss, ss, sf, sf}], s[{sf}, {sf}], "
                  "s{ss, s[{ss, ss, ss}]}}",
                  "id", "ada", "rubric", "Light", "points", 6.123456, "of", 8.0, "cpu_s", 3.5,
                  "trouble", "wrong", "accepted", "", "checks", checks, "parts", "number", "3",
                  "title", "Light", "points", 6.12, "of", 8.0, "pictures", "wall_s", 1.25, "wall_s",
                  0.5, "diagnosis", "finding", "bug", "named", "name", "x", "bug",
                  "light falls \"as\" 1/r", "where", "Part 3"));
    json_array_append_new(
        grades, json_pack("{ss, ss, sf, sf, sf, sn, ss, ss, s[o], s[], s[], sn}", "id", "bob",
                          "rubric", "Light", "points", 0.0, "of", 8.0, "cpu_s", 0.0, "trouble",
                          "wrong", "building it failed: exit status 2", "accepted", "", "checks",
                          a_check("falloff", 0, 6, "visible"), "parts", "pictures", "diagnosis"));
    json_array_append_new(grades, json_pack("{ss, ss, sf, sf, sf, ss, sn, s[], s[], s[]}", "id",
                                            "cyd", "rubric", "Light", "points", 0.0, "of", 8.0,
                                            "cpu_s", 0.0, "trouble", "no space left on device",
                                            "wrong", "checks", "parts", "pictures"));
    return grades;
}

/* The output of a test. */
static const char *output_of(const json_t *root, size_t i)
{
    return json_string_value(
        json_object_get(json_array_get(json_object_get(root, "tests"), i), "output"));
}

static json_t *results_of(const char *id)
{
    json_error_t why;
    json_t *root = json_load_file(test_path(fs_path("%s/results.json", id).s), 0, &why);
    if (root == NULL)
        fail_msg("%s: %s", id, why.text);
    return root;
}

TEST(every_file_has_documented_fields_only)
{
    static const char *const ids[] = {"ada", "bob", "cyd"};
    struct err e;
    json_auto_t *grades = a_class();
    assert_non_null(grades);
    for (int i = 0; i < 3; i++)
        assert_int_equal(mkdir(test_path(ids[i]), 0700), 0);
    MUST(grade_write(test_path(""), NULL, NULL, grades, &e));
    for (int i = 0; i < 3; i++) {
        json_auto_t *root = results_of(ids[i]);
        assert_true(valid_results(root));
    }
    /* What Gradescope adds up is what was given, to a hundredth of a point. */
    json_t *root = results_of("ada"), *tests = json_object_get(root, "tests"), *t;
    double sum = 0, most = 0;
    size_t i;
    json_array_foreach(tests, i, t) {
        sum += json_number_value(json_object_get(t, "score"));
        most += json_number_value(json_object_get(t, "max_score"));
    }
    assert_int_equal(i, 2);
    assert_true(fabs(sum - 6.12) < 1e-9 && most == 8);
    assert_string_equal(json_string_value(json_object_get(json_array_get(tests, 1), "visibility")),
                        "after_published");
    assert_string_equal(json_string_value(json_object_get(json_array_get(tests, 0), "status")),
                        "failed");
    assert_string_equal(json_string_value(json_object_get(root, "output")), "");
    assert_true(json_number_value(json_object_get(root, "execution_time")) == 1.75);
    /* Some of the points; all of them, for now. */
    assert_non_null(strstr(output_of(root, 0), "Partial credit: 4.12 of 6 points."));
    assert_null(strstr(output_of(root, 0), "Provisional"));
    assert_null(strstr(output_of(root, 1), "Partial"));
    assert_non_null(strstr(output_of(root, 1), "Provisional: "));
    json_decref(root);
    root = results_of("cyd");
    assert_true(json_number_value(json_object_get(root, "score")) == 0);
    json_decref(root);
}

/* The grade with a mistake that only the second check shows, which is hidden or not; `shown`: what the first alone says of it. */
static json_t *a_view(const char *visibility, json_t *shown)
{
    json_auto_t *grades = a_class();
    json_t *grade = json_array_get(grades, 0), *checks = json_object_get(grade, "checks");
    json_object_set_new(json_array_get(checks, 1), "visibility", json_string(visibility));
    json_object_set_new(json_array_get(checks, 1), "share", json_real(0.5));
    json_object_set_new(json_array_get(checks, 0), "carried", json_string("paid: falls as 1/r"));
    json_object_set_new(grade, "for_student", shown);
    json_object_set_new(grade, "located", json_string("only in glass"));
    json_object_set_new(grade, "before", json_object());
    return student_view(grade);
}

static json_t *first_of(const json_t *view, const char *array)
{
    return json_array_get(json_object_get(view, array), 0);
}

TEST(a_student_reads_what_the_shown_checks_say)
{
    json_t *hidden = a_view("hidden", json_pack("{sn}", "diagnosis"));
    assert_int_equal(json_array_size(json_object_get(hidden, "checks")), 1);
    assert_null(json_object_get(hidden, "located"));
    assert_null(json_object_get(hidden, "before"));
    assert_true(json_is_null(json_object_get(hidden, "diagnosis")));
    assert_true(json_number_value(json_object_get(hidden, "of")) == 6);
    assert_true(json_number_value(json_object_get(first_of(hidden, "parts"), "of")) == 6);
    assert_null(
        strstr(json_string_value(json_object_get(first_of(hidden, "checks"), "carried")), "1/r"));
    json_decref(hidden);
    json_t *all = a_view("visible", json_pack("{sn}", "diagnosis"));
    assert_int_equal(json_array_size(json_object_get(all, "checks")), 2);
    assert_string_equal(json_string_value(json_object_get(all, "located")), "only in glass");
    assert_true(json_is_object(json_object_get(all, "diagnosis")));
    assert_true(json_number_value(json_object_get(all, "of")) == 8);
    assert_non_null(
        strstr(json_string_value(json_object_get(first_of(all, "checks"), "carried")), "1/r"));
    json_decref(all);
    json_t *named = a_view("hidden", json_pack("{s{s[{ss}]}, ss}", "diagnosis", "named", "bug",
                                               "falls as 1/r", "located", "only in rain"));
    assert_string_equal(json_string_value(json_object_get(named, "located")), "only in rain");
    assert_non_null(
        strstr(json_string_value(json_object_get(first_of(named, "checks"), "carried")), "1/r"));
    json_decref(named);
}

TEST(other_fields_and_values_are_rejected)
{
    static const struct {
        const char *text;
        bool right;
    } cases[] = {
        {"{}", false},
        {"[]", false},
        {"{'tests': []}", false},
        {"{'score': '4'}", false},
        {"{'score': 4, 'points': 4}", false},
        {"{'score': 4, 'visibility': 'shown'}", false},
        {"{'score': 4, 'output_format': 'markdown'}", false},
        {"{'score': 4, 'tests': {}}", false},
        {"{'tests': [{'score': true}]}", false},
        {"{'tests': [{'score': 1, 'max_score': null}]}", false},
        {"{'tests': [{'score': 1, 'number': 1.1}]}", false},
        {"{'tests': [{'score': 1, 'status': 'ok'}]}", false},
        {"{'tests': [{'score': 1, 'tags': [1]}]}", false},
        {"{'tests': [{'score': 1, 'hint': 'look'}]}", false},
        {"{'score': 1, 'leaderboard': [{'name': 'n', 'value': 1, 'order': 'up'}]}", false},
        {"{'score': 4}", true},
        {"{'tests': [{'score': 1, 'max_score': 2, 'number': '1.1', 'tags': ['a'], "
         "'status': 'passed', 'visibility': 'hidden'}], 'stdout_visibility': 'hidden'}",
         true},
        {"{'score': 1, 'leaderboard': [{'name': 'n', 'value': 1, 'order': 'asc'}]}", true},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        OWN_TEXT text = test_json(cases[i].text);
        json_auto_t *root = json_loads(text, 0, NULL);
        if (root == NULL || valid_results(root) != cases[i].right)
            fail_msg("%s: %s", cases[i].right ? "rejected" : "not rejected", text);
    }
}

/* A file of another program, say of run_autograder. */
TEST(a_file_that_is_given_has_documented_fields_only)
{
    const char *path = getenv("ASSAY_RESULTS");
    json_auto_t *root = path != NULL ? json_load_file(path, 0, NULL) : NULL;
    assert_true(path == NULL || valid_results(root));
}
