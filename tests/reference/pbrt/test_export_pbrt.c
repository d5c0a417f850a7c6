/* The pbrt-v4 scene as a text that was written by hand from the format's description (pbrt.org/fileformat-v4), and
 * what is refused. pbrt itself was not to be had. */
#define _GNU_SOURCE
#include "tests/support/build_scene.h"

#include "reference/pbrt/export_pbrt.h"
#include "renderer/scene/environment.h"
#include "tests/support/test.h"

/* The text; the caller frees. */
static char *export(const struct scene *s, const struct camera *c)
{
    char *text;
    size_t size;
    struct err e;
    FILE *f = open_memstream(&text, &size);
    assert_non_null(f);
    MUST(export_pbrt(s, c, 3, f, &e));
    fclose(f);
    return text;
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
    struct scene s = build_scene();
    for (size_t i = 0; i < COUNT(all); i++)
        s.materials[build_material(&s, grey(0), grey(0))] = all[i];
    build_quad(&s, v3(-1, 0, -5), v3(2, 0, 0), v3(0, 3, 0.5f), 0);
    build_triangle(&s, v3(0, 0, -3), v3(1, 0, -3), v3(0, 1, -3.5f), 6);
    s.normal[7] = normalize(v3(.3f, .4f, 1));
    build_sphere(&s, v3(.25f, .5f, -6), 1.5f, 1, 2);
    build_sphere(&s, v3(2, 3, -7), .5f, -1, 1);
    build_light(&s, point);
    build_light(&s, (struct light){
                        .kind = LIGHT_DIRECTIONAL, .value = {2, 4, 6}, .to_light = {0, .6f, .8f}});
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
    scene_free(&s);
}

static struct scene triangle_of(struct material m)
{
    struct scene s = build_scene();
    s.materials[build_material(&s, grey(0), grey(0))] = m;
    build_triangle(&s, v3(0, 0, -4), v3(1, 0, -4), v3(0, 1, -4), 0);
    build_camera(&s, v3(0, 0, 0), 50);
    return s;
}

static void refuse(struct scene *s, const char *pattern)
{
    struct err e;
    struct camera c = build_finish(s, 40, 30);
    char *text;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    REFUSES(export_pbrt(s, &c, 3, f, &e), pattern);
    fclose(f);
    free(text);
    scene_free(s);
}

TEST(what_it_has_not_is_refused)
{
    static const struct {
        struct material m;
        const char *pattern;
    } bad[] = {
        {{.kind = MATERIAL_MIRROR, .reflectance = {1, .9f, 1}}, "a mirror whose"},
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
        {{.kind = MATERIAL_MICROFACET, .alpha = .2f, .reflectance = {.5f, .5f, .5f}},
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
