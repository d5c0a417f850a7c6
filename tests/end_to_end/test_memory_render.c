/* Every allocation fails in turn, libraries included, in what builds hierarchies and tables, and renders. */
#include "tests/support/alloc_fail.h"
#include "tests/support/build_scene.h"

#include "renderer/bvh/bvh.h"
#include "renderer/scene/camera.h"
#include "renderer/shading/scene_simd.h"
#include "renderer/shading/light.h"
#include "renderer/transport/render.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { NO_SUM = 0 }; /* not known yet */

/* AddressSanitizer does not survive it when a thread that begins has no memory. */
#ifdef __SANITIZE_ADDRESS__
#define WITH_THREADS ALLOC_OURS
#else
#define WITH_THREADS ALLOC_ALL
#endif

/* A room with a lamp, and as many tiles as a tree needs. */
static struct scene room(int side)
{
    struct scene s = build_scene();
    struct err e = {0};
    uint32_t white = build_material(&s, grey(0.6f), grey(0));
    uint32_t lamp = build_material(&s, grey(0), grey(10));
    for (int i = 0; i < side * side; i++)
        build_quad(&s, v3((float)(i % side), 0.1f * (float)(i % 3), (float)-(i / side)),
                   v3(1, 0, 0), v3(0, 0, -1), white);
    build_quad(&s, v3(1, 3, -1), v3(1, 0, 0), v3(0, 0, 1), lamp);
    build_sphere(&s, v3(1, 1, -1), 0.5f, 1, white);
    build_camera(&s, v3(1, 1, 5), 60);
    assert_true(scene_finish(&s, "test", &e));
    return s;
}

struct build {
    struct scene *s;
    enum bvh_kind kind;
    int threads;
    uint32_t nodes;
};

static bool build_bvh(void *ctx, struct err *e)
{
    struct build *b = ctx;
    struct bvh *t = bvh_build_on(b->s, b->kind, ISA_AUTO, b->threads, e);
    alloc_fail_off();
    if (t == NULL)
        return false;
    if (b->nodes == NO_SUM)
        b->nodes = bvh_num_nodes(t);
    assert_int_equal(bvh_num_nodes(t), b->nodes);
    struct rays r;
    struct hits h;
    struct bvh_stats stats = {0};
    const uint16_t lane = 0;
    rays_set(&r, 0, (ray){v3(0.25f, 2, -0.5f), v3(0, -1, 0), 0, INFINITY});
    bvh_closest(t, &r, &lane, 1, &h, &stats);
    assert_int_equal(h.prim[0], 1); /* beyond the diagonal of the first quad */
    bvh_free(t);
    return true;
}

static void hierarchies(void **state)
{
    (void)state;
    struct scene small = room(2), large = room(12);
    for (int kind = BVH_BRUTE_FORCE; kind <= BVH_WIDE; kind++)
        for (int threads = 1; threads <= (kind == BVH_WIDE ? 2 : 1); threads++) {
            const enum alloc_by by = threads > 1 ? WITH_THREADS : ALLOC_ALL;
            struct build b = {&small, (enum bvh_kind)kind, threads, NO_SUM};
            alloc_fail_each(bvh_kind_names[kind], by, build_bvh, &b);
            b.s = &large;
            b.nodes = NO_SUM;
            alloc_fail_each(bvh_kind_names[kind], by, build_bvh, &b);
        }
    scene_free(&small);
    scene_free(&large);
}

static bool make_tables(void *ctx, struct err *e)
{
    struct light_table *lights = light_table_build(ctx, e);
    struct scene_simd *lanes = lights != NULL ? scene_simd_build(ctx, e) : NULL;
    alloc_fail_off();
    bool ok = lights != NULL && lanes != NULL;
    if (ok)
        assert_true(light_choice_probability(lights, 0) == 1 && lanes->has_spheres);
    light_table_free(lights);
    scene_simd_free(lanes);
    return ok;
}

static void tables(void **state)
{
    (void)state;
    struct scene s = room(2);
    alloc_fail_each("lights and records", ALLOC_ALL, make_tables, &s);
    scene_free(&s);
}

struct job {
    struct scene s;
    struct camera c;
    struct bvh *bvh;
    struct render_options o;
    double sum;
};

static bool render_job(void *ctx, struct err *e)
{
    struct job *j = ctx;
    struct progress p;
    struct moments m = {0};
    struct render_stats stats;
    progress_start(&p, "test", NULL, true);
    bool ok = render(&j->s, &j->c, j->bvh, &j->o, &p, &m, &stats, e);
    alloc_fail_off();
    double sum = 0;
    for (int i = 0; ok && i < 3 * m.width * m.height; i++)
        sum += (i + 1) * m.mean[i];
    if (ok && j->sum == NO_SUM)
        j->sum = sum;
    assert_true(!ok || (sum > 0 && sum == j->sum));
    if (ok)
        moments_free(&m);
    return ok;
}

static void renders(void **state)
{
    (void)state;
    struct err e = {0};
    struct job j = {.s = room(6)};
    assert_true(camera_init(&j.c, &j.s, 20, 20, &e));
    j.bvh = bvh_build(&j.s, BVH_WIDE, &e);
    assert_non_null(j.bvh);
    j.o = (struct render_options){.integrator = {.kind = INTEGRATE_PATHS,
                                                 .direct = DIRECT_MIS,
                                                 .max_bounces = 2,
                                                 .light_samples = 1},
                                  .width = 20,
                                  .height = 20,
                                  .num_samples = 2,
                                  .threads = 1};
    alloc_fail_each("render, one thread", WITH_THREADS, render_job, &j);
    j.o.threads = 3; /* the same bits */
    alloc_fail_each("render, three threads", WITH_THREADS, render_job, &j);
    j.sum = NO_SUM;
    j.o.pilot_samples = 4;
    j.o.pilot_max = 8;
    j.o.pilot_tolerance = 0.5;
    alloc_fail_each("render with a pilot", WITH_THREADS, render_job, &j);
    bvh_free(j.bvh);
    scene_free(&j.s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(hierarchies, alloc_fail_tell),
        cmocka_unit_test_teardown(tables, alloc_fail_tell),
        cmocka_unit_test_teardown(renders, alloc_fail_tell),
    };
    return cmocka_run_group_tests(tests, NULL, alloc_fail_sum);
}
