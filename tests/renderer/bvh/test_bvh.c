/* Hierarchies against brute force: the same nearest hit, bit for bit, and the same answer on
 * occlusion; and intersections against closed forms. */
#include "renderer/bvh/bvh.h"
#include "renderer/bvh/small_scene.h"
#include "renderer/math/sampler.h"
#include "renderer/scene/shape.h"
#include "renderer/scene/shape_simd.h"
#include "renderer/math/warp.h"
#include "tests/support/build_scene.h"
#include "tests/support/mesh.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

enum { KINDS = BVH_WIDE + 1 };

enum layout { SCATTERED, COINCIDENT, FLAT, WIDE_RANGE, ONE, NUM_LAYOUTS };

static vec3 random_point(uint32_t i, uint32_t k)
{
    return mesh_random_point(11, i, k);
}

static struct scene make_scene(enum layout layout)
{
    struct scene s = build_scene();
    uint32_t m = build_material(&s, grey(0.5f), grey(0));
    uint32_t n = layout == ONE ? 1 : 700;
    for (uint32_t i = 0; i < n; i++) {
        vec3 c = random_point(i, 0), d = scale(random_point(i, 1), 0.2f);
        vec3 f = scale(random_point(i, 2), 0.2f);
        if (layout == COINCIDENT)
            c = v3(0, 0, 0); /* centroids of triangle pairs fall together */
        if (layout == FLAT)
            c.y = d.y = f.y = 0;
        if (layout == WIDE_RANGE)
            c = scale(c, exp2f((float)(i % 40) - 20));
        if (layout != FLAT && i % 3 == 0)
            build_sphere(&s, c, layout == ONE ? 0.7f : 0.02f + 0.05f * fabsf(d.x), 1, m);
        else
            build_triangle(&s, c, add(c, d), add(c, f), m);
        if (layout == COINCIDENT)
            build_triangle(&s, neg(c), neg(d), neg(f), m);
    }
    struct err e = {0};
    MUST(scene_finish(&s, "test", &e));
    return s;
}

/* Rays from around, from inside, along axes and through vertices. */
static ray make_ray(const struct scene *s, uint32_t i)
{
    struct sample4 u = sampler_get(12, i, 0, 0, 0);
    vec3 o = scale(random_point(i, 3), i % 2 ? 3 : 0.5f), d = warp_uniform_sphere(u.u[0], u.u[1]);
    if (i % 5 == 0)
        d = v3(i % 3 == 0, i % 3 == 1, i % 3 == 2);
    if (i % 7 == 0 && s->num_triangles > 0)
        d = sub(s->position[i % (3 * s->num_triangles)], o);
    if (length(d) == 0)
        d = v3(0, 0, 1);
    return (ray){o, normalize(d), 0, i % 4 ? INFINITY : 0.5f + u.u[2]};
}

TEST(hierarchies_equal_brute_force)
{
    struct err e = {0};
    for (enum layout layout = SCATTERED; layout < NUM_LAYOUTS; layout++) {
        OWN(scene) s = make_scene(layout);
        struct bvh *tree[KINDS];
        for (int k = 0; k < KINDS; k++) {
            tree[k] = bvh_build(&s, (enum bvh_kind)k, &e);
            assert_non_null(tree[k]);
        }
        struct rays r;
        uint16_t lane[BATCH_LANES];
        uint32_t hits = 0, rays = 0;
        struct bvh_stats stats[KINDS] = {{0}};
        for (uint32_t first = 0; first < 20 * BATCH_LANES; first += BATCH_LANES) {
            for (int i = 0; i < BATCH_LANES; i++) {
                rays_set(&r, i, make_ray(&s, first + (uint32_t)i));
                r.ignore[i] = NO_HIT;
                lane[i] = (uint16_t)i;
            }
            struct hits h[KINDS];
            bool occluded[KINDS][BATCH_LANES];
            for (int k = 0; k < KINDS; k++) {
                bvh_closest(tree[k], &r, lane, BATCH_LANES, &h[k], &stats[k]);
                bvh_occluded(tree[k], &r, lane, BATCH_LANES, occluded[k], &stats[k]);
            }
            for (int k = 1; k < KINDS; k++)
                for (int i = 0; i < BATCH_LANES; i++) {
                    /* Two primitives at the very same distance may swap; nothing else may. */
                    assert_true(h[k].t[i] == h[0].t[i]);
                    assert_true((h[k].prim[i] == NO_HIT) == (h[0].prim[i] == NO_HIT));
                    assert_true(occluded[k][i] == occluded[0][i]);
                    assert_true(occluded[k][i] == (h[k].prim[i] != NO_HIT));
                }
            for (int i = 0; i < BATCH_LANES; i++)
                hits += h[0].prim[i] != NO_HIT;
            rays += BATCH_LANES;
        }
        /* The comparison has to have seen both answers. */
        assert_true(hits > rays / 1000 && hits < rays);
        if (layout == SCATTERED)
            for (int k = 1; k < KINDS; k++)
                assert_true(stats[k].primitive_tests < stats[0].primitive_tests / 10);
        for (int k = 0; k < KINDS; k++) {
            assert_true(stats[k].rays == 2 * rays);
            bvh_free(tree[k]);
        }
    }
}

static bool meets(const struct triangle *tri, const ray *r, float *t, float *u, float *v)
{
    struct shear s = shape_shear(r);
    return triangle_intersect(tri, r, &s, t, u, v);
}

/* Triangle (0,0,0) (1,0,0) (0,1,0) and rays along -Z at places with known barycentrics. */
TEST(triangle_closed_form)
{
    const struct triangle tri = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
    static const struct {
        float x, y;
        bool hit;
    } places[] = {{0.25f, 0.5f, true}, {0.0f, 0.0f, true},    {0.5f, 0.5f, true},
                  {0.6f, 0.5f, false}, {-0.01f, 0.5f, false}, {0.5f, -0.01f, false}};
    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++)
        for (int side = -1; side <= 1; side += 2) {
            ray r = {{places[i].x, places[i].y, 2.0f * (float)side}, {0, 0, (float)-side}, 0, 10};
            float t, u, v;
            assert_true(meets(&tri, &r, &t, &u, &v) == places[i].hit);
            if (places[i].hit)
                assert_true(t == 2 && u == places[i].x && v == places[i].y);
            r.tmax = 1.999f;
            assert_false(meets(&tri, &r, &t, &u, &v));
            r.tmax = 10;
            r.tmin = 2.001f;
            assert_false(meets(&tri, &r, &t, &u, &v));
        }
    ray parallel = {{-1, 0.2f, 0}, {1, 0, 0}, 0, 10};
    float t, u, v;
    assert_false(meets(&tri, &parallel, &t, &u, &v));
}

/* At distance D from the centre and impact parameter b: t = sqrt(D^2-b^2) -+ sqrt(r^2-b^2). */
TEST(sphere_closed_form)
{
    const struct sphere s = {{0, 0, 0}, 0.5f, 1};
    for (int k = 0; k < 100; k++) {
        float b = 0.006f * (float)k;
        ray r = {{b, 0, 1000}, {0, 0, -1}, 0, INFINITY};
        float t;
        bool hit = sphere_intersect(&s, &r, &t);
        if (b < 0.4999f) {
            assert_true(hit);
            assert_true(fabs(t - (1000 - sqrt(0.25 - (double)b * b))) < 2e-4);
        } else if (b > 0.5001f) {
            assert_false(hit);
        }
        /* From inside only the far side counts. */
        r.o = v3(b * 0.8f, 0, 0);
        assert_true(sphere_intersect(&s, &r, &t));
        assert_true(fabs(t - sqrt(0.25 - 0.64 * (double)b * b)) < 1e-6);
    }
}

/* A ray that leaves a surface does not meet it again: from 10^5 places of a slanted triangle with
 * large coordinates and of a sphere, in grazing directions too. */
TEST(no_self_intersection)
{
    OWN(scene) s = build_scene();
    uint32_t m = build_material(&s, grey(0.5f), grey(0));
    build_triangle(&s, v3(100, 3, -50), v3(103, 7, -48), v3(99, 8, -53), m);
    build_sphere(&s, v3(5, 6, 7), 0.3f, 1, m);
    struct err e = {0};
    assert_true(scene_finish(&s, "test", &e));
    struct bvh *bvh = bvh_build(&s, BVH_BRUTE_FORCE, &e);
    struct bvh_stats stats = {0};
    for (uint32_t i = 0; i < 100000; i++) {
        struct sample4 u = sampler_get(13, i, 0, 0, 0);
        uint32_t prim = i % 2;
        struct surface at;
        if (prim == 0) {
            float b1, b2;
            warp_triangle(u.u[0], u.u[1], &b1, &b2);
            at = surface_at(&s, 0, &(ray){0}, 0, b1, b2);
        } else {
            vec3 d = warp_uniform_sphere(u.u[0], u.u[1]);
            at = surface_at(&s, 1, &(ray){.o = mad(v3(5, 6, 7), 2, d), .d = neg(d)}, 1.7f, 0, 0);
        }
        vec3 local = warp_uniform_hemisphere(u.u[2], u.u[3]);
        local.z *= i % 3 ? 1 : 1e-3f;
        frame f = frame_from_normal(at.ng);
        vec3 wi = normalize(frame_to_world(&f, local));
        struct rays r;
        rays_set(&r, 0, (ray){leave_surface(at.p, at.ng, at.eps, wi), wi, 0, INFINITY});
        struct hits h;
        const uint16_t lane = 0;
        bvh_closest(bvh, &r, &lane, 1, &h, &stats);
        assert_true(h.prim[0] != prim);
    }
    bvh_free(bvh);
}

/* One to twenty rays against a tree and a list of primitives: nothing is read or written past the n-th lane. */
TEST(few_rays)
{
    struct err e = {0};
    for (enum layout layout = SCATTERED; layout <= ONE; layout += ONE - SCATTERED) {
        OWN(scene) s = make_scene(layout);
        struct bvh *all = bvh_build(&s, BVH_BRUTE_FORCE, &e), *wide = bvh_build(&s, BVH_WIDE, &e);
        MUST(all != NULL && wide != NULL);
        for (int n = 1; n <= 20; n++) {
            struct rays r;
            uint16_t lane[20];
            for (int i = 0; i < 20; i++) {
                rays_set(&r, i, make_ray(&s, (uint32_t)(20 * n + i)));
                r.ignore[i] = NO_HIT;
                lane[i] = (uint16_t)i;
            }
            struct hits h[2];
            bool occluded[2][BATCH_LANES];
            struct bvh_stats stats = {0};
            for (int k = 0; k < 2; k++) {
                memset(&h[k], 0, sizeof h[k]);
                memset(occluded[k], 0, sizeof occluded[k]);
                uint16_t *exact = malloc((size_t)n * sizeof *exact); /* reads past its end are seen */
                assert_non_null(exact);
                memcpy(exact, lane, (size_t)n * sizeof *exact);
                bvh_closest(k == 0 ? all : wide, &r, exact, n, &h[k], &stats);
                bvh_occluded(k == 0 ? all : wide, &r, exact, n, occluded[k], &stats);
                free(exact);
            }
            for (int i = 0; i < 20; i++) {
                assert_true(h[0].t[i] == h[1].t[i]);
                assert_true(occluded[0][i] == occluded[1][i]);
            }
        }
        bvh_free(all);
        bvh_free(wide);
    }
}

/* The walls of a cube of half edge a, seen from its centre: a ray of direction d meets them at t = a / max(|dx|,
 * |dy|, |dz|). With coordinates beyond 1e4 or all below 1e-4 a list has no quick test, and its exact one has to
 * answer. */
TEST(a_cube_of_any_size)
{
    static const float half[] = {1e-5f, 5e-4f, 1, 5e3f, 2e4f, 1e6f};
    struct err e = {0};
    for (size_t k = 0; k < sizeof half / sizeof *half; k++) {
        const float a = half[k];
        OWN(scene) s = build_scene();
        uint32_t m = build_material(&s, grey(0.5f), grey(0));
        build_box(&s, v3(-a, -a, -a), v3(2 * a, 2 * a, 2 * a), m);
        MUST(scene_finish(&s, "test", &e));
        struct bvh *bvh = bvh_build(&s, BVH_WIDE, &e);
        assert_non_null(bvh);
        struct bvh_stats stats = {0};
        for (uint32_t i = 0; i < 100; i++) {
            struct rays r[2];
            struct hits h = {0};
            bool met[2][BATCH_LANES] = {{false}};
            uint16_t lane[8];
            float t[8];
            for (uint16_t l = 0; l < 8; l++) {
                struct sample4 u = sampler_get(17, 8 * i + l, 0, 0, 0);
                vec3 d = warp_uniform_sphere(u.u[0], u.u[1]);
                t[l] = a / maxf(fabsf(d.x), maxf(fabsf(d.y), fabsf(d.z)));
                rays_set(&r[0], l, (ray){v3(0, 0, 0), d, 0, INFINITY});
                rays_set(&r[1], l, (ray){v3(0, 0, 0), d, 0, 0.99f * t[l]});
                r[0].ignore[l] = r[1].ignore[l] = NO_HIT;
                lane[l] = l;
            }
            bvh_closest(bvh, &r[0], lane, 8, &h, &stats);
            for (int j = 0; j < 2; j++)
                bvh_occluded(bvh, &r[j], lane, 8, met[j], &stats);
            for (int l = 0; l < 8; l++) {
                assert_true(h.prim[l] < 12);
                assert_near(h.t[l] / t[l], 1, 1e-5);
                assert_true(met[0][l] && !met[1][l]);
            }
        }
        bvh_free(bvh);
    }
}

/* A cube, and apart from it a triangle and two spheres. The cube has 8 corners, 12 edges and 6 faces; each face is
 * two triangles, which share a diagonal: 6 more edges. */
TEST(corners_edges_and_faces)
{
    struct err e = {0};
    OWN(scene) s = build_scene();
    uint32_t m = build_material(&s, grey(0.5f), grey(0));
    build_box(&s, v3(0, 0, 0), v3(1, 1, 1), m);
    build_triangle(&s, v3(3, 0, 0), v3(-7, 0, 0), v3(3, 1, 0), m);
    build_sphere(&s, v3(9, 1, 2), 0.5f, 1, m);
    build_sphere(&s, v3(4, 1, 2), 0.25f, -1, m);
    MUST(scene_finish(&s, "test", &e));
    uint32_t prim[15];
    for (uint32_t i = 0; i < 15; i++)
        prim[i] = i;
    static struct small_scene f;
    small_scene_fill(&s, prim, 15, &f);
    assert_int_equal(f.num_triangles, 13);
    assert_int_equal(f.num_spheres, 2);
    assert_int_equal(f.num_corners, 8 + 3);
    assert_int_equal(f.num_edges, 12 + 6 + 3);
    assert_int_equal(f.num_faces, 6 + 1);
    assert_true(f.reach == 7);
    for (int i = 0; i < 15; i++)
        assert_int_equal(f.number[i], i);
    assert_true(f.sphere[0][0] == 9 && f.sphere[0][3] == 0.5f && f.sphere[1][0] == 4 &&
                f.sphere[1][3] == 0.25f);
    int seen[15] = {0};
    for (int i = 0; i < f.num_faces; i++) {
        const struct flat_face *face = &f.face[i];
        const bool alone = face->prim[0] == 12;
        assert_int_equal(face->is_triangle, alone);
        seen[face->prim[0]]++;
        seen[face->prim[1]] += !alone;
        /* Both triangles are of one square and in the face's plane; u and v run from 0 to 1. */
        assert_true(alone || face->prim[0] / 2 == face->prim[1] / 2);
        double lo[2] = {9, 9}, hi[2] = {-9, -9};
        for (int j = 0; j < (alone ? 1 : 2); j++)
            for (int c = 0; c < 3; c++) {
                const vec3 p = s.position[3 * face->prim[j] + c];
                const float *n = face->normal, *row[2] = {face->u_row, face->v_row};
                assert_near(n[0] * p.x + n[1] * p.y + n[2] * p.z, face->offset, 1e-6);
                for (int k = 0; k < 2; k++) {
                    double x =
                        (double)(row[k][0] * p.x + row[k][1] * p.y + row[k][2] * p.z + row[k][3]);
                    lo[k] = fmin(lo[k], x);
                    hi[k] = fmax(hi[k], x);
                }
            }
        for (int k = 0; k < 2; k++) {
            assert_near(lo[k], 0, 1e-6);
            assert_near(hi[k], 1, 1e-6);
        }
        assert_near(face->per_area, alone ? 0.1 : 1, 1e-6);
    }
    for (int i = 0; i < 13; i++)
        assert_int_equal(seen[i], 1);
}
