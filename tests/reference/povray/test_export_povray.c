/* The POV-Ray scene writer and its plan: what is refused, how deep radiosity goes, which emitters
 * become spotlights, and whether the numbers in the text are the scene's. What POV-Ray makes of the
 * text is in test_povray.c. */
#include "tests/support/build_scene.h"

#include "reference/povray/povray_lamp.h"
#include "reference/povray/povray_replicate_parts.h"
#include "povray_fixture.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <gsl/gsl_math.h>

/* A floor, a ball on it and, if asked for, a lamp above: 0.5 x 0.25 around (0, 2, 0), facing down. */
static struct scene floor_and_ball(bool with_lamp)
{
    struct scene s = build_scene();
    uint32_t grey_half = build_material(&s, grey(.5f), grey(0));
    build_quad(&s, v3(-1, 0, -1), v3(0, 0, 2), v3(2, 0, 0), grey_half);
    build_sphere(&s, v3(.1f, .3f, -.2f), .3f, 1, grey_half);
    if (with_lamp) {
        uint32_t lamp = build_material(&s, grey(0), (rgb){3, 2, 1});
        build_quad(&s, v3(-.25f, 2, -.125f), v3(.5f, 0, 0), v3(0, 0, .25f), lamp);
    }
    build_camera(&s, v3(.5f, 1, 4), 60);
    return s;
}

static struct povray_passes plan(struct scene *s, int depth)
{
    struct err e;
    struct povray_passes p;
    struct camera c = build_finish(s, 40, 30);
    MUST(povray_passes(s, &c, depth, &p, &e));
    scene_free(s);
    return p;
}

/* Three numbers that follow `key` and a "<". */
static void numbers_after(const char *text, const char *key, double x[3])
{
    const char *at = strstr(text, key);
    assert_non_null(at);
    at = strchr(at, '<');
    assert_non_null(at);
    assert_int_equal(sscanf(at, "<%lf,%lf,%lf>", &x[0], &x[1], &x[2]), 3);
}

/* Light sources make paths of 1 .. N+1 bounces at recursion_limit N, glowing geometry 0 .. N. */
TEST(test_recursion)
{
    static const struct {
        int depth, recursion;
    } sources[] = {{0, 0}, {1, 0}, {2, 1}, {5, 4}, {21, 20}};
    for (size_t i = 0; i < COUNT(sources); i++) {
        struct scene s = floor_and_ball(true);
        struct povray_passes p = plan(&s, sources[i].depth);
        assert_int_equal(p.num_passes, 1);
        assert_true(p.pass[0].sources == (sources[i].depth > 0) && p.pass[0].glow);
        assert_false(p.constant);
        assert_int_equal(p.pass[0].recursion, sources[i].recursion);
    }
    for (int depth = 0; depth <= 5; depth += 5) {
        struct scene s = floor_and_ball(false);
        build_sphere(&s, v3(0, 2, 0), .2f, 1, build_material(&s, grey(.5f), grey(3)));
        struct povray_passes p = plan(&s, depth);
        assert_int_equal(p.num_passes, 1);
        assert_true(p.pass[0].glow && !p.pass[0].sources);
        assert_int_equal(p.pass[0].recursion, depth);
        assert_false(p.constant);
    }
}

TEST(test_no_indirect_light)
{
    struct scene dark = floor_and_ball(false);
    assert_int_equal(plan(&dark, 5).pass[0].recursion, 0);

    struct light bulb = {
        .kind = LIGHT_POINT, .value = {1, 1, 1}, .position = {0, 1, 0}, .attenuation = {0, 0, 1}};
    for (int step = 0; step < 2; step++) {
        struct scene s = build_scene();
        uint32_t m = build_material(&s, grey(.5f), grey(0));
        build_quad(&s, v3(-1, 0, -1), v3(0, 0, 2), v3(2, 0, 0), m);
        build_quad(&s, v3(1, 0.25f * (float)step, -1), v3(0, 0, 2), v3(2, 0, 0), m);
        build_light(&s, bulb);
        build_camera(&s, v3(0, 1, 4), 60);
        assert_int_equal(plan(&s, 5).pass[0].recursion, step == 0 ? 0 : 4);
    }
}

TEST(test_furnace_is_constant)
{
    for (int inside = 0; inside < 2; inside++) {
        struct scene s = build_scene();
        build_sphere(&s, v3(0, 0, 0), 2, -1, build_material(&s, grey(.5f), grey(1)));
        build_camera(&s, v3(0, .5f, inside ? 1 : 5), 60);
        assert_int_equal(plan(&s, 5).constant, inside);
    }
}

static void refused(struct scene *s, const struct camera *c, int depth, const char *why)
{
    struct err e;
    struct povray_passes p;
    REFUSES(povray_passes(s, c, depth, &p, &e), why);
}

TEST(test_camera_refused)
{
    OWN(scene) s = floor_and_ball(true);
    struct camera c = build_finish(&s, 40, 30), bad;
    bad = c;
    bad.lens_radius = .01f;
    refused(&s, &bad, 1, "depth of field");
    /* The ball's nearest point is 4.2 - 0.3 away at least, the farthest floor corner about 5.3. */
    bad = c;
    bad.near = 4.5f;
    refused(&s, &bad, 1, "near plane is at 4.5");
    bad = c;
    bad.far = 5;
    refused(&s, &bad, 1, "far plane is at 5");
    refused(&s, &c, 22, "depth 21 only");
    struct povray_passes p;
    struct err e;
    assert_true(povray_passes(&s, &c, 21, &p, &e));
}

TEST(test_small_scene_refused)
{
    OWN(scene) s = build_scene();
    build_sphere(&s, v3(0, 0, 0), .01f, 1, build_material(&s, grey(.5f), grey(0)));
    build_camera(&s, v3(0, 0, 1), 60);
    struct camera c = build_finish(&s, 40, 30);
    refused(&s, &c, 1, "tolerances");
}

TEST(test_normals_refused)
{
    OWN(scene) s = floor_and_ball(true);
    s.normal[4] = v3(0, -1, 0);
    struct camera c = build_finish(&s, 40, 30);
    refused(&s, &c, 1, "behind its triangle");
}

TEST(test_lights_refused)
{
    static const float falloff[][3] = {{0, 1, 0}, {1, 0, 1}, {1, 1, 0}};
    for (size_t i = 0; i < COUNT(falloff); i++) {
        OWN(scene) s = floor_and_ball(false);
        struct light l = {.kind = LIGHT_POINT, .value = {1, 1, 1}, .position = {0, 1, 0}};
        memcpy(l.attenuation, falloff[i], sizeof l.attenuation);
        build_light(&s, l);
        struct camera c = build_finish(&s, 40, 30);
        refused(&s, &c, 1, "falloff");
    }
    OWN(scene) tinted = floor_and_ball(false);
    build_sphere(&tinted, v3(0, 2, 0), .2f, 1, build_material(&tinted, (rgb){.5f, 0, 0}, grey(3)));
    struct camera c = build_finish(&tinted, 40, 30);
    refused(&tinted, &c, 1, "does not reflect");
}

/* Two texels along u, mirrored, on coordinates 0 .. 1.5 times 2: texels 0 to 3 and one more to each side, the fourth of which is the
 * first again. Nearest has each colour from edge to edge, bilinear once, at its centre. The lamp with a texture is none. */
TEST(test_textures)
{
    const rgb texels[2] = {{.125f, .25f, .5f}, {.75f, .5f, .25f}};
    for (int nearest = 0; nearest < 2; nearest++) {
        OWN(scene) s = floor_and_ball(true);
        struct povray_lamp lamp;
        uint32_t map = build_texture(&s, 2, 1, texels, nearest, TEXTURE_MIRROR);
        for (size_t k = 6; k < 12; k++)
            s.uv[k].u *= 1.5f;
        s.materials[1].radiance_map = map;
        struct camera c = build_finish(&s, 40, 30);
        assert_false(povray_lamp(&s, &s.lights[0], &lamp));
        const struct povray_variant v = povray_variant_plain();
        OWN_TEXT text = povray_text(&s, &c, 1, &v);
        static const char *const parts[2][4] = {
            {"function { x*0.33333333333333331 - -0.16666666666666666 } color_map {\n      [0.0833333333 rgb <0.375,0.5,0.5>] "
             "[0.25 rgb <0.375,0.5,0.5>] [0.416666667 rgb <2.25,1,0.25>] [0.583333333 rgb <2.25,1,0.25>]\n      "
             "[0.75 rgb <0.375,0.5,0.5>]",
             "finish { diffuse 0 emission S }", "uv_vectors { 6,\n    <0,0>,<1.5,0>,<1.5,1>",
             "uv_mapping"},
            {"[0 rgb <0.375,0.5,0.5>] [0.166666667 rgb <0.375,0.5,0.5>] [0.166666667 rgb <0.375,0.5,0.5>] [0.333333333 rgb "
             "<0.375,0.5,0.5>] [0.333333333 rgb <2.25,1,0.25>]",
             "finish { diffuse 0 emission S }", "uv_vectors", "uv_mapping"}};
        for (int i = 0; i < 4; i++)
            if (strstr(text, parts[nearest][i]) == NULL)
                fail_msg("no %s in %.900s", parts[nearest][i], strstr(text, "uv_mapping"));
    }
}

TEST(test_textures_refused)
{
    static const struct {
        float scale;
        rgb albedo;
        bool nearest;
        const char *says;
    } cases[] = {
        {1, {0, 0, 0}, true, NULL},
        {62, {0, 0, 0}, true, NULL}, /* 62 x 2 texels and 3 around are 127 */
        {63,
         {0, 0, 0},
         true,
         "POV-Ray: material 'm' shows 129 x 66 texels, edges written out, of which 127 x 127"},
        {63, {0, 0, 0}, false, NULL},
        {126, {0, 0, 0}, false, "of which 254 x 254 is the most"},
        {1, {0, .1f, 0}, false, "material 'm': it reflects and glows, one of both with a texture"},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        const rgb texels[2] = {{.1f, .2f, .5f}, {.7f, .5f, .3f}};
        struct err e = {""};
        struct povray_passes p;
        OWN(scene) s = floor_and_ball(true);
        s.materials[1].radiance_map =
            build_texture(&s, 2, 1, texels, cases[i].nearest, TEXTURE_WRAP);
        s.materials[1].reflectance = cases[i].albedo;
        build_uv(&s, 2, cases[i].scale, (struct uv){0, 0});
        struct camera c = build_finish(&s, 40, 30);
        if (cases[i].says == NULL)
            MUST(povray_passes(&s, &c, 1, &p, &e));
        else
            REFUSES(povray_passes(&s, &c, 1, &p, &e), cases[i].says);
    }
}

/* All ways to cut a parallelogram and to number its corners give the same set of points. */
TEST(test_lamp_any_numbering)
{
    const vec3 corner[4] = {{0, 1, 0}, {.5f, 1.25f, 0}, {.75f, 1.25f, 1}, {.25f, 1, 1}};
    for (int cut = 0; cut < 2; cut++)
        for (int turn = 0; turn < 9; turn++) {
            OWN(scene) s = floor_and_ball(false);
            uint32_t m = build_material(&s, grey(0), grey(2));
            vec3 first[3] = {corner[cut], corner[cut + 1], corner[cut + 2]};
            vec3 second[3] = {corner[cut], corner[cut + 2], corner[(cut + 3) % 4]};
            int i = turn % 3, j = turn / 3;
            build_triangle(&s, first[i], first[(i + 1) % 3], first[(i + 2) % 3], m);
            build_triangle(&s, second[j], second[(j + 1) % 3], second[(j + 2) % 3], m);
            build_join(&s, s.num_objects - 2);
            build_finish(&s, 40, 30);
            struct povray_lamp l;
            assert_int_equal(s.num_lights, 1);
            assert_true(povray_lamp(&s, &s.lights[0], &l));
            assert_int_equal(l.kind, POVRAY_RECTANGLE);
            /* Sides (1/2, 1/4, 0) and (1/4, 0, 1): their cross product is (4, -8, -1)/16 of length 9/16;
             * the centre is the mean of the corners. */
            assert_near(l.area, 9. / 16, 1e-6);
            vec3 centre = mad(l.corner, .5f, add(l.edge1, l.edge2));
            assert_near(length(sub(centre, v3(.375f, 1.125f, .5f))), 0, 1e-6);
            vec3 n = cross(l.edge1, l.edge2);
            assert_near(fabsf(dot(n, l.normal)), l.area, 1e-6);
            assert_near(length(sub(l.normal, normalize(v3(4, -8, -1)))), 0, 1e-6);
        }
}

TEST(test_not_a_lamp)
{
    for (int what = 0; what < 4; what++) {
        OWN(scene) s = floor_and_ball(false);
        uint32_t m = build_material(&s, grey(what == 0 ? .5f : 0), grey(2));
        s.materials[m].radiance_both_sides = what == 1;
        build_quad(&s, v3(0, 2, 0), v3(1, 0, 0), v3(0, 0, 1), m);
        if (what == 2) /* a trapezium */
            for (uint32_t i = 3 * (s.num_triangles - 2); i < 3 * s.num_triangles; i++)
                if (s.position[i].x == 1 && s.position[i].z == 1)
                    s.position[i].x = 1.01f;
        build_finish(&s, 40, 30);
        assert_int_equal(s.num_lights, 1);
        struct povray_lamp l;
        assert_int_equal(povray_lamp(&s, &s.lights[0], &l), what >= 2);
        if (what >= 2)
            assert_int_equal(l.kind, what == 2 ? POVRAY_MESH : POVRAY_RECTANGLE);
    }
}

/* The 2-point Gauss rule in each pair of cells is exact for cubics, so over the rectangle
 * [-1/4, 1/4] x [-1/8, 1/8] the points' mean is 0 and their mean squares are (1/4)^2/3, (1/8)^2/3.
 * Colour x points = radiance x area / (2 pi d^2), see reference/povray/README.md. */
TEST(test_lamp_points)
{
    OWN(scene) s = floor_and_ball(true);
    struct camera c = build_finish(&s, 40, 30);
    struct povray_variant v = povray_variant_plain();
    for (int jitter = 0; jitter < 2; jitter++) {
        v.lamp_cells = 6;
        v.rule = jitter ? POVRAY_JITTER : POVRAY_GAUSS;
        v.lamp_seed = 77;
        char *text = povray_text(&s, &c, 1, &v);
        double x[3], sum[3] = {0}, square[3] = {0};
        int n = 0, cell[36] = {0};
        for (const char *at = text; (at = strstr(at, "Lamp0(<")) != NULL; at++, n++) {
            numbers_after(at, "Lamp0(", x);
            assert_true(fabs(x[0]) <= .25 && fabs(x[2]) <= .125);
            assert_near(x[1], 2, 1e-9);
            int i = (int)((x[0] + .25) * 12), j = (int)((x[2] + .125) * 24);
            cell[6 * i + j]++;
            for (int k = 0; k < 3; k++) {
                sum[k] += x[k];
                square[k] += x[k] * x[k];
            }
        }
        assert_int_equal(n, 36);
        for (int i = 0; i < 36; i++)
            assert_int_equal(cell[i], 1);
        bool exact = fabs(sum[0] / n) < 1e-9 && fabs(sum[2] / n) < 1e-9 &&
                     fabs(square[0] / n - 1. / 48) < 1e-9 && fabs(square[2] / n - 1. / 192) < 1e-9;
        assert_int_equal(exact, !jitter);
        double colour[3], d;
        numbers_after(text, "rgb S*<", colour);
        const char *fade = strstr(text, "fade_distance");
        assert_non_null(fade);
        assert_int_equal(sscanf(fade, "fade_distance %lf", &d), 1);
        for (int k = 0; k < 3; k++)
            assert_near(colour[k] * n * 2 * 3.14159265358979 * d * d / (3 - k), .125, 1e-7);
        free(text);
    }
}

TEST(test_jitter_follows_seed)
{
    OWN(scene) s = floor_and_ball(true);
    struct camera c = build_finish(&s, 40, 30);
    struct povray_variant v = povray_variant_plain();
    v.rule = POVRAY_JITTER;
    char *text[3];
    for (int i = 0; i < 3; i++) {
        v.lamp_seed = i == 2 ? 6 : 5;
        text[i] = povray_text(&s, &c, 1, &v);
    }
    assert_string_equal(text[0], text[1]);
    assert_string_not_equal(text[0], text[2]);
    for (int i = 0; i < 3; i++)
        free(text[i]);
}

/* (x, y, z) -> (-y, x, z), without minus zero. */
static vec3 quarter_turn(vec3 v)
{
    return v3(0 - v.y, v.x, v.z);
}

/* Writing a scene turned must be the same as turning the scene and writing it. */
TEST(test_rotation)
{
    char *text[2];
    for (int by_hand = 0; by_hand < 2; by_hand++) {
        OWN(scene) s = floor_and_ball(true);
        build_point(&s, v3(.5f, 3, 2), (rgb){1, 2, 3});
        build_sun(&s, v3(.6f, .8f, 0), (rgb){1, 2, 3});
        struct camera c = build_finish(&s, 40, 30);
        struct povray_variant v = povray_variant_plain();
        if (by_hand) {
            for (uint32_t i = 0; i < 3 * s.num_triangles; i++) {
                s.position[i] = quarter_turn(s.position[i]);
                s.normal[i] = quarter_turn(s.normal[i]);
            }
            for (uint32_t i = 0; i < s.num_spheres; i++)
                s.spheres[i].centre = quarter_turn(s.spheres[i].centre);
            for (uint32_t i = 0; i < s.num_lights; i++) {
                s.lights[i].position = quarter_turn(s.lights[i].position);
                s.lights[i].to_light = quarter_turn(s.lights[i].to_light);
            }
            vec3 a = quarter_turn(s.bounds_min), b = quarter_turn(s.bounds_max);
            s.bounds_min = vmin(a, b);
            s.bounds_max = vmax(a, b);
            c.eye = quarter_turn(c.eye);
            c.right = quarter_turn(c.right);
            c.up = quarter_turn(c.up);
            c.backward = quarter_turn(c.backward);
        } else {
            const double r[3][3] = {{0, -1, 0}, {1, 0, 0}, {0, 0, 1}};
            memcpy(v.rotation, r, sizeof r);
        }
        v.roulette = 0;
        text[by_hand] = povray_text(&s, &c, 5, &v);
    }
    assert_string_equal(text[0], text[1]);
    free(text[0]);
    free(text[1]);
}

/* A window moved by half an image to the right and a quarter up looks along the ray that the
 * unmoved image has there: -backward + (2 x 1/2) tan_h right + (2 x 1/4) tan_v up. */
TEST(test_shift)
{
    OWN(scene) s = floor_and_ball(true);
    struct camera c = build_finish(&s, 40, 30);
    struct povray_variant v = povray_variant_plain();
    v.shift_x = .5;
    v.shift_y = .25;
    OWN_TEXT text = povray_text(&s, &c, 1, &v);
    double d[3], right[3], up[3];
    numbers_after(text, "\n  direction", d);
    numbers_after(text, "\n  right", right);
    numbers_after(text, "\n  up", up);
    double tan_h = tan(M_PI / 6), tan_v = tan_h * 30 / 40; /* 60 degrees, 40 x 30 */
    const double expected[3][3] = {{tan_h, .5 * tan_v, -1}, {2 * tan_h, 0, 0}, {0, 2 * tan_v, 0}};
    for (int k = 0; k < 3; k++) {
        assert_near(d[k], expected[0][k], 1e-6);
        assert_near(right[k], expected[1][k], 1e-6);
        assert_near(up[k], expected[2][k], 1e-6);
    }
}

/* Radiosity and roulette appear only where there is indirect light to find. */
TEST(test_radiosity_on_demand)
{
    OWN(scene) s = floor_and_ball(true);
    struct camera c = build_finish(&s, 40, 30);
    struct povray_variant v = povray_variant_plain();
    static const struct {
        int depth;
        bool indirect, radiosity, roulette;
    } cases[] = {{1, true, false, false}, {5, true, true, true}, {5, false, false, true}};
    for (size_t i = 0; i < COUNT(cases); i++) {
        v.indirect = cases[i].indirect;
        OWN_TEXT text = povray_text(&s, &c, cases[i].depth, &v);
        assert_int_equal(strstr(text, "recursion_limit 4") != NULL, cases[i].radiosity);
        assert_int_equal(strstr(text, "radiosity {") != NULL, cases[i].radiosity);
        assert_int_equal(strstr(text, "Fate") != NULL, cases[i].roulette);
    }
}
