/* What claims that differ are told to have in common: which scenes have a feature is read off their files' text. */
#include "tests/support/suite_files.h"
#include "tests/support/test.h"
#include "tools/results/results.h"
#include "tools/validate/shared_features.h"

static bool file_has(const char *path, const char *word)
{
    static char text[1 << 20];
    FILE *f = fopen(path, "r");
    assert_non_null(f);
    text[fread(text, 1, sizeof text - 1, f)] = '\0';
    fclose(f);
    return strstr(text, word) != NULL;
}

/* One claim for each scene that should be EQUIVALENT, DIFFERENT where `differs` says so. The sentence into text. */
static int tell(bool (*differs)(const struct suite_scene *s), const char *a, char *text,
                size_t size)
{
    json_t *claims = json_array(), *results = json_pack("{so}", "claims", claims);
    struct err e = {""};
    int num = 0;
    for (int i = 0; i < suite_shipped()->num_scenes; i++) {
        const struct suite_scene *s = &suite_shipped()->scene[i];
        bool is = s->expect == VERDICT_EQUIVALENT && differs(s);
        num += is;
        json_array_append_new(claims, json_pack("{ss,ss,ss,ss,ss}", "scene", s->name, "a",
                                                is ? a : "pathtracer", "b", "cycles", "expected",
                                                verdict_name(s->expect), "verdict",
                                                is ? "DIFFERENT" : verdict_name(s->expect)));
    }
    MUST(shared_features_tell(results, "reference/scenes", text, size, &e));
    json_decref(results);
    print_message("%d: %s\n", num, text);
    return num;
}

static bool has_glass(const struct suite_scene *s)
{
    return file_has(s->dae, "<glass>");
}

static bool has_spot(const struct suite_scene *s)
{
    return file_has(s->dae, "<spot>");
}

static bool has_lens(const struct suite_scene *s)
{
    return s->lens_radius > 0;
}

/* Neither does it alone. */
static bool has_mirror_and_spheres(const struct suite_scene *s)
{
    return file_has(s->dae, "<mirror>") && file_has(s->dae, "<sphere>");
}

static bool every_third(const struct suite_scene *s)
{
    return (s - suite_shipped()->scene) % 3 == 0;
}

static bool all(const struct suite_scene *s)
{
    (void)s;
    return true;
}

static bool none(const struct suite_scene *s)
{
    (void)s;
    return false;
}

static bool cornell_alone(const struct suite_scene *s)
{
    return strcmp(s->name, "41_cornell") == 0;
}

TEST(what_the_claims_that_differ_share_is_told)
{
    static const struct {
        bool (*differs)(const struct suite_scene *s);
        const char *a, *told;
    } cases[] = {
        {has_glass, "pathtracer", "have glass; none"},
        {has_spot, "pathtracer", "have a spot light; none"},
        {has_lens, "pathtracer", " a lens; none"},
        {has_mirror_and_spheres, "pathtracer", "a mirror with spheres"},
        {cornell_alone, "pathtracer-hemisphere", "the side pathtracer-hemisphere; none"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[1024];
        assert_true(tell(cases[i].differs, cases[i].a, text, sizeof text) > 0);
        assert_non_null(strstr(text, cases[i].told));
    }
}

/* Controls: nothing is told of what has nothing in common, or if nothing differs. */
TEST(what_they_do_not_share_is_not)
{
    char text[1024];
    tell(every_third, "pathtracer", text, sizeof text);
    assert_non_null(strstr(text, "nothing in common"));
    tell(all, "pathtracer", text, sizeof text);
    assert_non_null(strstr(text, "nothing in common"));
    tell(none, "pathtracer", text, sizeof text);
    assert_string_equal(text, "");
}
