/* Points set by staff, and how a change of grade is reported. Sums are by hand. */
#include "tools/gradebook/appeals.h"
#include "tools/gradebook/grade_change.h"

#include "tests/support/own.h"
#include "tests/support/test.h"

static struct rubric *rubric;

static int set_up(void **state)
{
    (void)state;
    rubric = calloc(1, sizeof *rubric);
    if (rubric == NULL)
        return 1;
    strcpy(rubric->path, "a.rubric");
    rubric->num_checks = 2;
    rubric->check[0] = (struct rubric_check){.name = "falloff", .points = 4};
    rubric->check[1] = (struct rubric_check){.name = "bounces", .points = 6};
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    free(rubric);
    return 0;
}

TEST_GROUP(set_up, tear_down)

static bool reads(const char *text, struct appeals *a, struct err *e)
{
    test_write(test_path("appeals"), text, strlen(text));
    return appeals_read(test_path("appeals"), rubric, a, e);
}

static json_t *grade_of(double falloff, double bounces)
{
    return json_pack(
        "{ss, sf, sf, s[{ss, sf}, {ss, sf}], s[{ss, ss, sf, sf, sb}, {ss, ss, sf, sf, sb}]}", "id",
        "bob", "points", falloff + bounces, "of", 10.0, "parts", "number", "3", "points", falloff,
        "number", "4", "points", bounces, "checks", "name", "falloff", "part", "3", "points",
        falloff, "share", falloff / 4, "judged", 1, "name", "bounces", "part", "4", "points",
        bounces, "share", bounces / 6, "judged", 0);
}

static const json_t *member_of(const json_t *grade, const char *list, size_t i, const char *key)
{
    return json_object_get(json_array_get(json_object_get(grade, list), i), key);
}

TEST(what_is_decided_counts)
{
    OWN(appeals) a;
    struct err e;
    char none[65], key[65];
    MUST(reads("# ID CHECK POINTS REASON\n\n  bob bounces 4.5 lost power,  twice \n"
               "\"Ada Lovelace\"\tfalloff 0 not hers\n",
               &a, &e));
    json_auto_t *grade = grade_of(4, 0);
    appeals_apply(&a, rubric, grade);
    assert_near(json_number_value(json_object_get(grade, "points")), 8.5, 1e-12);
    assert_near(json_number_value(member_of(grade, "parts", 0, "points")), 4, 1e-12);
    assert_near(json_number_value(member_of(grade, "parts", 1, "points")), 4.5, 1e-12);
    assert_near(json_number_value(member_of(grade, "checks", 1, "share")), 0.75, 1e-12);
    assert_true(json_is_true(member_of(grade, "checks", 1, "judged")));
    assert_string_equal(json_string_value(member_of(grade, "checks", 1, "appeal")),
                        "lost power,  twice ");
    assert_null(member_of(grade, "checks", 0, "appeal"));
    json_object_set_new(grade, "id", json_string("Ada Lovelace"));
    appeals_apply(&a, rubric, grade);
    assert_near(json_number_value(json_object_get(grade, "points")), 4.5, 1e-12);
    /* The hash of the decisions differs between students who have some, and is constant for those without. */
    appeals_key(NULL, "bob", none);
    appeals_key(&a, "eve", key);
    assert_string_equal(key, none);
    appeals_key(&a, "bob", key);
    assert_string_not_equal(key, none);
}

TEST(mistakes_are_named_with_their_lines)
{
    static const struct {
        const char *text, *says;
    } of[] = {{"bob shadows 1 x\n", "appeals:1: 'shadows' is no check of a.rubric"},
              {"#\nbob falloff 5 x\n", "appeals:2: points"},
              {"bob falloff -1 x\n", "appeals:1: points"},
              {"bob falloff many x\n", "appeals:1: points"},
              {"bob falloff 3\n", "appeals:1: no reason given"},
              {"bob falloff 3  \t\n", "appeals:1: no reason given"},
              {"bob falloff 3 x\nbob falloff 3 x\n", "appeals:2: decided in line 1 already"},
              {"bob\n", "appeals:1: '' is no check"}};
    for (size_t i = 0; i < COUNT(of); i++) {
        struct appeals a;
        struct err e;
        if (reads(of[i].text, &a, &e) || strstr(e.msg, of[i].says) == NULL)
            fail_msg("'%s': not '%s' but '%s'", of[i].text, of[i].says, e.msg);
    }
    struct appeals a;
    struct err e;
    assert_false(appeals_read("/nowhere/appeals", rubric, &a, &e));
}

TEST(what_changed_is_told)
{
    char text[256];
    json_auto_t *old = grade_of(4, 0), *grade = grade_of(4, 4.5);
    assert_null(grade_change(NULL, grade));
    assert_null(grade_change(grade, grade));
    grade_change_text(grade, text, sizeof text);
    assert_string_equal(text, "");
    json_object_set_new(grade, "before", grade_change(old, grade));
    grade_change_text(grade, text, sizeof text);
    assert_string_equal(text, "4.00 of 10 before; bounces 0.00, now 4.50");
    json_object_set_new(json_array_get(json_object_get(grade, "checks"), 1), "name",
                        json_string("lamp"));
    json_object_set_new(grade, "before", grade_change(old, grade));
    grade_change_text(grade, text, sizeof text);
    assert_string_equal(text,
                        "4.00 of 10 before; lamp not asked, now 4.50; bounces 0.00, not asked now");
}
