/* Environment, spot lights and the choice among many lights, through render(), against closed forms
 * and quadrature. The z-tests are those of render_check.h; each scene has a value that a known bug
 * would give, which the same test must reject. */
#include "renderer/shading/light_simd.h"
#include "tests/support/render_check.h"
#include "tests/support/sky.h"
#include "tests/support/mesh.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <gsl/gsl_integration.h>

static struct integrator_options paths(int direct, int depth)
{
    return check_options(direct, depth, 20260202);
}

/* The scene owns it from then on. */
static void give_sky(struct scene *s, struct environment *env)
{
    assert_non_null(env);
    s->environment = env;
    build_light(s, (struct light){.kind = LIGHT_ENVIRONMENT});
}

/* Nothing but a sky of radiance L over a plate of albedo rho, or around a sphere: they show rho L at every
 * depth, as neither sees itself. Beside the sphere: L. */
TEST(constant_sky)
{
    struct err e;
    for (int around = 0; around < 2; around++) {
        struct scene s = check_plate(v3(0, 1, 0), 0.6f);
        if (around) {
            scene_free(&s);
            s = build_scene();
            build_sphere(&s, v3(0, 0, -5), 1, 1, build_material(&s, grey(0.6f), grey(0)));
            build_camera(&s, v3(0.4f, 0.3f, 0), 0.02f);
        }
        give_sky(&s, environment_constant((rgb){1, 2, 4}, &e));
        check_finish(&s);
        for (int direct = 0; direct_kind_names[direct] != NULL; direct++) {
            struct integrator_options io = paths(direct, around ? 3 : 1);
            struct check_result film = check_look(&s, io, 8, 1024);
            for (int c = 0; c < 3; c++) {
                check_mean(&film, c, 0.6 * (1 << c), direct_kind_names[direct]);
                /* Twice, as if light sampling and path both counted in full; and 5 % less. */
                assert_false(check_agrees(&film, c, 1.2 * (1 << c)));
                assert_false(check_agrees(&film, c, 0.57 * (1 << c)));
            }
        }
        if (around) {
            s.camera.eye = v3(2, 0, 0);
            struct check_result film = check_look(&s, paths(DIRECT_MIS, 1), 4, 4);
            check_mean(&film, 2, 4, "beside the sphere");
        }
        scene_free(&s);
    }
}

/* An uneven map over plates that face five ways: rho/pi times the irradiance by quadrature. The
 * wrong values are those of the plate that faces the other way, and 5 %. */
TEST(uneven_sky)
{
    static const double normals[5][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 0, 1}, {0, 0, -1}, {0, 1, 0}};
    const struct sky sky = sky_uneven(16, 8);
    for (int k = 0; k < 5; k++) {
        const double *n = normals[k], opposite[3] = {-n[0], -n[1], -n[2]};
        OWN(scene) s = check_plate(v3((float)n[0], (float)n[1], (float)n[2]), 0.7f);
        give_sky(&s, sky_environment(&sky));
        check_finish(&s);
        double expected = 0.7 / M_PI * sky_irradiance(&sky, n);
        for (int direct = 0; direct_kind_names[direct] != NULL; direct++) {
            struct integrator_options io = paths(direct, 1);
            struct check_result film = check_look(&s, io, 8, 1024);
            check_mean(&film, 0, expected, direct_kind_names[direct]);
            check_mean(&film, 2, 3 * expected, direct_kind_names[direct]);
            assert_false(check_agrees(&film, 0, 0.7 / M_PI * sky_irradiance(&sky, opposite)));
            if (direct == DIRECT_LIGHT || direct == DIRECT_MIS)
                assert_false(check_agrees(&film, 0, 1.05 * expected));
        }
    }
}

/* One bright texel of 32 x 16, a tent of half width d = pi/16 around theta_c and 2 pi/32 in
 * azimuth: E = L 2pi/32 int (1 - |x|/d) sin(theta_c + x) cos(theta_c + x) dx
 *         = L 2pi/32 (sin(2 theta_c)/2) sin(d)^2/d,
 * which for a small texel is L times solid angle times cosine. Light sampling has a standard error of
 * less than 1 % from 65536 paths; uniform directions leave about 4 %. */
TEST(bright_texel)
{
    struct sky sky = {.width = 32, .height = 16};
    sky.value[3 * 32 + 11] = 1000;
    OWN(scene) s = check_plate(v3(0, 1, 0), 0.5f);
    give_sky(&s, sky_environment(&sky));
    check_finish(&s);
    double theta = 3.5 * M_PI / 16, d = M_PI / 16, azimuth = 2 * M_PI / 32;
    double irradiance = 1000 * azimuth * 0.5 * sin(2 * theta) * sin(d) * sin(d) / d;
    double solid_angle = azimuth * (cos(theta - d / 2) - cos(theta + d / 2));
    assert_true(fabs(irradiance / (1000 * solid_angle * cos(theta)) - 1) < 0.05);
    double expected = 0.5 / M_PI * irradiance;
    for (int direct = 0; direct_kind_names[direct] != NULL; direct++) {
        struct integrator_options io = paths(direct, 1);
        struct check_result film = check_look(&s, io, 8, 1024);
        check_mean(&film, 1, 2 * expected, direct_kind_names[direct]);
        if (direct == DIRECT_LIGHT || direct == DIRECT_MIS) {
            assert_true(film.std_error[1] < 0.01 * 2 * expected);
            /* Without the cosine at the plate; 5 %, as if the tent were a square. */
            assert_false(check_agrees(&film, 1, 2 * expected / cos(theta)));
            assert_false(check_agrees(&film, 1, 1.05 * 2 * expected));
        }
    }
}

/* What the camera sees in direction w: the sky directly, in a mirror, or through a ball of glass of index 1.
 * Light sampling has no part in it. */
enum view { VIEW_SKY, VIEW_MIRROR, VIEW_NO_GLASS, NUM_VIEWS };

static struct scene catalogue_view_scene(enum view view, vec3 w, float reflectance)
{
    struct scene s = build_scene();
    uint32_t m = build_material(&s, grey(reflectance), grey(0));
    s.materials[m].transmittance = grey(reflectance);
    frame f = frame_from_normal(w);
    vec3 backward = neg(w);
    s.materials[m].ior = 1;
    s.materials[m].kind = view == VIEW_MIRROR ? MATERIAL_MIRROR : MATERIAL_GLASS;
    switch (view) {
    case VIEW_SKY: build_sphere(&s, scale(w, -9), 1, 1, m); break;
    case VIEW_NO_GLASS: build_sphere(&s, scale(w, 5), 1, 1, m); break;
    case VIEW_MIRROR: {
        /* The plate's normal is halfway between w and the way back to the eye. */
        const float h = 0.70710678f;
        vec3 n = scale(add(w, f.s), h);
        frame g = frame_from_normal(n);
        build_quad(&s, add(scale(g.s, -1), scale(g.t, -1)), scale(g.s, 2), scale(g.t, 2), m);
        backward = f.s;
        check_aim(&s, scale(f.s, 4), backward, f.t);
        return s;
    }
    case NUM_VIEWS: break;
    }
    check_aim(&s, v3(0, 0, 0), backward, f.t);
    return s;
}

TEST(seen_directly_and_in_mirrors)
{
    static const float directions[7][3] = {{-1, 0, 0},
                                           {0, 0, 1},
                                           {1, 0, 0},
                                           {0, 0, -1},
                                           {0.48f, 0.6f, 0.64f},
                                           {0.48f, -0.6f, -0.64f},
                                           {-0.6f, 0.64f, 0.48f}};
    const struct sky sky = sky_uneven(16, 8);
    for (int k = 0; k < 7; k++)
        for (int view = 0; view < NUM_VIEWS; view++)
            for (int direct = 0; direct_kind_names[direct] != NULL; direct++) {
                vec3 w = v3(directions[k][0], directions[k][1], directions[k][2]);
                OWN(scene) s = catalogue_view_scene((enum view)view, w, 0.8f);
                give_sky(&s, sky_environment(&sky));
                check_finish(&s);
                struct integrator_options io = paths(direct, 2);
                io.roulette = ROULETTE_OFF;
                struct check_result film = check_look(&s, io, 2, 256);
                double theta = acos((double)w.y), phi = atan2(-(double)w.z, w.x) + M_PI;
                double le = sky_on_map(&sky, phi / (2 * M_PI) * 16, theta / M_PI * 8);
                static const double factor[NUM_VIEWS] = {1, 0.8, 0.64};
                /* The image is 0.0003 radians wide, on which the map changes by 1e-3 at most. */
                double expected = factor[view] * le;
                if (fabs(film.mean[0] - expected) > 1e-3 + 2e-3 * expected)
                    fail_msg("direction %d, view %d, %s: %.6f, expected %.6f", k, view,
                             direct_kind_names[direct], film.mean[0], expected);
            }
}

TEST(glass_in_a_constant_sky)
{
    struct err e;
    OWN(scene) s = catalogue_view_scene(VIEW_NO_GLASS, v3(0, 0, -1), 1);
    s.materials[0].ior = 1.5f;
    s.camera.hfov = 0.3f;
    give_sky(&s, environment_constant(grey(3), &e));
    check_finish(&s);
    struct integrator_options io = paths(DIRECT_MIS, 60);
    struct check_result film = check_look(&s, io, 8, 64);
    check_mean(&film, 0, 3, "glass");
    /* With few bounces some of the light is still inside. */
    io.max_bounces = 2;
    film = check_look(&s, io, 8, 64);
    assert_false(check_agrees(&film, 0, 3));
}

/* The assignment's ambient light: a plate that looks up gets pi L, one that looks sideways half of
 * it, one that looks down nothing; camera and mirror see black. */
TEST(upper_half)
{
    struct err e;
    static const float normals[3][3] = {{0, 1, 0}, {1, 0, 0}, {0, -1, 0}};
    for (int k = 0; k < 3; k++)
        for (int direct = 0; direct_kind_names[direct] != NULL; direct++) {
            OWN(scene) s = check_plate(v3(normals[k][0], normals[k][1], normals[k][2]), 0.7f);
            give_sky(&s, environment_upper_half(grey(2), &e));
            check_finish(&s);
            struct integrator_options io = paths(direct, 1);
            struct check_result film = check_look(&s, io, 8, 512);
            double expected = 0.7 * 2 * (1 - 0.5 * k);
            check_mean(&film, 0, expected, direct_kind_names[direct]);
            assert_false(check_agrees(&film, 0, expected + 0.07));
        }
    for (int view = 0; view < NUM_VIEWS; view++) {
        OWN(scene) s = catalogue_view_scene((enum view)view, v3(0, 1, 0), 0.8f);
        give_sky(&s, environment_upper_half(grey(2), &e));
        check_finish(&s);
        struct integrator_options io = paths(DIRECT_MIS, 3);
        struct check_result film = check_look(&s, io, 2, 16);
        check_mean(&film, 0, 0, "hidden");
    }
}

/* Floor, wall, two spheres: something that shades itself. */
static struct scene corner_scene(void)
{
    struct scene s = build_scene();
    uint32_t white = build_material(&s, grey(0.7f), grey(0));
    uint32_t red = build_material(&s, (rgb){0.6f, 0.2f, 0.2f}, grey(0));
    build_quad(&s, v3(-1, 0, 1), v3(2, 0, 0), v3(0, 0, -2), white);
    build_quad(&s, v3(-1, 0, -1), v3(2, 0, 0), v3(0, 1.5f, 0), white);
    build_sphere(&s, v3(0.4f, 0.3f, 0.3f), 0.3f, 1, white);
    build_sphere(&s, v3(-0.4f, 0.3f, -0.3f), 0.3f, 1, red);
    build_camera(&s, v3(0, 0.75f, 3), 45);
    return s;
}

/* A constant environment, and a sphere of radius 50 around the scene that emits the same radiance inwards:
 * two ways through the code to the same image. 32 x 24 pixels, 256 samples, standard error of the
 * difference about 0.2 %. */
TEST(sky_or_sphere_of_emitters)
{
    struct err e;
    struct integrator_options io = paths(DIRECT_MIS, 3);
    OWN(scene) sphere = corner_scene();
    build_sphere(&sphere, v3(0, 0, 0), 50, -1, build_material(&sphere, grey(0), grey(2)));
    check_finish(&sphere);
    OWN(moments) reference = check_render(&sphere, io, 32, 24, 256);
    for (int direct = 0; direct_kind_names[direct] != NULL; direct++)
        for (int dim = 0; dim < 2; dim++) {
            OWN(scene) s = corner_scene();
            give_sky(&s, environment_constant(grey(dim ? 1.94f : 2), &e));
            check_finish(&s);
            io.sampler.seed++;
            io.direct = (enum direct_kind)direct;
            OWN(moments) film = check_render(&s, io, 32, 24, 256);
            double z = check_z(&film, &reference, 0);
            if ((fabs(z) > CHECK_Z_LIMIT) != (dim != 0))
                fail_msg("%s, %s: z = %.2f", direct_kind_names[direct], dim ? "3 % less" : "equal",
                         z);
        }
}

/* rho/pi I cos(alpha)^e cos(theta)/d^2 inside the cone, 0 outside; no noise. The lamp is at
 * (0.6, 0.8, -0.5), so d^2 = 1.25. */
TEST(spot_light)
{
    static const struct {
        double off, half_angle, exponent; /* degrees between axis and the plate's middle */
    } spots[] = {{0, 30, 0},    {0, 5, 8},   {20, 25, 0}, {20, 25, 3}, {20, 19, 3},
                 {50, 90, 1.5}, {89, 90, 1}, {91, 90, 0}, {160, 90, 2}};
    const vec3 at = v3(0.6f, 0.8f, -0.5f);
    for (size_t k = 0; k < sizeof spots / sizeof *spots; k++) {
        OWN(scene) s = check_plate(v3(0, 1, 0), 0.7f);
        frame f = frame_from_normal(normalize(neg(at)));
        float off = (float)(spots[k].off * M_PI / 180);
        vec3 axis = add(scale(f.n, cosf(off)), scale(f.t, sinf(off)));
        float cutoff =
            spots[k].half_angle < 90 ? cosf((float)(spots[k].half_angle * M_PI / 180)) : 0;
        build_spot(&s, at, normalize(axis), cutoff, (float)spots[k].exponent, (rgb){2, 3, 4});
        check_finish(&s);
        bool lit = spots[k].off < spots[k].half_angle;
        double share = lit ? pow(cos(spots[k].off * M_PI / 180), spots[k].exponent) : 0;
        for (int one = 0; one < 2; one++) {
            struct integrator_options io = paths(DIRECT_MIS, 1);
            io.many_lights = one ? LIGHTS_ONE : LIGHTS_ALL;
            struct check_result film = check_look(&s, io, 4, 64);
            for (int c = 0; c < 3; c++) {
                double expected = 0.7 / M_PI * (c + 2) * share * 0.8 / pow(1.25, 1.5);
                /* Near the right angle the image's width shows: 0.0003 radians of 1 degree. */
                if (!(fabs(film.mean[c] - expected) <= 1e-3 * expected))
                    fail_msg("spot %zu: %.7f, expected %.7f", k, film.mean[c], expected);
                if (spots[k].exponent > 0 && spots[k].off > 0 && lit)
                    assert_false(check_agrees(&film, c, expected / share));
            }
        }
    }
}

/* A lamp of forty triangles, one after the other along x, of heights 1 to 13 and so of uneven areas. Numbers in equal
 * steps find each in proportion to its area, to one step at either end, and the density is that of a point of the whole:
 * d^2 / (cos area), with cos = 1/d at a distance of 1. */
TEST(triangles_of_a_mesh_lamp_by_area)
{
    enum { N = 40, STEPS = 20000 };
    struct err e;
    OWN(scene) s = build_scene();
    uint32_t m = build_material(&s, grey(0), grey(1));
    double height[N], all = 0;
    for (int k = 0; k < N; k++) {
        const float x = (float)k, z = (float)(1 + 7 * k % 13);
        build_triangle(&s, v3(x, 1, 0), v3(x + 1, 1, 0), v3(x, 1, z), m);
        all += height[k] = (double)z;
    }
    build_join(&s, 0);
    build_camera(&s, v3(0, 0, 0), 40);
    check_finish(&s);
    assert_int_equal(s.num_lights, 1);
    struct light_table *t = light_table_build(&s, &e);
    assert_non_null(t);
    int count[N] = {0};
    for (int i = 0; i < STEPS; i++) {
        const float u[4] = {0.3f, 0.4f, ((float)i + 0.5f) / STEPS, 0};
        struct light_samplev l;
        sample_light_from(t, 0, v3(20, 0, 0), v3(0, 1, 0), u, 1, &l);
        int k = (int)floorf(20 + l.wi.x * l.distance);
        assert_in_range(k, 0, N - 1);
        count[k]++;
        double d = (double)l.distance;
        assert_near(l.pdf_w * (all / 2) / (d * d * d), 1, 1e-5);
    }
    for (int k = 0; k < N; k++)
        assert_near(count[k], STEPS * height[k] / all, 1.5);
    light_table_free(t);
}

/* Chooses a light for the point p with unit normal n by the number 0 <= u < 1; *probability: how likely it was. */
static uint32_t choose_light(const struct light_clusters *c, vec3 p, vec3 n, float u,
                             float *probability)
{
    float weight, all, within;
    const int cluster = choose_cluster(c, p, n, u, &weight, &all, &u);
    const uint32_t light = choose_in_cluster(c, cluster, &u, &within);
    *probability = weight / all * within;
    return light;
}

static float choice_probability(const struct light_table *t, uint32_t l, vec3 p, vec3 n)
{
    float weight, all, rest;
    choose_cluster(t->all, p, n, 0, &weight, &all, &rest);
    return chosen_probability(t->all, l, p, n, all);
}

/* At a plate's middle a light of each kind is chosen in proportion to its irradiance there, in closed form: I cos/d^2
 * of a point (its falloff aside), L A cos cos/d^2 of a small lamp (within 1 %), L pi r^2 cos/d^2 of a small sphere,
 * pi L of a constant sky. Lights below the plate, or facing away from it, are never chosen. */
TEST(choice_is_by_irradiance)
{
    struct err e;
    OWN(scene) s = check_plate(v3(0, 1, 0), 0.5f);
    const vec3 up = v3(0, 1, 0), down = v3(0, -1, 0), at = v3(1, 1, 0);
    const float falls[][3] = {{0, 0, 1}, {2, 0, 0}};
    for (int k = 0; k < 2; k++)
        build_light(&s, (struct light){.kind = LIGHT_POINT,
                                       .value = {1, 1, 1},
                                       .position = at,
                                       .attenuation = {falls[k][0], falls[k][1], falls[k][2]}});
    build_point(&s, v3(0, -0.5f, 0), grey(9));
    build_spot(&s, v3(0.5f, 1, 0), down, 0.6f, 1, grey(3));
    build_spot(&s, v3(0.5f, 1, 0), up, 0.6f, 1, grey(3));
    build_sun(&s, v3(0.6f, 0.8f, 0), (rgb){0, 2, 0});
    build_sun(&s, down, (rgb){0, 2, 0});
    build_light(&s, (struct light){.kind = LIGHT_POINT, .attenuation = {1, 0, 0}});
    give_sky(&s, environment_constant(grey(0.1f), &e));
    uint32_t lamp = build_material(&s, grey(0), grey(16000));
    build_quad(&s, v3(0.995f, 2, -0.005f), v3(0.01f, 0, 0), v3(0, 0, 0.01f), lamp);
    build_quad(&s, v3(0.995f, 2, -0.005f), v3(0, 0, 0.01f), v3(0.01f, 0, 0), lamp);
    build_sphere(&s, v3(-1, 2, 0), 0.005f, 1, lamp);
    check_finish(&s);
    assert_int_equal(s.num_dark_lights, 1);
    const double slant = 1 / sqrt(1.25);
    const double part[] = {1 / (2 * sqrt(2)),
                           0.5 / sqrt(2),
                           0,
                           3 * slant * slant / 1.25,
                           0,
                           2 * 0.7152 * 0.8,
                           0,
                           0,
                           M_PI * 0.1,
                           16000 * 0.0001 * (4. / 5) / 5,
                           0,
                           16000 * M_PI * 0.000025 * (2 / sqrt(5)) / 5};
    enum { N = sizeof part / sizeof *part };
    assert_int_equal(s.num_lights, N);
    struct light_table *t = light_table_build(&s, &e);
    assert_non_null(t);
    assert_int_equal(light_count_areas(t), 4);
    double all = 0, delta = 0;
    for (int i = 0; i < N; i++) {
        all += part[i];
        delta += light_is_delta(&s.lights[i]) ? part[i] : 0;
    }
    const vec3 p = v3(0, 0, 0);
    for (uint32_t i = 0; i < N; i++)
        assert_near(choice_probability(t, i, p, up), part[i] / all, 0.01 * part[i] / all);
    /* As often as that, and with that probability. 65536 numbers in equal steps. */
    uint32_t count[2][N] = {{0}};
    for (int d = 0; d < 2; d++)
        for (int k = 0; k < 65536; k++) {
            float probability;
            const uint32_t light =
                choose_light(d != 0 ? t->delta : t->all, p, up, (float)k / 65536, &probability);
            assert_true(light < N && probability > 0);
            count[d][light]++;
        }
    for (uint32_t i = 0; i < N; i++) {
        bool is_delta = light_is_delta(&s.lights[i]);
        assert_near(count[0][i] / 65536., choice_probability(t, i, p, up), 1e-4);
        assert_near(count[1][i] / 65536., is_delta ? part[i] / delta : 0, 2e-3);
    }
    /* From below only the point light and the sun of the other side, and the sky, which is all around. */
    for (uint32_t i = 0; i < N; i++)
        assert_int_equal(choice_probability(t, i, p, down) > 0, i == 2 || i == 6 || i == 8);
    light_table_free(t);
}

static vec3 random_point(uint32_t i, uint32_t k)
{
    return mesh_random_point(11, i, k);
}

/* 300 spots, points, spheres and lamps of any size and direction in a cube, and 200 points with normals in it: a
 * light whose own sample reaches the front of the surface has a positive probability there; probabilities sum to 1,
 * and lights are chosen as often as they say (4096 numbers in equal steps; rounding at the ends of a cluster and of a
 * light may cost one each). Control: with the normal reversed, lights that do contribute are left out. */
TEST(no_light_is_left_out)
{
    enum { N = 300, PLACES = 200, STEPS = 4096 };
    struct err e;
    struct scene s = build_scene();
    for (uint32_t i = 0; i < N / 3; i++) {
        const vec3 at = random_point(i, 0), axis = normalize(random_point(i, 1));
        build_light(&s, (struct light){.kind = i % 2 ? LIGHT_POINT : LIGHT_SPOT,
                                       .value = grey(1 + at.x),
                                       .position = at,
                                       .attenuation = {0.1f, 0, 1},
                                       .axis = axis,
                                       .cos_cutoff = 0.9f * fabsf(at.y),
                                       .exponent = 2 * fabsf(at.z)});
    }
    for (uint32_t i = N / 3; i < N; i++) {
        const vec3 at = random_point(i, 0), size = scale(random_point(i, 1), i % 7 ? 0.1f : 0.7f);
        uint32_t m = build_material(&s, grey(0), grey(3 + at.z));
        s.materials[m].radiance_both_sides = i % 5 == 0;
        if (i % 3)
            build_quad(&s, at, size, scale(random_point(i, 2), 0.1f), m);
        else
            build_sphere(&s, at, length(size), i % 2 ? 1 : -1, m);
    }
    build_camera(&s, v3(0, 0, 0), 40);
    check_finish(&s);
    assert_int_equal(s.num_lights, N);
    struct light_table *t = light_table_build(&s, &e);
    assert_non_null(t);
    int left_out = 0, found = 0, never = 0;
    for (uint32_t k = 0; k < PLACES; k++) {
        const vec3 p = random_point(N + k, 0), n = normalize(random_point(N + k, 1));
        double sum = 0, probability[N];
        int count[N] = {0};
        for (uint32_t l = 0; l < N; l++) {
            sum += probability[l] = (double)choice_probability(t, l, p, n);
            never += probability[l] == 0;
            for (uint32_t i = 0; i < 4; i++) {
                struct light_samplev ls;
                sample_light_from(t, l, p, n, sampler_get(12, k, l, i, 0).u, 1, &ls);
                if (!(ls.pdf_w > 0 && dot(ls.wi, n) > 0 && rgb_max(ls.radiance) > 0))
                    continue;
                found++;
                if (probability[l] == 0)
                    fail_msg("light %u is never chosen at place %u", l, k);
                left_out += choice_probability(t, l, p, neg(n)) == 0;
            }
        }
        assert_near(sum, 1, 1e-5);
        for (int i = 0; i < STEPS; i++) {
            float its;
            const uint32_t l = choose_light(t->all, p, n, ((float)i + 0.5f) / STEPS, &its);
            assert_near(its / probability[l], 1, 1e-2);
            count[l]++;
        }
        for (int l = 0; l < N; l++)
            assert_near(count[l], STEPS * probability[l], 2.1);
    }
    assert_true(found > 10000 && left_out > 100 && never > 100);
    light_table_free(t);
    scene_free(&s);
}

/* At the origin, of unit radiance, facing down. */
static double rectangle_irradiance(vec3 p, float width, float depth)
{
    const double v[4][3] = {{p.x, p.y, p.z},
                            {p.x + width, p.y, p.z},
                            {p.x + width, p.y, p.z + depth},
                            {p.x, p.y, p.z + depth}};
    return check_irradiance(v, 4);
}

/* 60 point lights below 40 rectangular lamps that face down, over a plate; intensities and radiances each
 * span nearly three decades. Nothing is shadowed, so the closed forms add up. With all lights sampled, with
 * one chosen by place, and with the renderer's default, which here is the latter to the bit. */
TEST(a_hundred_lights)
{
    OWN(scene) s = check_plate(v3(0, 1, 0), 0.6f);
    double irradiance = 0, lamps = 0, brightest = 0;
    for (int i = 0; i < 60; i++) {
        vec3 at =
            v3(-1.5f + 0.05f * (float)i, 0.5f + 0.2f * (float)(i % 5), 0.3f * (float)(i % 7) - 1);
        float value = powf(10, 0.05f * (float)i - 2);
        build_point(&s, at, grey(value));
        double d2 = (double)dot(at, at), part = (double)value * at.y / (d2 * sqrt(d2));
        irradiance += part;
        brightest = fmax(brightest, part);
    }
    for (int i = 0; i < 40; i++) {
        vec3 p = v3(0.4f * (float)(i % 8) - 1.6f, 2, 0.4f * (float)(i / 8) - 1);
        float radiance = powf(10, 0.075f * (float)i);
        build_quad(&s, p, v3(0.2f, 0, 0), v3(0, 0, 0.25f),
                   build_material(&s, grey(0), grey(radiance)));
        lamps += (double)radiance * rectangle_irradiance(p, 0.2f, 0.25f);
    }
    check_finish(&s);
    assert_int_equal(s.num_lights, 100);
    double expected = 0.6 / M_PI * (irradiance + lamps);
    assert_true(lamps > 0.1 * irradiance && irradiance > 0.1 * lamps);
    for (int direct = 0; direct_kind_names[direct] != NULL; direct++) {
        struct integrator_options io = paths(direct, 1);
        struct moments film[3];
        for (int many = LIGHTS_AUTO; many <= LIGHTS_ONE; many++) {
            io.many_lights = (enum many_lights)many;
            io.light_samples = many == LIGHTS_ALL ? 1 : 2;
            film[many] = check_render(&s, io, 8, 8, many == LIGHTS_ALL ? 128 : 1024);
            const struct check_result r = check_pool(&film[many]);
            check_mean(&r, 0, expected, direct_kind_names[direct]);
            /* 3 %; without the brightest point light; where the lamps are found by chance, without
             * any point light. */
            bool aimed = direct == DIRECT_LIGHT || direct == DIRECT_MIS;
            double missing = 0.6 / M_PI * (aimed ? brightest : irradiance);
            assert_false(check_agrees(&r, 0, expected - missing));
            if (aimed)
                assert_false(check_agrees(&r, 0, 0.97 * expected));
        }
        assert_memory_equal(film[LIGHTS_AUTO].mean, film[LIGHTS_ONE].mean, 3 * 64 * sizeof(double));
        for (int many = LIGHTS_AUTO; many <= LIGHTS_ONE; many++)
            moments_free(&film[many]);
    }
}

/* A sky map, spheres, lamps and a spot together, three bounces: every estimator, all lights or one
 * of them. 32 x 24 pixels; relative standard error below 1 % but for uniform directions. */
TEST(all_or_one_of_the_lights)
{
    const struct sky sky = sky_uneven(16, 8);
    OWN(scene) s = corner_scene();
    give_sky(&s, sky_environment(&sky));
    build_spot(&s, v3(0.5f, 1.4f, 0.8f), v3(0, -1, 0), 0.5f, 2, grey(3));
    for (int i = 0; i < 10; i++)
        build_sphere(&s, v3(-0.9f + 0.2f * (float)i, 1, -0.5f), 0.03f, 1,
                     build_material(&s, grey(0.2f), grey((float)(2 + 3 * i))));
    check_finish(&s);
    struct integrator_options io = paths(DIRECT_MIS, 3);
    io.many_lights = LIGHTS_ALL;
    OWN(moments) reference = check_render(&s, io, 32, 24, 256);
    for (int direct = 0; direct_kind_names[direct] != NULL; direct++)
        for (int many = LIGHTS_ALL; many <= LIGHTS_ONE; many++) {
            io.sampler.seed++;
            io.direct = (enum direct_kind)direct;
            io.many_lights = (enum many_lights)many;
            OWN(moments) film = check_render(&s, io, 32, 24, 128);
            double z = check_z(&film, &reference, 0);
            if (fabs(z) > CHECK_Z_LIMIT)
                fail_msg("%s, %s: z = %.2f", direct_kind_names[direct],
                         many == LIGHTS_ALL ? "all" : "one", z);
        }
    /* Negative control: one lamp of the twelve less. */
    s.materials[s.num_materials - 1].radiance = grey(0);
    io.direct = DIRECT_MIS;
    OWN(moments) dark = check_render(&s, io, 32, 24, 256);
    assert_true(fabs(check_z(&dark, &reference, 0)) > CHECK_Z_LIMIT);
}

/* A rectangle over a plate whose halves glow in other colours, texel by texel (nearest), cut into strips of as many triangles as a
 * lamp or a mesh has: Lambert's formula for each half. The plate is a ramp between two texels, seen where their mean is. */
TEST(textured_lamp_over_textured_plate)
{
    const rgb halves[2] = {{1, 0, 2}, {3, 5, 0}},
              ramp[2] = {{0.1f, 0.2f, 0.3f}, {0.9f, 0.4f, 0.5f}};
    const float albedo[3] = {0.5f, 0.3f, 0.4f};
    const double half[2] = {rectangle_irradiance(v3(-1, 1, -0.4f), 1.2f, 1),
                            rectangle_irradiance(v3(0.2f, 1, -0.4f), 1.2f, 1)};
    for (int many = 0; many < 2; many++) {
        OWN(scene) s = check_plate(v3(0, 1, 0), 1);
        s.materials[0].reflectance_map = build_texture(&s, 2, 1, ramp, false, TEXTURE_CLAMP);
        uint32_t lamp = build_material(&s, grey(0), grey(0.7f));
        s.materials[lamp].radiance_map = build_texture(&s, 2, 1, halves, true, TEXTURE_WRAP);
        const int strips = many ? 6 : 1;
        const float depth = 1 / (float)strips;
        for (int k = 0; k < strips; k++)
            build_quad(&s, v3(-1, 1, -0.4f + depth * (float)k), v3(2.4f, 0, 0), v3(0, 0, depth),
                       lamp);
        build_join(&s, 1);
        check_finish(&s);
        for (int direct = DIRECT_HEMISPHERE; direct <= DIRECT_MIS; direct++)
            for (int one = 0; one < 2; one++) {
                struct integrator_options io = paths(direct, 1);
                io.many_lights = one ? LIGHTS_ONE : LIGHTS_ALL;
                struct check_result film = check_look(&s, io, 16, 256);
                const float value[2][3] = {{1, 0, 2}, {3, 5, 0}};
                for (int c = 0; c < 3; c++) {
                    double light =
                        0.7 * (half[0] * (double)value[0][c] + half[1] * (double)value[1][c]);
                    check_mean(&film, c, (double)albedo[c] / M_PI * light, "textures");
                    double turned =
                        0.7 * (half[1] * (double)value[0][c] + half[0] * (double)value[1][c]);
                    assert_false(check_agrees(&film, c, (double)albedo[c] / M_PI * turned));
                }
            }
    }
}

/* A textured lamp's triangles are chosen by 0.1 of their area plus 0.9 of their mean texel over the lamp's mean: of
 * four equal ones on texels of 0, 1, 3 and 4 (mean 2) with 0.1, 0.55, 1.45 and 1.9 times 1/4. A sample's pdf is that
 * of pdf_of_light() at its point. */
TEST(triangles_of_a_textured_lamp_by_mean)
{
    enum { STEPS = 4000 };
    struct err e;
    const rgb colours[4] = {{0, 0, 0}, {1, 1, 1}, {3, 3, 3}, {4, 4, 4}};
    const double share[4] = {0.025, 0.1375, 0.3625, 0.475};
    struct scene s = build_scene();
    uint32_t m = build_material(&s, grey(0), grey(1));
    s.materials[m].radiance_map = build_texture(&s, 4, 1, colours, true, TEXTURE_CLAMP);
    for (int k = 0; k < 4; k++) {
        build_triangle(&s, v3((float)k, 1, 0), v3((float)k + 1, 1, 0), v3((float)k, 1, 1), m);
        for (int c = 0; c < 3; c++)
            s.uv[3 * k + c] = (struct uv){0.25f * (float)k + 0.1f + 0.01f * (float)c, 0.5f};
    }
    build_join(&s, 0);
    build_camera(&s, v3(0, 0, 0), 40);
    check_finish(&s);
    struct light_table *t = light_table_build(&s, &e);
    assert_non_null(t);
    int count[4] = {0};
    const vec3 from = v3(2, 0, 0);
    for (int i = 0; i < STEPS; i++) {
        const float u[4] = {0.3f, 0.4f, ((float)i + 0.5f) / STEPS, 0};
        struct light_samplev l;
        sample_light_from(t, 0, from, v3(0, 1, 0), u, 1, &l);
        int k = l.pdf_w > 0 ? (int)floorf(from.x + l.wi.x * l.distance) : 0;
        assert_in_range(k, 0, 3);
        count[k]++;
        if (k == 0)
            continue;
        const uint32_t prim = (uint32_t)k;
        double pdf_w =
            (double)pdf_of_light(t, (int32_t[]){0}, &prim, from, l.wi, l.distance, v3(0, -1, 0), 1);
        double d = (double)l.distance;
        assert_near((double)l.pdf_w / pdf_w, 1, 1e-5);
        assert_near(pdf_w * (2 / (4 * share[k])) / (d * d * d), 1, 1e-5);
        assert_near(l.radiance.g, colours[k].g, 1e-6);
    }
    for (int k = 0; k < 4; k++)
        assert_near(count[k], STEPS * share[k], 2);
    light_table_free(t);
    scene_free(&s);
}

/* One environment, on a finished scene too, and it is a light. */
TEST(one_environment)
{
    struct err e = {""};
    struct scene s = check_plate(v3(0, 1, 0), 0.5f);
    check_finish(&s);
    assert_int_equal(s.environment_light, -1);
    struct environment *first = environment_constant(grey(1), &e);
    struct environment *second = environment_constant(grey(1), &e);
    assert_true(scene_add_environment(&s, first, &e));
    assert_int_equal(s.num_lights, 1);
    assert_int_equal(s.environment_light, 0);
    assert_false(scene_add_environment(&s, second, &e));
    assert_non_null(strstr(e.msg, "ambient light"));
    environment_free(second);
    struct check_result film = check_look(&s, paths(DIRECT_MIS, 1), 8, 256);
    check_mean(&film, 0, 0.5, "added environment");
    scene_free(&s);

    s = check_plate(v3(0, 1, 0), 0.5f);
    build_light(&s, (struct light){.kind = LIGHT_ENVIRONMENT});
    assert_false(scene_finish(&s, "test", &e));
    assert_non_null(strstr(e.msg, "light 0: more than one environment, or none"));
    scene_free(&s);
}
