/* Every allocation fails in turn, libraries included, in what reads and writes pictures, moments and states. Where a writer
 * fails there is no file and nothing beside it; where a reader fails what it would have filled can be freed. */
#include "tests/support/alloc_fail.h"

#include "renderer/bvh/bvh.h"
#include "renderer/base/fs.h"
#include "renderer/pathtracer/heatmap.h"
#include "renderer/image/image.h"
#include "renderer/image/moments.h"
#include "renderer/pathtracer/options.h"
#include "renderer/pathtracer/output.h"
#include "renderer/pathtracer/checkpoint.h"
#include "tests/support/build_scene.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { WIDTH = 5, HEIGHT = 18 }; /* two bands of rows */

static char dir[] = "/tmp/test_memory_files_XXXXXX";
static char out[128], whole[128]; /* in a directory of its own each */

static int make_place(void **state)
{
    (void)state;
    struct err e;
    if (mkdtemp(dir) == NULL)
        return -1;
    snprintf(out, sizeof out, "%s/out/x", dir);
    snprintf(whole, sizeof whole, "%s/whole/x", dir);
    return fs_make_parent_dirs(out, &e) && fs_make_parent_dirs(whole, &e) ? 0 : -1;
}

static int remove_place(void **state)
{
    struct err e;
    alloc_fail_sum(state);
    return fs_remove_tree(dir, &e) ? 0 : -1;
}

static struct moments some_moments(void)
{
    struct moments m;
    struct err e;
    assert_true(moments_alloc(&m, WIDTH, HEIGHT, &e));
    for (int k = 0; k < 3; k++)
        for (size_t p = 0; p < WIDTH * HEIGHT; p++)
            moments_add(&m, p, (double[3]){(double)(p % 7) + k, (double)(k * k), 0.5 * k});
    return m;
}

static const struct image_attr attrs[] = {{"assay:seed", "7"}, {"assay:scene", "none"}};

/* Of a file that was written with memory enough. */
static void check_moments(const char *path)
{
    struct moments m, right = some_moments();
    struct image im;
    struct err e = {0};
    if (!moments_read(path, &m, &im, &e))
        fail_msg("%s", e.msg);
    for (size_t i = 0; i < 3 * WIDTH * HEIGHT; i++)
        assert_true(m.mean[i] == (float)right.mean[i] && m.m2[i] == (float)right.m2[i]);
    assert_string_equal(image_get_attr(&im, "assay:seed"), "7");
    assert_string_equal(image_get_attr(&im, "assay:scene"), "none");
    image_free(&im);
    moments_free(&m);
    moments_free(&right);
}

static bool write_moments(void *ctx, struct err *e)
{
    bool ok = moments_write(out, ctx, attrs, 2, e);
    alloc_fail_off();
    if (ok)
        check_moments(out);
    alloc_fail_output(out, ok);
    return ok;
}

struct layered {
    struct film film;
    struct image layers;
};

static bool write_layers(void *ctx, struct err *e)
{
    const struct layered *l = ctx;
    struct image layers = {0};
    bool ok = film_layers(&l->film, &layers, e);
    alloc_fail_off();
    assert_true(!ok || memcmp(layers.data, l->layers.data,
                              sizeof(float) * WIDTH * HEIGHT * NUM_LAYERS) == 0);
    alloc_fail_on();
    ok = ok && moments_write_layers(out, &l->film.m, &layers, attrs, 2, e);
    alloc_fail_off();
    image_free(&layers);
    if (ok)
        check_moments(out);
    alloc_fail_output(out, ok);
    return ok;
}

static bool read_moments(void *ctx, struct err *e)
{
    struct moments m = {0};
    struct image im = {0};
    bool ok = moments_read(whole, &m, ctx != NULL ? &im : NULL, e);
    alloc_fail_off();
    if (ok) {
        assert_int_equal(m.width, WIDTH);
        assert_string_equal(m.unit, "sample");
        assert_true(m.n[WIDTH * HEIGHT - 1] == 3);
        assert_true(ctx == NULL || im.num_attrs == 4); /* unit, spp and ours */
    }
    if (ok && ctx != NULL)
        image_free(&im);
    if (ok)
        moments_free(&m);
    return ok;
}

static void moments_files(void **state)
{
    (void)state;
    struct moments m = some_moments();
    struct layered l;
    struct err e = {0};
    alloc_fail_each("moments_write", ALLOC_ALL, write_moments, &m);
    assert_true(film_alloc(&l.film, WIDTH, HEIGHT, true, &e));
    moments_free(&l.film.m);
    l.film.m = some_moments();
    assert_true(film_layers(&l.film, &l.layers, &e));
    alloc_fail_each("film_layers, moments_write_layers", ALLOC_ALL, write_layers, &l);
    image_free(&l.layers);
    film_free(&l.film);
    assert_true(moments_write(whole, &m, attrs, 2, &e));
    alloc_fail_each("moments_read", ALLOC_ALL, read_moments, NULL);
    alloc_fail_each("moments_read with the image", ALLOC_ALL, read_moments, whole);
    moments_free(&m);
    alloc_fail_output(whole, true);
}

static const struct render_id id = {.scene = "5ce4e",
                                    .settings = "integrator path",
                                    .adaptive = "pilot",
                                    .seed = "1",
                                    .cell = "0 0 5 18 of 5 18"};

static bool film_and_state(void *ctx, struct err *e)
{
    struct film f = {0}, back = {0};
    (void)ctx;
    bool ok = film_alloc(&f, WIDTH, HEIGHT, true, e);
    if (ok) {
        f.num_samples = 3;
        ok = (f.target = calloc(WIDTH * HEIGHT, sizeof *f.target)) != NULL ||
             err_set(e, "the test's own memory");
    }
    if (ok)
        moments_add(&f.m, 7, (double[3]){1, 2, 3});
    ok = ok && checkpoint_write(out, &id, &f, e);
    alloc_fail_off();
    assert_int_equal(access(out, F_OK) == 0, ok);
    alloc_fail_on();
    ok = ok && film_alloc(&back, WIDTH, HEIGHT, true, e) && checkpoint_read(out, &id, &back, e);
    alloc_fail_off();
    if (ok) {
        assert_int_equal(back.num_samples, 3);
        assert_true(back.m.mean[3 * 7 + 2] == 3 && back.target != NULL);
    }
    alloc_fail_output(out, access(out, F_OK) == 0);
    film_free(&f);
    film_free(&back);
    return ok;
}

static void states(void **state)
{
    (void)state;
    alloc_fail_each("film_alloc, checkpoint_write, checkpoint_read", ALLOC_ALL, film_and_state,
                    NULL);
}

static bool read_picture(void *ctx, struct err *e)
{
    const char *path = ctx;
    struct image im = {0};
    bool half, ok = strstr(path, ".hdr") != NULL ? image_read_hdr(path, &im, e)
                                                 : image_read_exr(path, &im, &half, e);
    alloc_fail_off();
    assert_true(ok == (im.data != NULL));
    assert_true(!ok || image_channel(&im, "R") >= 0);
    image_free(&im);
    return ok;
}

static bool write_exr(void *ctx, struct err *e)
{
    (void)ctx;
    static const char *const names[] = {"R", "G", "B", "depth.Z"};
    struct image im = {0}, back = {0};
    bool ok = image_alloc(&im, WIDTH, HEIGHT, 4, names, e) && image_set_attr(&im, "a", "b", e) &&
              image_write_exr(out, &im, e);
    alloc_fail_off();
    if (ok) {
        assert_true(image_read_exr(out, &back, NULL, e));
        assert_string_equal(image_get_attr(&back, "a"), "b");
        image_free(&back);
    }
    image_free(&im);
    alloc_fail_output(out, ok);
    return ok;
}

static const uint8_t rgb8[3 * WIDTH * HEIGHT] = {1, 2, 3};

/* The bytes of the one are those of the other. */
static bool write_png(void *ctx, struct err *e)
{
    long *right = ctx;
    uint8_t *bytes = NULL;
    size_t size = 0;
    bool ok = image_encode_png(WIDTH, HEIGHT, rgb8, &bytes, &size, e) &&
              image_write_png(out, WIDTH, HEIGHT, rgb8, e);
    alloc_fail_off();
    if (size > 0)
        free(bytes);
    if (ok && *right == 0)
        *right = alloc_fail_file_size(out);
    assert_true(!ok || ((long)size == *right && alloc_fail_file_size(out) == *right));
    alloc_fail_output(out, ok);
    return ok;
}

static const struct image_attr texts[] = {{"assay:seed", "1"}, {"assay:cell", "0 0 4 4 of 4 4"}};

static bool write_texts(void *ctx, struct err *e)
{
    (void)ctx;
    bool ok = image_write_png_texts(out, WIDTH, HEIGHT, rgb8, texts, 2, e);
    alloc_fail_off();
    alloc_fail_output(out, ok);
    return ok;
}

static void pictures(void **state)
{
    (void)state;
    long size = 0;
    alloc_fail_each("image_read_hdr", ALLOC_ALL, read_picture, "tests/fuzz/seeds/picture.hdr");
    alloc_fail_each("image_read_exr", ALLOC_ALL, read_picture, "tests/fuzz/seeds/picture.exr");
    alloc_fail_each("image_write_exr", ALLOC_ALL, write_exr, NULL);
    alloc_fail_each("image_write_png, image_encode_png", ALLOC_ALL, write_png, &size);
    alloc_fail_each("image_write_png_texts", ALLOC_ALL, write_texts, NULL);
}

struct rendered {
    struct scene s;
    struct camera c;
    struct bvh *bvh;
    struct options o;
    struct film film;
};

static bool write_heatmap(void *ctx, struct err *e)
{
    const struct rendered *r = ctx;
    uint64_t most;
    bool ok = heatmap_write(out, r->bvh, &r->c, 0, 0, WIDTH, HEIGHT, &most, e);
    alloc_fail_off();
    alloc_fail_output(out, ok);
    return ok;
}

static void check_whole_exr(const char *path)
{
    struct err e = {0};
    struct image im;
    if (!image_read_exr(path, &im, NULL, &e))
        fail_msg("%s", e.msg);
    assert_int_equal(im.height, HEIGHT);
    assert_true(image_channel(&im, "depth.Z") >= 0 && image_channel(&im, "M3.B") >= 0);
    image_free(&im);
}

/* An EXR picture with layers, a PNG and the picture of its sampling rates. Each appears as a whole; those before the one that
 * failed stay. */
static bool write_outputs(void *ctx, struct err *e)
{
    const struct rendered *r = ctx;
    char *argv[] = {"pathtracer", "-f", "x.exr", NULL};
    const struct output o = {
        .opt = &r->o, .id = &id, .scene = &r->s, .accel = "wide", .argc = 3, .argv = argv};
    bool ok = output_pictures(&o, &r->film, NULL, e);
    alloc_fail_off();
    char rate[200];
    snprintf(rate, sizeof rate, "%s_rate.png", out);
    assert_true(!ok || access(rate, F_OK) == 0);
    unlink(rate);
    if (access(r->o.output[0], F_OK) == 0)
        check_whole_exr(r->o.output[0]);
    assert_true(!ok || access(r->o.output[0], F_OK) == 0);
    unlink(r->o.output[0]);
    alloc_fail_output(r->o.output[1], access(r->o.output[1], F_OK) == 0);
    return ok;
}

static void outputs(void **state)
{
    (void)state;
    struct err e = {0};
    struct rendered r = {.s = build_scene()};
    char exr[200], png[200], *argv[] = {"pathtracer", "-a", "4", "0.1", "--aov", "-r",    "5",
                                        "18",         "-f", exr, "-f",  png,     "x.dae", NULL};
    snprintf(exr, sizeof exr, "%s.exr", out);
    snprintf(png, sizeof png, "%s.png", out);
    build_quad(&r.s, v3(-1, -1, 0), v3(2, 0, 0), v3(0, 2, 0),
               build_material(&r.s, grey(0.5f), grey(1)));
    build_camera(&r.s, v3(0, 0, 3), 60);
    assert_true(scene_finish(&r.s, "test", &e) && camera_init(&r.c, &r.s, WIDTH, HEIGHT, &e));
    r.bvh = bvh_build(&r.s, BVH_SAH, &e);
    assert_non_null(r.bvh);
    if (!options_parse(13, argv, &r.o, &e))
        fail_msg("%s", e.msg);
    assert_true(film_alloc(&r.film, WIDTH, HEIGHT, true, &e));
    alloc_fail_each("heatmap_write", ALLOC_ALL, write_heatmap, &r);
    alloc_fail_each("output_pictures", ALLOC_ALL, write_outputs, &r);
    film_free(&r.film);
    bvh_free(r.bvh);
    scene_free(&r.s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(moments_files, alloc_fail_tell),
        cmocka_unit_test_teardown(states, alloc_fail_tell),
        cmocka_unit_test_teardown(pictures, alloc_fail_tell),
        cmocka_unit_test_teardown(outputs, alloc_fail_tell),
    };
    return cmocka_run_group_tests(tests, make_place, remove_place);
}
