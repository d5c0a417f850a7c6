/* The features that differing claims are said to share; the expected ones are found by searching the scene files. */
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

static void add_claim(json_t *claims, const struct suite_scene *s, const char *a, const char *b,
                      bool differs)
{
    const char *expected = verdict_name(s->expect);
    json_array_append_new(claims, json_pack("{ss,ss,ss,ss,ss}", "scene", s->name, "a", a, "b", b,
                                            "expected", expected, "verdict",
                                            differs ? "DIFFERENT" : expected));
}

/* One claim for each scene that should be EQUIVALENT, DIFFERENT where `differs` says so; and one of the reference, which
 * agrees with another; without the scenes 5x and 6x, each of which has many features, unless `pairs`. The sentence into
 * text. */
static int tell(bool (*differs)(const struct suite_scene *s), const char *a, bool pairs, char *text,
                size_t size)
{
    json_t *claims = json_array(), *results = json_pack("{so}", "claims", claims);
    struct err e = {""};
    int num = 0;
    for (int i = 0; i < suite_shipped()->num_scenes; i++) {
        const struct suite_scene *s = &suite_shipped()->scene[i];
        bool is = s->expect == VERDICT_EQUIVALENT && differs(s);
        if (!pairs && (s->name[0] == '5' || s->name[0] == '6'))
            continue;
        num += is;
        add_claim(claims, s, is ? a : "pathtracer", "cycles", is);
        add_claim(claims, s, "cycles", "truth", false);
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

static bool has_mirror(const struct suite_scene *s)
{
    return file_has(s->dae, "<mirror>") || file_has(s->dae, "<reflective>");
}

static bool is_specular(const struct suite_scene *s)
{
    return has_mirror(s) || has_glass(s) || file_has(s->dae, "<refraction>");
}

static bool is_of_odd_size(const struct suite_scene *s)
{
    return s->width % 16 != 0 || s->height % 16 != 0;
}

static bool has_sky_image(const struct suite_scene *s)
{
    return s->environment[0] != '\0';
}

/* A mistake that needs both features: neither alone shows it. */
static bool has_mirror_and_spheres(const struct suite_scene *s)
{
    return has_mirror(s) && file_has(s->dae, "<sphere>");
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
        {is_specular, "pathtracer", "have a mirror, glass or refraction; none"},
        {is_of_odd_size, "pathtracer", "have sides that are no multiple of 16; none"},
        {has_sky_image, "pathtracer", "have an image of the sky; none"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[1024];
        assert_true(tell(cases[i].differs, cases[i].a, true, text, sizeof text) > 0);
        assert_non_null(strstr(text, cases[i].told));
    }
}

/* Controls: no feature is named where the differing claims share none, or where nothing differs. */
TEST(what_they_do_not_share_is_not)
{
    char text[1024];
    tell(every_third, "pathtracer", true, text, sizeof text);
    assert_non_null(strstr(text, "nothing in common"));
    assert_non_null(strstr(text, "several mistakes"));
    tell(cornell_alone, "pathtracer", true, text, sizeof text);
    assert_non_null(strstr(text, "Only 41_cornell differs"));
    tell(all, "pathtracer", true, text, sizeof text);
    assert_non_null(strstr(text, "Every claim differs"));
    tell(none, "pathtracer", true, text, sizeof text);
    assert_string_equal(text, "");
    /* One claim says nothing of others. */
    json_t *claims = json_array(), *results = json_pack("{so}", "claims", claims);
    struct err e;
    add_claim(claims, &suite_shipped()->scene[0], "pathtracer", "cycles", true);
    MUST(shared_features_tell(results, "reference/scenes", text, sizeof text, &e));
    json_decref(results);
    assert_string_equal(text, "");
}

/* 32_sun_plane and 27_smooth_normals have a directional light, the latter and 44_mesh shading normals: if 27 alone differs
 * no claim tells the two apart. Control: if 44 differs as well, they are. */
static bool is_of_both(const struct suite_scene *s)
{
    return strcmp(s->name, "27_smooth_normals") == 0;
}

static bool has_shading_normals(const struct suite_scene *s)
{
    return is_of_both(s) || strcmp(s->name, "44_mesh") == 0;
}

TEST(a_tie_is_told_as_one)
{
    char text[1024];
    tell(is_of_both, "pathtracer", false, text, sizeof text);
    assert_non_null(strstr(text, "a directional light"));
    assert_non_null(strstr(text, "shading normals"));
    assert_non_null(strstr(text, "Nearly as likely"));
    tell(has_shading_normals, "pathtracer", false, text, sizeof text);
    assert_non_null(strstr(text, "have shading normals; none"));
    assert_null(strstr(text, "a directional light"));
}

/* Nothing but the noise is wrong: claims of consistency are ones of their own, and of no account if they agree. */
TEST(claims_of_consistency_count_if_one_differs)
{
    struct err e = {""};
    char text[1024];
    json_t *claims = json_array(), *consistency = json_array(),
           *results = json_pack("{so,so}", "claims", claims, "consistency", consistency);
    int num = 0;
    for (int i = 0; i < suite_shipped()->num_scenes; i++) {
        const struct suite_scene *s = &suite_shipped()->scene[i];
        if (s->expect != VERDICT_EQUIVALENT)
            continue;
        add_claim(claims, s, "pathtracer", "cycles", false);
        if (s->consistency.renders == 0)
            continue;
        num++;
        json_array_append_new(consistency, json_pack("{ss,ss,ss}", "scene", s->name, "engine",
                                                     "pathtracer", "verdict", "DIFFERENT"));
    }
    assert_true(num > 2);
    MUST(shared_features_tell(results, "reference/scenes", text, sizeof text, &e));
    assert_non_null(strstr(text, "have the side pathtracer-consistency; none"));
    size_t i;
    json_t *c;
    json_array_foreach(consistency, i, c)
        json_object_set_new(c, "verdict", json_string("EQUIVALENT"));
    MUST(shared_features_tell(results, "reference/scenes", text, sizeof text, &e));
    assert_string_equal(text, "");
    json_decref(results);
}
