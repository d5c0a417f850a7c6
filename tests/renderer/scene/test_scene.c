/* scene_finish(): lights of emissive objects, areas, bounds, and what it refuses. */
#include "renderer/scene/scene.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

static void *copy(const void *data, size_t size)
{
    void *p = malloc(size);
    assert_non_null(p);
    memcpy(p, data, size);
    return p;
}

/* Object 0: two triangles that do not emit. Object 1: two triangles that do, right angles with legs
 * 1,1 and 3,4, so 0.5 + 6 in area. Object 2: two emissive spheres of radius 2 and 0.5. One point
 * light comes first. */
static struct scene make_scene(void)
{
    const vec3 position[12] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 0, 0}, {6, 0, 0}, {5, 1, 0},
                               {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {0, 0, 9}, {3, 0, 9}, {0, 4, 9}};
    vec3 normal[12];
    for (int i = 0; i < 12; i++)
        normal[i] = v3(0, 0, 1);
    const uint32_t tri_material[4] = {0, 0, 1, 1}, tri_object[4] = {0, 0, 1, 1};
    const struct sphere spheres[2] = {{{-3, 0, 0}, 2, 1}, {{0, -7, 0}, 0.5f, -1}};
    const uint32_t sphere_material[2] = {1, 1}, sphere_object[2] = {2, 2};
    const struct material materials[2] = {
        {.name = "paint", .reflectance = {0.5f, 0.5f, 0.5f}},
        {.name = "lamp", .radiance = {1, 2, 3}, .reflectance = {0.1f, 0, 0}}};
    const struct object objects[3] = {
        {"wall", 0, 2, 0, 0, 0}, {"panel", 2, 2, 0, 0, 1}, {"bulbs", 4, 0, 0, 2, 1}};
    const struct light point = {.kind = LIGHT_POINT, .value = {1, 1, 1}, .attenuation = {0, 0, 1}};
    return (struct scene){.num_triangles = 4,
                          .num_spheres = 2,
                          .num_materials = 2,
                          .num_lights = 1,
                          .num_objects = 3,
                          .position = copy(position, sizeof position),
                          .normal = copy(normal, sizeof normal),
                          .tri_material = copy(tri_material, sizeof tri_material),
                          .tri_object = copy(tri_object, sizeof tri_object),
                          .spheres = copy(spheres, sizeof spheres),
                          .sphere_material = copy(sphere_material, sizeof sphere_material),
                          .sphere_object = copy(sphere_object, sizeof sphere_object),
                          .materials = copy(materials, sizeof materials),
                          .lights = copy(&point, sizeof point),
                          .objects = copy(objects, sizeof objects)};
}

TEST(area_lights_follow_delta_lights)
{
    OWN(scene) s = make_scene();
    struct err e = {""};
    assert_true(scene_finish(&s, "test", &e));
    assert_int_equal(s.num_lights, 4);
    assert_int_equal(s.lights[0].kind, LIGHT_POINT);
    assert_int_equal(s.lights[1].kind, LIGHT_TRIANGLES);
    assert_int_equal(s.lights[1].first, 2);
    assert_int_equal(s.lights[1].count, 2);
    assert_true(fabsf(s.lights[1].area - 6.5f) < 1e-6f);
    const float pi = 3.14159265f;
    for (uint32_t k = 0; k < 2; k++) {
        float r = k == 0 ? 2 : 0.5f;
        assert_int_equal(s.lights[2 + k].kind, LIGHT_SPHERE);
        assert_int_equal(s.lights[2 + k].first, k);
        assert_true(fabsf(s.lights[2 + k].area - 4 * pi * r * r) < 1e-5f);
        assert_int_equal(s.sphere_light[k], 2 + k);
    }
    const int32_t expected[4] = {-1, -1, 1, 1};
    assert_memory_equal(s.tri_light, expected, sizeof expected);
}

/* Corners by hand: the first sphere reaches x = -5, y = 2, z = +-2; the second y = -7.5. */
TEST(bounds_hold_triangles_and_spheres)
{
    OWN(scene) s = make_scene();
    struct err e = {""};
    assert_true(scene_finish(&s, "test", &e));
    const vec3 lo = {-5, -7.5f, -2}, hi = {6, 4, 9};
    assert_memory_equal(&s.bounds_min, &lo, sizeof lo);
    assert_memory_equal(&s.bounds_max, &hi, sizeof hi);
    assert_memory_equal(&s.frame_min, &lo, sizeof lo);
    assert_memory_equal(&s.frame_max, &hi, sizeof hi);
}

TEST(free_zeroes)
{
    struct scene s = make_scene();
    static const struct scene zero;
    scene_free(&s);
    assert_null(s.position);
    assert_int_equal(s.num_triangles, 0);
    assert_memory_equal(&s, &zero, sizeof s);
    scene_free(&s);
}

/* A texture of one texel on the wall. */
static void give_texture(struct scene *s, float texel)
{
    struct err e;
    s->images = calloc(1, sizeof *s->images);
    s->textures = calloc(1, sizeof *s->textures);
    s->uv = calloc(12, sizeof *s->uv);
    assert_true(s->images != NULL && s->textures != NULL && s->uv != NULL);
    assert_true(image_alloc(s->images, 1, 1, 3, (const char *const[]){"R", "G", "B"}, &e));
    s->images->data[1] = texel;
    s->textures[0] = (struct texture){.width = 1, .height = 1, .texel = s->images->data};
    s->num_images = s->num_textures = 1;
    s->materials[0].reflectance_map = 1;
}

enum { WAYS = 28 };

/* Spoils a scene of make_scene() in one of those ways; returns a part of the error message that it
 * must cause. */
static const char *spoil(struct scene *s, int way)
{
    switch (way) {
    case 0: s->position[7].y = NAN; return "triangle 2: position";
    case 1: s->normal[3] = v3(0, 0, 2); return "triangle 1: normal";
    case 2: s->materials[0].reflectance.g = 1.01f; return "'paint': reflectance";
    case 3: s->materials[0].reflectance.b = -0.01f; return "'paint': reflectance";
    case 4: s->materials[0].reflectance_map = 1; return "'paint': a texture that is not there";
    case 5: give_texture(s, 2.01f); return "'paint': reflectance outside [0,1] in its texture";
    case 6: give_texture(s, NAN); return "'paint': reflectance outside";
    case 7:
        give_texture(s, 1);
        s->materials[0].kind = MATERIAL_MIRROR;
        return "not diffuse";
    case 8:
        give_texture(s, 1);
        s->materials[1].radiance_map = 1;
        return "'bulbs': a texture on a sphere";
    case 9:
        give_texture(s, -0.1f);
        s->materials[0].reflectance_map = 0;
        s->materials[1].radiance_map = 1;
        return "'lamp': radiance negative or not finite in";
    case 10:
        give_texture(s, 1);
        s->uv[7].v = 1.1e6f;
        return "triangle 2: texture coordinate beyond";
    case 11: s->materials[1].radiance.r = INFINITY; return "'lamp': radiance";
    case 12: s->objects[0].material = 2; return "'wall': no material 2";
    case 13: s->tri_material[1] = 1; return "triangle 1: not the material";
    case 14: s->tri_object[3] = 3; return "triangle 3: not of object";
    case 15: s->tri_object[0] = 1; return "triangle 0: not of object";
    case 16: s->objects[1].first_triangle = 1; return "'panel': its primitives";
    case 17:
        s->objects[1].num_triangles = 1;
        s->objects[2].first_triangle = 3;
        return "differ in number";
    case 18: s->sphere_object[1] = 0; return "sphere 1: not of object";
    case 19: s->spheres[0].radius = 0; return "sphere 0: centre or radius";
    case 20: s->spheres[0].normal_out = 0; return "normal_out";
    case 21: s->lights[0].value.g = -1; return "light 0: value";
    case 22: s->lights[0].attenuation[2] = 0; return "light 0: attenuation";
    case 23: s->lights[0].kind = LIGHT_DIRECTIONAL; return "light 0: direction";
    case 24: s->lights[0].kind = LIGHT_SPOT; return "light 0: direction";
    case 25:
        s->lights[0].kind = LIGHT_SPOT;
        s->lights[0].axis = v3(0, 1, 0);
        s->lights[0].cos_cutoff = 1;
        return "light 0: cone";
    case 26:
        s->lights[0].kind = LIGHT_ENVIRONMENT;
        return "light 0: more than one environment, or none";
    case 27:
        for (int k = 6; k < 12; k++)
            s->position[k] = v3(1, 1, 1);
        return "'panel': emits, but its area is 0";
    default: return "no such way";
    }
}

TEST(bad_scenes_are_refused)
{
    for (int way = 0; way < WAYS; way++) {
        OWN(scene) s = make_scene();
        struct err e = {""};
        const char *says = spoil(&s, way);
        REFUSES(scene_finish(&s, "room.dae", &e), says);
        assert_memory_equal(e.msg, "room.dae: ", 10);
    }
}

/* Every number of a scene at and beyond the ends of where it may be, one at a time. */
enum part { MATERIAL, GLASS, ROUGH, PLASTIC, POINT, SPOT, SUN, SPHERE, NUM_PARTS };

static float *number_of(struct scene *s, enum part part, size_t offset)
{
    switch (part) {
    case GLASS: s->materials[0].kind = MATERIAL_GLASS; break;
    case ROUGH: s->materials[0].kind = MATERIAL_MICROFACET; break;
    case PLASTIC: s->materials[0].kind = MATERIAL_PLASTIC; break;
    case SPOT: s->lights[0].kind = LIGHT_SPOT; break;
    case SUN: s->lights[0].kind = LIGHT_DIRECTIONAL; break;
    case MATERIAL:
    case POINT:
    case SPHERE:
    case NUM_PARTS: break;
    }
    s->materials[0].ior = 1.5f;
    s->materials[0].alpha = 0.5f;
    s->lights[0].axis = s->lights[0].to_light = v3(0, 0, 1);
    s->lights[0].cos_cutoff = 0.5f;
    char *base = part == SPHERE ? (char *)&s->spheres[1]
                 : part < POINT ? (char *)&s->materials[0]
                                : (char *)&s->lights[0];
    return (float *)(void *)(base + offset);
}

/* A scene without surfaces is accepted; its bounds are 0. */
TEST(nothing_is_a_scene)
{
    OWN(scene) s = make_scene();
    struct err e = {""};
    s.num_triangles = s.num_spheres = s.num_objects = 0;
    MUST(scene_finish(&s, "room.dae", &e));
    assert_true(s.num_lights == 1 && length(s.bounds_min) == 0 && length(s.frame_max) == 0);
}

TEST(every_number_is_looked_at)
{
#define AT(type, member)   offsetof(struct type, member)
#define EACH(type, member) AT(type, member), 3
/* good, and bad */
/* clang-format off */
#define SHARE    {0, 1, 0.5f}, {-1e-6f, 1.0001f, NAN, inf}
#define POSITIVE {0, 1, 1e30f}, {-1e-6f, -1, NAN, inf}
    /* clang-format on */
    const float inf = INFINITY, low = MICROFACET_MIN_ALPHA;
    const struct {
        enum part part;
        size_t offset;
        int count; /* numbers that follow each other */
        float good[3], bad[4];
        const char *says;
    } of[] = {
        {MATERIAL, EACH(material, reflectance), SHARE, "reflectance"},
        {GLASS, EACH(material, transmittance), SHARE, "transmittance"},
        {MATERIAL, EACH(material, radiance), POSITIVE, "'paint': radiance"},
        {ROUGH, EACH(material, eta), {0, 1, 1e9f}, {-1e-6f, -1, NAN, inf}, "index of refraction"},
        {ROUGH, EACH(material, k), {0, 1, 1e9f}, {-1e-6f, -1, NAN, inf}, "index of refraction"},
        {ROUGH, AT(material, alpha), 1, {low, 1, 1e9f}, {0.99f * low, -1, NAN, inf}, "roughness"},
        {PLASTIC, AT(material, alpha), 1, {low, 1, 1e9f}, {0.99f * low, -1, NAN, inf}, "roughness"},
        {PLASTIC, EACH(material, specular), SHARE, "highlight"},
        {PLASTIC, EACH(material, mirror), SHARE, "highlight"},
        {GLASS,
         AT(material, ior),
         1,
         {1, 1 / MAX_IOR, MAX_IOR},
         {0.99f / MAX_IOR, 1.01f * MAX_IOR, NAN, inf},
         "index of refraction"},
        {POINT, EACH(light, value), POSITIVE, "light 0: value"},
        {POINT, EACH(light, position), {0, -1, 1e30f}, {NAN, -NAN, inf, -inf}, "light 0: position"},
        {SPOT, EACH(light, position), {0, -1, 1e30f}, {NAN, -NAN, inf, -inf}, "light 0: position"},
        {POINT,
         EACH(light, attenuation),
         {2, 1, 1e30f},
         {-1e-6f, -1, NAN, inf},
         "light 0: attenuation"},
        {SPOT, EACH(light, axis), {0, 0, 0}, {2, -2, NAN, inf}, "light 0: direction"},
        {SUN, EACH(light, to_light), {0, 0, 0}, {2, -2, NAN, inf}, "light 0: direction"},
        {SPOT, AT(light, cos_cutoff), 1, {0, 0.5f, 0.999f}, {-1e-6f, 1, NAN, inf}, "light 0: cone"},
        {SPOT, AT(light, exponent), 1, POSITIVE, "light 0: cone or exponent"},
        {SPHERE, EACH(sphere, centre), {0, -1, 1e15f}, {NAN, -NAN, inf, -inf}, "sphere 1: centre"},
        {SPHERE,
         AT(sphere, radius),
         1,
         {1e-6f, 1, 1e9f},
         {0, -1, NAN, inf},
         "sphere 1: centre or radius"},
        {SPHERE, AT(sphere, normal_out), 1, {1, -1, 1}, {0, 0.5f, -2, NAN}, "normal_out"},
    };
    for (size_t i = 0; i < COUNT(of); i++)
        for (int k = 0; k < of[i].count; k++)
            for (int v = 0; v < 7; v++) {
                OWN(scene) s = make_scene();
                struct err e = {""};
                float *x = number_of(&s, of[i].part, of[i].offset) + k;
                bool is_direction = strstr(of[i].says, "direction") != NULL;
                if (v < 3 && !is_direction) /* a direction is good as it is */
                    *x = of[i].good[v];
                else if (v >= 3)
                    *x = of[i].bad[v - 3];
                bool ok = scene_finish(&s, "room.dae", &e);
                if (ok != (v < 3) || (!ok && strstr(e.msg, of[i].says) == NULL))
                    fail_msg("%s, number %d, %g: '%s'", of[i].says, k, (double)*x, e.msg);
            }
#undef POSITIVE
#undef SHARE
#undef EACH
#undef AT
}
