/* The Mitsuba 3 scene as a text that was written by hand from its documentation, its meshes from their bytes, and the
 * environment by Mitsuba's interpolation as its documentation has it. Mitsuba itself was not to be had; a path tracer that
 * reads the same file is run by end_to_end.sh. */
#include "tests/support/build_scene.h"

#include "reference/mitsuba/export_mitsuba.h"
#include "renderer/image/image_oiio.h"
#include "renderer/scene/environment.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#define EXPECTED "tests/reference/mitsuba/"

static void expect(const struct scene *s, const struct camera *c, const char *expected)
{
    struct err e;
    MUST(export_mitsuba(s, c, 3, test_path("scene.xml"), &e));
    OWN_TEXT text = test_read(test_path("scene.xml"));
    test_same_text(text, expected);
}

/* The bytes of a PLY file as numbers, vertices of n floats. */
static void expect_ply(const char *name, unsigned n)
{
    unsigned vertices = 0, faces = 0;
    char *bytes = test_read(test_path(name)), text[2048];
    char *at = strstr(bytes, "end_header\n");
    assert_non_null(at);
    at += strlen("end_header\n");
    int used = snprintf(text, sizeof text, "%.*s", (int)(at - bytes), bytes);
    assert_int_equal(sscanf(strstr(bytes, "element vertex"), "element vertex %u", &vertices), 1);
    assert_int_equal(sscanf(strstr(bytes, "element face"), "element face %u", &faces), 1);
    for (unsigned i = 0; i < n * vertices; i++, at += sizeof(float)) {
        float v;
        memcpy(&v, at, sizeof v);
        used += snprintf(text + used, sizeof text - (size_t)used, "%.9g%c", (double)v,
                         i % n == n - 1 ? '\n' : ' ');
    }
    for (unsigned i = 0; i < faces; i++) {
        int32_t v[3];
        memcpy(v, at + 1, sizeof v);
        used += snprintf(text + used, sizeof text - (size_t)used, "%d: %d %d %d\n", *at, v[0], v[1],
                         v[2]);
        at += 1 + sizeof v;
    }
    assert_int_equal(*at, '\0'); /* the end, by test_read() */
    free(bytes);
    char expected[256];
    snprintf(expected, sizeof expected, EXPECTED "%s.expected", name);
    test_same_text(text, expected);
}

static struct image read_image(const char *name)
{
    struct image im;
    struct err e;
    bool half;
    MUST(image_read(test_path(name), &im, &half, &e));
    assert_false(half);
    return im;
}

static const struct light point = {
    .kind = LIGHT_POINT, .value = {2, 4, 6}, .position = {1, 2, 3}, .attenuation = {0, 0, 2}};
static const struct light sun = {
    .kind = LIGHT_DIRECTIONAL, .value = {2, 4, 6}, .to_light = {0, .6f, .8f}};
static const struct light spot = {.kind = LIGHT_SPOT,
                                  .value = {2, 4, 6},
                                  .position = {1, 2, 3},
                                  .axis = {.6f, 0, -.8f},
                                  .cos_cutoff = .5f,
                                  .attenuation = {0, 0, 1}};

/* One of everything. */
TEST(the_text_is_that_of_the_description)
{
    static const struct material all[] = {
        {.reflectance = {.125f, .25f, .375f}},
        {.reflectance = {.125f, .25f, .375f}, .radiance = {4, 5, 6}},
        {.kind = MATERIAL_MIRROR, .reflectance = {.875f, .75f, .625f}},
        {.kind = MATERIAL_GLASS,
         .ior = 1.5f,
         .reflectance = {1, .5f, .25f},
         .transmittance = {.25f, .5f, .75f}},
        {.kind = MATERIAL_MICROFACET,
         .microfacet = MICROFACET_GGX,
         .alpha = .25f,
         .separable = true,
         .conductor = true,
         .eta = {.25f, 1.5f, 1.25f},
         .k = {3, 3, 3}},
        {.kind = MATERIAL_MICROFACET,
         .microfacet = MICROFACET_BECKMANN,
         .alpha = .5f,
         .separable = true,
         .reflectance = {.875f, .75f, .625f}},
    };
    struct err e;
    OWN(scene) s = build_scene();
    for (size_t i = 0; i < COUNT(all); i++)
        build_like(&s, all[i]);
    build_quad(&s, v3(-1, 0, -5), v3(2, 0, 0), v3(0, 3, 0.5f), 0);
    build_triangle(&s, v3(0, 0, -4), v3(1, 0, -4), v3(0, 1, -4.5f), 1);
    build_triangle(&s, v3(0, 0, -3), v3(1, 0, -3), v3(0, 1, -3.5f), 3);
    s.normal[3 * 3 + 1] = normalize(v3(.3f, .4f, 1));
    build_sphere(&s, v3(.25f, .5f, -6), 1.5f, -1, 1);
    build_sphere(&s, v3(2, 3, -7), .5f, 1, 2);
    build_light(&s, point);
    build_light(&s, sun);
    build_light(&s, spot);
    build_camera(&s, v3(1, 2, 3), 60);
    s.camera.right = v3(.6f, 0, -.8f);
    s.camera.backward = v3(.8f, 0, .6f);
    s.camera.near = .0625f;
    s.camera.far = 64;
    struct camera c = build_finish(&s, 40, 30);
    assert_true(scene_add_environment(&s, environment_constant((rgb){1, 2, 3}, &e), &e));
    c.lens_radius = .25f;
    c.focal_distance = 7;
    expect(&s, &c, EXPECTED "scene.xml.expected");
    expect_ply("scene_object_0.ply", 3);
    expect_ply("scene_object_1.ply", 3);
    expect_ply("scene_object_2.ply", 6);
    OWN(image) im = read_image("scene_material_4_eta.exr");
    for (int i = 0; i < im.width * im.height; i++)
        assert_true(im.data[3 * i] == .25f && im.data[3 * i + 1] == 1.5f &&
                    im.data[3 * i + 2] == 1.25f);
}

/* Mitsuba's radiance from direction w: local = to_world^-1 w, u = atan2(x, -z) / 2 pi, v = acos(y) / pi;
 * texels are at u = (column + 1/2)/W and v = row/(H-1), bilinear, around in u. */
static double mitsuba_sky(const struct image *im, const double m[16], vec3 w, int channel)
{
    double l[3];
    for (int k = 0; k < 3; k++)
        l[k] = m[k] * (double)w.x + m[4 + k] * (double)w.y + m[8 + k] * (double)w.z;
    double u = atan2(l[0], -l[2]) / (2 * M_PI), v = acos(l[1]) / M_PI;
    double x = (u - floor(u)) * im->width - 0.5, y = v * (im->height - 1);
    int row = (int)fmin(y, im->height - 2), column = (int)floor(x);
    double fx = x - column, fy = y - row, sum = 0;
    for (int k = 0; k < 4; k++) {
        int c = (column + k % 2 + im->width) % im->width, r = row + k / 2;
        sum += (k % 2 ? fx : 1 - fx) * (k / 2 ? fy : 1 - fy) *
               (double)im->data[3 * (r * im->width + c) + channel];
    }
    return sum;
}

static struct scene lit_by(struct light l)
{
    struct scene s = build_scene();
    build_triangle(&s, v3(0, 0, -4), v3(1, 0, -4), v3(0, 1, -4),
                   build_material(&s, grey(.5f), grey(0)));
    build_light(&s, l);
    build_camera(&s, v3(0, 0, 0), 90);
    s.camera.near = 0.25f;
    s.camera.far = 64;
    return s;
}

TEST(environment_images)
{
    /* to_world of environment.xml.expected */
    const double m[16] = {0, 0, 1, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 0, 1};
    struct err e;
    OWN(image) im = build_image(6, 5);
    srand(7);
    for (int i = 0; i < 6 * 5 * 3; i++)
        im.data[i] = (float)(rand() % 1000) / 100;
    OWN(scene) s = lit_by(sun);
    struct camera c = build_finish(&s, 40, 30);
    assert_true(scene_add_environment(&s, environment_from_image(&im, "test", &e), &e));
    expect(&s, &c, EXPECTED "environment.xml.expected");
    OWN(image) got = read_image("scene_environment.exr");
    for (int i = 0; i < 2000; i++) {
        double y = 1 - 2 * (i + .5) / 2000, phi = 2.399963 * i, r = sqrt(1 - y * y);
        vec3 w = v3((float)(r * cos(phi)), (float)y, (float)(r * sin(phi)));
        rgb want = environment_radiance(s.environment, w);
        assert_near(mitsuba_sky(&got, m, w, 0), want.r, 2e-4);
        assert_near(mitsuba_sky(&got, m, w, 1), want.g, 2e-4);
        assert_near(mitsuba_sky(&got, m, w, 2), want.b, 2e-4);
    }
    /* Turned the other way around it is another sky: the comparison can fail. */
    double turned[16], worst = 0;
    memcpy(turned, m, sizeof turned);
    for (int k = 0; k < 3; k++)
        turned[4 * k] = -turned[4 * k];
    for (int i = 0; i < 100; i++) {
        vec3 w = normalize(v3((float)cos(i), .3f, (float)sin(i)));
        worst = fmax(worst, fabs(mitsuba_sky(&got, turned, w, 0) -
                                 (double)environment_radiance(s.environment, w).r));
    }
    assert_true(worst > 0.1);
}

static void refuse(struct scene *s, struct camera *c, const char *why)
{
    struct err e;
    struct camera built = c != NULL ? *c : build_finish(s, 40, 30);
    REFUSES(export_mitsuba(s, &built, 3, test_path("refused.xml"), &e), why);
    assert_int_not_equal(access(test_path("refused.xml"), F_OK), 0);
    scene_free(s);
}

TEST(what_it_has_not_is_refused)
{
    const struct {
        struct material m;
        const char *pattern;
    } bad[] = {
        {{.kind = MATERIAL_REFRACTION, .ior = 1.5f}, "only refracts"},
        {{.kind = MATERIAL_GLASS, .ior = 1.5f, .schlick = true}, "Schlick"},
        {{.kind = MATERIAL_MICROFACET, .alpha = .2f}, "correlated"},
        {{.radiance = {1, 1, 1}, .radiance_both_sides = true}, "both sides"},
    };
    for (size_t i = 0; i < COUNT(bad); i++) {
        struct scene s = build_scene();
        build_triangle(&s, v3(0, 0, -4), v3(1, 0, -4), v3(0, 1, -4), build_like(&s, bad[i].m));
        build_camera(&s, v3(0, 0, 0), 50);
        refuse(&s, NULL, bad[i].pattern);
    }
    const rgb texel = {.1f, .2f, .3f};
    struct scene painted = lit_by(sun);
    painted.materials[0].reflectance_map =
        build_texture(&painted, 1, 1, &texel, true, TEXTURE_WRAP);
    refuse(&painted, NULL, "the texture of material");
    struct light light[] = {point, spot};
    light[0].attenuation[0] = 1;
    light[1].exponent = 2;
    for (int i = 0; i < 6; i++) {
        struct scene s = lit_by(i < 2 ? light[i] : sun);
        if (i == 2)
            s.normal[1] = normalize(v3(1, 0, -.1f));
        struct camera c = build_finish(&s, 40, 30);
        if (i == 3)
            c.tan_v *= 1.01f;
        if (i == 4)
            c.near = 5;
        if (i == 5)
            c.right = normalize(v3(1, .01f, 0));
        static const char *const why[] = {"not the inverse square",
                                          "power of the cosine",
                                          "behind its triangle",
                                          "not square",
                                          "may cut",
                                          "not orthogonal"};
        refuse(&s, &c, why[i]);
    }
}
