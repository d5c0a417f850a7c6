/* The dump for Blender as a text that was written by hand from the scene below, and what has to be refused. */
#include "tests/support/build_scene.h"
#include "tests/support/sky.h"

#include "reference/cycles/export_cycles.h"
#include "renderer/image/image_oiio.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <sys/stat.h>

struct fixture {
    const char *path;
    struct scene s;
    struct camera c;
};

/* Floor (material 0), emitter (1), dark spheres (0), a glowing sphere (2), every other material on a sphere. */
static int setup(void **state)
{
    static const struct material more[] = {
        {.kind = MATERIAL_MIRROR, .reflectance = {.5f, .25f, 1}},
        {.kind = MATERIAL_REFRACTION, .ior = 1.5f, .transmittance = {.9f, .8f, .6f}},
        {.kind = MATERIAL_GLASS,
         .ior = 1.5f,
         .reflectance = {1, .5f, 1},
         .transmittance = {.9f, .8f, .6f},
         .schlick = true},
        {.kind = MATERIAL_MICROFACET,
         .reflectance = {.5f, .25f, 1},
         .microfacet = MICROFACET_GGX,
         .separable = true,
         .alpha = .25f},
    };
    struct fixture *f = calloc(1, sizeof *f);
    f->path = strdup(test_path("scene.json"));
    f->s = build_scene();
    uint32_t floor = build_material(&f->s, (rgb){.1f, .2f, .7f}, grey(0));
    uint32_t lamp = build_material(&f->s, grey(0), (rgb){3, 2, 1});
    uint32_t bulb = build_material(&f->s, grey(.5f), grey(4));
    f->s.materials[bulb].radiance_both_sides = true;
    build_quad(&f->s, v3(-2, 0, -2), v3(0, 0, 4), v3(4, 0, 0), floor);
    build_quad(&f->s, v3(-1, 2, -1), v3(1, 0, 0), v3(0, 0, 1), lamp);
    build_sphere(&f->s, v3(.1f, .3f, -.2f), .3f, 1, floor);
    build_sphere(&f->s, v3(0, 1, 3), 3, -1, floor); /* the eye is inside */
    build_sphere(&f->s, v3(1, 1, 0), .2f, 1, bulb);
    for (size_t i = 0; i < COUNT(more); i++) {
        uint32_t m = build_material(&f->s, grey(0), grey(0));
        f->s.materials[m] = more[i];
        build_sphere(&f->s, v3(-1, .5f, 0), .25f, 1, m);
    }
    build_light(&f->s, (struct light){.kind = LIGHT_POINT,
                                      .value = {8, 4, 2},
                                      .position = {1, 2, 3},
                                      .attenuation = {0, 0, 4}});
    build_light(&f->s, (struct light){.kind = LIGHT_SPOT,
                                      .value = {8, 4, 2},
                                      .position = {1, 2, 3},
                                      .axis = {0, -.8f, .6f},
                                      .cos_cutoff = .7f,
                                      .exponent = 3.5f,
                                      .attenuation = {2, .25f, 0}});
    build_sun(&f->s, v3(0, .6f, .8f), (rgb){3, 2, 1});
    build_camera(&f->s, v3(.1f, 1, 4), 90);
    f->c = build_finish(&f->s, 40, 30);
    *state = f;
    return 0;
}

static int teardown(void **state)
{
    struct fixture *f = *state;
    unlink(f->path);
    free((char *)(uintptr_t)f->path);
    scene_free(&f->s);
    free(f);
    return 0;
}

#define EXPORT(name) TEST_OF(fixture, name, setup, teardown)

/* The dump, with a line for each member; the caller frees. */
static char *dump(struct fixture *f, int depth)
{
    struct err e = {"untouched"};
    MUST(export_cycles(&f->s, &f->c, depth, f->path, &e));
    assert_string_equal(e.msg, "untouched");
    char *text = test_read(f->path), *lines = calloc(2, strlen(text) + 1), *to = lines;
    for (const char *at = text; *at != '\0'; at++) {
        *to++ = *at;
        if (*at == '{' || (*at == ',' && (at[1] == '"' || at[1] == '{')))
            *to++ = '\n';
    }
    free(text);
    assert_int_equal(unlink(f->path), 0);
    return lines;
}

static void expect(struct fixture *f, int depth, const char *expected)
{
    OWN_TEXT text = dump(f, depth);
    test_same_text(text, expected);
}

static void expect_part(struct fixture *f, const char *part)
{
    OWN_TEXT text = dump(f, 1);
    if (strstr(text, part) == NULL)
        fail_msg("no %s in %s", part, text);
}

static void assert_refused(struct fixture *f, int depth, const char *why)
{
    struct err e;
    REFUSES(export_cycles(&f->s, &f->c, depth, f->path, &e), why);
    assert_int_equal(access(f->path, F_OK), -1);
}

/* With shading normals: the floor's second triangle is smooth, and the lamp's are all
 * on the wrong side, from where the renderer turns them. */
EXPORT(the_dump_is_the_scene)
{
    strcpy(f->s.materials[0].name, "fl\303\266or\"");
    for (int k = 0; k < 3; k++) {
        f->s.normal[3 + k] = v3(.6f, .8f, 0);
        f->s.normal[6 + k] = v3(0, 1, 0);
        f->s.normal[9 + k] = v3(-.6f, .8f, 0);
    }
    f->c.lens_radius = .25f;
    f->c.focal_distance = 3;
    expect(f, 5, "tests/reference/cycles/scene.expected");
    f->s.normal[4] = v3(-.6f, -.8f, 0);
    assert_refused(f, 1, "object 'o': triangle 1 has shading normals on both of its sides");
}

static void put_out_delta_lights(struct fixture *f)
{
    assert_true(f->s.num_lights >= 3);
    memmove(f->s.lights, f->s.lights + 3, (f->s.num_lights - 3) * sizeof *f->s.lights);
    f->s.num_lights -= 3;
}

static void set_environment(struct fixture *f, struct environment *env)
{
    struct err e = {"no environment"};
    MUST(env != NULL && scene_add_environment(&f->s, env, &e));
}

/* Only what the Glossy BSDF is (GGX, separable, one colour for all angles) may meet lights that no ray
 * runs into. */
EXPORT(microfacets)
{
    struct err e;
    struct material *m = &f->s.materials[0];
    m->kind = MATERIAL_MICROFACET;
    m->microfacet = MICROFACET_GGX;
    m->separable = true;
    m->alpha = .25f;
    const struct material plain = *m;
    m->separable = false;
    assert_refused(f, 1, "material 'm': a point light cannot light a microfacet that is not GGX");
    *m = plain;
    m->microfacet = MICROFACET_BECKMANN;
    f->s.lights[0].kind = LIGHT_SPOT;
    assert_refused(f, 1, "material 'm': a spot light cannot");
    f->s.lights[0].kind = LIGHT_DIRECTIONAL;
    *m = plain;
    m->alpha = .009f;
    assert_refused(f, 1, "material 'm': a directional light cannot");
    m->alpha = 1.01f;
    assert_refused(f, 1, "material 'm': a directional light cannot");
    *m = plain;
    m->conductor = true;
    m->eta = (rgb){.2f, .9f, 1.1f};
    m->k = (rgb){3.9f, 2.5f, 2.1f};
    assert_refused(f, 1, "material 'm': a directional light cannot");

    put_out_delta_lights(f);
    m->separable = false;
    m->microfacet = MICROFACET_BECKMANN;
    set_environment(f, environment_constant((rgb){1, 2, 4}, &e));
    expect(f, 1, "tests/reference/cycles/facets.expected");
}

/* Diffuse and a sharp mirror may meet every light, facets of a highlight only what rays run into. */
EXPORT(plastic)
{
    struct material *m = &f->s.materials[0];
    m->kind = MATERIAL_PLASTIC;
    m->reflectance = (rgb){.5f, .25f, 0};
    m->mirror = (rgb){0, .25f, .5f};
    m->microfacet = MICROFACET_BECKMANN;
    m->separable = true;
    m->alpha = .25f;
    expect_part(f, "\"specular\":[0.0,0.0,0.0],\n\"mirror\":[0.0,0.25,0.5]");
    m->specular = (rgb){.5f, 0, 0};
    assert_refused(f, 1, "material 'm': a point light cannot");
    put_out_delta_lights(f);
    expect_part(
        f, "\"distribution\":\"beckmann\",\n\"alpha\":0.25,\n\"separable\":true,\n\"facets\":true");
}

EXPORT(ambient_light)
{
    struct err e;
    put_out_delta_lights(f);
    set_environment(f, environment_upper_half((rgb){1, 2, 4}, &e));
    expect_part(f, "\"environment\":{\n\"kind\":\"upper_half\",\n\"radiance\":[1.0,2.0,4.0]}");
    f->s.materials[0].kind = MATERIAL_MICROFACET;
    f->s.materials[0].alpha = .25f;
    assert_refused(f, 1, "material 'm': the ambient light cannot light a microfacet");
}

/* The map goes beside the dump, to the bit, and nothing of it stays if the dump fails. */
EXPORT(a_sky)
{
    struct err e;
    OWN(image) got;
    const struct sky sky = sky_uneven(8, 4);
    set_environment(f, sky_environment(&sky));
    expect_part(f, "\"environment\":{\n\"kind\":\"image\",\n\"file\":\"scene.json.exr\"}");
    const char *path = test_path("scene.json.exr");
    bool half = true;
    MUST(image_read(path, &got, &half, &e));
    OWN(image) want = sky_image(&sky);
    assert_true(!half && got.width == 8 && got.height == 4 && got.channels == 3);
    for (int i = 0; i < 8 * 4; i++)
        for (int c = 0; c < 3; c++) {
            static const char *const NAMES[] = {"R", "G", "B"};
            int at_got = image_channel(&got, NAMES[c]), at_want = image_channel(&want, NAMES[c]);
            assert_true(got.data[3 * i + at_got] == want.data[want.channels * i + at_want]);
        }
    assert_int_equal(unlink(path), 0);
    assert_int_equal(mkdir(f->path, 0777), 0); /* in the dump's way */
    assert_false(export_cycles(&f->s, &f->c, 1, f->path, &e));
    assert_int_equal(access(path, F_OK), -1);
    assert_int_equal(rmdir(f->path), 0);
}

EXPORT(a_lens)
{
    f->c.lens_radius = .25f;
    f->c.focal_distance = 0;
    assert_refused(f, 1, "a lens that focuses at distance 0");
    f->c.focal_distance = 3;
    f->c.near = 1.75f; /* the big sphere is at 1.99501 of the eye */
    assert_refused(f, 1, "the near plane is at 1.75");
    f->c.near = 1;
    f->c.far = 6.6f; /* the floor's far corner is at 6.435 of the eye */
    assert_refused(f, 1, "the far plane is at 6.6");
}

EXPORT(cameras_that_cycles_lacks_are_refused)
{
    const struct camera c = f->c;
    f->c.tan_v *= 1.01f;
    assert_refused(f, 1, "pixels are not square");
    f->c = c;
    f->c.tan_h = f->c.tan_v = 20;
    f->c.width = f->c.height = 30;
    assert_refused(f, 1, "angle of view out of Blender's range");
    f->c = c;
    f->c.up = normalize(v3(.01f, 1, 0));
    assert_refused(f, 1, "axes are not orthogonal");
    f->c = c;
    f->c.near = 1.996f; /* the big sphere is at 1.99501 */
    assert_refused(f, 1, "the near plane is at 1.996");
    f->c.near = 1.994f;
    f->c.far = 6.4f; /* the floor's far corner is at 6.435 */
    assert_refused(f, 1, "the far plane is at 6.4");
    f->c.far = 6.5f;
    free(dump(f, 1));
    f->c.near = 0;
    f->c.eye = v3(.1f, 0, 1);
    assert_refused(f, 1, "geometry, at distance 0 to");
}

/* A border makes the image one texel larger in that direction alone, and all of what is left is black; coordinates are those of the
 * corners, in the triangles' order. */
EXPORT(textures_are_images_beside_the_dump)
{
    const rgb texels[2] = {{.1f, .2f, 3}, {.4f, .5f, .6f}};
    OWN(image) im;
    struct err e = {""};
    uint32_t map = build_texture(&f->s, 2, 1, texels, true, TEXTURE_MIRROR);
    f->s.textures[map - 1].wrap[1] = TEXTURE_BORDER;
    f->s.materials[1].radiance_map = map;
    f->s.lights[3].textured = true;
    OWN_TEXT text = dump(f, 1);
    char file[300];
    snprintf(file, sizeof file, "%s.texture0.exr", f->path);
    MUST(image_read_colours(file, &im, &e));
    assert_true(im.width == 2 && im.height == 3);
    for (int i = 0; i < 6; i++) {
        const rgb want = i / 2 == 1 ? texels[i % 2] : grey(0);
        assert_memory_equal(im.data + 3 * i, &want, sizeof want);
    }
    if (strstr(
            text,
            "\"wrap\":[\"mirror\",\n\"clamp\"],\n\"size\":[2,1],\n\"pad\":[0,1],\n\"nearest\":true}") ==
            NULL ||
        strstr(text, "\"radiance_map\":{\n\"file\":\"scene.json.texture0.exr\",\n\"sha256\":\"") ==
            NULL ||
        strstr(text, "\"uv\":[0.0,0.0,1.0,0.0,1.0,1.0,0.0,0.0,1.0,1.0,0.0,1.0]") == NULL ||
        strstr(text, "reflectance_map") != NULL)
        fail_msg("%s", text);
    assert_int_equal(unlink(file), 0);
    f->c.tan_v *= 2;
    assert_refused(f, 1, "pixels are not square");
    assert_int_equal(access(file, F_OK), -1);
}

/* Squares at depths 1, 4 and 9, with sides of 1, 2 and 2: distances 1 to 1.22, 4 to 4.24, 9 to 9.11. A plane between two
 * by distance is put half way between them by depth; one that cuts through the first is refused. */
EXPORT(planes_between_whole_surfaces_clip_by_depth)
{
    scene_free(&f->s);
    f->s = build_scene();
    uint32_t grey_material = build_material(&f->s, grey(.5f), grey(0));
    build_quad(&f->s, v3(-.5f, -.5f, -1), v3(1, 0, 0), v3(0, 1, 0), grey_material);
    build_quad(&f->s, v3(-1, -1, -4), v3(2, 0, 0), v3(0, 2, 0), grey_material);
    build_quad(&f->s, v3(-1, -1, -9), v3(2, 0, 0), v3(0, 2, 0), grey_material);
    build_camera(&f->s, v3(0, 0, 0), 90);
    f->c = build_finish(&f->s, 40, 30);
    f->c.near = 2;
    f->c.far = 7;
    expect_part(f, "\"clip\":[2.5,6.5]");
    f->c.lens_radius =
        .75f; /* rays may start 0.75 nearer or further: 1.22 + 0.75 is before 2, 9 - 0.75 beyond 7 */
    f->c.focal_distance = 3;
    expect_part(f, "\"clip\":[2.5,6.5]");
    f->c.lens_radius = .8f;
    assert_refused(f, 1, "the near plane is at 2");
    f->c.lens_radius = 0;
    f->c.near = 1.1f;
    assert_refused(f, 1, "the near plane is at 1.1");
}

EXPORT(depth_is_limited_and_files_appear_whole)
{
    assert_refused(f, 1026, "Cycles: depth 1026, at most 1025 are possible");
    free(dump(f, 1025));
    free((char *)(uintptr_t)f->path);
    f->path = strdup(test_path("none/scene.json"));
    assert_refused(f, 1, "/none/scene.json: cannot write: ");
}
