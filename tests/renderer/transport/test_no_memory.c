/* Each of the renderer's own allocations fails in turn: the call fails with one line that mentions memory, or its
 * result is the usual one; and nothing leaks. Whole commands, and allocations of libraries:
 * tests/end_to_end/no_memory.c. */
#include "renderer/bvh/bvh.h"
#include "renderer/collada/collada.h"
#include "renderer/pathtracer/checkpoint.h"
#include "renderer/scene/triangulate.h"
#include "renderer/shading/light_simd.h"
#include "renderer/shading/scene_simd.h"
#include "renderer/transport/render.h"
#include "tests/support/build_scene.h"
#include "tests/support/malloc_below.h"
#include "tests/support/mesh.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <pthread.h>
#include <stdatomic.h>

extern const char __executable_start, etext;

enum { MOST_HELD = 1 << 16, SOME = 16 };
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static bool armed;
static long count, fail_at; /* of our own allocations while armed */
static void *held[MOST_HELD];
static atomic_int num_held;

/* Without checks: the sanitizers call free() before their own start-up is done. */
#define BARE __attribute__((no_sanitize("address"), no_sanitize("undefined")))

/* Asked for by the program itself, not by a library. */
static BARE bool is_own(const void *caller)
{
    return armed && (const char *)caller >= &__executable_start && (const char *)caller < &etext;
}

static BARE bool fails(bool own)
{
    if (!own)
        return false;
    pthread_mutex_lock(&lock);
    bool now = ++count == fail_at;
    pthread_mutex_unlock(&lock);
    return now;
}

static BARE void *keep(bool own, void *p)
{
    if (!own || p == NULL)
        return p;
    pthread_mutex_lock(&lock);
    if (num_held < MOST_HELD)
        held[num_held++] = p;
    pthread_mutex_unlock(&lock);
    return p;
}

/* Forgets a block that is freed; p may be NULL or not one of ours. */
static BARE void let_go(const void *p)
{
    if (num_held == 0) /* nor lock */
        return;
    pthread_mutex_lock(&lock);
    for (int i = num_held; i-- > 0;)
        if (held[i] == p) {
            held[i] = held[--num_held];
            break;
        }
    pthread_mutex_unlock(&lock);
}

BARE void *malloc(size_t size)
{
    bool own = is_own(__builtin_return_address(0));
    return fails(own) ? NULL : keep(own, MALLOC_BELOW(malloc)(size));
}
BARE void *calloc(size_t n, size_t size)
{
    bool own = is_own(__builtin_return_address(0));
    return fails(own) ? NULL : keep(own, MALLOC_BELOW(calloc)(n, size));
}
BARE void *realloc(void *p, size_t size)
{
    bool own = is_own(__builtin_return_address(0));
    if (fails(own))
        return NULL;
    let_go(p);
    return keep(own, MALLOC_BELOW(realloc)(p, size));
}
BARE void *aligned_alloc(size_t alignment, size_t size)
{
    bool own = is_own(__builtin_return_address(0));
    return fails(own) ? NULL : keep(own, MALLOC_BELOW(memalign)(alignment, size));
}
BARE void free(void *p)
{
    let_go(p);
    MALLOC_BELOW(free)(p);
}

/* The operation under test. On success *digest is a checksum of its result. */
typedef bool action(const void *arg, double *digest, struct err *e);

/* Runs the action once for each allocation that fails; of many allocations the first, the last and some between. */
static void try_all(const char *name, action *act, const void *arg, long least)
{
    struct err e = {0};
    double wanted = 0;
    long num = 1, refused = 0, tried = 0;
    for (long k = 0; k <= num; k += k < SOME || k + SOME >= num ? 1 : 1 + num / SOME) {
        double digest = 0;
        e.msg[0] = '\0';
        count = 0;
        num_held = 0;
        fail_at = k;
        armed = true;
        bool ok = act(arg, &digest, &e);
        armed = false;
        if (k == 0) {
            MUST(ok);
            num = count;
            wanted = digest;
        } else if (ok && digest != wanted) {
            fail_msg("%s without allocation %ld of %ld: %g in place of %g", name, k, num, digest,
                     wanted);
        } else if (!ok && (strstr(e.msg, "memory") == NULL || strchr(e.msg, '\n') != NULL)) {
            fail_msg("%s without allocation %ld of %ld: '%s'", name, k, num, e.msg);
        }
        tried += k != 0;
        refused += !ok;
        if (num_held != 0)
            fail_msg("%s without allocation %ld of %ld: %d blocks stay", name, k, num, num_held);
    }
    print_message("%-16s %4ld allocations, %ld tried, %ld needed\n", name, num, tried, refused);
    assert_true(num >= least && 2 * refused >= tried);
}

static bool load(const void *arg, double *digest, struct err *e)
{
    struct scene s;
    if (!collada_load(arg, DIALECT_AUTO, &s, e))
        return false;
    struct light_table *t = light_table_build(&s, e);
    struct scene_simd *l = t != NULL ? scene_simd_build(&s, e) : NULL;
    *digest = s.num_triangles + 1e4 * s.num_lights + 1e7 * s.num_materials + 1e9 * s.num_spheres;
    for (uint32_t i = 0; i < s.num_lights && t != NULL; i++)
        *digest +=
            (double)chosen_probability(t->all, i, v3(0, 0, 0), v3(0.6f, 0.8f, 0), 1) / (i + 2);
    scene_simd_free(l);
    light_table_free(t);
    scene_free(&s);
    return l != NULL;
}

TEST(loaded_scenes)
{
    static const char *const scenes[] = {"27_smooth_normals", "30_odd_size",  "33_sphere_light",
                                         "36_mesh_lamp",      "38_spot_edge", "43_cornell_metal"};
    for (size_t i = 0; i < COUNT(scenes); i++) {
        char path[128];
        snprintf(path, sizeof path, "reference/scenes/%s.dae", scenes[i]);
        try_all(scenes[i], load, path, 20);
    }
    try_all("of others", load, "tests/fuzz/seeds/collada-parts.dae", 20);
    try_all("of two files", load, "tests/fuzz/seeds/collada-refers.dae", 20);
}

static bool sky(const void *arg, double *digest, struct err *e)
{
    struct environment *env =
        arg != NULL ? environment_read(arg, e) : environment_upper_half((rgb){1, 2, 3}, e);
    if (env == NULL)
        return false;
    const vec3 up = v3(0, 1, 0);
    float pdf_w = 0;
    look_up_environment(env, &up, v3(0.6f, 0, 0.8f), 1, &pdf_w);
    *digest = environment_total(env) + (double)pdf_w;
    environment_free(env);
    return true;
}

TEST(skies)
{
    try_all("upper half", sky, NULL, 1);
    try_all("image of a sky", sky, "reference/scenes/46_sky.exr", 5);
}

/* A zigzag of seven corners. */
static bool polygon(__attribute__((unused)) const void *arg, double *digest, struct err *e)
{
    const dvec3 p[] = {d3(0, 0, 0), d3(4, 0, 0), d3(4, 3, 0), d3(3, 1, 0),
                       d3(2, 3, 0), d3(1, 1, 0), d3(0, 3, 0)};
    uint32_t index[15];
    enum triangulate_result r = triangulate(p, 7, index);
    for (int i = 0; i < 15 && r == TRIANGULATE_OK; i++)
        *digest += index[i] * (i + 1);
    return r == TRIANGULATE_OK || (r == TRIANGULATE_MEMORY && err_set(e, "out of memory"));
}

TEST(triangles_of_a_polygon)
{
    try_all("polygon", polygon, NULL, 2);
}

struct tree {
    const struct scene *s;
    enum bvh_kind kind;
    int threads;
};

static bool grow(const void *arg, double *digest, struct err *e)
{
    const struct tree *t = arg;
    struct bvh *b = bvh_build_on(t->s, t->kind, ISA_AUTO, t->threads, e);
    if (b == NULL)
        return false;
    *digest = bvh_sah_cost(b) + bvh_num_nodes(b);
    bvh_free(b);
    return true;
}

/* With threads, more than the hierarchy needs before it uses them (1 << 14 triangles). */
TEST(hierarchies)
{
    struct scene small = mesh_ball(12, 12, 0.3f), large = mesh_ball(92, 92, 0.3f);
    for (enum bvh_kind kind = BVH_BRUTE_FORCE; kind <= BVH_WIDE; kind++)
        try_all(bvh_kind_names[kind], grow, &(struct tree){&small, kind, 1}, 1);
    try_all("on three threads", grow, &(struct tree){&large, BVH_WIDE, 3}, 10);
    scene_free(&small);
    scene_free(&large);
}

struct job {
    const struct scene *s;
    const struct camera *c;
    const struct bvh *bvh;
    bool first_hits;
    int threads, batch;
    uint32_t pilot;
};

/* A film, its files and its way back from them. */
static bool draw(const void *arg, double *digest, struct err *e)
{
    const struct job *j = arg;
    const struct render_options o = {.integrator = {.kind = INTEGRATE_PATHS,
                                                    .direct = DIRECT_MIS,
                                                    .max_bounces = 2,
                                                    .light_samples = 1,
                                                    .roulette = ROULETTE_THROUGHPUT,
                                                    .sampler = {SAMPLER_INDEPENDENT, 3}},
                                     .width = 20,
                                     .height = 18,
                                     .num_samples = 8,
                                     .threads = j->threads,
                                     .adaptive_batch = j->batch,
                                     .adaptive_tolerance = 0.2,
                                     .pilot_samples = j->pilot,
                                     .pilot_max = j->pilot != 0 ? 8 : 0,
                                     .pilot_tolerance = 0.2};
    static const struct render_id id = {.scene = "abc", .settings = "path", .adaptive = "off"};
    struct film f = {0}, back = {0};
    struct image layers = {0}, read_again = {0};
    OWN(moments) m = {0};
    struct render_stats stats;
    struct progress p;
    const char *exr = test_path("m.exr"), *state = test_path("m.state");
    progress_start(&p, "test", NULL, true);
    bool ok = film_alloc(&f, 20, 18, j->first_hits, e) &&
              render_film(j->s, j->c, j->bvh, &o, NULL, &p, &f, &stats, e) &&
              (!j->first_hits || film_layers(&f, &layers, e)) &&
              moments_write_layers(exr, &f.m, j->first_hits ? &layers : NULL, NULL, 0, e) &&
              moments_read(exr, &m, &read_again, e) && checkpoint_write(state, &id, &f, e) &&
              film_alloc(&back, 20, 18, j->first_hits, e) &&
              checkpoint_read(state, &id, &back, e) && film_merge(&back, &f, 0, 20 * 18, e);
    for (size_t i = 0; ok && i < 20 * 18; i++)
        *digest += (m.mean[3 * i] + back.m.m2[3 * i + 1] + m.n[i] + back.m.n[i]) * (double)(i + 1);
    image_free(&layers);
    image_free(&read_again);
    film_free(&f);
    film_free(&back);
    return ok;
}

TEST(renders)
{
    struct err e = {0};
    OWN(scene) s = build_room(9);
    struct camera c = build_finish(&s, 20, 18);
    struct bvh *bvh = bvh_build(&s, BVH_WIDE, &e);
    MUST(bvh != NULL);
    try_all("one thread", draw, &(struct job){&s, &c, bvh, false, 1, 0, 0}, 10);
    try_all("with layers", draw, &(struct job){&s, &c, bvh, true, 1, 0, 0}, 10);
    try_all("two threads", draw, &(struct job){&s, &c, bvh, false, 2, 0, 0}, 10);
    try_all("adaptive", draw, &(struct job){&s, &c, bvh, true, 1, 4, 0}, 10);
    try_all("after a pilot", draw, &(struct job){&s, &c, bvh, false, 2, 0, 4}, 10);
    bvh_free(bvh);
}
