/* The pbrt-v4 scene as a text that was written by hand from the format's description (pbrt.org/fileformat-v4), the sky's image by
 * pbrt's map the other way round, and what is refused. What pbrt itself renders of it: reference/docs/engines.md. */
#define _GNU_SOURCE
#include "tests/support/build_scene.h"

#include "reference/pbrt/export_pbrt.h"
#include "renderer/scene/environment.h"
#include "renderer/image/image_oiio.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <gsl/gsl_math.h>

/* The text; the caller frees. */
static char *export(const struct scene *s, const struct camera *c)
{
    struct err e;
    MUST(export_pbrt(s, c, 3, test_path("scene.pbrt"), &e));
    return test_read(test_path("scene.pbrt"));
}

static const struct light point = {
    .kind = LIGHT_POINT, .value = {2, 4, 6}, .position = {1, 2, 3}, .attenuation = {0, 0, 2}};
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
        {.radiance = {4, 5, 6}, .radiance_both_sides = true},
        {.kind = MATERIAL_MIRROR, .reflectance = {1, 1, 1}},
        {.kind = MATERIAL_GLASS, .ior = 1.5f, .reflectance = {1, 1, 1}, .transmittance = {1, 1, 1}},
        {.kind = MATERIAL_MICROFACET,
         .alpha = .25f,
         .conductor = true,
         .eta = {.5f, 1.5f, 1},
         .k = {3, 2, 1}},
        {.kind = MATERIAL_MICROFACET, .alpha = .5f, .reflectance = {1, 1, 1}},
        {.reflectance = {.5f, 0, 0}, .radiance = {1, 2, 3}},
    };
    struct err e;
    OWN(scene) s = build_scene();
    for (size_t i = 0; i < COUNT(all); i++)
        build_like(&s, all[i]);
    build_quad(&s, v3(-1, 0, -5), v3(2, 0, 0), v3(0, 3, 0.5f), 0);
    build_triangle(&s, v3(0, 0, -3), v3(1, 0, -3), v3(0, 1, -3.5f), 6);
    s.normal[7] = normalize(v3(.3f, .4f, 1));
    build_sphere(&s, v3(.25f, .5f, -6), 1.5f, 1, 2);
    build_sphere(&s, v3(2, 3, -7), .5f, -1, 1);
    build_light(&s, point);
    build_sun(&s, v3(0, .6f, .8f), (rgb){2, 4, 6});
    build_light(&s, spot);
    build_camera(&s, v3(1, 2, 3), 53.13010235f);
    s.camera.right = v3(.6f, 0, -.8f);
    s.camera.backward = v3(.8f, 0, .6f);
    struct camera c = build_finish(&s, 40, 30);
    assert_true(scene_add_environment(&s, environment_constant((rgb){1, 2, 3}, &e), &e));
    char *text = export(&s, &c);
    assert_null(strstr(text, "lens"));
    free(text);
    c.lens_radius = .25f;
    c.focal_distance = 7;
    text = export(&s, &c);
    test_same_text(text, "tests/reference/pbrt/scene.expected");
    free(text);
}

static struct scene triangle_of(struct material m)
{
    struct scene s = build_scene();
    build_triangle(&s, v3(0, 0, -4), v3(1, 0, -4), v3(0, 1, -4), build_like(&s, m));
    build_camera(&s, v3(0, 0, 0), 50);
    return s;
}

static void refuse(struct scene *s, const char *pattern)
{
    struct err e;
    struct camera c = build_finish(s, 40, 30);
    REFUSES(export_pbrt(s, &c, 3, test_path("refused.pbrt"), &e), pattern);
    assert_int_not_equal(access(test_path("refused.pbrt"), F_OK), 0);
    scene_free(s);
}

/* With one of the two by chance: 0.4 of 0.9999 are 0.39996. */
TEST(grey_mirrors_reflect_a_part)
{
    static const char *const expected[2] = {
        "MakeNamedMaterial \"material_0_whole\" \"string type\" [\"conductor\"] \"rgb reflectance\" [1 1 1]\n"
        "MakeNamedMaterial \"material_0_black\" \"string type\" [\"diffuse\"] \"rgb reflectance\" [0 0 0]\n"
        "MakeNamedMaterial \"material_0\" \"string type\" [\"mix\"] \"string materials\" [\"material_0_whole\" "
        "\"material_0_black\"] \"float amount\" [0.6]\n",
        "MakeNamedMaterial \"material_0_whole\" \"string type\" [\"conductor\"] \"rgb reflectance\" [1 1 1] "
        "\"float roughness\" [0.5] \"bool remaproughness\" [false]\n"};
    const struct material grey_ones[2] = {
        {.kind = MATERIAL_MIRROR, .reflectance = {.39996f, .39996f, .39996f}},
        {.kind = MATERIAL_MICROFACET, .alpha = .5f, .reflectance = {.39996f, .39996f, .39996f}}};
    for (int i = 0; i < 2; i++) {
        OWN(scene) s = triangle_of(grey_ones[i]);
        struct camera c = build_finish(&s, 40, 30);
        char *text = export(&s, &c), *at = strstr(text, "\"float amount\" [");
        assert_non_null(at);
        assert_near(atof(at + strlen("\"float amount\" [")), 0.6, 1e-6);
        at = strstr(text, "MakeNamedMaterial");
        at[strcspn(at, "\n") + 1] = '\0';
        assert_memory_equal(at, expected[i], strlen(at));
        free(text);
    }
}

/* The texel that pbrt finds for w: its equal-area map of the octahedron [Clarberg08], by arctan where pbrt has a polynomial. */
static const float *pbrt_sky(const struct image *im, vec3 w)
{
    double x = fabs((double)w.x), y = fabs((double)w.y), z = (double)w.z, r = sqrt(1 - fabs(z));
    double v = r * atan2(y, x) * 2 / M_PI, u = r - v;
    if (z < 0) {
        double old = u;
        u = 1 - v;
        v = 1 - old;
    }
    int column = (int)((copysign(u, (double)w.x) + 1) / 2 * im->width);
    int row = (int)((copysign(v, (double)w.y) + 1) / 2 * im->height);
    column = column < im->width ? column : im->width - 1;
    row = row < im->height ? row : im->height - 1;
    return im->data + 3 * (row * im->width + column);
}

/* Whether a texel is in the range of the sky's red around w. Corners of one texel of 80 x 80 are 0.106 apart at most. */
static bool is_around(const struct environment *sky, vec3 w, float texel)
{
    float low = INFINITY, high = 0;
    const frame f = frame_from_normal(w);
    for (int i = 0; i < 400; i++) {
        float r = 0.12f * sqrtf((i + .5f) / 400), phi = 2.399963f * (float)i;
        vec3 d = normalize(add(w, add(scale(f.s, r * cosf(phi)), scale(f.t, r * sinf(phi)))));
        low = fminf(low, environment_radiance(sky, d).r);
        high = fmaxf(high, environment_radiance(sky, d).r);
    }
    return texel >= low - 1e-3f && texel <= high + 1e-3f;
}

TEST(environment_images)
{
    struct err e;
    struct image im = build_image(6, 5), got;
    srand(7);
    for (int i = 0; i < 6 * 5 * 3; i++)
        im.data[i] = (float)(rand() % 1000) / 100;
    OWN(scene) s = triangle_of((struct material){.reflectance = {1, 1, 1}});
    struct camera c = build_finish(&s, 40, 30);
    assert_true(scene_add_environment(&s, environment_from_image(&im, "test", &e), &e));
    OWN_TEXT text = export(&s, &c);
    assert_non_null(strstr(
        text, "\nLightSource \"infinite\" \"string filename\" [\"scene_environment.exr\"]\n"));
    bool half;
    MUST(image_read(test_path("scene_environment.exr"), &got, &half, &e));
    assert_false(half);
    assert_int_equal(got.width, 16 * 5);
    assert_int_equal(got.height, 16 * 5);
    int turned = 0;
    for (int i = 0; i < 2000; i++) {
        double y = 1 - 2 * (i + .5) / 2000, phi = 2.399963 * i, r = sqrt(1 - y * y);
        vec3 w = v3((float)(r * cos(phi)), (float)y, (float)(r * sin(phi)));
        assert_true(is_around(s.environment, w, *pbrt_sky(&got, w)));
        turned += !is_around(s.environment, w, *pbrt_sky(&got, v3(w.x, w.y, -w.z)));
    }
    assert_true(turned > 1000); /* a sky mirrored is another: the comparison can fail */
    /* Irradiance on the sides of a cube: texels are equal parts of 4 pi; against the sky in rings of equal height. A texel loses
     * the product of the slopes of radiance, 10 in a row of 36 degrees, and of the cosine, 1, times its squared side, 4 pi/80^2,
     * over 12: 0.0026 of some 5. */
    for (int side = 0; side < 6; side++) {
        double texels = 0, rings = 0;
        const double sign = side < 3 ? 1 : -1;
        enum { RINGS = 2000, AROUND = 1000 };
        const int fine =
            4 *
            got.width; /* sixteen directions of each texel, by their place in the square alone */
        for (int y = 0; y < fine; y++)
            for (int x = 0; x < fine; x++) {
                double u = 2 * (x + .5) / fine - 1, v = 2 * (y + .5) / fine - 1;
                double d = 1 - fabs(u) - fabs(v), r = 1 - fabs(d);
                double phi = M_PI / 2 * (d > 0 ? fabs(v) : 1 - fabs(u)) / r;
                double across = sqrt(1 - pow(1 - r * r, 2));
                const double w[3] = {copysign(cos(phi) * across, u), copysign(sin(phi) * across, v),
                                     copysign(1 - r * r, d)};
                texels += fmax(0, sign * w[side % 3]) * 4 * M_PI / fine / fine *
                          (double)got.data[3 * (y / 4 * got.width + x / 4)];
            }
        for (int i = 0; i < RINGS * AROUND; i++) {
            double y = 1 - 2 * (i / AROUND + .5) / RINGS,
                   phi = 2 * M_PI * (i % AROUND + .5) / AROUND;
            const double w[3] = {sqrt(1 - y * y) * cos(phi), y, sqrt(1 - y * y) * sin(phi)};
            rings += fmax(0, sign * w[side % 3]) * 4 * M_PI / (RINGS * AROUND) *
                     (double)environment_radiance(s.environment,
                                                  v3((float)w[0], (float)w[1], (float)w[2]))
                         .r;
        }
        assert_near(texels / rings, 1, 1e-3);
    }
    image_free(&im);
    image_free(&got);
    im = build_image(1, 513);
    im.data[0] = 1;
    struct scene tall = triangle_of((struct material){.reflectance = {1, 1, 1}});
    assert_true(scene_add_environment(&tall, environment_from_image(&im, "test", &e), &e));
    refuse(&tall, "of 513 rows, at most 512");
    image_free(&im);
}

TEST(what_it_has_not_is_refused)
{
    static const struct {
        struct material m;
        const char *pattern;
    } bad[] = {
        {{.kind = MATERIAL_MIRROR, .reflectance = {1, .9f, 1}}, "a mirror of a colour"},
        {{.kind = MATERIAL_REFRACTION, .ior = 1.5f}, "only refracts"},
        {{.kind = MATERIAL_GLASS, .ior = 1.5f, .schlick = true}, "Schlick"},
        {{.kind = MATERIAL_GLASS,
          .ior = 1.5f,
          .reflectance = {1, 1, 1},
          .transmittance = {1, 1, .5f}},
         "tinted"},
        {{.kind = MATERIAL_MICROFACET, .alpha = .2f, .microfacet = MICROFACET_BECKMANN},
         "Beckmann"},
        {{.kind = MATERIAL_MICROFACET, .alpha = .2f, .separable = true}, "independent"},
        {{.kind = MATERIAL_MICROFACET, .alpha = .2f, .reflectance = {.5f, .5f, .4f}},
         "without an index"},
    };
    for (size_t i = 0; i < COUNT(bad); i++) {
        struct scene s = triangle_of(bad[i].m);
        refuse(&s, bad[i].pattern);
    }
    const rgb texel = {.1f, .2f, .3f};
    struct scene painted = triangle_of((struct material){.reflectance = {1, 1, 1}});
    painted.materials[0].reflectance_map =
        build_texture(&painted, 1, 1, &texel, true, TEXTURE_WRAP);
    refuse(&painted, "the texture of material");
    struct light light[] = {point, spot};
    light[0].attenuation[0] = 1;
    light[1].exponent = 1;
    for (int i = 0; i < 3; i++) {
        struct scene s = triangle_of((struct material){.reflectance = {.5f, .5f, .5f}});
        if (i < 2)
            build_light(&s, light[i]);
        else
            s.camera.near = 10;
        refuse(&s, (const char *[]){"not the inverse square", "power of the cosine", "may cut"}[i]);
    }
}
