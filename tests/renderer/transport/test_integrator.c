/* Estimators against closed forms. H0 of every z-test: the mean of the pixel's samples is the
 * closed form. Two-sided at alpha = 1e-6 (|z| < 4.89), one seed, fixed n, no retry. With n = 4e4 or
 * more samples of moderate skew the normal limit is good to a factor of two there. Each group has a
 * negative control: a value that a known bug would give must be rejected by the same test. */
#include "tests/support/render_check.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

static struct integrator_options paths(int direct, int depth)
{
    return check_options(direct, depth, 20260101);
}

/* A sphere seen from inside that reflects rho and emits E: L = E sum_{k=0..m} rho^k for every m,
 * because every point sees the same radiance in all directions. */
TEST(furnace_at_every_depth)
{
    const double rho[3] = {0.8, 0.5, 0.2}, emitted[3] = {1, 2, 4};
    OWN(scene) s = build_scene();
    uint32_t m = build_material(&s, (rgb){0.8f, 0.5f, 0.2f}, (rgb){1, 2, 4});
    build_sphere(&s, v3(0.1f, -0.2f, 0.3f), 1, -1, m);
    build_camera(&s, v3(0.3f, 0, 0.5f), 60);
    check_finish(&s);
    for (int direct = 0; direct_kind_names[direct] != NULL; direct++)
        for (int depth = 0; depth <= 6; depth += depth < 2 ? 1 : 4) {
            struct integrator_options io = paths(direct, depth);
            struct check_result film = check_look(&s, io, 8, 1024);
            for (int c = 0; c < 3; c++) {
                double sum = 0, term = emitted[c];
                for (int k = 0; k <= depth; k++, term *= rho[c])
                    sum += term;
                check_mean(&film, c, sum, direct_kind_names[direct]);
                /* Negative control: depth counted one too high. Hemisphere sampling is too noisy to
                 * see that in the deep sums; everything else has to. */
                if (term > 1e-3 * sum && (direct != DIRECT_HEMISPHERE || depth < 2))
                    assert_false(check_agrees(&film, c, sum + term));
            }
        }
}

TEST(rectangle_light)
{
    /* Parallel, off axis; upright and near (grazing); both face the patch. */
    static const float quads[2][9] = {{0.2f, 1, -0.7f, 0.9f, 0, 0, 0, 0, 0.5f},
                                      {0.3f, 0.05f, 0.5f, 0, 0, -1, 0, 0.8f, 0}};
    for (int q = 0; q < 2; q++) {
        OWN(scene) s = check_plate(v3(0, 1, 0), 0.6f);
        uint32_t lamp = build_material(&s, grey(0), grey(5));
        const float *f = quads[q];
        vec3 p = v3(f[0], f[1], f[2]), u = v3(f[3], f[4], f[5]), v = v3(f[6], f[7], f[8]);
        /* The front has to see the origin. */
        if (dot(cross(u, v), neg(p)) < 0)
            build_quad(&s, p, v, u, lamp);
        else
            build_quad(&s, p, u, v, lamp);
        check_finish(&s);
        double corner[4][3] = {{p.x, p.y, p.z},
                               {p.x + u.x, p.y + u.y, p.z + u.z},
                               {p.x + u.x + v.x, p.y + u.y + v.y, p.z + u.z + v.z},
                               {p.x + v.x, p.y + v.y, p.z + v.z}};
        double expected = 0.6 / M_PI * 5 * check_irradiance((const double(*)[3])corner, 4);
        for (int direct = 0; direct_kind_names[direct] != NULL; direct++)
            for (int l = 1; l <= 3; l += 2) {
                struct integrator_options io = paths(direct, 1);
                io.light_samples = l;
                struct check_result film = check_look(&s, io, 8, 4096);
                check_mean(&film, 1, expected, direct_kind_names[direct]);
                /* Negative control: the assignment's pdf lacks a factor of the distance, so its image would be
                 * 1.25 (first lamp) and 0.53 times (second) as bright; 5 % would already be rejected. */
                assert_false(check_agrees(&film, 1, 1.05 * expected));
            }
    }
}

/* E = pi L (r/d)^2 cos(theta) for a sphere of uniform radiance wholly above the horizon, d from the
 * point to its centre. */
TEST(sphere_light)
{
    static const float centre[3][3] = {{0, 1, 0}, {0.8f, 0.9f, -0.3f}, {0, 0.35f, 0.2f}};
    for (int q = 0; q < 3; q++) {
        OWN(scene) s = check_plate(v3(0, 1, 0), 0.5f);
        uint32_t lamp = build_material(&s, grey(0), grey(3));
        vec3 c = v3(centre[q][0], centre[q][1], centre[q][2]);
        build_sphere(&s, c, 0.25f, 1, lamp);
        check_finish(&s);
        double d2 = (double)dot(c, c), cos_theta = c.y / sqrt(d2);
        double expected = 0.5 / M_PI * (M_PI * 3 * 0.0625 / d2 * cos_theta);
        for (int direct = 0; direct_kind_names[direct] != NULL; direct++) {
            struct integrator_options io = paths(direct, 1);
            struct check_result film = check_look(&s, io, 8, 4096);
            check_mean(&film, 0, expected, direct_kind_names[direct]);
            assert_false(check_agrees(&film, 0, expected / cos_theta * 0.9));
        }
    }
}

/* Point light: rho/pi I cos/d^2. Directional: rho/pi E cos. The only noise is from the size of the
 * pixel. */
TEST(delta_lights)
{
    OWN(scene) s = check_plate(v3(0, 1, 0), 0.7f);
    build_point(&s, v3(0.6f, 0.8f, -0.5f), (rgb){2, 3, 4});
    vec3 sun = normalize(v3(-1, 2, 0.5f));
    build_sun(&s, sun, (rgb){1, 0, 0.5f});
    check_finish(&s);
    struct check_result film = check_look(&s, paths(DIRECT_MIS, 1), 4, 64);
    double d2 = 0.36 + 0.64 + 0.25, cos_point = 0.8 / sqrt(d2);
    double cos_sun = 2 / sqrt(1 + 4 + 0.25);
    const double intensity[3] = {2, 3, 4}, irradiance[3] = {1, 0, 0.5};
    for (int c = 0; c < 3; c++) {
        double expected = 0.7 / M_PI * (intensity[c] * cos_point / d2 + irradiance[c] * cos_sun);
        check_mean(&film, c, expected, "delta lights");
        assert_false(check_agrees(&film, c, expected * 1.001));
    }
}

/* A plate between light and patch blocks all light; moved out of the line of sight, none. */
TEST(shadow)
{
    for (int blocked = 0; blocked < 2; blocked++) {
        OWN(scene) s = check_plate(v3(0, 1, 0), 0.7f);
        uint32_t black = build_material(&s, grey(0), grey(0));
        build_quad(&s, v3(blocked ? -0.1f : 0.3f, 0.5f, -0.1f), v3(0.2f, 0, 0), v3(0, 0, 0.2f),
                   black);
        build_point(&s, v3(0, 1, 0), grey(1));
        check_finish(&s);
        struct check_result film = check_look(&s, paths(DIRECT_MIS, 1), 4, 16);
        check_mean(&film, 0, blocked ? 0 : 0.7 / M_PI, "shadow");
    }
}

/* A box with two spheres and a lamp; enough of everything for the metamorphic tests. */
static struct scene box_scene(float radiance)
{
    struct scene s = build_room(radiance);
    build_sphere(&s, v3(-0.4f, 0.3f, -0.3f), 0.3f, 1, 1);
    check_finish(&s);
    return s;
}

/* A cell, and a range of samples, are the same numbers as in the whole image. */
TEST(cells_and_sample_ranges_add_up)
{
    struct err e = {0};
    OWN(scene) s = box_scene(10);
    struct camera c;
    MUST(camera_init(&c, &s, 40, 30, &e));
    struct render_options o = {.integrator = paths(DIRECT_MIS, 3),
                               .width = 40,
                               .height = 30,
                               .num_samples = 6,
                               .threads = 2};
    OWN(moments) whole = check_render_all(&s, &c, &o, BVH_SAH, NULL);
    o.num_samples = 2;
    OWN(moments) first = check_render_all(&s, &c, &o, BVH_SAH, NULL);
    o.first_sample = 2;
    o.num_samples = 4;
    OWN(moments) rest = check_render_all(&s, &c, &o, BVH_SAH, NULL);
    MUST(moments_merge(&first, &rest, &e));
    o = (struct render_options){.integrator = o.integrator,
                                .x = 7,
                                .y = 11,
                                .width = 21,
                                .height = 13,
                                .num_samples = 6,
                                .threads = 1};
    OWN(moments) cell = check_render_all(&s, &c, &o, BVH_SAH, NULL);
    for (int y = 0; y < 13; y++)
        assert_memory_equal(cell.mean + 3 * (size_t)y * 21,
                            whole.mean + 3 * ((size_t)(y + 11) * 40 + 7), 21 * 3 * sizeof(double));
    for (size_t i = 0; i < 3 * 40 * 30; i++) {
        assert_true(fabs(first.mean[i] - whole.mean[i]) <= 1e-12 * (1 + fabs(whole.mean[i])));
        assert_true(fabs(first.m2[i] - whole.m2[i]) <= 1e-10 * (1 + fabs(whole.m2[i])));
    }
}

/* Bounces 0..4 rendered one by one add up to the image that accumulates them: the same random
 * numbers, so up to float rounding and not only in the mean. */
TEST(bounces_add_up)
{
    OWN(scene) s = box_scene(10);
    for (int direct = 0; direct_kind_names[direct] != NULL; direct++) {
        struct integrator_options io = paths(direct, 4);
        OWN(moments) all = check_render(&s, io, 16, 12, 16);
        double sum[16 * 12 * 3] = {0};
        for (int k = 0; k <= 4; k++) {
            io.first_bounce = io.max_bounces = k;
            OWN(moments) only = check_render(&s, io, 16, 12, 16);
            for (size_t i = 0; i < 16 * 12 * 3; i++)
                sum[i] += only.mean[i];
        }
        for (size_t i = 0; i < 16 * 12 * 3; i++)
            assert_true(fabs(sum[i] - all.mean[i]) <= 1e-5 * (0.01 + all.mean[i]));
    }
}

TEST(twice_the_light_twice_the_image)
{
    struct integrator_options io = paths(DIRECT_MIS, 4);
    struct scene one = box_scene(5), two = box_scene(10);
    OWN(moments) a = check_render(&one, io, 16, 12, 16);
    OWN(moments) b = check_render(&two, io, 16, 12, 16);
    for (size_t i = 0; i < 16 * 12 * 3; i++)
        assert_true(b.mean[i] == 2 * a.mean[i]);
    scene_free(&one);
    scene_free(&two);
}

/* All estimators, roulette or not, have the same mean. Cornell-like box, depth 4, 64 x 48 pixels,
 * 64 samples: relative standard error about 0.3 % (light, mis), so a loss of 3 % is found. */
TEST(estimators_agree)
{
    OWN(scene) s = box_scene(10);
    struct integrator_options io = paths(DIRECT_MIS, 4);
    io.roulette = ROULETTE_OFF;
    OWN(moments) reference = check_render(&s, io, 64, 48, 64);
    for (int direct = 0; direct_kind_names[direct] != NULL; direct++)
        for (int roulette = ROULETTE_OFF; roulette <= ROULETTE_FIXED; roulette++) {
            io.sampler.seed++;
            io.direct = (enum direct_kind)direct;
            io.roulette = (enum roulette_kind)roulette;
            io.survival = 0.7f;
            OWN(moments) film = check_render(&s, io, 64, 48, 64);
            double z = check_z(&film, &reference, 0);
            if (fabs(z) > CHECK_Z_LIMIT)
                fail_msg("%s, roulette %d: z = %.2f", direct_kind_names[direct], roulette, z);
        }
    /* Negative control: one bounce less. */
    io.max_bounces = 3;
    OWN(moments) shallow = check_render(&s, io, 64, 48, 256);
    assert_true(fabs(check_z(&shallow, &reference, 0)) > CHECK_Z_LIMIT);
}
