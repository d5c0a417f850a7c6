/* Loading of the suite: the shipped one, and every way in which a suite can be wrong. */
#include "reference/suite/suite.h"
#include "renderer/scene/environment.h"
#include "renderer/base/fs.h"
#include "renderer/base/sha256.h"
#include "tests/support/build_scene.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

static const char shipped[] = "reference/scenes";

/* Writes dir/name of test_path(). */
static void put(const char *dir, const char *name, const char *text)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", dir, name);
    test_write_json(test_path(path), text);
}

static const char *make_dir(const char *name)
{
    struct err e;
    MUST(fs_make_dirs(test_path(name), &e));
    return name;
}

static void load_shipped(struct suite *s)
{
    struct err e;
    MUST(suite_load(shipped, s, &e));
}

/* What the families promise: closed forms in 1x, each engine a reference or a reason why not, a page
 * for each scene. */
TEST(shipped_suite_loads)
{
    OWN(suite) s;
    load_shipped(&s);
    int closed_forms = 0, must_differ = 0;
    for (int i = 0; i < s.num_scenes; i++) {
        const struct suite_scene *scene = &s.scene[i];
        char path[4096];
        snprintf(path, sizeof path, "%s/%s.md", shipped, scene->name);
        if (access(path, R_OK) != 0)
            fail_msg("%s is missing", path);
        assert_int_equal(access(scene->dae, R_OK), 0);
        static const char *const engines[] = {"cycles", "povray"};
        for (size_t k = 0; k < COUNT(engines); k++)
            if ((suite_reference_of(scene, engines[k]) != NULL) ==
                (json_object_get(scene->not_expressible, engines[k]) != NULL))
                fail_msg("%s: needs either a reference or a reason for %s", scene->name,
                         engines[k]);
        if (scene->name[0] == '1')
            assert_non_null(suite_reference_of(scene, "truth"));
        if (i > 0)
            assert_true(strcmp(s.scene[i - 1].name, scene->name) < 0);
        assert_ptr_equal(suite_find(&s, scene->name), scene);
        closed_forms += scene->name[0] == '1';
        must_differ += scene->name[0] == '9';
    }
    assert_true(closed_forms > 0 && must_differ > 0);
    assert_null(suite_find(&s, "41_corne"));
}

TEST(fields_are_those_of_the_file)
{
    OWN(suite) s;
    load_shipped(&s);
    const struct suite_scene *c = suite_find(&s, "41_cornell");
    assert_non_null(c);
    assert_string_equal(c->dae, "reference/scenes/41_cornell.dae");
    assert_string_equal(c->references_of, "41_cornell");
    assert_int_equal(c->width, 128);
    assert_int_equal(c->height, 128);
    assert_int_equal(c->depth, 5);
    assert_int_equal(c->spp, 4096);
    assert_int_equal(c->tile, 16);
    assert_int_equal(c->expect, VERDICT_EQUIVALENT);
    const struct suite_reference *povray = suite_reference_of(c, "povray");
    assert_string_equal(povray->fidelity, "limit");
    assert_true(povray->margin_global == 0.005 && povray->margin_tile == 0.02);
    assert_int_equal(povray->replicates, 256);
    assert_int_equal(povray->subgrid, 3);
    assert_int_equal(suite_reference_of(c, "cycles")->spp, 256);

    const struct suite_scene *f = suite_find(&s, "11_furnace");
    assert_string_equal(suite_reference_of(f, "truth")->kind, "furnace");
    assert_non_null(json_object_get(suite_reference_of(f, "truth")->values, "albedo"));

    const struct suite_scene *d = suite_find(&s, "92_half_pixel");
    assert_int_equal(d->expect, VERDICT_DIFFERENT);
    assert_string_equal(d->references_of, "41_cornell");
    assert_int_equal(d->num_references, c->num_references);
    assert_memory_equal(d->reference, c->reference, sizeof c->reference);
    assert_string_not_equal(d->sha256, c->sha256);
}

/* The images that a scene loads are exactly those its .json lists as used, so its hash covers them. */
TEST(images_of_textures_are_used_files)
{
    struct suite s;
    size_t images = 0;
    load_shipped(&s);
    for (int i = 0; i < s.num_scenes; i++) {
        struct scene scene;
        struct camera camera;
        struct err e = {""};
        const json_t *uses = json_object_get(s.scene[i].json, "uses");
        if (strcmp(s.scene[i].name, "44_mesh") == 0)
            continue; /* a megabyte without any */
        MUST(suite_open(&s.scene[i], &scene, &camera, &e));
        assert_int_equal(json_array_size(uses), scene.num_images);
        for (uint32_t k = 0; k < scene.num_images; k++, images++) {
            bool found = false;
            const char *file = fs_base(image_get_attr(&scene.images[k], SCENE_IMAGE_FILE));
            for (size_t j = 0; j < json_array_size(uses); j++)
                found |= strcmp(json_string_value(json_array_get(uses, j)), file) == 0;
            assert_true(found);
        }
        scene_free(&scene);
    }
    assert_true(images > 0);
    char dae[65];
    struct err e = {""};
    const struct suite_scene *t = suite_find(&s, "29_textures");
    MUST(sha256_file(t->dae, dae, &e));
    assert_string_not_equal(t->sha256, dae);
    suite_free(&s);
}

/* Lines in which two files differ, the comment at the top aside; calls back with both. */
static int differing_lines(const char *a, const char *b,
                           void (*check)(const char *line_a, const char *line_b))
{
    char path[2][4096], line[2][1024];
    FILE *f[2];
    for (int i = 0; i < 2; i++) {
        snprintf(path[i], sizeof path[i], "%s/%s.dae", shipped, i == 0 ? a : b);
        f[i] = fopen(path[i], "r");
        assert_non_null(f[i]);
    }
    int differing = 0;
    for (int n = 1;; n++) {
        char *got[2] = {fgets(line[0], sizeof line[0], f[0]), fgets(line[1], sizeof line[1], f[1])};
        assert_true((got[0] == NULL) == (got[1] == NULL));
        if (got[0] == NULL)
            break;
        if (n == 2 || strcmp(line[0], line[1]) == 0)
            continue;
        differing++;
        check(line[0], line[1]);
    }
    fclose(f[0]);
    fclose(f[1]);
    return differing;
}

static void albedos_are_2_percent_apart(const char *line_a, const char *line_b)
{
    static const char format[] = " <diffuse><color>%lf %lf %lf 1</color></diffuse>";
    double a[3], b[3];
    assert_int_equal(sscanf(line_a, format, &a[0], &a[1], &a[2]), 3);
    assert_int_equal(sscanf(line_b, format, &b[0], &b[1], &b[2]), 3);
    for (int c = 0; c < 3; c++)
        assert_true(b[c] > 1.0199999 * a[c] && b[c] < 1.0200001 * a[c]);
}

/* Both lines are `format` with one number each; the second number is more than low and less than high times the
 * first. */
static void factor(const char *line_a, const char *line_b, const char *format, double low,
                   double high)
{
    double a, b;
    assert_int_equal(sscanf(line_a, format, &a), 1); // NOLINT(clang-diagnostic-format-nonliteral)
    assert_int_equal(sscanf(line_b, format, &b), 1); // NOLINT(clang-diagnostic-format-nonliteral)
    assert_true(b > low * a && b < high * a);
}

/* Half a pixel at the image's centre: atan(tan(39.6 deg / 2) / 128) = 0.16115402 deg. */
static void turn_is_half_a_pixel(const char *line_a, const char *line_b)
{
    double a, b;
    assert_int_equal(sscanf(line_a, " <rotate>0 1 0 %lf</rotate>", &a), 1);
    assert_int_equal(sscanf(line_b, " <rotate>0 1 0 %lf</rotate>", &b), 1);
    assert_true(a == 0 && b > 0.16115 && b < 0.16116);
}

static void index_is_3_percent_less(const char *line_a, const char *line_b)
{
    factor(line_a, line_b, " <ior>%lf</ior>", 0.9699999, 0.9700001);
}

static void alphas_are_10_percent_apart(const char *line_a, const char *line_b)
{
    factor(line_a, line_b, " <alpha>%lf</alpha>", 1.0999999, 1.1000001);
}

static void no_line_differs(const char *line_a, const char *line_b)
{
    fail_msg("%s differs from %s", line_b, line_a);
}

/* A 9x scene must be the named scene but for the stated change, or its verdict says nothing. */
TEST(scenes_that_differ_differ_as_stated)
{
    assert_int_equal(
        differing_lines("41_cornell", "91_albedo_2_percent", albedos_are_2_percent_apart), 4);
    assert_int_equal(differing_lines("41_cornell", "92_half_pixel", turn_is_half_a_pixel), 1);
    assert_int_equal(
        differing_lines("42_cornell_glass", "93_glass_ior_3_percent", index_is_3_percent_less), 1);
    assert_int_equal(
        differing_lines("43_cornell_metal", "94_rough_10_percent", alphas_are_10_percent_apart), 3);
    assert_int_equal(differing_lines("41_cornell", "95_one_bounce_less", no_line_differs), 0);
    assert_int_equal(differing_lines("46_sky", "96_sky_turned", no_line_differs), 0);

    /* The skies: tests/reference/suite/test_suite_scenes.c. */
    OWN(suite) s;
    load_shipped(&s);
    for (int i = 0; i < s.num_scenes; i++) {
        const struct suite_scene *scene = &s.scene[i], *base = suite_find(&s, scene->references_of);
        int missing = strcmp(scene->name, "95_one_bounce_less") == 0;
        assert_int_equal(scene->depth, base->depth - missing);
        assert_true(scene->lens_radius == base->lens_radius);
        assert_true(scene->focal_distance == base->focal_distance);
        assert_int_equal(strcmp(scene->environment, base->environment) != 0,
                         strcmp(scene->name, "96_sky_turned") == 0);
    }
}

/* Test vectors of FIPS 180-2, appendix B.1 and B.3, and of the empty message. */
TEST(sha256_matches_the_standard)
{
    static char million[1000001];
    memset(million, 'a', sizeof million - 1);
    const char *const cases[][2] = {
        {"", "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"},
        {"abc", "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"},
        {million, "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0"}};
    const char *path = test_path("message");
    char hex[65];
    struct err e;
    for (size_t i = 0; i < COUNT(cases); i++) {
        test_write_text(path, cases[i][0]);
        MUST(sha256_file(path, hex, &e));
        assert_string_equal(hex, cases[i][1]);
        sha256_text(cases[i][0], hex);
        assert_string_equal(hex, cases[i][1]);
    }
    assert_false(sha256_file(test_path("."), hex, &e));
    REFUSES(sha256_file(test_path("absent"), hex, &e), "absent: No such file");
}

TEST(verdicts_have_names)
{
    static const char *const names[] = {"EQUIVALENT", "DIFFERENT", "INCONCLUSIVE"};
    for (size_t i = 0; i < COUNT(names); i++) {
        enum verdict v;
        assert_true(verdict_parse(names[i], &v));
        assert_string_equal(verdict_name(v), names[i]);
    }
    enum verdict v;
    assert_false(verdict_parse("equivalent", &v));
    assert_false(verdict_parse("", &v));
}

static const char good[] =
    "{\n"
    "  'title': 'A title', 'detects': 'this', 'blind_to': 'that',\n"
    "  'width': 64, 'height': 32, 'depth': 1, 'spp': 16, 'tile': 16,\n"
    "  'expect': 'EQUIVALENT',\n"
    "  'references': {\n"
    "    'cycles': {'class': 'exact', 'margin_global': 0.004, 'margin_tile': 0.02,\n"
    "               'replicates': 8, 'spp': 64},\n"
    "    'povray': {'class': 'limit', 'margin_global': 0.005, 'margin_tile': 0.03,\n"
    "               'replicates': 9, 'subgrid': 3},\n"
    "    'truth': {'class': 'approximate', 'margin_global': 0.002, 'margin_tile': 0.01,\n"
    "              'kind': 'furnace', 'values': {}}\n"
    "  }\n"
    "}\n";

static const char good_9x[] = "{'title': 'A title', 'detects': 'this', 'blind_to': 'that',\n"
                              " 'width': 64, 'height': 32, 'depth': 1, 'spp': 16, 'tile': 16,\n"
                              " 'expect': 'DIFFERENT', 'references_of': '42_good'}\n";

/* Edits to one of those two files: `from` becomes `to`, "+" puts it behind a member; `message` is a part of the line that must
 * come out, file name first. */
static const struct fault {
    const char *from, *to, *message;
} faults[] = {
    {"'title': 'A title'", "'titel': 'A title'", "42_good.json: unknown key 'titel'"},
    {"'title': 'A title',", "", "42_good.json: missing key 'title'"},
    {"'A title'", "7", "42_good.json: 'title' is not a text"},
    {"'A title'", "''", "42_good.json: 'title' is empty"},
    {"'A title'", "'two\\nlines'", "42_good.json: 'title' is not one line"},
    {"'A title'",
     "'012345678901234567890123456789012345678901234567890123456789012301234567890123456789"
     "01234567890123456789012345678901234567890123'",
     "42_good.json: 'title' is longer than 127 bytes"},
    {"'blind_to': 'that',", "", "42_good.json: missing key 'blind_to'"},
    {"'width': 64", "'width': 64.0", "42_good.json: 'width' is not a whole number"},
    {"'width': 64", "'width': '64'", "42_good.json: 'width' is not a whole number"},
    {"'width': 64", "'width': 0", "42_good.json: 'width' is 0, not in 1..16384"},
    {"'width': 64", "'width': 4294967360", "42_good.json: 'width' is 4294967360, not in"},
    {"'height': 32", "'height': -32", "42_good.json: 'height' is -32, not in"},
    {"'tile': 16", "'tile': 0", "42_good.json: 'tile' is 0"},
    {"'depth': 1", "'depth': -1", "42_good.json: 'depth' is -1"},
    {"'spp': 16", "'spp': 1", "42_good.json: 'spp' is 1, not in 2.."},
    {"EQUIVALENT", "DIFFERENT", "but scenes of family 4 must be"},
    {"EQUIVALENT", "EQUAL", "42_good.json: 'expect' is 'EQUAL'"},
    {"EQUIVALENT", "INCONCLUSIVE", "42_good.json: 'expect' is 'INCONCLUSIVE'"},
    {"'references'", "'references_of': '42_good', 'references'",
     "42_good.json: unknown key 'references_of'"},
    {"'cycles'", "'arnold'", "42_good.json: unknown engine 'references.arnold'"},
    {"'cycles'", "'povray'", "42_good.json:8: duplicate object key"},
    {"'spp': 64", "'subgrid': 64", "42_good.json: unknown key 'references.cycles.subgrid'"},
    {", 'spp': 64", "", "42_good.json: missing key 'references.cycles.spp'"},
    {"'spp': 64", "'spp': 0", "42_good.json: 'references.cycles.spp' is 0"},
    {"'replicates': 8", "'replicates': 1",
     "42_good.json: 'references.cycles.replicates' is 1, not in 2.."},
    {"'class': 'exact'", "'class': 'good'", "42_good.json: 'references.cycles.class' is 'good'"},
    {"'class': 'exact', ", "", "42_good.json: missing key 'references.cycles.class'"},
    {"0.004", "0", "42_good.json: 'references.cycles.margin_global' is 0, not between"},
    {"0.004", "1", "42_good.json: 'references.cycles.margin_global' is 1, not between"},
    {"0.004", "-0.1", "42_good.json: 'references.cycles.margin_global' is -0.1"},
    {"0.03", "'3 %'", "42_good.json: 'references.povray.margin_tile' is not a number"},
    {"'subgrid': 3", "'subgrid': 65", "'references.povray.subgrid' is 65, not in 1..64"},
    {"'subgrid': 3", "'spp': 3", "unknown key 'references.povray.spp'"},
    {"'kind': 'furnace', ", "", "missing key 'references.truth.kind'"},
    {"'values': {}", "'values': []", "'references.truth.values' is not an object"},
    {"'kind'", "'replicates': 8, 'kind'", "unknown key 'references.truth.replicates'"},
    {"+", "'environment': 'a/b.exr'",
     "42_good.json: 'environment' is 'a/b.exr', not a file beside it"},
    {"+", "'uses': 'a.png'", "'uses' is not a list of files"},
    {"+", "'uses': ['a/b.png']", "'uses' [0] is not a file beside it"},
    {"+", "'uses': ['none.png']", "none.png: No such file"},
    {"+", "'environment': 1", "'environment' is not a text"},
    {"+", "'environment': 'none.exr'", "none.exr: No such file"},
    {"+", "'lens_radius': 0.1", "missing key 'focal_distance'"},
    {"+", "'focal_distance': 1", "missing key 'lens_radius'"},
    {"+", "'lens_radius': 0, 'focal_distance': 1", "42_good.json: 'lens_radius' is 0, not between"},
    {"+", "'not_expressible': {'povray': 'why'}",
     "42_good.json: 'povray' is both a reference and not expressible"},
    {"+", "'not_expressible': {'truth': 'why'}",
     "42_good.json: unknown key 'not_expressible.truth'"},
    {"+", "'variants': []", "'variants' is not an array of 1 to 8"},
    {"+", "'variants': [{'name': 'h'}]", "missing key 'variants[0].spp'"},
    {"+",
     "'variants': [{'name': 'H', 'options': ['-H'], 'spp': 4, 'margin_global': 0.1, "
     "'margin_tile': 0.1}]",
     "'variants[0].name' is 'H': only a-z"},
    {"+",
     "'variants': [{'name': 'h', 'options': [4], 'spp': 4, 'margin_global': 0.1, "
     "'margin_tile': 0.1}]",
     "'variants[0].options' holds what is not a text"},
    {"+", "'consistency': {'renders': 3, 'spp': 4, 'margin': 1}",
     "'consistency.renders' is 3, not in 4..256"},
    {"+", "'consistency': {'renders': 8, 'spp': 4, 'margin': 1, 'noise_margin': 0.1}",
     "42_good.json: 'consistency.noise_margin' needs a truth whose noise is known"},
    {"+", "'consistency': {'renders': 8, 'spp': 4, 'margin': 1, 'parts': 4}",
     "'consistency.parts' is 4, not in 1..3"},
    {"+",
     "'consistency': {'renders': 8, 'spp': 4, 'margin': 1, 'adaptive': {'batch': 1, "
     "'tolerance': 0.1, 'spp': 64}}",
     "'consistency.adaptive.batch' is 1, not in 2.."},
    {"  }\n}", "  }\n", "42_good.json:14: '}' expected near end of file"},
};
static const struct fault faults_of_9x[] = {
    {"+", "'not_expressible': {}", "unknown key 'not_expressible'"},
    {"DIFFERENT", "EQUIVALENT", "93_good.json: 'expect' is 'EQUIVALENT', but scenes of"},
    {", 'references_of': '42_good'", "", "93_good.json: missing key 'references_of'"},
    {"'references_of': '42_good'", "'references': {}", "93_good.json: unknown key 'references'"},
    {"42_good", "42_best", "93_good.json: 'references_of' names no scene: '42_best'"},
    {"42_good", "93_good", "93_good.json: 'references_of' names '93_good', which has none"},
    {"'height': 32", "'height': 64", "93_good.json: 64 x 64 pixels, but '42_good' has"},
};

/* `text` so edited; the caller frees. */
static char *edited(const char *text, const char *from, const char *to)
{
    const bool adds = strcmp(from, "+") == 0;
    const char *at = strstr(text, adds ? "'expect'" : from);
    assert_non_null(at);
    size_t size = strlen(text) + strlen(to) + 3;
    char *out = malloc(size);
    assert_non_null(out);
    snprintf(out, size, "%.*s%s%s%s", (int)(at - text), text, to, adds ? ", " : "",
             at + (adds ? 0 : strlen(from)));
    return out;
}

static void expect_faults(const char *dir, const char *name, const char *text,
                          const struct fault *f, size_t num)
{
    struct suite s;
    struct err e;
    for (size_t i = 0; i < num; i++) {
        OWN_TEXT wrong = edited(text, f[i].from, f[i].to);
        put(dir, name, wrong);
        REFUSES(suite_load(test_path(dir), &s, &e), f[i].message);
        assert_ptr_equal(strstr(e.msg, test_path(dir)), e.msg);
    }
    put(dir, name, text);
}

TEST(faults_are_named)
{
    const char *dir = make_dir("faults");
    OWN(suite) s;
    struct err e;
    put(dir, "42_good.dae", "geometry");
    put(dir, "93_good.dae", "geometry");
    put(dir, "42_good.json", good);
    put(dir, "93_good.json", good_9x);
    put(dir, "README.md", "ignored");
    put(dir, ".hidden.json", "ignored");
    MUST(suite_load(test_path(dir), &s, &e));
    assert_int_equal(s.num_scenes, 2);
    assert_int_equal(s.scene[1].num_references, 3);
    expect_faults(dir, "42_good.json", good, faults, COUNT(faults));
    expect_faults(dir, "93_good.json", good_9x, faults_of_9x, COUNT(faults_of_9x));
}

/* One directory after the other: its files, and what must be said of it. */
static const struct listing {
    const char *files[3];
    const char *message;
} listings[] = {
    {{NULL}, ": no scenes"},
    {{"README.md"}, ": no scenes"},
    {{"42_good.dae"}, "/42_good.dae: no 42_good.json beside it"},
    {{"42_good.json"}, "/42_good.json: no 42_good.dae beside it"},
    {{"42_good.json", "42_good.dae", "43_more.dae"}, "/43_more.dae: no 43_more.json"},
    {{"good.dae"}, "/good.dae: not named NN_name"},
    {{"72_good.dae"}, "/72_good.dae: not named NN_name"},
    {{"4_good.dae"}, "/4_good.dae: not named NN_name"},
    {{"42_Good.dae"}, "/42_Good.dae: not named NN_name"},
    {{"42_.json"}, "/42_.json: not named NN_name"},
    {{"42_234567890123456789012345678901234567890123456789012345678901234.dae"}, "not named"},
};

/* A copy of 12_point_plane with a lens and an environment of radiance 1 2 3. */
TEST(environment_and_lens_are_opened)
{
    const char *dir = make_dir("lens");
    char plain[65], *dae = test_read("reference/scenes/12_point_plane.dae");
    struct err e;
    test_write_text(test_path("lens/42_good.dae"), dae);
    free(dae);
    put(dir, "42_good.json", good);
    struct suite s;
    MUST(suite_load(test_path(dir), &s, &e));
    memcpy(plain, s.scene[0].sha256, sizeof plain);
    suite_free(&s);

    struct image sky = build_image(4, 2);
    for (int i = 0; i < 3 * 8; i++)
        sky.data[i] = (float)(1 + i % 3);
    MUST(image_write_exr(test_path("lens/sky.exr"), &sky, &e));
    image_free(&sky);
    char *text =
        edited(good, "+", "'environment': 'sky.exr', 'lens_radius': 0.25, 'focal_distance': 2.5");
    put(dir, "42_good.json", text);
    free(text);
    OWN(scene) scene;
    struct camera camera;
    MUST(suite_load(test_path(dir), &s, &e) && suite_open(&s.scene[0], &scene, &camera, &e));
    assert_true(camera.lens_radius == 0.25f && camera.focal_distance == 2.5f);
    assert_int_equal(camera.width, 64);
    rgb up = environment_radiance(scene.environment, (vec3){0, 1, 0});
    assert_true(up.r == 1 && up.g == 2 && up.b == 3);
    assert_string_not_equal(s.scene[0].sha256, plain);
    suite_free(&s);
}

TEST(wrong_directories_are_named)
{
    struct suite s;
    struct err e;
    assert_false(suite_load("tests/no such directory", &s, &e));
    assert_string_equal(e.msg, "tests/no such directory: No such file or directory");
    for (size_t i = 0; i < COUNT(listings); i++) {
        char dir[16];
        snprintf(dir, sizeof dir, "listing_%zu", i);
        make_dir(dir);
        for (size_t j = 0; j < COUNT(listings[i].files) && listings[i].files[j] != NULL; j++)
            put(dir, listings[i].files[j], good);
        REFUSES(suite_load(test_path(dir), &s, &e), listings[i].message);
    }
}
