/* What the POV-Ray writer makes of mirrors, glass, skies, spot lights and mixtures of lights, and what
 * it refuses of them. What POV-Ray makes of the text is in test_povray_optics.c. */
#include "tests/support/build_scene.h"

#include "reference/povray/export_povray.h"
#include "reference/povray/povray_glass.h"
#include "reference/povray/povray_lamp.h"
#include "renderer/scene/environment.h"
#include "povray_fixture.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

static uint32_t build_glass(struct scene *s, enum material_kind kind)
{
    uint32_t m = build_material(s, grey(1), grey(0));
    s->materials[m].kind = kind;
    s->materials[m].transmittance = (rgb){.5f, .75f, 1};
    s->materials[m].ior = 1.5f;
    return m;
}

/* Floor, lamp above, and a ball of a kind; material 2 is the ball's. */
static struct scene ball_of(enum material_kind kind)
{
    struct scene s = build_scene();
    build_quad(&s, v3(-1, 0, -1), v3(0, 0, 2), v3(2, 0, 0), build_material(&s, grey(.5f), grey(0)));
    build_quad(&s, v3(-.25f, 2, -.125f), v3(.5f, 0, 0), v3(0, 0, .25f),
               build_material(&s, grey(0), (rgb){3, 2, 1}));
    build_sphere(&s, v3(0, .5f, 0), .375f, 1, build_glass(&s, kind));
    build_camera(&s, v3(0, 1, 4), 60);
    return s;
}

/* The text of a pass; the caller frees. */
static char *text_of(const struct scene *s, const struct camera *c, int depth, int pass)
{
    struct povray_variant v = povray_variant_plain();
    v.pass = pass;
    return povray_text(s, c, depth, &v);
}

static int count(const char *text, const char *what)
{
    int n = 0;
    for (; (text = strstr(text, what)) != NULL; text++)
        n++;
    return n;
}

static void refused(struct scene *s, int depth, const char *why)
{
    struct err e;
    struct povray_passes p;
    struct camera c = build_finish(s, 40, 30);
    REFUSES(povray_passes(s, &c, depth, &p, &e), why);
    scene_free(s);
}

/* Light sources end a path of m bounces at m surfaces, a glow at m + 1. */
TEST(test_passes)
{
    OWN(scene) s = ball_of(MATERIAL_GLASS);
    struct camera c = build_finish(&s, 40, 30);
    struct povray_passes p;
    struct err e;
    assert_true(povray_passes(&s, &c, 1, &p, &e));
    assert_true(p.num_passes == 2 && p.specular && !povray_passes_are_noisy(&p));
    assert_true(p.pass[0].sources && !p.pass[0].glow && p.pass[0].levels == 1);
    assert_true(!p.pass[1].sources && p.pass[1].glow && p.pass[1].levels == 2);
    assert_true(povray_passes(&s, &c, 10, &p, &e));
    assert_true(povray_passes_are_noisy(&p));
    assert_true(p.pass[0].levels == 10 && p.pass[0].recursion == 9);
    assert_true(p.pass[1].levels == 11 && p.pass[1].recursion == 9);
    /* j diffuse surfaces take 3j/2 levels: a path of 10 surfaces, 8 of them diffuse and then a
     * mirror, needs 3 x 8/2 + 2. */
    assert_true(p.pass[0].levels_indirect >= 14 && p.pass[1].levels_indirect >= 14);
}

TEST(test_glass_text)
{
    OWN(scene) s = ball_of(MATERIAL_GLASS);
    struct camera c = build_finish(&s, 40, 30);
    char *lit = text_of(&s, &c, 10, 0), *seen = text_of(&s, &c, 10, 1);
    for (int i = 0; i < 2; i++) {
        const char *text = i == 0 ? lit : seen;
        assert_int_equal(count(text,
                               "pigment { rgbf <0.5,0.75,1,1> } finish { diffuse 0 reflection { "
                               "rgb 0, rgb 1 fresnel on } conserve_energy }"),
                         1);
        assert_int_equal(count(text, "interior { ior 1.5 }"), 1);
        assert_int_equal(count(text, "light_source"), i == 0);
        assert_int_equal(count(text, "emission"), i);
        /* Its shadow, and what keeps the glow from diffuse surfaces. */
        assert_int_equal(count(text, "no_image no_reflection no_radiosity"), 1 - i);
        assert_int_equal(count(text, "no_image no_reflection no_shadow"), i);
    }
    free(lit);
    free(seen);
}

TEST(test_mirror_and_refraction_text)
{
    struct scene s = ball_of(MATERIAL_MIRROR);
    s.materials[2].reflectance = (rgb){.5f, .25f, 1};
    struct camera c = build_finish(&s, 40, 30);
    char *text = text_of(&s, &c, 10, 0);
    assert_non_null(strstr(text, "finish { diffuse 0 reflection { rgb <0.5,0.25,1> } }"));
    free(text);
    scene_free(&s);
    s = ball_of(MATERIAL_REFRACTION);
    c = build_finish(&s, 40, 30);
    text = text_of(&s, &c, 10, 0);
    assert_non_null(strstr(text, "rgbf <0.5,0.75,1,1> } finish { diffuse 0 }"));
    assert_null(strstr(text, "fresnel"));
    assert_false(povray_hides_total_reflection(&s));
    free(text);
    scene_free(&s);
}

TEST(test_spot_text)
{
    OWN(scene) s = ball_of(MATERIAL_DIFFUSE);
    build_light(&s, (struct light){.kind = LIGHT_SPOT,
                                   .value = {1, 1, 1},
                                   .position = {0, 1, 2},
                                   .axis = {0, 0, -1},
                                   .cos_cutoff = .5f,
                                   .exponent = 7,
                                   .attenuation = {1, 0, 0}});
    struct camera c = build_finish(&s, 40, 30);
    OWN_TEXT text = text_of(&s, &c, 1, 0);
    assert_non_null(
        strstr(text, "spotlight point_at <0,1,1>\n    tightness 7 radius 60 falloff 60 }"));
}

static void add_sky(struct scene *s, struct environment *env)
{
    struct err e;
    assert_non_null(env);
    assert_true(scene_add_environment(s, env, &e));
}

static struct environment *image(int width, int height)
{
    struct err e;
    OWN(image) im = build_image(width, height);
    for (int i = 0; i < 3 * width * height; i++)
        im.data[i] = (float)i;
    struct environment *env = environment_from_image(&im, "test", &e);
    return env;
}

/* 2 x 1 texels (0,1,2) and (3,4,5): centres at 1/4 and 3/4 of the circle, their mean at the seam. */
TEST(test_sky_text)
{
    struct err e;
    struct scene s = ball_of(MATERIAL_DIFFUSE);
    struct camera c = build_finish(&s, 40, 30);
    add_sky(&s, image(2, 1));
    char *text = text_of(&s, &c, 3, 1);
    assert_non_null(strstr(text, "[0 rgb S*<1.5,2.5,3.5>] [0.25 rgb S*<0,1,2>] "
                                 "[0.75 rgb S*<3,4,5>] [1 rgb S*<1.5,2.5,3.5>]"));
    assert_null(strstr(text, "background"));
    free(text);
    scene_free(&s);

    s = ball_of(MATERIAL_DIFFUSE);
    c = build_finish(&s, 40, 30);
    add_sky(&s, environment_constant((rgb){1, 2, 3}, &e));
    text = text_of(&s, &c, 3, 0);
    assert_null(strstr(text, "background"));
    free(text);
    text = text_of(&s, &c, 3, 1);
    assert_non_null(strstr(text, "background { rgb S*<1,2,3> }"));
    free(text);
    scene_free(&s);
}

TEST(test_sky_refused)
{
    struct err e;
    for (int which = 0; which < 2; which++) {
        OWN(scene) s = ball_of(MATERIAL_DIFFUSE);
        struct camera c = build_finish(&s, 40, 30);
        struct povray_passes p;
        add_sky(&s, which == 0 ? environment_upper_half(grey(1), &e) : image(255, 2));
        REFUSES(povray_passes(&s, &c, 1, &p, &e),
                which == 0 ? "only diffuse surfaces see" : "255 x 2");
    }
}

TEST(test_glass_refused)
{
    static const char *const why[] = {"not have microfacets", "Schlick",       "is not 1",
                                      "must be above 1",      "that emits",    "front is inside",
                                      "the camera",           "may be inside", "at depth 7"};
    for (size_t i = 0; i < COUNT(why); i++) {
        struct scene s = ball_of(i == 0 ? MATERIAL_MICROFACET : MATERIAL_GLASS);
        struct material *m = &s.materials[2];
        if (i == 0)
            m->alpha = .5f;
        m->schlick = i == 1;
        if (i == 2)
            m->reflectance = grey(.5f);
        if (i == 3)
            m->ior = .75f;
        if (i == 4)
            m->radiance = grey(1);
        if (i == 5)
            s.spheres[0].normal_out = -1;
        if (i == 6)
            s.spheres[0].centre = v3(0, 1, 4);
        if (i == 7)
            build_sphere(&s, v3(0, .5f, .25f), .375f, 1, 0);
        refused(&s, i == 8 ? 7 : 10, why[i]);
    }
}

/* A tetrahedron is closed; with one triangle less, or turned inside out, it is refused. Refraction
 * alone by triangles is refused beside a mirror, and hides total reflection else. */
TEST(test_glass_meshes)
{
    const vec3 p[4] = {{0, .25f, 0}, {.5f, .25f, 0}, {0, .75f, 0}, {0, .25f, .5f}};
    static const int face[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    for (int what = 0; what < 5; what++) {
        struct scene s = ball_of(what == 4 ? MATERIAL_MIRROR : MATERIAL_DIFFUSE);
        s.spheres[0].centre = v3(-.75f, .5f, 0);
        s.spheres[0].radius = .25f;
        uint32_t m = build_glass(&s, what < 3 ? MATERIAL_GLASS : MATERIAL_REFRACTION);
        int faces = what == 1 ? 3 : 4, swap = what == 2;
        for (int i = 0; i < faces; i++)
            build_triangle(&s, p[face[i][0]], p[face[i][1 + swap]], p[face[i][2 - swap]], m);
        build_join(&s, s.num_objects - (uint32_t)faces);
        if (what == 1 || what == 2) {
            refused(&s, 10, "not a closed surface");
            continue;
        }
        if (what == 4) {
            refused(&s, 10, "reflects totally");
            continue;
        }
        struct camera c = build_finish(&s, 40, 30);
        OWN_TEXT text = text_of(&s, &c, 10, 1);
        assert_int_equal(strstr(text, "  no_reflection\n") != NULL, what == 3);
        scene_free(&s);
    }
}

/* All lights at once: two passes, and no light is left out of both. */
TEST(test_mixed_lights)
{
    OWN(scene) s = ball_of(MATERIAL_DIFFUSE);
    build_point(&s, v3(0, 1, 2), grey(1));
    build_sphere(&s, v3(.75f, 1, 0), .125f, 1, build_material(&s, grey(0), grey(2)));
    build_sphere(&s, v3(-.75f, 1, 0), .125f, 1, build_material(&s, grey(.5f), grey(2)));
    struct camera c = build_finish(&s, 40, 30);
    struct povray_passes p;
    struct err e;
    assert_true(povray_passes(&s, &c, 3, &p, &e));
    assert_true(p.num_passes == 2 && p.num_lamps == 2);
    assert_true(p.pass[0].recursion == 2 && p.pass[1].recursion == 3);
    char *lit = text_of(&s, &c, 3, 0), *seen = text_of(&s, &c, 3, 1);
    assert_int_equal(count(lit, "light_source"), 3); /* point, and two lamps' macros */
    assert_int_equal(count(lit, "emission"), 0);
    assert_int_equal(count(seen, "light_source"), 0);
    /* Two lamps for the camera, the reflecting ball, which is roulette's two textures. */
    assert_int_equal(count(seen, "emission"), 4);
    free(lit);
    free(seen);
}

/* Points of a ball lie on it and look outwards; for a spiral of n points their mean is within 1/n or
 * so of the centre. Points of two triangles of areas 1 : 3 are shared out 1 : 3. */
TEST(test_lamp_points)
{
    enum { N = 256 };
    const double shift[3] = {.3, .6, .8};
    vec3 p[N], n[N], sum = {0};
    OWN(scene) s = build_scene();
    build_sphere(&s, v3(1, 2, 3), .5f, 1, build_material(&s, grey(0), grey(2)));
    uint32_t m = build_material(&s, grey(0), grey(1));
    build_triangle(&s, v3(0, 0, 0), v3(1, 0, 0), v3(0, 0, -1), m);
    build_triangle(&s, v3(0, 0, 0), v3(0, 0, 3), v3(1, 0, 0), m);
    build_join(&s, 1);
    build_camera(&s, v3(0, 1, 9), 60);
    build_finish(&s, 40, 30);
    for (uint32_t i = 0; i < s.num_lights; i++) {
        struct povray_lamp l;
        assert_true(povray_lamp(&s, &s.lights[i], &l));
        povray_lamp_points(&s, &l, shift, N, p, n);
        int near = 0;
        for (int k = 0; k < N; k++) {
            if (l.kind == POVRAY_BALL) {
                vec3 out = scale(sub(p[k], v3(1, 2, 3)), 2);
                sum = mad(sum, 1.f / N, out);
                assert_true(fabsf(length(out) - 1) < 1e-5f && dot(out, n[k]) > .99999f);
            } else {
                assert_true(p[k].y == 0 && p[k].x >= 0 && n[k].y == 1);
                assert_true(p[k].x + p[k].z / 3 <= 1.00001f && p[k].x - p[k].z <= 1.00001f);
                near += p[k].z < 0;
            }
        }
        if (l.kind == POVRAY_BALL)
            assert_true(length(sum) < .02f);
        else
            assert_int_equal(near, N / 4);
    }
}

/* A sphere around the eye is turned inside out (export_povray.c says why). */
TEST(test_sphere_around_the_eye)
{
    for (int around = 0; around < 2; around++) {
        OWN(scene) s = ball_of(MATERIAL_DIFFUSE);
        build_sphere(&s, v3(0, 0, 0), around ? 9 : .125f, -1, 0);
        struct camera c = build_finish(&s, 40, 30);
        OWN_TEXT text = text_of(&s, &c, 1, 0);
        assert_int_equal(count(text, "  inverse\n"), around);
    }
}
