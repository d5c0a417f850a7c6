/* The dump for Blender: the numbers of a scene built by hand, and what has to be refused. */
#include "tests/support/build_scene.h"
#include "tests/support/sky.h"

#include "reference/cycles/export_cycles.h"
#include "reference/base/image_oiio.h"
#include "renderer/base/fs.h"
#include "tests/support/test.h"

#include <sys/stat.h>

#include <jansson.h>

struct fixture {
    char dir[64], path[128];
    struct scene s;
    struct camera c;
};

/* One of everything: floor (material 0), emitter (1), dark spheres (0), a glowing sphere (2). */
static int setup(void **state)
{
    struct fixture *f = calloc(1, sizeof *f);
    struct err e;
    strcpy(f->dir, "/tmp/test_export.XXXXXX");
    assert_non_null(mkdtemp(f->dir));
    snprintf(f->path, sizeof f->path, "%s/scene.json", f->dir);
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
    build_light(&f->s, (struct light){.kind = LIGHT_POINT,
                                      .value = {8, 4, 2},
                                      .position = {1, 2, 3},
                                      .attenuation = {0, 0, 4}});
    build_light(&f->s, (struct light){.kind = LIGHT_POINT,
                                      .value = {8, 4, 2},
                                      .position = {1, 2, 3},
                                      .attenuation = {2, 0, 0}});
    build_light(
        &f->s,
        (struct light){.kind = LIGHT_DIRECTIONAL, .value = {3, 2, 1}, .to_light = {0, .6f, .8f}});
    build_camera(&f->s, v3(.1f, 1, 4), 90);
    if (!scene_finish(&f->s, "test", &e) || !camera_init(&f->c, &f->s, 40, 30, &e))
        fail_msg("%s", e.msg);
    *state = f;
    return 0;
}

static int teardown(void **state)
{
    struct fixture *f = *state;
    struct err e;
    bool ok = fs_remove_tree(f->dir, &e);
    scene_free(&f->s);
    free(f);
    return ok ? 0 : -1;
}

static json_t *dump(struct fixture *f, int depth)
{
    struct err e = {"untouched"};
    json_error_t je;
    MUST(export_cycles(&f->s, &f->c, depth, f->path, &e));
    assert_string_equal(e.msg, "untouched");
    json_t *root = json_load_file(f->path, JSON_REJECT_DUPLICATES, &je);
    if (root == NULL)
        fail_msg("%d: %s", je.line, je.text);
    return root;
}

static void assert_refused(struct fixture *f, int depth, const char *why)
{
    struct err e = {""};
    if (export_cycles(&f->s, &f->c, depth, f->path, &e))
        fail_msg("accepted, although: %s", why);
    if (strstr(e.msg, why) == NULL)
        fail_msg("'%s' does not say '%s'", e.msg, why);
    assert_null(strchr(e.msg, '\n'));
    assert_int_equal(access(f->path, F_OK), -1);
}

/* Every float32 is a float32 again after reading: the numbers are compared exactly. */
static void assert_floats(const json_t *array, const float *want, size_t count)
{
    assert_int_equal(json_array_size(array), count);
    for (size_t i = 0; i < count; i++)
        if ((float)json_number_value(json_array_get(array, i)) != want[i])
            fail_msg("[%zu] is %.9g, not %.9g", i, json_number_value(json_array_get(array, i)),
                     (double)want[i]);
}

#define FLOATS(array, ...)                                                                         \
    assert_floats((array), (const float[]){__VA_ARGS__},                                           \
                  sizeof((const float[]){__VA_ARGS__}) / sizeof(float))

static const json_t *at(const json_t *root, const char *key, size_t i)
{
    const json_t *v = json_array_get(json_object_get(root, key), i);
    assert_non_null(v);
    return v;
}

static double number(const json_t *object, const char *key)
{
    assert_true(json_is_number(json_object_get(object, key)));
    return json_number_value(json_object_get(object, key));
}

TEST_WITH(frame_and_camera, setup, teardown)
{
    struct fixture *f = *state;
    json_t *root = dump(f, 5);
    const json_t *c = json_object_get(root, "camera");
    assert_true(number(root, "assay_cycles") == 2);
    assert_true(json_is_null(json_object_get(root, "environment")));
    assert_true(number(root, "depth") == 5);
    assert_true(number(root, "width") == 40);
    assert_true(number(root, "height") == 30);
    /* x and z: the big sphere from -3 to 3 and 0 to 6, the floor to z = -2; y: -2 to 4. */
    assert_float_equal(number(root, "extent"), sqrt(6 * 6 + 6 * 6 + 8 * 8), 1e-5);
    FLOATS(json_object_get(c, "right"), 1, 0, 0);
    FLOATS(json_object_get(c, "up"), 0, 1, 0);
    FLOATS(json_object_get(c, "backward"), 0, 0, 1);
    FLOATS(json_object_get(c, "eye"), .1f, 1, 4);
    assert_float_equal(number(c, "tan_h"), 1, 1e-6);
    /* Nearest is the big sphere, 3 - |(.1, 0, 1)| = 1.99501 away; furthest the floor's corner, at
     * |(2.1, 1, 6)| = 6.435. A ray into the picture's corner runs 1/sqrt(1 + 1 + .75^2) of its
     * length along the axis. */
    double near = json_number_value(json_array_get(json_object_get(c, "clip"), 0));
    double far = json_number_value(json_array_get(json_object_get(c, "clip"), 1));
    assert_true(near > 1e-3 && near < 1.995 / sqrt(2.5625));
    assert_true(far > 6.435 && far < 1e3);
    json_decref(root);
}

TEST_WITH(materials, setup, teardown)
{
    struct fixture *f = *state;
    strcpy(f->s.materials[0].name, "fl\303\266or\"");
    json_t *root = dump(f, 1);
    assert_int_equal(json_array_size(json_object_get(root, "materials")), 3);
    const json_t *floor = at(root, "materials", 0), *bulb = at(root, "materials", 2);
    FLOATS(json_object_get(floor, "reflectance"), .1f, .2f, .7f);
    FLOATS(json_object_get(floor, "radiance"), 0, 0, 0);
    assert_true(json_is_false(json_object_get(floor, "both_sides")));
    assert_string_equal(json_string_value(json_object_get(floor, "name")), "fl??or\"");
    FLOATS(json_object_get(at(root, "materials", 1), "radiance"), 3, 2, 1);
    FLOATS(json_object_get(bulb, "reflectance"), .5f, .5f, .5f);
    FLOATS(json_object_get(bulb, "radiance"), 4, 4, 4);
    assert_true(json_is_true(json_object_get(bulb, "both_sides")));
    json_decref(root);
}

TEST_WITH(meshes, setup, teardown)
{
    struct fixture *f = *state;
    json_t *root = dump(f, 1);
    assert_int_equal(json_array_size(json_object_get(root, "meshes")), 2);
    const json_t *floor = at(root, "meshes", 0), *lamp = at(root, "meshes", 1);
    assert_true(number(floor, "material") == 0);
    FLOATS(json_object_get(floor, "positions"), -2, 0, -2, -2, 0, 2, 2, 0, 2, -2, 0, -2, 2, 0, 2, 2,
           0, -2);
    assert_true(json_is_null(json_object_get(floor, "normals")));
    assert_true(number(lamp, "material") == 1);
    FLOATS(json_object_get(lamp, "positions"), -1, 2, -1, 0, 2, -1, 0, 2, 0, -1, 2, -1, 0, 2, 0, -1,
           2, 0);
    json_decref(root);
}

/* The floor's second triangle becomes smooth: it moves to a mesh of its own. Normals all on the
 * wrong side are turned as the renderer turns them; on both sides they are refused. */
TEST_WITH(shading_normals, setup, teardown)
{
    struct fixture *f = *state;
    for (int k = 3; k < 6; k++)
        f->s.normal[k] = v3(.6f, .8f, 0);
    json_t *root = dump(f, 1);
    assert_int_equal(json_array_size(json_object_get(root, "meshes")), 3);
    FLOATS(json_object_get(at(root, "meshes", 0), "positions"), -2, 0, -2, -2, 0, 2, 2, 0, 2);
    assert_true(json_is_null(json_object_get(at(root, "meshes", 0), "normals")));
    FLOATS(json_object_get(at(root, "meshes", 1), "positions"), -2, 0, -2, 2, 0, 2, 2, 0, -2);
    FLOATS(json_object_get(at(root, "meshes", 1), "normals"), .6f, .8f, 0, .6f, .8f, 0, .6f, .8f,
           0);
    json_decref(root);
    for (int k = 0; k < 3; k++)
        f->s.normal[k] = v3(0, -1, 0);
    for (int k = 3; k < 6; k++)
        f->s.normal[k] = v3(-.6f, -.8f, 0);
    root = dump(f, 1);
    assert_true(json_is_null(json_object_get(at(root, "meshes", 0), "normals")));
    FLOATS(json_object_get(at(root, "meshes", 1), "normals"), .6f, .8f, 0, .6f, .8f, 0, .6f, .8f,
           0);
    json_decref(root);
    unlink(f->path);
    f->s.normal[4] = v3(.6f, .8f, 0);
    assert_refused(f, 1, "object 'o': triangle 1 has shading normals on both of its sides");
}

TEST_WITH(spheres, setup, teardown)
{
    struct fixture *f = *state;
    json_t *root = dump(f, 1);
    assert_int_equal(json_array_size(json_object_get(root, "spheres")), 3);
    const json_t *small = at(root, "spheres", 0), *around = at(root, "spheres", 1),
                 *bulb = at(root, "spheres", 2);
    FLOATS(json_object_get(small, "centre"), .1f, .3f, -.2f);
    assert_true((float)number(small, "radius") == .3f);
    assert_true(number(small, "normal_out") == 1);
    assert_true(json_is_true(json_object_get(small, "exact")));
    assert_true(number(around, "normal_out") == -1);
    assert_true(json_is_false(json_object_get(around, "exact")));
    assert_true(number(bulb, "material") == 2);
    assert_true(json_is_false(json_object_get(bulb, "exact")));
    json_decref(root);
}

/* Nothing is divided out: it is for Blender's nodes to form value / (a + b d + c d^2). */
TEST_WITH(delta_lights, setup, teardown)
{
    struct fixture *f = *state;
    f->s.lights[1].kind = LIGHT_SPOT;
    f->s.lights[1].axis = v3(0, -.8f, .6f);
    f->s.lights[1].cos_cutoff = .7f;
    f->s.lights[1].exponent = 3.5f;
    f->s.lights[1].attenuation[1] = .25f;
    json_t *root = dump(f, 1);
    assert_int_equal(json_array_size(json_object_get(root, "lights")), 3);
    const json_t *point = at(root, "lights", 0), *spot = at(root, "lights", 1),
                 *sun = at(root, "lights", 2);
    assert_string_equal(json_string_value(json_object_get(point, "kind")), "point");
    FLOATS(json_object_get(point, "value"), 8, 4, 2);
    FLOATS(json_object_get(point, "position"), 1, 2, 3);
    FLOATS(json_object_get(point, "attenuation"), 0, 0, 4);
    assert_string_equal(json_string_value(json_object_get(spot, "kind")), "spot");
    FLOATS(json_object_get(spot, "value"), 8, 4, 2);
    FLOATS(json_object_get(spot, "attenuation"), 2, .25f, 0);
    FLOATS(json_object_get(spot, "axis"), 0, -.8f, .6f);
    assert_true((float)number(spot, "cos_cutoff") == .7f && number(spot, "exponent") == 3.5);
    assert_string_equal(json_string_value(json_object_get(sun, "kind")), "directional");
    FLOATS(json_object_get(sun, "to_light"), 0, .6f, .8f);
    FLOATS(json_object_get(sun, "irradiance"), 3, 2, 1);
    json_decref(root);
}

TEST_WITH(specular_materials, setup, teardown)
{
    struct fixture *f = *state;
    struct material *m = &f->s.materials[0];
    const char *const reflecting[] = {"diffuse", "mirror"};
    json_t *root;
    for (int k = 0; k < 2; k++) {
        m->kind = k == 0 ? MATERIAL_DIFFUSE : MATERIAL_MIRROR;
        root = dump(f, 1);
        assert_string_equal(json_string_value(json_object_get(at(root, "materials", 0), "kind")),
                            reflecting[k]);
        assert_null(json_object_get(at(root, "materials", 0), "ior"));
        /* Seen from outside only: a point of a cloud will do. */
        assert_true(json_is_true(json_object_get(at(root, "spheres", 0), "exact")));
        json_decref(root);
    }
    m->ior = 1.5f;
    m->transmittance = (rgb){.9f, .8f, .6f};
    const char *const refracting[] = {"refraction", "glass"};
    for (int k = 0; k < 2; k++) {
        m->kind = k == 0 ? MATERIAL_REFRACTION : MATERIAL_GLASS;
        m->schlick = k == 1;
        root = dump(f, 1);
        const json_t *j = at(root, "materials", 0);
        assert_string_equal(json_string_value(json_object_get(j, "kind")), refracting[k]);
        FLOATS(json_object_get(j, "reflectance"), .1f, .2f, .7f);
        FLOATS(json_object_get(j, "transmittance"), .9f, .8f, .6f);
        assert_true(number(j, "ior") == 1.5);
        assert_int_equal(json_is_true(json_object_get(j, "schlick")), k == 1);
        /* A ray meets its inside. */
        assert_true(json_is_false(json_object_get(at(root, "spheres", 0), "exact")));
        json_decref(root);
    }
}

static void put_out_delta_lights(struct fixture *f)
{
    assert_true(f->s.num_lights >= 3);
    memmove(f->s.lights, f->s.lights + 3, (f->s.num_lights - 3) * sizeof *f->s.lights);
    f->s.num_lights -= 3;
}

/* Only what the Glossy BSDF is (GGX, separable, one colour for all angles) may meet lights that no ray
 * runs into. */
TEST_WITH(microfacets, setup, teardown)
{
    struct fixture *f = *state;
    struct material *m = &f->s.materials[0];
    m->kind = MATERIAL_MICROFACET;
    m->microfacet = MICROFACET_GGX;
    m->separable = true;
    m->alpha = .25f;
    json_t *root = dump(f, 1);
    const json_t *j = at(root, "materials", 0);
    assert_string_equal(json_string_value(json_object_get(j, "kind")), "microfacet");
    assert_string_equal(json_string_value(json_object_get(j, "distribution")), "ggx");
    assert_true(number(j, "alpha") == .25);
    assert_true(json_is_true(json_object_get(j, "separable")));
    assert_true(json_is_false(json_object_get(j, "facets")));
    assert_true(json_is_null(json_object_get(j, "eta")) && json_is_null(json_object_get(j, "k")));
    json_decref(root);
    assert_int_equal(unlink(f->path), 0);

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
    root = dump(f, 1);
    j = at(root, "materials", 0);
    assert_string_equal(json_string_value(json_object_get(j, "distribution")), "beckmann");
    assert_true(json_is_false(json_object_get(j, "separable")));
    assert_true(json_is_true(json_object_get(j, "facets")));
    FLOATS(json_object_get(j, "eta"), .2f, .9f, 1.1f);
    FLOATS(json_object_get(j, "k"), 3.9f, 2.5f, 2.1f);
    json_decref(root);
}

static void set_environment(struct fixture *f, struct environment *env)
{
    struct err e = {"no environment"};
    if (env == NULL || !scene_add_environment(&f->s, env, &e))
        fail_msg("%s", e.msg);
}

TEST_WITH(a_constant_environment, setup, teardown)
{
    struct fixture *f = *state;
    struct err e;
    set_environment(f, environment_constant((rgb){1, 2, 4}, &e));
    json_t *root = dump(f, 1);
    const json_t *env = json_object_get(root, "environment");
    assert_string_equal(json_string_value(json_object_get(env, "kind")), "constant");
    FLOATS(json_object_get(env, "radiance"), 1, 2, 4);
    json_decref(root);
}

TEST_WITH(ambient_light, setup, teardown)
{
    struct fixture *f = *state;
    struct err e;
    put_out_delta_lights(f);
    set_environment(f, environment_upper_half((rgb){1, 2, 4}, &e));
    json_t *root = dump(f, 1);
    const json_t *env = json_object_get(root, "environment");
    assert_string_equal(json_string_value(json_object_get(env, "kind")), "upper_half");
    FLOATS(json_object_get(env, "radiance"), 1, 2, 4);
    json_decref(root);
    assert_int_equal(unlink(f->path), 0);
    f->s.materials[0].kind = MATERIAL_MICROFACET;
    f->s.materials[0].alpha = .25f;
    assert_refused(f, 1, "material 'm': the ambient light cannot light a microfacet");
}

/* The map goes beside the dump, to the bit, and nothing of it stays if the dump fails. */
TEST_WITH(a_sky, setup, teardown)
{
    struct fixture *f = *state;
    struct err e;
    struct image got;
    const struct sky sky = sky_uneven(8, 4);
    char path[sizeof f->path + 8];
    set_environment(f, sky_environment(&sky));
    json_t *root = dump(f, 1);
    const json_t *env = json_object_get(root, "environment");
    assert_string_equal(json_string_value(json_object_get(env, "kind")), "image");
    assert_string_equal(json_string_value(json_object_get(env, "file")), "scene.json.exr");
    snprintf(path, sizeof path, "%s.exr", f->path);
    bool half = true;
    MUST(image_read(path, &got, &half, &e));
    struct image want = sky_image(&sky);
    assert_true(!half && got.width == 8 && got.height == 4 && got.channels == 3);
    for (int i = 0; i < 8 * 4; i++)
        for (int c = 0; c < 3; c++) {
            static const char *const NAMES[] = {"R", "G", "B"};
            int at_got = image_channel(&got, NAMES[c]), at_want = image_channel(&want, NAMES[c]);
            assert_true(got.data[3 * i + at_got] == want.data[want.channels * i + at_want]);
        }
    image_free(&got);
    image_free(&want);
    json_decref(root);
    assert_int_equal(unlink(path), 0);
    assert_int_equal(unlink(f->path), 0);
    assert_int_equal(mkdir(f->path, 0777), 0); /* in the dump's way */
    assert_false(export_cycles(&f->s, &f->c, 1, f->path, &e));
    assert_int_equal(access(path, F_OK), -1);
}

TEST_WITH(a_lens, setup, teardown)
{
    struct fixture *f = *state;
    f->c.lens_radius = .25f;
    f->c.focal_distance = 3;
    json_t *root = dump(f, 1);
    const json_t *c = json_object_get(root, "camera");
    assert_true(number(c, "lens_radius") == .25 && number(c, "focal_distance") == 3);
    json_decref(root);
    assert_int_equal(unlink(f->path), 0);
    f->c.focal_distance = 0;
    assert_refused(f, 1, "a lens that focuses at distance 0");
    f->c.focal_distance = 3;
    f->c.near = 1.75f; /* the big sphere is at 1.99501 of the eye */
    assert_refused(f, 1, "the near plane is at 1.75");
    f->c.near = 1;
    f->c.far = 6.6f; /* the floor's far corner is at 6.435 of the eye */
    assert_refused(f, 1, "the far plane is at 6.6");
}

TEST_WITH(cameras_that_cycles_lacks_are_refused, setup, teardown)
{
    struct fixture *f = *state;
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
    json_decref(dump(f, 1));
    assert_int_equal(unlink(f->path), 0);
    f->c.near = 0;
    f->c.eye = v3(.1f, 0, 1);
    assert_refused(f, 1, "geometry at distance 0 from the eye");
}

TEST_WITH(depth_is_limited_and_files_appear_whole, setup, teardown)
{
    struct fixture *f = *state;
    assert_refused(f, 1026, "Cycles: depth 1026, at most 1025 are possible");
    json_decref(dump(f, 1025));
    assert_int_equal(unlink(f->path), 0);
    snprintf(f->path, sizeof f->path, "%s/none/scene.json", f->dir);
    assert_refused(f, 1, "/none/scene.json: cannot write: ");
}
