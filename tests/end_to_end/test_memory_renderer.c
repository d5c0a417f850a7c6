/* Every allocation fails in turn, libraries included, in what loads scenes and skies and reads command lines. What
 * comes out where a call succeeds is held against what comes out with memory enough. */
#include "tests/support/alloc_fail.h"

#include "renderer/scene/camera.h"
#include "renderer/base/cli.h"
#include "renderer/collada/collada.h"
#include "renderer/scene/environment.h"
#include "renderer/pathtracer/render_id.h"
#include "renderer/pathtracer/options.h"
#include "renderer/base/sha256.h"
#include "renderer/base/shell_quote.h"
#include "tests/support/build_scene.h"

#include <libxml/xmlerror.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/renderer/collada/dae.h"

enum { NO_SUM = 0 };

/* A number that another scene would hardly have. */
static double scene_sum(const struct scene *s)
{
    double sum = s->num_triangles + 10.0 * s->num_spheres + 100.0 * s->num_lights +
                 1e3 * s->num_materials + 1e4 * s->num_objects + s->camera.hfov;
    for (size_t i = 0; i < 3 * (size_t)s->num_triangles; i++)
        sum += (double)(i + 1) * (s->position[i].x + 2 * s->position[i].y + 3 * s->position[i].z +
                                  0.1 * s->normal[i].x);
    for (uint32_t i = 0; i < s->num_spheres; i++)
        sum += s->spheres[i].radius;
    for (uint32_t i = 0; i < s->num_materials; i++)
        sum += s->materials[i].reflectance.r + 7 * s->materials[i].radiance.g;
    return sum;
}

struct load {
    const char *path;
    double sum; /* NO_SUM: not known yet */
};

static bool load_scene(void *ctx, struct err *e)
{
    struct load *l = ctx;
    struct scene s = {.note = "untouched"};
    bool ok = collada_load(l->path, DIALECT_AUTO, &s, e);
    alloc_fail_off();
    if (!ok) {
        assert_string_equal(s.note, "untouched");
        assert_null(s.position);
    } else {
        double sum = scene_sum(&s);
        if (l->sum == NO_SUM)
            l->sum = sum;
        assert_true(sum == l->sum);
        scene_free(&s);
    }
    xmlResetLastError(); /* what libxml2 keeps of its last complaint */
    return ok;
}

static void scenes(void **state)
{
    (void)state;
    static const char *const name[] = {"12_point_plane", "22_glass_sphere", "46_sky", "41_cornell"};
    for (size_t i = 0; i < sizeof name / sizeof name[0]; i++) {
        char path[100];
        snprintf(path, sizeof path, "reference/scenes/%s.dae", name[i]);
        struct load l = {path, NO_SUM};
        alloc_fail_each(path, ALLOC_ALL, load_scene, &l);
    }
}

struct document {
    char *text;
    double sum;
};

static bool parse_document(void *ctx, struct err *e)
{
    struct document *d = ctx;
    struct scene s = {0};
    bool ok = collada_parse(d->text, strlen(d->text), "memory.dae", DIALECT_AUTO, &s, e);
    alloc_fail_off();
    assert_true(ok || s.position == NULL);
    if (ok && d->sum == NO_SUM)
        d->sum = scene_sum(&s);
    assert_true(!ok || d->sum == scene_sum(&s));
    scene_free(&s);
    xmlResetLastError();
    return ok;
}

/* A polygon of six corners with a notch, and a sphere of the assignment's dialect. */
static void dialects_and_polygons(void **state)
{
    (void)state;
    struct document d = {
        dae_text(&(struct dae){
            .mesh =
                "<polylist material='m' count='1'>$vertex<vcount>6</vcount><p>0 1 2 3 4 5</p></polylist>",
            .libraries =
                "<library_geometries><geometry id='ball'><extra><technique profile='CGL'><sphere>"
                "<radius>2</radius></sphere></technique></extra></geometry></library_geometries>",
            .nodes = "<node id='a'>$g</node><node id='b'>$ball</node>"}),
        NO_SUM};
    alloc_fail_each("collada_parse", ALLOC_ALL, parse_document, &d);
    free(d.text);
}

static bool read_environment(void *ctx, struct err *e)
{
    struct environment *env = environment_read(ctx, e);
    alloc_fail_off();
    if (env == NULL)
        return false;
    assert_int_equal(environment_parts(env).kind, ENVIRONMENT_IMAGE);
    assert_true(environment_total(env) > 0);
    environment_free(env);
    return true;
}

static bool make_environments(void *ctx, struct err *e)
{
    (void)ctx;
    struct environment *sky = environment_constant(grey(2), e);
    struct environment *half = sky != NULL ? environment_upper_half(grey(2), e) : NULL;
    alloc_fail_off();
    bool ok = half != NULL;
    environment_free(sky);
    environment_free(half);
    return ok;
}

static bool add_environment(void *ctx, struct err *e)
{
    (void)ctx;
    alloc_fail_off();
    struct scene s = build_scene();
    build_sphere(&s, v3(0, 0, 0), 1, 1, build_material(&s, grey(0.5f), grey(0)));
    assert_true(scene_finish(&s, "test", e));
    const uint32_t lights = s.num_lights;
    alloc_fail_on();
    bool ok = scene_read_environment(&s, "tests/fuzz/seeds/picture.hdr", e);
    alloc_fail_off();
    assert_int_equal(s.num_lights, lights + ok);
    assert_true((s.environment != NULL) == ok);
    scene_free(&s);
    return ok;
}

static void environments(void **state)
{
    (void)state;
    alloc_fail_each("environment_read (.hdr)", ALLOC_ALL, read_environment,
                    "tests/fuzz/seeds/picture.hdr");
    alloc_fail_each("environment_read (.exr)", ALLOC_ALL, read_environment,
                    "tests/fuzz/seeds/picture.exr");
    alloc_fail_each("environment_constant", ALLOC_ALL, make_environments, NULL);
    alloc_fail_each("scene_read_environment", ALLOC_ALL, add_environment, NULL);
}

static bool words(void *ctx, struct err *e)
{
    const char *const *word = ctx;
    char *text = shell_quote_join("first", word), **back = NULL;
    int num = 0;
    bool ok = (text != NULL || err_set(e, "out of memory")) &&
              (back = shell_quote_split(text, &num, e)) != NULL;
    alloc_fail_off();
    if (ok) {
        assert_int_equal(num, 3);
        assert_string_equal(back[1], word[0]);
        assert_string_equal(back[2], word[1]);
    }
    free(text);
    free(back);
    return ok;
}

static bool command_line(void *ctx, struct err *e)
{
    char *argv[] = {"pathtracer", "-qs4", "-f", "x.exr", ctx, NULL};
    struct options o;
    struct render_id id = {0};
    struct camera c = {.width = 4, .height = 4};
    char **apart = NULL;
    bool ok = options_parse(5, argv, &o, e) &&
              ((apart = options_apart(5, argv)) != NULL || err_set(e, "out of memory")) &&
              render_id_make(&o, &id, e) && camera_read_file(&c, "tests/fuzz/seeds/camera.info", e);
    alloc_fail_off();
    if (ok) {
        char digest[65];
        assert_true(sha256_file(ctx, digest, e));
        assert_string_equal(id.scene, digest);
        assert_string_equal(apart[1], "-q");
        assert_string_equal(apart[2], "-s");
    }
    free(apart);
    return ok;
}

static void command_lines(void **state)
{
    (void)state;
    static const char *word[] = {"two words", "it's", NULL};
    alloc_fail_each("shell_join and shell_quote_split", ALLOC_ALL, words, word);
    alloc_fail_each("options, identity, camera file", ALLOC_ALL, command_line,
                    "reference/scenes/11_furnace.dae");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(scenes, alloc_fail_tell),
        cmocka_unit_test_teardown(dialects_and_polygons, alloc_fail_tell),
        cmocka_unit_test_teardown(environments, alloc_fail_tell),
        cmocka_unit_test_teardown(command_lines, alloc_fail_tell),
    };
    return cmocka_run_group_tests(tests, NULL, alloc_fail_sum);
}
