/* What staff have to look at: each reason alone, and that a grade without any has none. */
#include "tools/gradebook/grade_needs.h"

#include "tests/support/test.h"

/* A grade that needs no attention by staff, though points are lost. */
static json_t *a_grade(void)
{
    return json_pack("{sn, sn, ss, s[{ss, ss, sb, sf}], s[{ss}, {sn}]}", "trouble", "wrong",
                     "state", "graded", "checks", "name", "floor", "flag", "", "judged", 1, "share",
                     0.5, "pictures", "sha256", "00", "sha256");
}

static void expect(json_t *grade, const char *state, const char *text)
{
    char said[256];
    bool needs = grade_needs(grade, said, sizeof said);
    const char *is = grade_state(grade);
    assert_string_equal(said, text);
    assert_true(needs == (text[0] != '\0'));
    assert_string_equal(is != NULL ? is : "", state);
    json_decref(grade);
}

static json_t *with(const char *key, json_t *value)
{
    json_t *grade = a_grade();
    json_object_set_new(grade, key, value);
    return grade;
}

static json_t *with_check(const char *key, json_t *value)
{
    json_t *grade = a_grade();
    json_object_set_new(json_array_get(json_object_get(grade, "checks"), 0), key, value);
    return grade;
}

TEST(each_reason_is_said)
{
    expect(a_grade(), "", "");
    expect(with("trouble", json_string("no space left")), "not graded", "no space left");
    expect(with("wrong", json_string("two main()")), "", "two main()");
    expect(with("state", json_string("not_built")), "not built", "not built");
    expect(with("state", json_string("not_started")), "no image", "no image");
    expect(with("state", json_string("usage")), "printed its usage", "printed its usage");
    expect(with("flag", json_string("images alone")), "", "images alone");
    expect(with("pictures", json_pack("[{sn}]", "sha256")), "no image", "no image");
    expect(with_check("flag", json_string("a copy")), "", "floor: a copy");
    expect(with_check("judged", json_false()), "", "floor: not judged");
    expect(with_check("provisional", json_true()), "", "floor: provisional");
}

TEST(all_reasons_are_in_one_line_as_far_as_it_reaches)
{
    char said[40];
    json_auto_t *grade = with("wrong", json_string("two main()"));
    json_object_set_new(json_array_get(json_object_get(grade, "checks"), 0), "judged",
                        json_false());
    assert_true(grade_needs(grade, said, sizeof said));
    assert_string_equal(said, "two main(); floor: not judged");
    for (size_t size = 2; size < 30; size++) {
        assert_true(grade_needs(grade, said, size));
        assert_true(strlen(said) > 0 && strlen(said) < size);
        assert_memory_equal(said, "two main(); floor: not judged", strlen(said));
    }
}

/* A check without its image was compared with nothing. */
TEST(images_differ_where_one_was_compared_and_lost)
{
    json_auto_t *none = with_check("relative", json_null()),
                *one = with_check("relative", json_pack("[f]", 0.5)),
                *right = with_check("relative", json_pack("[f]", 0.0));
    json_object_set_new(json_array_get(json_object_get(right, "checks"), 0), "share", json_real(1));
    assert_false(grade_differs(none));
    assert_true(grade_differs(one));
    json_object_set_new(json_array_get(json_object_get(one, "checks"), 0), "kind",
                        json_string("growth"));
    assert_false(grade_differs(one));
    assert_false(grade_differs(right));
}
