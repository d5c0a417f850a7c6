/* Descriptions of engines: what is read and refused, which scenes need what, and what comes of
 * programs that behave and that do not. The programs are a few words of shell; their images are
 * written here first, so that every number of the folded image is known. Renderers that trace rays
 * are run by end_to_end.sh. */
#define _GNU_SOURCE
#include "tests/support/build_scene.h"

#include "reference/external/engine_bindings.h"
#include "reference/external/engine_description.h"
#include "reference/suite/features.h"
#include "reference/replicates/engine_driver.h"
#include "renderer/base/shell_quote.h"
#include "tests/support/suite_files.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

enum { W = 4, H = 3, PIXELS = W * H, K = 3, SEED = 5 };

static struct suite_scene point_plane; /* 12_point_plane at W x H */

static int set_up(void **state)
{
    (void)state;
    point_plane = *suite_shipped_scene("12_point_plane");
    point_plane.width = W;
    point_plane.height = H;
    return 0;
}

static bool load(const char *json, struct engine *en, struct err *e)
{
    test_write_json(test_path("engine.json"), json);
    return engine_load(test_path("engine.json"), en, e);
}

static void must_load(const char *json, struct engine *en)
{
    struct err e;
    MUST(load(json, en, &e));
}

/* Red is red(pixel), green 2, blue 0. PFM goes from the bottom row up. */
static void write_pfm(const char *name, int width, int height, float (*red)(int pixel, int k),
                      int k)
{
    char bytes[4096];
    int n = snprintf(bytes, sizeof bytes, "PF\n%d %d\n-1.0\n", width, height);
    for (int y = height - 1; y >= 0; y--)
        for (int x = 0; x < width; x++) {
            const float px[3] = {red(y * width + x, k), 2, 0};
            memcpy(bytes + n, px, sizeof px);
            n += (int)sizeof px;
        }
    test_write(test_path(name), bytes, (size_t)n);
}

static float ramp(int pixel, int k)
{
    return (float)(pixel + 1) * (float)(k * k + 1); /* x 1, 2, 5 */
}
static float constant(int pixel, int k)
{
    (void)pixel, (void)k;
    return 0.25f;
}
static float not_a_number(int pixel, int k)
{
    return pixel == 6 ? NAN : (float)k;
}

/* Runs `script` with the scene, the image's path and the seed as $1, $2, $3. */
static void engine_of_script(const char *script, const char *more, struct engine *en)
{
    char json[2048];
    snprintf(json, sizeof json,
             "{'name': 'fake', 'format': 'pbrt', 'image': 'pfm', 'expresses': "
             "['diffuse', 'point'], 'replicates': %d, 'spp': 7, 'command': ['sh', '-c', "
             "'%s', 'sh', '{scene}', '{out}', '{seed}', '{spp} {depth} {width} {height} "
             "{threads}'], 'output': 'mean'%s}",
             K, script, more);
    must_load(json, en);
}

/* Writes an image for each replicate, named after its seed. */
static void write_replicates(int num)
{
    for (int k = 0; k < num; k++) {
        char name[64];
        snprintf(name, sizeof name, "picture_%u.pfm", replicate_seed(SEED, k));
        write_pfm(name, W, H, ramp, k);
    }
}

static bool render(const struct engine *en, const struct suite_scene *s, struct moments *m,
                   json_t **manifest, struct err *e)
{
    const struct engine_options opt = {
        .seed = SEED, .threads = 2, .timeout_s = 1, .work_dir = test_path(".")};
    return engine_render(en, s, &opt, m, manifest, e);
}

/* The image of point_plane, and its seeds; frees the engine. */
static struct moments must_render(struct engine *en, size_t num_seeds)
{
    struct moments m;
    json_t *manifest;
    struct err e = {""};
    MUST(render(en, &point_plane, &m, &manifest, &e));
    assert_int_equal(json_array_size(json_object_get(manifest, "seeds")), num_seeds);
    json_decref(manifest);
    engine_free(en);
    return m;
}

/* The same by a description. */
static struct moments image_of(const char *json, size_t num_seeds)
{
    struct engine en;
    must_load(json, &en);
    return must_render(&en, num_seeds);
}

TEST(shipped_descriptions_load)
{
    static const char *const names[] = {"mitsuba",          "pbrt",    "povray_plain", "student",
                                        "pathtracer_again", "blender", "c-ray"};
    for (size_t i = 0; i < COUNT(names); i++) {
        char path[128];
        OWN(engine) en;
        struct err e;
        snprintf(path, sizeof path, "reference/engines/%s.json", names[i]);
        MUST(engine_load(path, &en, &e));
        assert_string_equal(en.name, names[i]);
    }
}

TEST(members_are_read)
{
    OWN(engine) en;
    must_load("{'name': 'a-1', 'format': 'cycles', 'output': 'mean', 'image': 'hdr',"
              "'command': ['x', '{scene}', '{out}', '{seed}'], 'expresses': ['mirror'],"
              "'depth_offset': -1, 'spp': 9, 'replicates': 11}",
              &en);
    assert_string_equal(en.name, "a-1");
    assert_ptr_equal(en.format, engine_kind_of("cycles"));
    assert_int_equal(en.output, OUTPUT_MEAN);
    assert_string_equal(en.image, "hdr");
    assert_int_equal(en.feature, 1u << FEATURE_MIRROR);
    assert_int_equal(en.depth_offset, -1);
    assert_int_equal(en.spp, 9);
    assert_int_equal(en.replicates, 11);
}

/* Each replaces one member of a good description, or adds one; NULL: leaves it out. */
TEST(bad_descriptions_are_refused)
{
    static const char *const good[][2] = {
        {"name", "'x'"},
        {"format", "'pbrt'"},
        {"output", "'mean'"},
        {"command", "['x', '{scene}', '{out}', '{seed}']"},
        {"expresses", "['diffuse']"},
    };
    enum { NUM_GOOD = COUNT(good) };
    static const char *const bad[][3] = {
        {"colour", "1", "unknown key 'colour'"},
        {"name", NULL, "missing key 'name'"},
        {"name", "'X'", "a-z, 0-9"},
        {"name", "'../x'", "a-z, 0-9"},
        {"name", "'cycles'", "which this program uses itself"},
        {"format", "'obj'", "'format' is 'obj', none of: cycles, povray, "},
        {"format", "'obj'", "mitsuba, pbrt, dae"},
        {"output", "'variance'", "none of: mean, exact, moments"},
        {"output", "'exact'", "has a {seed}, but 'output' is 'exact'"},
        {"scale", "0", "'scale' is 0, not between"},
        {"filter", "'sinc:2'", "'filter': a pixel filter is box"},
        {"filter", "1", "'filter' is not"},
        {"shared_samples", "true", "about a 'filter', which is not there"},
        {"channels", "'apart'", "none of: together, separate"},
        {"margin", "0.1", "'margin' is not an object"},
        {"margin", "{'global': 0.1, 'tile': 0.2}", "missing key 'margin.reason'"},
        {"margin", "{'global': 1, 'tile': 0.2, 'reason': 'x'}", "'margin.global' is 1"},
        {"margin", "{'global': 0.1, 'tiles': 0.2}", "unknown key 'margin.tiles'"},
        {"output", "'noisy'", "has a {seed}, but 'output' is 'noisy'"},
        {"format", "'file'", "'expresses' is for scenes that are looked into"},
        {"image", "'png'", "none of: exr, hdr, pfm"},
        {"command", "[]", "'command' is not a list of 1 to 256 texts"},
        {"command", "'x {scene}'", "'command' is not a list"},
        {"command", "['x', 3]", "'command' [1] is not a text"},
        {"command", "['', '{scene}']", "'command' [0] is not a text"},
        {"command", "['x', '{scene}', '{seed}']", "'command' has no {out}"},
        {"command", "['x', '{out}', '{seed}']", "'command' has no {scene}"},
        {"command", "['x', '{out}', '{scene}']", "'command' has no {seed}"},
        {"command", "['x', '{out}', '{scene}', '{seed}', '-s={samples}']",
         "'command' [4]: unknown placeholder '{samples}'"},
        {"command", "['x', '{out}', '{scene}', '{seed']", "'command' [3]: a brace without"},
        {"command", "['x', '{out}', '{scene}', 'seed}']", "'command' [3]: a brace without"},
        {"command", "['x', '{out}', '{scene}', '{seed}', '{}']", "unknown placeholder '{}'"},
        {"command", "['x', '{out}', '{scene}', '{seed}\\n']", "'command' [3] is not one line"},
        {"version", "['x', '{seed}']", "'version' [1]: unknown placeholder '{seed}'"},
        {"expresses", "['diffuse', 'hair']", "'expresses' [1]: 'hair' is no feature"},
        {"expresses", "[7]", "'expresses' [0]"},
        {"depth_offset", "2", "'depth_offset' is 2, not in -1..1"},
        {"spp", "0.5", "'spp' is not a whole number"},
        {"replicates", "2", "'replicates' is 2, not in 3..4096"},
        {"lens_args", "['-b', '{lens_radius}', '{focal_distance}']",
         "'lens_args' is for \"format\": \"dae\" only"},
    };
    for (size_t i = 0; i < COUNT(bad); i++) {
        char json[1024] = "{";
        bool replaced = false;
        for (size_t k = 0; k <= NUM_GOOD; k++) {
            const char *key = k < NUM_GOOD ? good[k][0] : bad[i][0];
            const char *value = k < NUM_GOOD ? good[k][1] : bad[i][1];
            if (k < NUM_GOOD && strcmp(key, bad[i][0]) == 0) {
                value = bad[i][1];
                replaced = true;
            }
            if (value != NULL && (k < NUM_GOOD || !replaced))
                snprintf(json + strlen(json), sizeof json - strlen(json), "%s'%s': %s",
                         strlen(json) > 1 ? ", " : "", key, value);
        }
        strcat(json, "}");
        struct engine en;
        struct err e = {0};
        REFUSES(load(json, &en, &e), bad[i][2]);
        assert_non_null(strstr(e.msg, "engine.json"));
    }
    struct engine en;
    struct err e;
    REFUSES(load("{'name': }", &en, &e), "engine.json:1:");
    assert_false(load("{'name': 'x', 'name': 'y'}", &en, &e));
    assert_false(load("[]", &en, &e));
    REFUSES(engine_load(test_path("nothing.json"), &en, &e), "nothing.json: cannot read");
}

TEST(a_dae_needs_its_lens_on_the_command_line)
{
    const char *const head = "{'name': 'x', 'format': 'dae', 'output': 'mean', 'command': "
                             "['x', '{scene}', '{out}', '{seed}'], 'expresses': ";
    static const struct {
        const char *tail, *error;
    } cases[] = {
        {"['lens']}", "come together"},
        {"[], 'lens_args': ['{lens_radius}', '{focal_distance}']}", "come together"},
        {"['lens'], 'lens_args': ['{lens_radius}']}", "has no {focal_distance}"},
        {"['lens'], 'lens_args': ['{lens_radius}', '{focal_distance}']}", NULL},
        {"['environment'], 'environment_args': ['{scene}']}", "unknown placeholder"},
        {"['environment'], 'environment_args': ['-e{environment}']}", NULL},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        char json[1024];
        struct engine en;
        struct err e = {0};
        snprintf(json, sizeof json, "%s%s", head, cases[i].tail);
        bool ok = load(json, &en, &e);
        assert_int_equal(ok, cases[i].error == NULL);
        if (ok)
            engine_free(&en);
        else if (strstr(e.msg, cases[i].error) == NULL)
            fail_msg("%s: %s", json, e.msg);
    }
}

TEST(placeholders_are_filled_in)
{
    OWN(engine) en;
    struct err e;
    char **argv;
    must_load("{'name': 'x', 'format': 'pbrt', 'output': 'mean', 'expresses': [],"
              "'command': ['run', '', '{{{seed}}}', '{out}{out}', 'a b;$(c) {scene}']}",
              &en);
    const struct engine_value values[] = {{"scene", "s"}, {"out", "/o"}, {"seed", "12"}, {0}};
    const char *const command[] = {"command", NULL}, *const absent[] = {"version", NULL};
    MUST(engine_argv(&en, command, values, &argv, &e));
    const char *const want[] = {"run", "", "{12}", "/o/o", "a b;$(c) s"};
    for (int i = 0; i < 5; i++)
        assert_string_equal(argv[i], want[i]);
    assert_null(argv[5]);
    free(argv);
    assert_true(engine_argv(&en, absent, values, &argv, &e));
    assert_null(argv[0]);
    free(argv);
    REFUSES(engine_argv(&en, command, values + 1, &argv, &e), "no value for '{scene}'");
}

TEST(scenes_know_what_they_need)
{
    static const struct {
        const char *name;
        unsigned features;
    } cases[] = {
        {"11_furnace", 1u << FEATURE_DIFFUSE | 1u << FEATURE_AREA | 1u << FEATURE_SPHERE},
        {"12_point_plane", 1u << FEATURE_DIFFUSE | 1u << FEATURE_POINT},
        {"13_square_patch", 1u << FEATURE_DIFFUSE | 1u << FEATURE_AREA},
        {"41_cornell", 1u << FEATURE_DIFFUSE | 1u << FEATURE_AREA | 1u << FEATURE_SPHERE},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        const struct suite_scene *s = suite_shipped_scene(cases[i].name);
        OWN(scene) scene;
        struct camera camera;
        struct err e;
        assert_non_null(s);
        MUST(suite_open(s, &scene, &camera, &e));
        assert_int_equal(features_of_scene(&scene, &camera), cases[i].features);
        camera.lens_radius = 0.01f;
        assert_int_equal(features_of_scene(&scene, &camera),
                         cases[i].features | 1u << FEATURE_LENS);
        camera.lens_radius = 0;
        camera.far = 0.01f;
        assert_int_equal(features_of_scene(&scene, &camera),
                         cases[i].features | 1u << FEATURE_CLIP);
    }
}

/* The features that no scene above has, one material or light at a time. */
TEST(materials_and_lights_have_features)
{
    static const struct {
        struct material m;
        unsigned features;
    } of[] = {
        {{.kind = MATERIAL_MIRROR, .reflectance = {1, 1, 1}}, 1u << FEATURE_MIRROR},
        {{.kind = MATERIAL_GLASS, .ior = 1.5f}, 1u << FEATURE_GLASS},
        {{.kind = MATERIAL_GLASS, .ior = 1.5f, .schlick = true}, 1u << FEATURE_SCHLICK},
        {{.kind = MATERIAL_REFRACTION, .ior = 1.5f}, 1u << FEATURE_REFRACTION},
        {{.kind = MATERIAL_MICROFACET, .alpha = .1f}, 1u << FEATURE_MICROFACET},
        {{.kind = MATERIAL_MICROFACET, .microfacet = MICROFACET_BECKMANN, .alpha = .1f},
         1u << FEATURE_BECKMANN},
        {{.kind = MATERIAL_PLASTIC, .specular = {.1f, 0, 0}, .alpha = .1f}, 1u << FEATURE_PLASTIC},
        {{.kind = MATERIAL_PLASTIC, .specular = {.1f, 0, 0}, .mirror = {0, 0, .1f}, .alpha = .1f},
         1u << FEATURE_PLASTIC | 1u << FEATURE_MIRROR},
        {{.radiance = {1, 1, 1}, .radiance_both_sides = true}, 1u << FEATURE_TWO_SIDED},
    };
    for (size_t i = 0; i < 13; i++) {
        OWN(scene) s = build_scene();
        struct err e;
        unsigned want = 0;
        uint32_t m = build_like(&s, i < 9 ? of[i].m : (struct material){0});
        if (i < 9)
            want = of[i].features;
        build_quad(&s, v3(-1, -1, -3), v3(2, 0, 0), v3(0, 2, 0), m);
        if (i == 9) {
            build_spot(&s, v3(0, 0, 0), v3(0, 1, 0), 0, 0, grey(1));
            want = 1u << FEATURE_SPOT;
        }
        if (i == 10) {
            build_sun(&s, v3(0, 1, 0), grey(1));
            want = 1u << FEATURE_DIRECTIONAL;
        }
        if (i == 11) { /* tilted by 0.01, a little over half a degree */
            s.normal[0] = normalize(v3(0.01f, 0, 1));
            want = 1u << FEATURE_SMOOTH;
        }
        if (i == 12) {
            const rgb texel = {0.1f, 0.2f, 0.3f};
            s.materials[m].reflectance = grey(1);
            s.materials[m].reflectance_map = build_texture(&s, 1, 1, &texel, true, TEXTURE_CLAMP);
            want = 1u << FEATURE_DIFFUSE | 1u << FEATURE_TEXTURE;
        }
        build_camera(&s, v3(0, 0, 0), 40);
        const struct camera c = build_finish(&s, 8, 8);
        assert_int_equal(features_of_scene(&s, &c), want);
        assert_int_equal(features_check_textures("x", &s, &e), i != 12);
        assert_true(i != 12 ||
                    strcmp(e.msg, "x: the texture of material 'm' cannot be expressed") == 0);
    }
}

TEST(what_cannot_be_expressed_is_said)
{
    OWN(engine) en;
    struct err e;
    must_load("{'name': 'x', 'format': 'povray', 'output': 'mean', 'expresses': "
              "['diffuse', 'point'], 'command': ['x', '{scene}', '{out}', '{seed}']}",
              &en);
    assert_true(engine_expresses(&en, &point_plane, test_path("."), &e));
    assert_false(engine_expresses(&en, suite_shipped_scene("41_cornell"), test_path("."), &e));
    assert_string_equal(e.msg, "the description does not list: area, sphere");
    /* The format's own limits, whatever the description says. */
    struct suite_scene deep = *suite_shipped_scene("41_cornell");
    en.feature = ~0u;
    deep.depth = 60;
    REFUSES(engine_expresses(&en, &deep, test_path("."), &e), "POV-Ray is verified to depth");
}

/* Three images whose red is a pixel's number times 1, 2 and 5, each for one seed: mean 8/3, M2
 * sum (x - 8/3)^2 = 1 + 4 + 25 - 64/3 = 26/3, M3 = (-5/3)^3 + (-2/3)^3 + (7/3)^3 = 210/27. */
TEST(replicates_are_folded)
{
    OWN(engine) en;
    OWN(moments) m;
    json_t *manifest;
    struct err e;
    write_replicates(K);
    engine_of_script("cp {here}/picture_$3.pfm $2 && test -s $1 && echo $4 > {here}/args",
                     ", 'version': ['sh', '-c', 'echo; echo Fake 3.1; echo more'], "
                     "'depth_offset': 1",
                     &en);
    MUST(render(&en, &point_plane, &m, &manifest, &e));
    assert_string_equal(m.unit, "replicate");
    assert_true(m.spp == 7);
    for (int p = 0; p < PIXELS; p++) {
        double x = p + 1;
        assert_true(m.n[p] == K);
        assert_true(fabs(m.mean[3 * p] - x * 8 / 3) < 1e-12 * x);
        assert_true(fabs(m.m2[3 * p] - x * x * 26 / 3) < 1e-12 * x * x);
        assert_true(fabs(m.m3[3 * p] - x * x * x * 210 / 27) < 1e-11 * x * x * x);
        assert_true(m.mean[3 * p + 1] == 2 && m.mean[3 * p + 2] == 0 && m.m2[3 * p + 1] == 0);
    }
    static const char *const text[][2] = {{"engine", "fake"},
                                          {"scene", "12_point_plane"},
                                          {"unit", "replicate"},
                                          {"version", "Fake 3.1"}};
    for (size_t i = 0; i < COUNT(text); i++)
        assert_string_equal(json_string_value(json_object_get(manifest, text[i][0])), text[i][1]);
    const json_t *seeds = json_object_get(manifest, "seeds");
    assert_int_equal(json_array_size(seeds), K);
    for (int k = 0; k < K; k++)
        assert_int_equal(json_integer_value(json_array_get(seeds, (size_t)k)),
                         replicate_seed(SEED, k));
    assert_int_equal(strlen(json_string_value(json_object_get(manifest, "binary_sha256"))), 64);
    /* One of the words has blanks. */
    int num;
    char **word =
        shell_quote_split(json_string_value(json_object_get(manifest, "command")), &num, &e);
    assert_non_null(word);
    const json_t *command = json_object_get(en.json, "command");
    assert_int_equal(num, json_array_size(command));
    for (int i = 0; i < num; i++)
        assert_string_equal(word[i], json_string_value(json_array_get(command, (size_t)i)));
    free(word);
    /* {spp} {depth} {width} {height} {threads} */
    char args[64] = "", want[64];
    FILE *f = fopen(test_path("args"), "r");
    assert_non_null(f);
    assert_non_null(fgets(args, sizeof args, f));
    fclose(f);
    snprintf(want, sizeof want, "7 %d 4 3 2\n", point_plane.depth + 1);
    assert_string_equal(args, want);
    json_decref(manifest);
}

/* x, 2 x, 5 x: mean 8 x/3, M2 = 78 x^2/9 = 26 x^2/3. With a tent of radius 1 whose samples pixels share, M2 is
 * multiplied by 2.25 (test_camera.c); if each pixel draws its own samples it stays. */
TEST(pixels_that_share_samples_count_as_noisier)
{
    static const char *const more[] = {", 'filter': 'tent:1'",
                                       ", 'filter': 'tent:1', 'shared_samples': false"};
    for (int i = 0; i < 2; i++) {
        struct engine en;
        write_replicates(K);
        engine_of_script("cp {here}/picture_$3.pfm $2 && grep -q triangle $1", more[i], &en);
        OWN(moments) m = must_render(&en, K);
        assert_true(fabs(m.sharing - (i == 0 ? 2.25 : 0)) < 1e-5);
        for (int p = 0; p < PIXELS; p++) {
            double x = p + 1, m2 = (i == 0 ? 2.25 : 1) * 26 / 3 * x * x;
            assert_true(fabs(m.mean[3 * p] - 8 * x / 3) < 1e-6 * x);
            assert_true(fabs(m.m2[3 * p] - m2) < 1e-5 * m2);
        }
    }
}

/* One run for each channel, each with a seed of its own and a scene in which all colours are grey, as they are in that channel:
 * red of run 0, 3, 6 is the pixel's number times 1, 10, 37 (k^2 + 1): mean 16, M2 = 15^2 + 6^2 + 21^2 = 702; green is 2. */
TEST(channels_are_rendered_apart)
{
    static const char *const grey[3][2] = {{"[3 3 3]", "[0.5 0.5 0.5]"},
                                           {"[2 2 2]", "[0.600000024 0.600000024 0.600000024]"},
                                           {"[1 1 1]", "[0.699999988 0.699999988 0.699999988]"}};
    struct engine en;
    write_replicates(3 * K);
    engine_of_script("cp {here}/picture_$3.pfm $2 && cp $1 {here}/scene_$3",
                     ", 'channels': 'separate'", &en);
    OWN(moments) m = must_render(&en, (size_t)3 * K);
    for (int p = 0; p < PIXELS; p++) {
        double x = p + 1;
        assert_true(m.n[p] == K);
        assert_true(fabs(m.mean[3 * p] - 16 * x) < 1e-12 * x);
        assert_true(fabs(m.m2[3 * p] - 702 * x * x) < 1e-11 * x * x);
        assert_true(m.mean[3 * p + 1] == 2 && m.mean[3 * p + 2] == 0);
    }
    for (int k = 0; k < 3 * K; k++) {
        char name[64];
        snprintf(name, sizeof name, "scene_%u", replicate_seed(SEED, k));
        OWN_TEXT text = test_read(test_path(name));
        assert_non_null(strstr(text, grey[k % 3][0]));
        assert_non_null(strstr(text, grey[k % 3][1]));
    }
}

TEST(images_without_noise_are_exact)
{
    struct engine en;
    struct err e;
    write_pfm("constant.pfm", W, H, constant, 0);
    engine_of_script("cp {here}/constant.pfm $2", "", &en);
    struct moments m = must_render(&en, K);
    assert_string_equal(m.unit, "exact");
    assert_true(m.n[0] == 1 && m.mean[0] == 0.25 && m.m2[0] == 0 && m.m3[0] == 0);
    moments_free(&m);
    /* "exact" by declaration: one run, pixels may differ. */
    write_pfm("ramp.pfm", W, H, ramp, 0);
    m = image_of("{'name': 'x', 'format': 'pbrt', 'output': 'exact', 'image': 'pfm', "
                 "'expresses': ['diffuse', 'point'], "
                 "'command': ['sh', '-c', 'cp {here}/ramp.pfm {out} # {scene}']}",
                 0);
    assert_string_equal(m.unit, "exact");
    assert_true(m.n[11] == 1 && m.mean[3 * 11] == 12 && m.m2[3 * 11] == 0);
    moments_free(&m);
    /* Its unit is 0.25 of ours. */
    m = image_of("{'name': 'x', 'format': 'file', 'output': 'exact', 'image': 'pfm', "
                 "'scale': 0.25, 'command': ['sh', '-c', 'cp {here}/ramp.pfm {out} # {scene}']}",
                 0);
    assert_true(m.mean[3 * 11] == 3 && m.mean[3 * 11 + 1] == 0.5);
    moments_free(&m);
    struct moments own;
    MUST(moments_alloc(&own, W, H, &e));
    for (int p = 0; p < PIXELS; p++) {
        own.n[p] = 5;
        own.mean[3 * p] = own.m2[3 * p] = own.m3[3 * p] = 1;
    }
    MUST(moments_write(test_path("own.exr"), &own, NULL, 0, &e));
    moments_free(&own);
    m = image_of("{'name': 'x', 'format': 'file', 'output': 'moments', 'scale': 0.25, "
                 "'command': ['sh', '-c', 'cp {here}/own.exr {out} # {scene}']}",
                 1);
    assert_true(m.n[3] == 5 && m.mean[9] == 0.25 && m.m2[9] == 0.0625 && m.m3[9] == 0.015625);
    moments_free(&m);
    /* "noisy": one run, too, and nothing is known of its noise. */
    static const char noisy[] =
        "{'name': 'x', 'format': 'file', 'output': 'noisy', 'image': 'pfm', "
        "'command': ['sh', '-c', 'cp {here}/ramp.pfm {out} # {scene} {name}']}";
    must_load(noisy, &en);
    assert_true(engine_expresses(&en, &point_plane, test_path("."), &e));
    m = must_render(&en, 0);
    assert_string_equal(m.unit, "picture");
    assert_true(m.n[11] == 3 && m.mean[3 * 11] == 12 && m.m2[3 * 11] == 0);
    moments_free(&m);
}

/* Noise of its own for each pixel, or for each column: every row starts with the same seed. */
static bool rows_share_a_seed;
static float uniform(int pixel, int k)
{
    uint32_t x = (uint32_t)(rows_share_a_seed ? pixel % 16 : pixel) * 64 + (uint32_t)k;
    return (float)replicate_seed(SEED, (int)x) / 2147483648.f;
}

/* A verdict takes pixels for independent, so it needs to know that they are. */
TEST(replicates_whose_pixels_share_noise_are_an_error)
{
    struct suite_scene scene = point_plane;
    scene.width = scene.height = 16;
    for (int i = 0; i < 2; i++) {
        OWN(engine) en;
        OWN(moments) m = {0};
        json_t *manifest;
        struct err e = {0};
        rows_share_a_seed = i == 1;
        for (int k = 0; k < 8; k++) {
            char name[64];
            snprintf(name, sizeof name, "picture_%u.pfm", replicate_seed(SEED, k));
            write_pfm(name, 16, 16, uniform, k);
        }
        engine_of_script("cp {here}/picture_$3.pfm $2", "", &en);
        en.replicates = 8;
        if (i == 1) {
            REFUSES(render(&en, &scene, &m, &manifest, &e),
                    "pixels share their noise: sums over 16 x 16");
            continue;
        }
        MUST(render(&en, &scene, &m, &manifest, &e));
        assert_true(
            json_is_true(json_object_get(json_object_get(manifest, "independence"), "passed")));
        json_decref(manifest);
    }
}

TEST(programs_that_misbehave_are_errors)
{
    write_pfm("ramp.pfm", W, H, ramp, 0);
    write_pfm("large.pfm", W + 1, H, ramp, 0);
    write_pfm("nan.pfm", W, H, not_a_number, 0);
    test_write(test_path("grey.pfm"),
               "Pf\n4 3\n-1.0\n................................................", 60);
    test_write(test_path("bytes.pfm"), "P6\n4 3\n255\n....................................", 47);
    static const struct {
        const char *script, *error;
    } cases[] = {
        {"echo I am ill >&2; exit 3", "exit status 3: I am ill"},
        {"kill -9 $$", "killed by signal 9"},
        {"sleep 30", "no end after 1 s"},
        {"true", "sh: ended without an error, but wrote no image"},
        {"echo garbage > $2", "replicate_0000.pfm"},
        {"cp {here}/large.pfm $2", "5 x 3 pixels, not 4 x 3"},
        {"cp {here}/nan.pfm $2", "pixel 2,1 is not finite"},
        {"cp {here}/grey.pfm $2", "no channels R, G and B"},
        {"cp {here}/bytes.pfm $2", "replicate_0000.pfm: an image of 8-bit integers, not of floats"},
        {"cp {here}/ramp.pfm $2", "replicate 1 is the same image as an earlier one: the seed has"},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        OWN(engine) en;
        struct moments m;
        json_t *manifest;
        struct err e = {0};
        engine_of_script(cases[i].script, "", &en);
        REFUSES(render(&en, &point_plane, &m, &manifest, &e), cases[i].error);
        assert_non_null(strstr(e.msg, "12_point_plane, fake"));
        assert_non_null(strstr(e.msg, "(see "));
    }
    OWN(engine) en;
    struct moments m;
    json_t *manifest;
    struct err e = {0};
    must_load("{'name': 'x', 'format': 'pbrt', 'output': 'mean', 'expresses': [], "
              "'command': ['./no-such-program', '{scene}', '{out}', '{seed}']}",
              &en);
    assert_false(render(&en, &point_plane, &m, &manifest, &e));
    /* Beside the description, not where we stand. */
    assert_non_null(strstr(e.msg, test_path("./no-such-program: no such program")));
    test_write(test_path("no-such-program"), "#!/bin/sh\n", 10);
    assert_false(render(&en, &point_plane, &m, &manifest, &e));
    assert_non_null(strstr(e.msg, test_path("./no-such-program: is not executable")));
}

/* No name or ending says two engines, each can be asked to export, and those with goldens, which come first, are driven. */
TEST(the_table_is_bound)
{
    OWN(scene) scene;
    struct camera camera;
    struct err e;
    int num = 0;
    MUST(suite_open(&point_plane, &scene, &camera, &e));
    for (const struct engine_kind *k = engine_table; k->name != NULL; k++, num++) {
        bool has_goldens = num < NUM_ENGINES_WITH_GOLDENS;
        char name[32];
        for (const struct engine_kind *other = engine_table; other < k; other++)
            assert_true(strcmp(other->name, k->name) != 0 && strcmp(other->ending, k->ending) != 0);
        snprintf(name, sizeof name, "table%s", k->ending);
        bool ok = engine_export(k, &scene, &camera, 1, test_path(name), &e);
        assert_true(ok || strstr(e.msg, k->title) != NULL);
        assert_int_equal(access(test_path(name), R_OK) == 0, ok);
        assert_int_equal(engine_driver_of(k->name) != NULL, has_goldens);
        assert_ptr_equal(engine_with_goldens(k->name), has_goldens ? k : NULL);
        assert_ptr_equal(engine_kind_of(k->name), k);
    }
    assert_null(engine_names[NUM_ENGINES_WITH_GOLDENS]);
    assert_null(engine_kind_of("truth"));
    assert_null(engine_driver_of("mitsuba_"));
}

TEST_GROUP(set_up, NULL)
