/* The assignment's own scenes, which are not ours to ship: found by ASSAY_CS184. Expected counts are
 * those of the course's files as counted by hand and by the staff's renderer. */
#include "renderer/collada/collada.h"
#include "renderer/scene/environment.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

static const double DEGREE = M_PI / 180;

/* Skips the test, loudly, if the file is not there. */
static struct scene must_load(const char *name, enum dialect dialect)
{
    struct scene s = {0};
    struct err e = {""};
    MUST(collada_load(test_course_file(name), dialect, &s, &e));
    return s;
}

static void assert_close(vec3 a, float x, float y, float z)
{
    float far = length(sub(a, v3(x, y, z)));
    if (!(far < 1e-5f))
        fail_msg("(%g %g %g) is not (%g %g %g)", a.x, a.y, a.z, x, y, z);
}

static void assert_rgb(rgb c, float r, float g, float b)
{
    assert_close(v3(c.r, c.g, c.b), r, g, b);
}

static const struct material *material_of(const struct scene *s, const char *object)
{
    for (uint32_t i = 0; i < s->num_objects; i++)
        if (strcmp(s->objects[i].name, object) == 0)
            return &s->materials[s->objects[i].material];
    fail_msg("no object '%s'", object);
    return NULL;
}

/* 5 walls of 2 triangles, the lamp of 2, 2 spheres. Box 2 x 1.5 x 2. The lamp's node is
 * diag(0.6, 0.8, 1) at z = 1.49 of a Z-up file: corners (+-0.3, 1.49, +-0.4), area 0.48, downwards. */
TEST(spheres_lambertian)
{
    OWN(scene) s = must_load("sky/CBspheres_lambertian.dae", DIALECT_AUTO);
    assert_int_equal(s.dialect, DIALECT_CGL);
    assert_int_equal(s.num_triangles, 12);
    assert_int_equal(s.num_spheres, 2);
    assert_int_equal(s.num_degenerate, 0);
    assert_close(s.bounds_min, -1, 0, -1);
    assert_close(s.bounds_max, 1, 1.5f, 1);
    assert_close(s.spheres[0].centre, 0.4f, 0.3f, 0.3f);
    assert_close(s.spheres[1].centre, -0.4f, 0.3f, -0.3f);
    assert_true(fabsf(s.spheres[0].radius - 0.3f) < 1e-6f);
    assert_int_equal(s.num_lights, 1);
    assert_int_equal(s.lights[0].kind, LIGHT_TRIANGLES);
    assert_true(fabsf(s.lights[0].area - 0.48f) < 1e-6f);
    for (uint32_t k = 3 * s.lights[0].first; k < 3 * s.lights[0].first + 6; k++) {
        vec3 p = s.position[k];
        assert_close(v3(fabsf(p.x), p.y, fabsf(p.z)), 0.3f, 1.49f, 0.4f);
        assert_close(s.normal[k], 0, -1, 0);
    }
    const struct material *lamp = material_of(&s, "Area"), *left = material_of(&s, "leftWall");
    assert_rgb(lamp->radiance, 10, 10, 10);
    assert_false(lamp->radiance_both_sides);
    assert_rgb(left->reflectance, 0.6f, 0.2f, 0.2f);
    assert_close(s.camera.backward, 0, 0, 1);
    assert_true(fabs(s.camera.hfov - 49.13434 * DEGREE) < 1e-6);
    assert_true(fabs(s.camera.vfov - 37.849 * DEGREE) < 1e-4);
    assert_close(s.frame_max, 1, 1.5f, 1);
}

/* 28588 triangles with the two of the lamp; the eye is on the other side. */
TEST(bunny)
{
    OWN(scene) s = must_load("sky/CBbunny.dae", DIALECT_AUTO);
    assert_int_equal(s.num_triangles + s.num_degenerate, 28588);
    assert_int_equal(s.num_lights, 1);
    assert_close(s.camera.backward, 0, 0, -1);
}

/* The light mesh is commented out and there is no area light: a point of 5 without falloff. */
TEST(empty_box)
{
    OWN(scene) s = must_load("sky/CBempty.dae", DIALECT_AUTO);
    assert_int_equal(s.num_triangles, 10);
    assert_int_equal(s.num_lights, 1);
    assert_int_equal(s.lights[0].kind, LIGHT_POINT);
    assert_true(s.lights[0].value.g == 5 && s.lights[0].attenuation[0] == 1 &&
                s.lights[0].attenuation[2] == 0);
    assert_close(s.lights[0].position, 0, 1.49f, 0.00431585f);
}

/* No CGL extras, but written by the Blender that wrote all CGL files. Read as COLLADA, its phong has a highlight of
 * exponent 256, so alpha^2 = 2/(4 256 + 2). Direction of the light: M (0,0,-1,1) = (1 - .5, 1 - .5, 1.5 - .7071068),
 * by Z_UP (x, y, z) -> (-x, z, y) (-.5, .7928932, .5), divided by its length 1.0624. */
TEST(meshes_of_assignment_two)
{
    struct scene s = must_load("meshedit/cow.dae", DIALECT_COLLADA);
    assert_int_equal(s.materials[0].kind, MATERIAL_PLASTIC);
    assert_true(fabsf(s.materials[0].specular.g - 0.00625f) < 1e-8f);
    assert_true(fabsf(s.materials[0].alpha - sqrtf(2 / 1026.0f)) < 1e-6f);
    scene_free(&s);
    s = must_load("meshedit/cow.dae", DIALECT_AUTO);
    assert_int_equal(s.dialect, DIALECT_CGL);
    assert_non_null(strstr(s.note, "specular"));
    assert_int_equal(s.num_triangles + s.num_degenerate, 5856);
    assert_int_equal(s.lights[0].kind, LIGHT_DIRECTIONAL);
    assert_close(s.lights[0].to_light, -0.5f / 1.062393f, 0.7928932f / 1.062393f, 0.5f / 1.062393f);
    for (size_t k = 0; k < 3 * (size_t)s.num_triangles; k++)
        assert_true(fabsf(length(s.normal[k]) - 1) < 1e-5f);
    scene_free(&s);
    s = must_load("meshedit/maxplanck.dae", DIALECT_AUTO);
    assert_int_equal(s.num_triangles + s.num_degenerate, 50801);
    scene_free(&s);
}

/* One mirror of 1, one glass of 1.45, both clear; the box as in CBspheres_lambertian. */
TEST(mirror_and_glass)
{
    OWN(scene) s = must_load("sky/CBspheres.dae", DIALECT_AUTO);
    assert_int_equal(s.dialect, DIALECT_CGL);
    assert_int_equal(s.num_triangles, 12);
    assert_int_equal(s.num_spheres, 2);
    assert_int_equal(s.num_lights, 1);
    int mirrors = 0, glasses = 0;
    for (uint32_t i = 0; i < s.num_spheres; i++) {
        const struct material *m = &s.materials[s.sphere_material[i]];
        mirrors += m->kind == MATERIAL_MIRROR;
        glasses += m->kind == MATERIAL_GLASS;
        assert_rgb(m->reflectance, 1, 1, 1);
        assert_rgb(m->radiance, 0, 0, 0);
        assert_true(s.spheres[i].normal_out == 1);
        if (m->kind == MATERIAL_GLASS) {
            assert_rgb(m->transmittance, 1, 1, 1);
            assert_true(m->ior == 1.45f && !m->schlick);
        }
    }
    assert_int_equal(mirrors, 1);
    assert_int_equal(glasses, 1);
}

/* Three tinted glasses; 252 triangles. The camera's matrix has 15 numbers. */
TEST(gems)
{
    struct scene s = must_load("sky/CBgems.dae", DIALECT_AUTO);
    assert_int_equal(s.num_triangles + s.num_degenerate, 252);
    assert_int_equal(s.num_lights, 1);
    static const float tint[3][3] = {{1, 0.75f, 0.75f}, {0.75f, 0.75f, 1}, {1, 0.85f, 1}};
    int found[3] = {0}, glasses = 0;
    for (uint32_t i = 0; i < s.num_materials; i++) {
        const struct material *m = &s.materials[i];
        if (m->kind != MATERIAL_GLASS)
            continue;
        glasses++;
        assert_rgb(m->reflectance, 1, 1, 1);
        assert_true(m->ior == 1.45f);
        for (int k = 0; k < 3; k++)
            found[k] += m->transmittance.r == tint[k][0] && m->transmittance.g == tint[k][1] &&
                        m->transmittance.b == tint[k][2];
    }
    assert_int_equal(glasses, 3);
    for (int k = 0; k < 3; k++)
        assert_int_equal(found[k], 1);
    scene_free(&s);
}

/* An ambient light, which the camera does not see, and a directional one. */
TEST(banana)
{
    OWN(scene) s = must_load("keenan/banana.dae", DIALECT_AUTO);
    assert_int_equal(s.num_triangles + s.num_degenerate, 2458);
    assert_int_equal(s.num_lights, 2);
    assert_true(s.environment_light >= 0 && environment_is_hidden(s.environment));
    assert_int_equal(s.lights[1 - s.environment_light].kind, LIGHT_DIRECTIONAL);
    assert_true(environment_radiance(s.environment, v3(0, 1, 0)).g == 1);
}
