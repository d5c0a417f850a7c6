/* Every allocation fails in turn, libraries included, in what exports scenes, knows closed forms and keeps references. */
#include "tests/support/alloc_fail.h"

#include "reference/external/engine_description.h"
#include "reference/external/engine_bindings.h"
#include "reference/base/gsl_errors.h"
#include "reference/replicates/independence.h"
#include "reference/store/reference_render.h"
#include "reference/suite/suite.h"
#include "reference/truth/truth.h"
#include "reference/truth/truth_noise.h"
#include "renderer/scene/camera.h"
#include "renderer/base/fs.h"

#include <dirent.h>
#include <libxml/xmlerror.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static char dir[] = "/tmp/test_memory_reference_XXXXXX";
static char out[128];
static struct suite suite;

static int make_place(void **state)
{
    (void)state;
    struct err e;
    alloc_json(ALLOC_JSON_ENDS, out);
    gsl_errors_of_memory_return();
    if (mkdtemp(dir) == NULL)
        return -1;
    snprintf(out, sizeof out, "%s/out/x", dir);
    return fs_make_parent_dirs(out, &e) && suite_load("reference/scenes", &suite, &e) ? 0 : -1;
}

static int remove_place(void **state)
{
    struct err e;
    alloc_fail_sum(state);
    suite_free(&suite);
    return fs_remove_tree(dir, &e) ? 0 : -1;
}

struct export
{
    struct scene s;
    struct camera c;
    const char *engine;
    long size; /* 0: not known yet */
};

/* Files beside a Mitsuba scene, each whole, which are written before it. */
static void remove_more(void)
{
    char parent[128], path[512];
    snprintf(parent, sizeof parent, "%s/out", dir);
    DIR *d = opendir(parent);
    assert_non_null(d);
    for (const struct dirent *f = readdir(d); f != NULL; f = readdir(d))
        if (strncmp(f->d_name, "x_", 2) == 0 && strstr(f->d_name, ".tmp") == NULL) {
            snprintf(path, sizeof path, "%s/%s", parent, f->d_name);
            assert_int_equal(unlink(path), 0);
        }
    closedir(d);
}

static bool export_scene(void *ctx, struct err *e)
{
    struct export *x = ctx;
    bool ok = engine_export(engine_kind_of(x->engine), &x->s, &x->c, 3, out, e);
    alloc_fail_off();
    remove_more();
    if (ok) {
        FILE *f = fopen(out, "rb");
        assert_non_null(f);
        assert_int_equal(fseek(f, 0, SEEK_END), 0);
        if (x->size == 0)
            x->size = ftell(f);
        assert_int_equal(ftell(f), x->size);
        fclose(f);
    }
    alloc_fail_output(out, ok);
    return ok;
}

static void exports(void **state)
{
    (void)state;
    static const struct {
        const char *scene, *name, *engine;
        enum alloc_by by;
    } all[] = {
        /* libxml2's writer loses blocks where its lists fail. */
        {"12_point_plane", "export_mitsuba", "mitsuba", ALLOC_LOSSY},
        {"41_cornell", "export_cycles", "cycles", ALLOC_ALL},
        {"22_glass_sphere", "export_cycles, glass", "cycles", ALLOC_ALL},
        {"12_point_plane", "export_pbrt", "pbrt", ALLOC_ALL},
        {"19_glass_slab", "export_povray, glass", "povray", ALLOC_ALL},
    };
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) {
        struct err e = {0};
        struct export x = {.engine = all[i].engine};
        assert_true(suite_open(suite_find(&suite, all[i].scene), &x.s, &x.c, &e));
        alloc_fail_each(all[i].name, all[i].by, export_scene, &x);
        scene_free(&x.s);
    }
}

struct form {
    struct suite_scene scene;
    double sum; /* 0: not known yet */
};

static bool render_truth(void *ctx, struct err *e)
{
    struct form *f = ctx;
    struct moments m = {0};
    bool ok = truth_render(&f->scene, suite_reference_of(&f->scene, "truth"), &m, e);
    alloc_fail_off();
    double sum = 0;
    for (int i = 0; ok && i < 3 * m.width * m.height; i++)
        sum += (i + 1) * m.mean[i];
    if (ok && f->sum == 0)
        f->sum = sum;
    assert_true(!ok || (sum > 0 && sum == f->sum));
    moments_free(&m);
    return ok;
}

static bool noise_of_truth(void *ctx, struct err *e)
{
    struct form *f = ctx;
    double *variance = NULL;
    bool ok = truth_noise(&f->scene, suite_reference_of(&f->scene, "truth"), &variance, e);
    alloc_fail_off();
    if (ok && f->sum == 0)
        f->sum = variance[7];
    assert_true(!ok || variance[7] == f->sum);
    if (ok)
        free(variance);
    return ok;
}

/* Of each kind that asks for more than its picture one; what GSL has as tables asks for none. */
static void closed_forms(void **state)
{
    (void)state;
    static const char *const name[] = {"12_point_plane", "13_square_patch", "18_mirror_box",
                                       "23_ggx_furnace"};
    for (size_t i = 0; i < sizeof name / sizeof name[0]; i++) {
        struct form f = {.scene = *suite_find(&suite, name[i])};
        f.scene.width = f.scene.height = 8;
        /* gsl_cheb_alloc() loses a block where its second fails. */
        alloc_fail_each(name[i], i == 3 ? ALLOC_LOSSY : ALLOC_ALL, render_truth, &f);
        f.sum = 0;
        if (i == 1)
            alloc_fail_each("truth_noise", ALLOC_ALL, noise_of_truth, &f);
    }
}

struct made {
    struct moments m;
    json_t *manifest;
};

static bool make_reference(void *ctx, struct err *e)
{
    const struct made *made = ctx;
    struct made now = {.manifest = NULL};
    const struct suite_scene *scene = suite_find(&suite, "12_point_plane");
    const struct reference_options opt = {.seed = 1, .threads = 1, .work_dir = dir};
    bool ok =
        reference_render(scene, suite_reference_of(scene, "truth"), &opt, &now.m, &now.manifest, e);
    alloc_fail_off();
    assert_true(!ok || now.m.mean[5] == made->m.mean[5]);
    json_decref(now.manifest);
    moments_free(&now.m);
    return ok;
}

static bool keep_golden(void *ctx, struct err *e)
{
    const struct made *made = ctx;
    const struct suite_scene *scene = suite_find(&suite, "12_point_plane");
    const struct suite_reference *ref = suite_reference_of(scene, "truth");
    char golden[160], path[200];
    struct moments back = {0};
    json_t *read = NULL;
    struct golden inspected;
    snprintf(golden, sizeof golden, "%s/golden", dir);
    bool ok = golden_write(golden, scene->name, "truth", &made->m, made->manifest, e) &&
              golden_read(golden, scene, ref, &back, &read, e);
    alloc_fail_off();
    assert_true(!ok || back.mean[5] == (float)made->m.mean[5]);
    /* There is a whole one or none. */
    golden_inspect(golden, scene, ref, &inspected);
    assert_true(inspected.state == GOLDEN_MISSING || inspected.state == GOLDEN_CURRENT ||
                strstr(inspected.why.msg, "No such file") != NULL);
    assert_true(!ok || inspected.state == GOLDEN_CURRENT);
    golden_free(&inspected);
    snprintf(path, sizeof path, "%s/12_point_plane/truth.exr.next", golden);
    assert_true(access(path, F_OK) != 0);
    json_decref(read);
    moments_free(&back);
    assert_true(fs_remove_tree(golden, e));
    return ok;
}

/* What a kill can leave: the new manifest, the image before it, and the new one beside. The new one is never lost. */
static bool settle_golden(void *ctx, struct err *e)
{
    const char *golden = ctx;
    const struct suite_scene *scene = suite_find(&suite, "12_point_plane");
    const struct suite_reference *ref = suite_reference_of(scene, "truth");
    char exr[200], next[220];
    struct golden inspected;
    snprintf(exr, sizeof exr, "%s/12_point_plane/truth.exr", golden);
    snprintf(next, sizeof next, "%s.next", exr);
    alloc_fail_off();
    if (access(next, F_OK) != 0) {
        assert_int_equal(rename(exr, next), 0);
        FILE *f = fopen(exr, "w");
        assert_non_null(f);
        assert_int_equal(fclose(f), 0);
    }
    alloc_fail_on();
    bool ok = golden_settle(golden, scene->name, "truth", e);
    alloc_fail_off();
    assert_true(access(next, F_OK) == 0 || ok);
    golden_inspect(golden, scene, ref, &inspected);
    assert_int_equal(inspected.state, GOLDEN_CURRENT);
    golden_free(&inspected);
    return ok;
}

static bool test_independence(void *ctx, struct err *e)
{
    const float *picture = ctx;
    struct replicates r = {0};
    struct independence t;
    bool ok = replicates_alloc(&r, 32, 32, 6, e);
    for (int k = 0; ok && k < 6; k++)
        replicates_add(&r, picture + k * 3);
    ok = ok && independence_test(&r, 1e-6, &t, e);
    alloc_fail_off();
    assert_true(!ok || t.replicates == 6);
    replicates_free(&r);
    return ok;
}

static bool open_scene(void *ctx, struct err *e)
{
    struct scene s = {0};
    struct camera c;
    bool ok = suite_open(ctx, &s, &c, e);
    alloc_fail_off();
    assert_true(!ok || (s.environment != NULL && c.width == 64));
    scene_free(&s);
    xmlResetLastError();
    return ok;
}

static void references(void **state)
{
    (void)state;
    static float picture[3 * 32 * 32 + 3 * 6];
    for (size_t i = 0; i < sizeof picture / sizeof picture[0]; i++)
        picture[i] = (float)(i * 7919 % 104729);
    alloc_json(ALLOC_JSON_ENDS, NULL);
    char golden[160];
    struct err e = {0};
    struct made made = {.manifest = NULL};
    const struct suite_scene *scene = suite_find(&suite, "12_point_plane");
    const struct reference_options opt = {.seed = 1, .threads = 1, .work_dir = dir};
    assert_true(reference_render(scene, suite_reference_of(scene, "truth"), &opt, &made.m,
                                 &made.manifest, &e));
    alloc_fail_each("reference_render", ALLOC_ALL, make_reference, &made);
    alloc_fail_each("golden_write, golden_read", ALLOC_ALL, keep_golden, &made);
    snprintf(golden, sizeof golden, "%s/settled", dir);
    assert_true(golden_write(golden, scene->name, "truth", &made.m, made.manifest, &e));
    moments_free(&made.m);
    json_decref(made.manifest);
    alloc_fail_each("golden_settle", ALLOC_ALL, settle_golden, golden);
    alloc_fail_each("independence_test", ALLOC_ALL, test_independence, picture);
    alloc_fail_each("suite_open, a sky", ALLOC_ALL, open_scene,
                    (void *)suite_find(&suite, "46_sky"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(exports, alloc_fail_tell),
        cmocka_unit_test_teardown(closed_forms, alloc_fail_tell),
        cmocka_unit_test_teardown(references, alloc_fail_tell),
    };
    return cmocka_run_group_tests(tests, make_place, remove_place);
}
