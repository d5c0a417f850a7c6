/* The wide hierarchy against the scalar one and against brute force: the same distance bit for bit, and
 * of primitives at the same distance the one with the smallest number (the scalar tree may return a
 * larger one), whatever the rays, the scale and the instruction set; and every bit of the answer is the
 * same for a ray alone, in a batch or in a packet. */
#include "renderer/bvh/bvh_internal.h"
#include "renderer/bvh/bvh_wide.h"
#include "renderer/bvh/small_scene.h"
#include "renderer/math/sampler.h"
#include "renderer/math/warp.h"
#include "tests/support/build_scene.h"
#include "tests/support/mesh.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <float.h>

static vec3 random_point(uint32_t i, uint32_t k)
{
    return mesh_random_point(51, i, k);
}

enum aim {
    SCATTERED,
    PENCIL,
    ALONG_AXES,
    NEARLY_ALONG_AXES,
    FROM_SURFACE,
    AT_VERTEX,
    AT_EDGE,
    NUM_AIMS
};

static const float tiny[] = {0, -0.0f, FLT_MIN / 8, -FLT_MIN / 8, 1e-30f, -1e-18f, 1e-10f};

static ray make_ray(const struct scene *s, const struct mesh_bounds *f, enum aim aim, uint32_t i)
{
    struct sample4 u = sampler_get(52, i, (uint32_t)aim, 0, 0);
    const vec3 *p = s->position + 3 * ((size_t)i * 7919 % s->num_triangles);
    vec3 o = mad(f->middle, (i % 2 ? 2 : 0.5f) * f->size, warp_uniform_sphere(u.u[0], u.u[1]));
    vec3 target = mad(f->middle, f->size, random_point(i, 1));
    const int axis = (int)(i % 3), n = sizeof tiny / sizeof tiny[0];
    const vec3 e1 = sub(p[1], p[0]), e2 = sub(p[2], p[0]);
    float tmax = i % 4 ? INFINITY : u.u[2] * f->size;
    switch (aim) {
    case SCATTERED: break;
    case PENCIL: /* sixteen neighbours from one place: a packet */
        o = mad(f->middle, 2 * f->size, random_point(i / 16, 2));
        target = mad(mad(f->middle, 0.7f * f->size, random_point(i / 16, 3)), 0.02f * f->size,
                     random_point(i, 4));
        break;
    case ALONG_AXES:
        target = p[i / 3 % 3];
        o = mad(target, i % 2 ? 3 * f->size : -3 * f->size, v3(axis == 0, axis == 1, axis == 2));
        break;
    case NEARLY_ALONG_AXES: {
        float d[3] = {tiny[i % (uint32_t)n], tiny[i / 3 % (uint32_t)n], tiny[i / 5 % (uint32_t)n]};
        d[axis] = i % 2 ? 1 : -1;
        vec3 w = v3(d[0], d[1], d[2]);
        return (ray){mad(mad(p[0], 0.3f, e1), -2 * f->size, w), w, 0, tmax};
    }
    case FROM_SURFACE: /* not moved off it */
        return (ray){mad(mad(p[0], u.u[2] / 2, e1), u.u[3] / 2, e2),
                     warp_uniform_sphere(u.u[0], u.u[1]), 0, tmax};
    case AT_VERTEX: target = p[i % 3]; break;
    case AT_EDGE: target = mad(p[i % 3], u.u[3], sub(p[(i + 1) % 3], p[i % 3])); break;
    case NUM_AIMS: break;
    }
    vec3 d = sub(target, o);
    return (ray){o, dot(d, d) > 0 && dot(d, d) < INFINITY ? normalize(d) : v3(0, 0, 1), 0, tmax};
}

/* BVH_WIDE for each instruction set that this machine has. Returns how many. */
static int build_all(const struct scene *s, struct bvh *wide[3])
{
    int n = 0;
    for (enum isa isa = ISA_SSE42; isa <= ISA_AVX512; isa++) {
        struct err e = {0};
        enum isa have = isa;
        if (!isa_choose(&have, &e)) {
            print_message("%s\n", e.msg);
            continue;
        }
        wide[n] = bvh_build_on(s, BVH_WIDE, isa, 1, &e);
        assert_non_null(wide[n]);
        n++;
    }
    assert_true(n > 0);
    return n;
}

struct found {
    struct hits h;
    bool occluded[BATCH_LANES];
};

static void trace(const struct bvh *b, const struct rays *r, const uint16_t *lane, int n,
                  struct found *f)
{
    struct bvh_stats stats = {0};
    bvh_closest(b, r, lane, n, &f->h, &stats);
    bvh_occluded(b, r, lane, n, f->occluded, &stats);
    assert_true(stats.rays == 2 * (uint64_t)n);
}

static void assert_same(const struct found *a, const struct found *b, int i)
{
    assert_memory_equal(&a->h.t[i], &b->h.t[i], sizeof a->h.t[i]);
    assert_memory_equal(&a->h.prim[i], &b->h.prim[i], sizeof a->h.prim[i]);
    assert_true(a->occluded[i] == b->occluded[i]);
    if (a->h.prim[i] == NO_HIT)
        return;
    assert_memory_equal(&a->h.u[i], &b->h.u[i], sizeof a->h.u[i]);
    assert_memory_equal(&a->h.v[i], &b->h.v[i], sizeof a->h.v[i]);
}

/* Traces `batches` batches of rays; one in `brute` of them by brute force too (0: none). Frees the scene. */
static void compare(const char *name, struct scene s, uint32_t batches, uint32_t brute)
{
    struct err e = {0};
    struct bvh *wide[3], *sah = bvh_build(&s, BVH_SAH, &e),
                         *all = bvh_build(&s, BVH_BRUTE_FORCE, &e);
    int n = build_all(&s, wide);
    struct mesh_bounds f = mesh_bounds(&s);
    uint32_t hits = 0, ties = 0;
    for (uint32_t k = 0; k < batches; k++) {
        struct rays r;
        uint16_t lane[BATCH_LANES];
        static struct found want, exact, got[3], alone;
        const float none = 0;
        for (uint32_t i = 0; i < BATCH_LANES; i++) {
            rays_set(&r, (int)i, make_ray(&s, &f, k % NUM_AIMS, k * BATCH_LANES + i));
            r.ignore[i] = NO_HIT;
            lane[i] = (uint16_t)i;
        }
        trace(sah, &r, lane, BATCH_LANES, &want);
        /* Turned on by itself for large trees only; the answer is the same. */
        for (int j = 0; j < n; j++)
            wide[j]->wide->in_turns = k % 2;
        bool try_all = brute != 0 && k % brute == 0;
        if (try_all)
            trace(all, &r, lane, BATCH_LANES, &exact);
        for (int j = 0; j < n; j++)
            trace(wide[j], &r, lane, BATCH_LANES, &got[j]);
        for (int i = 0; i < BATCH_LANES; i++) {
            assert_true(got[0].h.t[i] == want.h.t[i]);
            assert_true((got[0].h.prim[i] == NO_HIT) == (want.h.prim[i] == NO_HIT));
            assert_true(got[0].h.prim[i] <= want.h.prim[i]);
            assert_true(got[0].occluded[i] == want.occluded[i]);
            if (try_all) /* brute force goes in order and keeps the first of equals */
                assert_same(&got[0], &exact, i);
            for (int j = 1; j < n; j++)
                assert_same(&got[j], &got[0], i);
            hits += got[0].h.prim[i] != NO_HIT;
            ties += got[0].h.prim[i] != want.h.prim[i];
        }
        /* The last ISA again, each ray alone; then every third ray, so that other rays share a packet. */
        for (uint16_t i = 0; i < BATCH_LANES; i++) {
            trace(wide[n - 1], &r, &i, 1, &alone);
            assert_same(&alone, &got[0], i);
        }
        for (uint16_t i = 0; i < BATCH_LANES / 3; i++)
            lane[i] = (uint16_t)(3 * i);
        for (int j = 0; j < n; j++) {
            memset(&alone, 0, sizeof alone);
            trace(wide[j], &r, lane, BATCH_LANES / 3, &alone);
            for (int i = 0; i < BATCH_LANES / 3; i++)
                assert_same(&alone, &got[0], 3 * i);
            /* Nothing is written for a lane that is not listed. */
            for (int i = 0; i < BATCH_LANES; i++)
                if (i % 3 != 0 || i / 3 >= BATCH_LANES / 3)
                    assert_true(memcmp(&alone.h.t[i], &none, sizeof none) == 0 &&
                                alone.h.prim[i] == 0 && !alone.occluded[i]);
        }
    }
    print_message("%-10s %7u triangles: %u of %u hit, %u at the distance of another\n", name,
                  s.num_triangles, hits, batches * BATCH_LANES, ties);
    assert_true(hits > batches * BATCH_LANES / 20 && hits < batches * BATCH_LANES);
    for (int j = 0; j < n; j++)
        bvh_free(wide[j]);
    bvh_free(sah);
    bvh_free(all);
    scene_free(&s);
}

/* 196 batches are 5 10^4 rays, of seven kinds. Brute force meets every kind: its strides have no divisor in
 * common with 7. */
TEST(generated_meshes)
{
    compare("terrain", mesh_terrain(70, 1), 196, 30);
    compare("ball", mesh_ball(70, 70, 0.3f), 196, 30);
    compare("soup", mesh_soup(10000), 196, 30);
    compare("twins", mesh_twins(40), 105, 13);
    compare("four", mesh_terrain(1, 1), 105, 1);
    compare("18", mesh_terrain(3, 1), 105, 1);
    compare("32", mesh_terrain(4, 1), 105, 1);
    compare("50", mesh_terrain(5, 1), 105, 1);
}

TEST(huge_and_tiny)
{
    compare("1e-12", mesh_terrain(30, 1e-12f), 70, 11);
    compare("1e-4", mesh_terrain(30, 1e-4f), 70, 11);
    compare("1e5", mesh_terrain(30, 1e5f), 70, 11);
    compare("1e12", mesh_terrain(30, 1e12f), 70, 11);
}

/* Triangles that have degenerated to points or lines are never hit and do not disturb the others. */
TEST(degenerate_triangles)
{
    struct scene s = mesh_terrain(30, 1);
    for (uint32_t i = 0; i < s.num_triangles; i += 3) {
        vec3 *p = s.position + 3 * (size_t)i;
        p[1] = p[0];
        if (i % 2)
            p[2] = p[0];
    }
    compare("degenerate", s, 70, 11);
}

/* Spheres and triangles together, few (kept as a list) and many (a tree with both kinds in its leaves). */
TEST(spheres_and_triangles)
{
    static const uint32_t counts[] = {1, 2, 9, 31, 33, 60, 500};
    for (size_t k = 0; k < sizeof counts / sizeof counts[0]; k++) {
        struct scene s = build_scene();
        uint32_t m = build_material(&s, grey(0.5f), grey(0));
        for (uint32_t i = 0; i < counts[k]; i++) {
            vec3 c = random_point(i, 10);
            if (i % 3)
                build_sphere(&s, c, 0.3f * fabsf(random_point(i, 11).x) + 0.01f, 1, m);
            else
                build_triangle(&s, c, mad(c, 0.5f, random_point(i, 12)),
                               mad(c, 0.5f, random_point(i, 13)), m);
        }
        struct err e = {0};
        assert_true(scene_finish(&s, "test", &e));
        compare("spheres", s, 70, 1);
    }
}

/* Half of a room's large primitives: two walls and a pane; or the floor and a large ball. */
static void add_large(struct scene *s, uint32_t m, bool second_half)
{
    if (second_half) {
        build_quad(s, v3(-1, -1, -1), v3(0, 0, 2), v3(2, 0, 0), m);
        build_sphere(s, v3(0.5f, -0.4f, 0.2f), 0.6f, 1, m);
        return;
    }
    build_quad(s, v3(-1, -1, -1), v3(2, 0, 0), v3(0.3f, 2, 0), m);
    build_quad(s, v3(-1, -1, 1), v3(0, 0, -2), v3(0, 2, 0.1f), m);
    build_triangle(s, v3(-0.7f, 0.6f, 0.3f), v3(0.4f, 0.5f, -0.2f), v3(0.1f, -0.4f, 0.6f), m);
}

/* Large primitives, kept as a list beside the tree, among small ones: spheres and triangles anywhere, and tiles in
 * the plane of the floor, hit at exactly the same distance. */
TEST(walls_beside_a_tree)
{
    for (int half = 0; half < 2; half++) {
        struct scene s = build_scene();
        struct err e = {0};
        uint32_t m = build_material(&s, grey(0.5f), grey(0));
        add_large(&s, m, half);
        for (uint32_t i = 0; i < 200; i++) {
            vec3 c = random_point(i, 20);
            if (i % 4 == 0)
                build_sphere(&s, c, 0.04f, 1, m);
            else if (i % 4 == 1)
                build_triangle(&s, v3(c.x, -1, c.z), v3(c.x, -1, c.z + 0.2f),
                               v3(c.x + 0.2f, -1, c.z), m);
            else
                build_triangle(&s, c, mad(c, 0.2f, random_point(i, 21)),
                               mad(c, 0.2f, random_point(i, 22)), m);
        }
        add_large(&s, m, !half);
        assert_true(scene_finish(&s, "test", &e));
        struct bvh *b = bvh_build(&s, BVH_WIDE, &e);
        assert_non_null(b);
        assert_true(b->wide->flat != NULL && b->wide->num_nodes > 0);
        bvh_free(b);
        compare("room", s, 140, 1);
    }
}

static const vec3 room_middle = {0.1f, 0.2f, 0.3f};

/* A point of the room that reaches `half` from its middle: on an edge or a wall, at a corner or anywhere inside. */
static vec3 place_in_room(uint32_t i, uint32_t k, vec3 half)
{
    const struct sample4 u = sampler_get(53, i, k, 0, 0);
    float p[3] = {2 * u.u[0] - 1, 2 * u.u[1] - 1, 2 * u.u[2] - 1};
    const uint32_t fixed = (uint32_t)(4 * u.u[3]),
                   axis = i % 3; /* coordinates that are those of a side */
    for (uint32_t a = 0; a < fixed; a++)
        p[(axis + a) % 3] = p[(axis + a) % 3] < 0 ? -1 : 1;
    return add(room_middle, v3(half.x * p[0], half.y * p[1], half.z * p[2]));
}

/* From inside, no nearer to a wall than 17 to 32 FLT_EPSILON of the largest coordinate (the integrator moves rays off by
 * 32); in every fourth batch from outside. Every second batch, and a third of the others, ends short of a place, as shadow
 * rays do. */
static ray ray_at_room(uint32_t i, vec3 half)
{
    const float off = (float)(17 + i / 3 % 16) * FLT_EPSILON * (0.3f + half.x);
    const vec3 target = place_in_room(i, 1, half), p = sub(place_in_room(i, 0, half), room_middle);
    vec3 o = add(room_middle, v3(maxf(off - half.x, minf(half.x - off, p.x)),
                                 maxf(off - half.y, minf(half.y - off, p.y)),
                                 maxf(off - half.z, minf(half.z - off, p.z))));
    if (i / BATCH_LANES % 4 == 3)
        o = add(o, scale(p, 2));
    const vec3 d = sub(target, o);
    const float length = sqrtf(dot(d, d));
    if (!(length > 0))
        return (ray){o, v3(1, 0, 0), 0, INFINITY};
    return (ray){o, scale(d, 1 / length), 0,
                 i % 3 && i / BATCH_LANES % 2 == 0 ? INFINITY : length * (1 - 1e-4f)};
}

/* Walls of a room, each a bit of `walls`, turned by `tilt` of its size; a lamp in the plane of its ceiling, a pane and a
 * ball; `more` small triangles. */
static struct scene room_of(unsigned walls, vec3 half, float tilt, uint32_t more)
{
    struct scene s = build_scene();
    struct err e = {0};
    const uint32_t m = build_material(&s, grey(0.5f), grey(0));
    const vec3 axes[3] = {v3(half.x, 0, 0), v3(0, half.y, 0), v3(0, 0, half.z)};
    for (int k = 0; k < 6; k++) {
        const vec3 n = axes[k / 2], u = axes[(k / 2 + 1) % 3], v = axes[(k / 2 + 2) % 3];
        const vec3 lean = scale(n, k % 2 ? tilt : -tilt);
        vec3 p = mad(room_middle, k % 2 ? -1 : 1, n);
        p = sub(sub(p, add(u, lean)), v);
        if (walls >> k & 1)
            build_quad(&s, p, scale(add(u, lean), 2), scale(v, 2), m);
    }
    const vec3 corner = v3(-0.3f * half.x, half.y, -0.2f * half.z);
    if (half.z > 0.1f * half.x) { /* else they would be too small for the quick form of the list */
        build_quad(&s, add(room_middle, corner), scale(axes[0], 0.5f), scale(axes[2], 0.4f), m);
        build_triangle(&s, room_middle, mad(room_middle, 0.6f, axes[0]),
                       add(room_middle, v3(0.1f * half.x, -0.4f * half.y, 0.6f * half.z)), m);
    }
    build_sphere(&s, add(room_middle, v3(-0.5f * half.x, -0.6f * half.y, 0.2f * half.z)),
                 0.3f * half.z, 1, m);
    for (uint32_t i = 0; i < more; i++) {
        const vec3 c = add(room_middle, scale(random_point(i, 30), 0.4f * half.z));
        build_triangle(&s, c, mad(c, 0.1f * half.z, random_point(i, 31)),
                       mad(c, 0.1f * half.z, random_point(i, 32)), m);
    }
    MUST(scene_finish(&s, "test", &e));
    return s;
}

/* Walls that are recognised as a room's, or are not since they are too few, turned too far or too near to each other: the
 * same bits as brute force from inside, at edges and corners too, and along the walls. 25600 rays each. */
TEST(rooms)
{
    static const struct {
        unsigned walls;
        float half, depth, tilt; /* depth: half size along z */
        uint32_t more;
        int recognised;
    } rooms[] = {
        {63, 1, 1, 0, 0, 6},     {31, 1, 1, 0, 0, 5},        {15, 2, 2, 0, 0, 4},
        {63, 1, 0.3f, 0, 0, 6},  {63, 1, 1, 2.5e-7f, 0, 6},    {61, 50, 40, 2e-7f, 0, 5},
        {63, 1, 1, 0, 200, 6},   {47, 1, 1, -1e-7f, 200, 5}, {7, 1, 1, 0, 0, 0},
        {63, 1, 1, 1e-6f, 0, 0}, {63, 1, 0.02f, 0, 0, 0},    {63, 1, 0.12f, 1e-7f, 0, 0},
    };
    for (size_t k = 0; k < sizeof rooms / sizeof rooms[0]; k++) {
        const vec3 half = v3(rooms[k].half, rooms[k].half, rooms[k].depth);
        OWN(scene) s = room_of(rooms[k].walls, half, rooms[k].tilt, rooms[k].more);
        struct err e = {0};
        struct bvh *wide[3], *all = bvh_build(&s, BVH_BRUTE_FORCE, &e);
        int n = build_all(&s, wide);
        assert_true(wide[0]->wide->flat->quick);
        assert_int_equal(wide[0]->wide->flat->num_walls, rooms[k].recognised);
        assert_true((wide[0]->wide->num_nodes > 0) == (rooms[k].more > 0));
        for (uint32_t batch = 0; batch < 100; batch++) {
            struct rays r;
            uint16_t lane[BATCH_LANES];
            static struct found want, got;
            for (uint32_t i = 0; i < BATCH_LANES; i++) {
                rays_set(&r, (int)i, ray_at_room(batch * BATCH_LANES + i, half));
                r.ignore[i] = NO_HIT;
                lane[i] = (uint16_t)i;
            }
            trace(all, &r, lane, BATCH_LANES, &want);
            for (int j = 0; j < n; j++) {
                trace(wide[j], &r, lane, BATCH_LANES, &got);
                for (int i = 0; i < BATCH_LANES; i++)
                    assert_same(&got, &want, i);
            }
        }
        for (int j = 0; j < n; j++)
            bvh_free(wide[j]);
        bvh_free(all);
    }
}

/* By the exact test this ray meets the wall of a flat box that it leaves, 16.5 FLT_EPSILON away, since that wall is a
 * hundred times as wide as high. What it meets must not depend on the hierarchy. */
TEST(a_flat_box)
{
    OWN(scene) s = build_scene();
    struct err e = {0};
    build_box(&s, v3(-1, -1, -0.01f), v3(2, 2, 0.02f), build_material(&s, grey(0.5f), grey(0)));
    MUST(scene_finish(&s, "test", &e));
    struct bvh *wide[3], *all = bvh_build(&s, BVH_BRUTE_FORCE, &e);
    int n = build_all(&s, wide);
    struct rays r;
    const uint16_t lane = 0;
    static struct found want, got;
    rays_set(&r, 0,
             (ray){v3(0x1.ba1988p-2f, 0x1.ffffbep-1f, 0x1.3346f4p-7f),
                   v3(0x1.452b58p-1f, -0x1.173336p-1f, -0x1.1819b6p-1f), 0, 0x1.9c43f2p-6f});
    r.ignore[0] = NO_HIT;
    trace(all, &r, &lane, 1, &want);
    assert_true(want.h.t[0] < 1e-6f && want.occluded[0]);
    for (int j = 0; j < n; j++) {
        assert_true(wide[j]->wide->flat->quick);
        trace(wide[j], &r, &lane, 1, &got);
        assert_same(&got, &want, 0);
        bvh_free(wide[j]);
    }
    bvh_free(all);
}

/* A shadow ray ignores the sphere that it goes to, and nothing else. */
TEST(ignored_sphere)
{
    for (uint32_t others = 0; others < 80; others += 40) {
        OWN(scene) s = build_scene();
        uint32_t m = build_material(&s, grey(0.5f), grey(0));
        build_triangle(&s, v3(9, 9, 9), v3(9, 8, 9), v3(8, 9, 9), m);
        for (uint32_t i = 0; i < others; i++)
            build_sphere(&s, v3(3 + (float)i, 5, 0), 0.2f, 1, m);
        build_sphere(&s, v3(0, 0, 0), 1, 1, m);
        build_sphere(&s, v3(5, 0, 0), 1, 1, m);
        struct err e = {0};
        assert_true(scene_finish(&s, "test", &e));
        struct bvh *wide[3];
        int n = build_all(&s, wide);
        for (int j = 0; j < n; j++) {
            struct rays r;
            uint16_t lane[16];
            bool occluded[BATCH_LANES];
            struct bvh_stats stats = {0};
            for (int i = 0; i < 16; i++) {
                float tmax = i % 4 < 2 ? 6 : 20;
                rays_set(&r, i, (ray){v3(-4, 0.01f * (float)i, 0), v3(1, 0, 0), 0, tmax});
                r.ignore[i] = i % 2 ? 1 + others : NO_HIT;
                lane[i] = (uint16_t)i;
            }
            for (int some = 1; some <= 16; some += 5) {
                bvh_occluded(wide[j], &r, lane, some, occluded, &stats);
                for (int i = 0; i < some; i++)
                    assert_true(occluded[i] == (i % 2 == 0 || i % 4 == 3));
            }
            bvh_free(wide[j]);
        }
    }
}

/* A tree of 10^5 triangles takes at most 60 bytes per triangle. */
TEST(small_enough)
{
    OWN(scene) s = mesh_ball(224, 224, 0.5f);
    struct err e = {0};
    struct bvh *b = bvh_build(&s, BVH_WIDE, &e);
    assert_non_null(b);
    assert_true(bvh_size(b) <= 60 * (size_t)s.num_triangles);
    assert_true(bvh_size(b) >= 36 * (size_t)s.num_triangles); /* the corners alone */
    bvh_free(b);
}

/* The same nodes and leaves, bit for bit, however many threads build them; also where half of the triangles
 * lie in one place and splits are lopsided. */
TEST(same_on_any_threads)
{
    struct scene scenes[] = {mesh_ball(180, 180, 0.5f), mesh_soup(40000), mesh_twins(100)};
    for (size_t i = 0; i < sizeof scenes / sizeof scenes[0]; i++) {
        struct scene *s = &scenes[i];
        for (uint32_t k = 0; i == 1 && k < 3 * s->num_triangles / 2; k++)
            s->position[k] = scale(s->position[k], 1e-6f);
        struct err e = {0};
        struct wide *one = wide_build(s, ISA_AUTO, 1, &e);
        assert_non_null(one);
        static const int threads[] = {2, 3, 16, 40};
        for (size_t k = 0; k < COUNT(threads); k++) {
            struct wide *w = wide_build(s, ISA_AUTO, threads[k], &e);
            assert_non_null(w);
            assert_true(w->used == one->used && w->num_leaves == one->num_leaves);
            assert_true(w->cost == one->cost && w->depth == one->depth);
            assert_memory_equal(w->arena, one->arena, one->used);
            wide_free(w);
        }
        wide_free(one);
        scene_free(s);
    }
}
