/* Annotations for GitHub: what is printed for each outcome, by GitHub's rules of escaping (in a message %,
 * CR and LF are %25, %0D, %0A; in a property : and , are %3A, %2C too). */
#include "tools/results/github_annotations.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

static json_t *judged(const char *scene, const char *expected, const char *verdict)
{
    json_t *c = json_pack("{ss ss ss ss ss sb ss sf ss}", "scene", scene, "a", "pathtracer", "b",
                          "cycles", "expected", expected, "verdict", verdict, "passed",
                          strcmp(expected, verdict) == 0, "reason", "too bright", "difference",
                          0.0123, "rerun", "assay validate --only x");
    assert_non_null(c);
    if (strcmp(verdict, "INCONCLUSIVE") == 0)
        json_object_set_new(c, "extra_factor", json_real(2.5));
    return c;
}

static json_t *not_judged(const char *scene, const char *error)
{
    json_t *c = json_pack("{ss ss ss ss sb ss}", "scene", scene, "a", "pathtracer", "b", "cycles",
                          "expected", "EQUIVALENT", "passed", 0, "error", error);
    assert_non_null(c);
    return c;
}

static char *printed(json_t *claims)
{
    char *text = NULL;
    json_auto_t *results = json_pack("{so}", "claims", claims);
    PRINTED(text, github_annotations_print(f, results));
    return text;
}

TEST(each_outcome)
{
    OWN_TEXT text = printed(json_pack(
        "[oooooo]", judged("good", "EQUIVALENT", "EQUIVALENT"),
        judged("found", "DIFFERENT", "DIFFERENT"), judged("bad", "EQUIVALENT", "DIFFERENT"),
        judged("open", "EQUIVALENT", "INCONCLUSIVE"), not_judged("lost", "cycles: not installed"),
        not_judged("lost too", "cycles: not installed")));
    OWN_TEXT wanted = test_read("tests/tools/results/annotations.expected");
    assert_string_equal(text, wanted);
}

TEST(all_is_well)
{
    OWN_TEXT text = printed(json_pack("[o]", judged("good", "EQUIVALENT", "EQUIVALENT")));
    assert_string_equal(text, "::notice title=assay::All 1 claims came out as expected.\n");
}

TEST(text_cannot_be_a_command)
{
    char *text =
        printed(json_pack("[o]", not_judged("a,b::c\n::set-env x", "50 %\r\n::error::forged")));
    assert_string_equal(
        text,
        "::error title=a%2Cb%3A%3Ac%0A%3A%3Aset-env x%3A pathtracer against cycles::could not be "
        "judged: 50 %25%0D%0A::error::forged\n"
        "::notice title=assay::Of 1 claims 0 came out wrong, 0 stayed undecided and 1 could not "
        "be judged.\n");
    free(text);
}
