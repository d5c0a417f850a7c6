/* Materials, lights, cameras and the two dialects of the COLLADA loader. Expected numbers are derived
 * by hand beside each test. */

#include "renderer/scene/environment.h"
#include "dae.h"
#include "tests/support/test.h"

static const double DEGREE = 3.14159265358979323846 / 180;

#define TRI "<node name=\"n\">" INSTANCE("tri") "</node>"

/* A document whose triangle wears an effect with that body. */
#define WEAR(body)                                                                                 \
    {                                                                                              \
        .libraries = "<library_effects>" EFFECT(                                                   \
            "x",                                                                                   \
            body) "</library_effects><library_materials>" MATERIAL("x") "</library_materials>",    \
        .nodes = "<node name=\"n\"><instance_geometry url=\"#tri\">" BIND(                         \
            "x") "</instance_geometry></node>"                                                     \
    }

static struct material load_material(struct dae d, enum dialect dialect)
{
    struct scene s = dae_must_load(d, dialect);
    struct material m = s.materials[s.objects[0].material];
    bool emits = !rgb_is_zero(m.radiance);
    assert_int_equal(s.num_lights, emits ? 1 : 0);
    assert_int_equal(s.tri_light[0], emits ? 0 : -1);
    scene_free(&s);
    return m;
}

static void assert_rgb(rgb c, float r, float g, float b)
{
    assert_vec(v3(c.r, c.g, c.b), r, g, b);
}

TEST(diffuse_and_emission_of_the_common_profile)
{
    static const char *const SHADERS[] = {"lambert", "phong", "blinn"};
    for (int i = 0; i < 3; i++) {
        char libraries[1024];
        snprintf(
            libraries, sizeof libraries,
            "<library_effects>" EFFECT(
                "x",
                COMMON("<%s><emission><color>1 2 3 1</color></emission><diffuse>"
                       "<color>.1 .2 .3</color></diffuse></%s>")) "</library_effects>"
                                                                  "<library_materials>" MATERIAL(
                                                                      "x") "</library_materials>",
            SHADERS[i], SHADERS[i]);
        struct dae d = WEAR("");
        d.libraries = libraries;
        struct material m = load_material(d, DIALECT_AUTO);
        assert_rgb(m.reflectance, .1f, .2f, .3f);
        assert_rgb(m.radiance, 1, 2, 3);
        assert_true(m.radiance_both_sides);
        assert_string_equal(m.name, "x");
    }
    struct material m =
        load_material((struct dae)WEAR(COMMON(
                          "<constant><emission><color>4 0 0 1</color></emission></constant>")),
                      DIALECT_AUTO);
    assert_rgb(m.reflectance, 0, 0, 0);
    assert_rgb(m.radiance, 4, 0, 0);
}

/* All of these say "opaque", by the formulas of the COLLADA specification. */
TEST(opaque_in_every_spelling)
{
    static const char *const SPELLINGS[] = {
        "<transparency><float>1</float></transparency>",
        "<transparent opaque=\"A_ONE\"><color>1 0 0 1</color></transparent>",
        "<transparent opaque=\"RGB_ZERO\"><color>0 0 0 1</color></transparent>",
        "<transparent opaque=\"RGB_ZERO\"><color>1 1 1 1</color></transparent>"
        "<transparency><float>0</float></transparency>",
        "<transparent opaque=\"A_ZERO\"><color>1 1 1 0</color></transparent>",
        "<transparent opaque=\"RGB_ONE\"><color>1 1 1 0</color></transparent>",
        "<reflective><color>1 1 1 1</color></reflective><reflectivity><float>0</float>"
        "</reflectivity>",
    };
    for (size_t i = 0; i < sizeof SPELLINGS / sizeof *SPELLINGS; i++) {
        char libraries[1024];
        snprintf(libraries, sizeof libraries,
                 "<library_effects>" EFFECT(
                     "x", COMMON("<phong><diffuse><color>1 1 1 "
                                 "1</color></diffuse>%s</phong>")) "</"
                                                                   "library_"
                                                                   "effects><"
                                                                   "library_"
                                                                   "materials"
                                                                   ">" MATERIAL("x") "</"
                                                                                     "libr"
                                                                                     "ary_"
                                                                                     "mate"
                                                                                     "rial"
                                                                                     "s>",
                 SPELLINGS[i]);
        struct dae d = WEAR("");
        d.libraries = libraries;
        struct scene s = dae_must_load(d, DIALECT_COLLADA);
        scene_free(&s);
    }
    dae_must_fail((struct dae)WEAR(COMMON("<phong><transparent opaque=\"RGB_ZERO\">"
                                          "<color>0 1 0 1</color></transparent></phong>")),
                  DIALECT_COLLADA, "transparency");
    dae_must_fail((struct dae)WEAR(COMMON("<phong><transparent><color>0 1 0 .5</color>"
                                          "</transparent></phong>")),
                  DIALECT_COLLADA, "transparency");
}

/* The assignment reads the diffuse colour and nothing else. */
TEST(cgl_ignores_what_the_assignment_ignores)
{
    struct material m = load_material(
        (struct dae)WEAR(COMMON("<phong><diffuse><color>.1 .2 .3 1</color></diffuse><specular>"
                                "<texture texture=\"t\"/></specular><transparency><float>.5</float>"
                                "</transparency></phong>")),
        DIALECT_CGL);
    assert_rgb(m.reflectance, .1f, .2f, .3f);
    m = load_material((struct dae)WEAR(COMMON("<phong/>")), DIALECT_CGL);
    assert_rgb(m.reflectance, .5f, .5f, .5f);
    m = load_material((struct dae)WEAR(""), DIALECT_CGL);
    assert_rgb(m.reflectance, .5f, .5f, .5f);
    dae_must_fail((struct dae)WEAR(COMMON("<phong><diffuse><texture texture=\"t\"/></diffuse>"
                                          "</phong>")),
                  DIALECT_CGL, "texture");
    dae_must_fail((struct dae)WEAR(COMMON("<phong><emission><color>1 1 1</color></emission>"
                                          "</phong>")),
                  DIALECT_CGL, "emission");
}

TEST(emission_of_the_two_profiles)
{
#define DIFFUSE COMMON("<lambert><diffuse><color>.1 .2 .3 1</color></diffuse></lambert>")
    struct material m = load_material(
        (struct dae)WEAR(DIFFUSE EXTRA(
            "ASSAY", "<emission><radiance>1 2 3</radiance><sides>1</sides></emission>")),
        DIALECT_AUTO);
    assert_rgb(m.reflectance, .1f, .2f, .3f);
    assert_rgb(m.radiance, 1, 2, 3);
    assert_false(m.radiance_both_sides);
    m = load_material(
        (struct dae)WEAR(DIFFUSE EXTRA(
            "ASSAY", "<emission><sides>2</sides><radiance>1 2 3</radiance></emission>")),
        DIALECT_AUTO);
    assert_true(m.radiance_both_sides);
    m = load_material((struct dae)WEAR(DIFFUSE EXTRA("blender", "<toon/>") EXTRA(
                          "CGL", "<emission><radiance>1 2 3</radiance></emission>")),
                      DIALECT_AUTO);
    assert_rgb(m.reflectance, 0, 0, 0);
    assert_rgb(m.radiance, 1, 2, 3);
    assert_true(m.radiance_both_sides);
    dae_must_fail(
        (struct dae)WEAR(COMMON("<phong><emission><color>1 1 1</color></emission></phong>")
                             EXTRA("ASSAY", "<emission><radiance>1 1 1</radiance>"
                                            "<sides>1</sides></emission>")),
        DIALECT_AUTO, "give one");
}

/* Two groups of one mesh: an object each, named by the symbol; the third uses the first's material. */
TEST(groups_get_their_own_material)
{
#define GROUP(symbol)                                                                              \
    "<triangles material=\"" symbol "\" count=\"1\"><input semantic=\"VERTEX\" source=\"#v\" "     \
    "offset=\"0\"/><p>0 1 2</p></triangles>"
#define BOUND(symbol, target) "<instance_material symbol=\"" symbol "\" target=\"#" target "\"/>"
    struct scene s = dae_must_load(
        (struct dae){
            .libraries = "<library_effects>" EFFECT(
                "red",
                COMMON(
                    "<lambert><diffuse><color>1 0 0 1</color>"
                    "</diffuse></lambert>")) "</"
                                             "library_effects><library_"
                                             "materials>" MATERIAL(
                                                 "red") "</"
                                                        "library_"
                                                        "materials><"
                                                        "library_"
                                                        "geometries"
                                                        ">" GEOMETRY(
                                                            "g",
                                                            SOURCE(
                                                                "p", 9, 3,
                                                                "0 0 0 1 0 0 0 1 0") VERTICES("v",
                                                                                              "p")
                                                                GROUP("a") GROUP("b") GROUP(
                                                                    "c")) "</library_geometries>",
            .nodes = "<node name=\"n\"><instance_geometry url=\"#g\"><bind_material>"
                     "<technique_common>" BOUND("b", "grey") BOUND("c", "red")
                         BOUND("a", "red") "</technique_common></bind_material></"
                                           "instance_geometry></node>"},
        DIALECT_AUTO);
    assert_int_equal(s.num_objects, 3);
    assert_string_equal(s.objects[0].name, "n:a");
    assert_string_equal(s.objects[1].name, "n:b");
    assert_int_equal(s.num_materials, 2);
    assert_int_equal(s.objects[0].material, s.objects[2].material);
    assert_string_equal(s.materials[s.objects[0].material].name, "red");
    assert_string_equal(s.materials[s.tri_material[1]].name, "grey");
    scene_free(&s);
}

TEST(without_a_binding)
{
    const struct dae bare = {.nodes = "<node><instance_geometry url=\"#tri\"/></node>"};
    dae_must_fail(bare, DIALECT_COLLADA, "no material bound to symbol 'm'");
    struct material m = load_material(bare, DIALECT_CGL);
    assert_rgb(m.reflectance, .5f, .5f, .5f);
}

/* Lights. */

#define LIGHT(common, extra)                                                                       \
    "<library_lights><light id=\"l\"><technique_common>" common "</technique_common>" extra        \
    "</light></library_lights>"
#define SHINE(transforms)                                                                          \
    TRI "<node name=\"lamp\">" transforms "<instance_light url=\"#l\"/></node>"
#define POINT(attenuation) "<point><color>10 20 30</color>" attenuation "</point>"

/* In a file in centimetres, c + l d + q d^2 at a distance of d cm must be what the scene has at d/100
 * m: 2 + 3 d + 4 d^2 = 2 + 300 (d/100) + 40000 (d/100)^2. Pure falloff 4 d^2 is 40000 (d/100)^2, so
 * an intensity of value / 40000. */
TEST(point_lights)
{
    struct scene s = dae_must_load((struct dae){.libraries = LIGHT(POINT(""), ""),
                                                .nodes = SHINE("<translate>1 2 3</translate>")},
                                   DIALECT_AUTO);
    assert_int_equal(s.num_lights, 1);
    assert_int_equal(s.lights[0].kind, LIGHT_POINT);
    assert_vec(s.lights[0].position, 1, 2, 3);
    assert_rgb(s.lights[0].value, 10, 20, 30);
    assert_vec(
        v3(s.lights[0].attenuation[0], s.lights[0].attenuation[1], s.lights[0].attenuation[2]), 1,
        0, 0);
    scene_free(&s);
    s = dae_must_load(
        (struct dae){.asset = "<unit meter=\"0.01\"/>",
                     .libraries = LIGHT(POINT("<constant_attenuation>2</constant_attenuation>"
                                              "<linear_attenuation>3</linear_attenuation>"
                                              "<quadratic_attenuation>4</quadratic_attenuation>"),
                                        ""),
                     .nodes = SHINE("")},
        DIALECT_AUTO);
    assert_near(s.lights[0].attenuation[0], 2, 0);
    assert_near(s.lights[0].attenuation[1], 300, 1e-4);
    assert_near(s.lights[0].attenuation[2], 40000, 1e-2);
    assert_rgb(s.lights[0].value, 10, 20, 30);
    scene_free(&s);
    s = dae_must_load(
        (struct dae){.asset = "<unit meter=\"0.01\"/>",
                     .libraries = LIGHT(POINT("<constant_attenuation>0</constant_attenuation>"
                                              "<quadratic_attenuation>4</quadratic_attenuation>"),
                                        ""),
                     .nodes = SHINE("")},
        DIALECT_AUTO);
    assert_near(s.lights[0].attenuation[0], 0, 0);
    assert_near(s.lights[0].attenuation[2], 1, 0);
    assert_near(s.lights[0].value.r, 10 / 40000.0, 1e-9);
    scene_free(&s);
    /* In the assignment the same light does not fall off. */
    s = dae_must_load(
        (struct dae){.libraries = LIGHT(POINT("<constant_attenuation>0</constant_attenuation>"
                                              "<quadratic_attenuation>4</quadratic_attenuation>"),
                                        ""),
                     .nodes = SHINE("")},
        DIALECT_CGL);
    assert_near(s.lights[0].attenuation[0], 1, 0);
    assert_near(s.lights[0].attenuation[2], 0, 0);
    assert_rgb(s.lights[0].value, 10, 20, 30);
    scene_free(&s);
}

/* It shines along -Z. Turned by -90 degrees about x, +Z becomes +Y: a light from above; where it
 * stands does not matter. In the assignment the direction is that of the point M (0,0,-1): turned,
 * (0,-1,0), and moved, (3,-1,4), over sqrt(26). */
TEST(directional_lights)
{
    const struct dae d = {.libraries = LIGHT("<directional><color>1 2 3</color></directional>", ""),
                          .nodes = SHINE("<translate>3 0 4</translate><rotate>1 0 0 -90</rotate>"
                                         "<scale>2 2 2</scale>")};
    struct scene s = dae_must_load(d, DIALECT_AUTO);
    assert_int_equal(s.lights[0].kind, LIGHT_DIRECTIONAL);
    assert_vec(s.lights[0].to_light, 0, 1, 0);
    assert_rgb(s.lights[0].value, 1, 2, 3);
    scene_free(&s);
    const struct dae unscaled = {
        .libraries = d.libraries,
        .nodes = SHINE("<translate>3 0 4</translate><rotate>1 0 0 -90</rotate>")};
    s = dae_must_load(unscaled, DIALECT_CGL);
    assert_vec(s.lights[0].to_light, 3 / sqrt(26), -1 / sqrt(26), 4 / sqrt(26));
    scene_free(&s);
}

/* Shines along -Z of its node, which looks along world -X after a quarter turn about Y. The angle is
 * that of the whole cone; the falloff is that of a point light. */
TEST(spot_lights)
{
    struct scene s = dae_must_load(
        (struct dae){.asset = "<unit meter=\"0.01\"/>",
                     .libraries = LIGHT("<spot><color>10 20 30</color>"
                                        "<constant_attenuation>0</constant_attenuation>"
                                        "<quadratic_attenuation>4</quadratic_attenuation>"
                                        "<falloff_angle>60</falloff_angle>"
                                        "<falloff_exponent>1.5</falloff_exponent></spot>",
                                        ""),
                     .nodes = SHINE("<translate>100 200 300</translate><rotate>0 1 0 90</rotate>"
                                    "<scale>3 3 3</scale>")},
        DIALECT_AUTO);
    assert_int_equal(s.num_lights, 1);
    assert_int_equal(s.lights[0].kind, LIGHT_SPOT);
    assert_vec(s.lights[0].position, 1, 2, 3);
    assert_vec(s.lights[0].axis, -1, 0, 0);
    assert_near(s.lights[0].cos_cutoff, 0.8660254038, 1e-6);
    assert_near(s.lights[0].exponent, 1.5, 0);
    assert_rgb(s.lights[0].value, 10 / 40000., 20 / 40000., 30 / 40000.);
    assert_near(s.lights[0].attenuation[0], 0, 0);
    assert_near(s.lights[0].attenuation[2], 1, 0);
    scene_free(&s);
    s = dae_must_load((struct dae){.libraries = LIGHT("<spot><color>1 1 1</color></spot>", ""),
                                   .nodes = SHINE("")},
                      DIALECT_AUTO);
    assert_near(s.lights[0].cos_cutoff, 0, 0);
    assert_near(s.lights[0].exponent, 0, 0);
    assert_near(s.lights[0].attenuation[0], 1, 0);
    assert_vec(s.lights[0].axis, 0, 0, -1);
    scene_free(&s);
}

/* Everywhere the same, and seen; in the assignment from above only, and hidden. */
TEST(ambient_light)
{
    static const struct dae AMBIENT = {
        .libraries = LIGHT("<ambient><color>1 2 3</color></ambient>", ""), .nodes = SHINE("")};
    for (int cgl = 0; cgl < 2; cgl++) {
        struct scene s = dae_must_load(AMBIENT, cgl ? DIALECT_CGL : DIALECT_COLLADA);
        assert_int_equal(s.num_lights, 1);
        assert_int_equal(s.lights[0].kind, LIGHT_ENVIRONMENT);
        assert_int_equal(s.environment_light, 0);
        assert_non_null(s.environment);
        assert_rgb(environment_radiance(s.environment, v3(0, 1, 0)), 1, 2, 3);
        rgb below = environment_radiance(s.environment, v3(0, -1, 0));
        assert_rgb(below, cgl ? 0 : 1, cgl ? 0 : 2, cgl ? 0 : 3);
        assert_int_equal(environment_is_hidden(s.environment), cgl);
        scene_free(&s);
    }
}

TEST(black_ambient_light_is_nothing)
{
    struct scene s = dae_must_load(
        (struct dae){.libraries = LIGHT("<ambient><color>0 0 0</color></ambient>", ""),
                     .nodes = SHINE("")},
        DIALECT_AUTO);
    assert_int_equal(s.num_lights, 0);
    scene_free(&s);
}

#define RECTANGLE                                                                                  \
    EXTRA("ASSAY", "<rectangle><radiance>7 8 9</radiance><width>2</width><height>3</height>"       \
                   "</rectangle>")

/* The four corners (+-x, +-y) at z, each once or twice among the six vertices, and all of area. */
static void check_rectangle(const struct scene *s, double x, double y, double z)
{
    const struct light *l = &s->lights[s->num_lights - 1];
    assert_int_equal(l->kind, LIGHT_TRIANGLES);
    assert_int_equal(l->count, 2);
    assert_near(l->area, 4 * x * y, 1e-5);
    int seen[4] = {0, 0, 0, 0};
    for (uint32_t k = 3 * l->first; k < 3 * l->first + 6; k++) {
        vec3 p = s->position[k];
        assert_near(fabsf(p.x), x, 1e-6);
        assert_near(fabsf(p.y), y, 1e-6);
        assert_near(p.z, z, 1e-6);
        seen[(p.x > 0) + 2 * (p.y > 0)]++;
    }
    for (int i = 0; i < 4; i++)
        assert_true(seen[i] == 1 || seen[i] == 2);
    const struct object *o = &s->objects[s->tri_object[l->first]];
    assert_string_equal(o->name, "lamp");
    const struct material *m = &s->materials[o->material];
    assert_rgb(m->reflectance, 0, 0, 0);
    assert_false(m->radiance_both_sides);
    assert_int_equal(s->tri_light[l->first], s->num_lights - 1);
    assert_int_equal(s->tri_light[l->first + 1], s->num_lights - 1);
}

/* It shines along its -Z, also where it is mirrored; turned by -90 degrees about x, -Z becomes -Y. */
TEST(rectangles_are_geometry)
{
    static const char *const MIRRORS[] = {"", "<scale>-1 1 1</scale>", "<scale>1 -1 1</scale>"};
    char nodes[1024];
    for (int i = 0; i < 3; i++) {
        snprintf(nodes, sizeof nodes, SHINE("<translate>0 0 5</translate>%s"), MIRRORS[i]);
        struct scene s = dae_must_load(
            (struct dae){.libraries = LIGHT("", RECTANGLE), .nodes = nodes}, DIALECT_AUTO);
        assert_int_equal(s.num_lights, 1);
        check_rectangle(&s, 1, 1.5, 5);
        assert_rgb(s.materials[s.tri_material[1]].radiance, 7, 8, 9);
        for (uint32_t t = 1; t < 3; t++) {
            assert_vec(front(&s, t), 0, 0, -1);
            assert_vec(s.normal[3 * t], 0, 0, -1);
        }
        scene_free(&s);
    }
    /* Mirrored along z it shines the other way. */
    struct scene s = dae_must_load(
        (struct dae){.libraries = LIGHT("", RECTANGLE), .nodes = SHINE("<scale>1 1 -1</scale>")},
        DIALECT_AUTO);
    assert_vec(front(&s, 1), 0, 0, 1);
    scene_free(&s);
    s = dae_must_load((struct dae){.libraries = LIGHT("", RECTANGLE),
                                   .nodes = SHINE("<rotate>1 0 0 -90</rotate>")},
                      DIALECT_AUTO);
    assert_vec(front(&s, 1), 0, -1, 0);
    assert_vec(front(&s, 2), 0, -1, 0);
    scene_free(&s);
}

#define AREA EXTRA("CGL", "<area><color>10 10 10</color></area>")

/* The assignment's unit square, scaled to 0.6 x 0.8 by the node. */
TEST(area_light_of_the_assignment)
{
    struct scene s = dae_must_load(
        (struct dae){.libraries = LIGHT(POINT(""), AREA),
                     .nodes = SHINE("<matrix>.6 0 0 0 0 .8 0 0 0 0 1 2 0 0 0 1</matrix>")},
        DIALECT_AUTO);
    assert_int_equal(s.dialect, DIALECT_CGL);
    assert_int_equal(s.num_lights, 1);
    check_rectangle(&s, 0.3, 0.4, 2);
    assert_vec(front(&s, 1), 0, 0, -1);
    scene_free(&s);
}

/* An emissive mesh of 0.8 x 0.6, so turned by 90 degrees, scaled by `size` and moved to `place`, and
 * an area light of 0.6 x 0.8 at z = 2. The scene is about 10 in size by a triangle far off, so both within 0.1
 * is the same lamp. */
static struct scene load_twins(const char *place, const char *size)
{
    char nodes[2048];
    snprintf(
        nodes, sizeof nodes,
        "<node><translate>9 0 0</translate>" INSTANCE(
            "tri") "</node>"
                   "<node name=\"glow\"><translate>%s</translate><scale>%s</scale>"
                   "<instance_geometry url=\"#q\">" BIND("x") "</instance_geometry></node>" SHINE(
                       "<matrix>.6 0 0 0 0 .8 0 0 0 0 1 2 0 0 0 1</matrix>"),
        place, size);
    return dae_must_load(
        (struct dae){
            .libraries = "<library_effects>" EFFECT(
                "x",
                EXTRA("CGL",
                      "<emission><radiance>5 5 "
                      "5</radiance></emission>")) "</"
                                                  "library_effects><library_"
                                                  "materials>" MATERIAL(
                                                      "x") "</"
                                                           "library_"
                                                           "materials><"
                                                           "library_"
                                                           "geometries"
                                                           ">" GEOMETRY(
                                                               "q",
                                                               SOURCE("p", 12, 4,
                                                                      "-.4 -.3 0 .4 -.3 0 "
                                                                      ".4 .3 0 -.4 .3 0")
                                                                   VERTICES("v",
                                                                            "p") "<polyli"
                                                                                 "st "
                                                                                 "materia"
                                                                                 "l="
                                                                                 "\"m\" "
                                                                                 "count="
                                                                                 "\"1\"><"
                                                                                 "input "
                                                                                 "semanti"
                                                                                 "c="
                                                                                 "\"VERTE"
                                                                                 "X\" "
                                                                                 "source="
                                                                                 "\"#v\" "
                                                                                 "offset="
                                                                                 "\"0\"/"
                                                                                 "><"
                                                                                 "vcount>"
                                                                                 "4"
                                                                                 "</"
                                                                                 "vcount>"
                                                                                 "<p>0 1 "
                                                                                 "2 "
                                                                                 "3</p></"
                                                                                 "polylis"
                                                                                 "t>") "<"
                                                                                       "/"
                                                                                       "l"
                                                                                       "i"
                                                                                       "b"
                                                                                       "r"
                                                                                       "a"
                                                                                       "r"
                                                                                       "y"
                                                                                       "_"
                                                                                       "g"
                                                                                       "e"
                                                                                       "o"
                                                                                       "m"
                                                                                       "e"
                                                                                       "t"
                                                                                       "r"
                                                                                       "i"
                                                                                       "e"
                                                                                       "s"
                                                                                       ">" LIGHT(
                                                                                           POINT(
                                                                                               ""),
                                                                                           AREA),
            .nodes = nodes},
        DIALECT_AUTO);
}

TEST(twin_of_an_area_light_is_left_out)
{
    struct scene s = load_twins("0 .05 1.99", "1 1 1");
    assert_int_equal(s.num_lights, 1);
    assert_int_equal(s.num_triangles, 4);
    assert_int_equal(s.num_objects, 3);
    assert_string_equal(s.objects[2].name, "lamp");
    assert_int_equal(s.objects[2].first_triangle, 2);
    assert_int_equal(s.tri_object[2], 2);
    check_rectangle(&s, 0.3, 0.4, 2);
    assert_non_null(strstr(s.note, "lamp"));
    assert_non_null(strstr(s.note, "glow"));
    assert_null(strchr(s.note, '\n'));
    /* The assignment's camera is framed on the mesh, not on the light: x from -0.4 to 10. */
    assert_vec(s.frame_min, -0.4, -0.25, 0);
    assert_vec(s.frame_max, 10, 1, 1.99);
    assert_vec(s.bounds_min, -0.3, -0.4, 0);
    assert_vec(s.bounds_max, 10, 1, 2);
    scene_free(&s);
}

TEST(emissive_mesh_elsewhere_is_a_lamp_of_its_own)
{
    /* Beside it, below it, and of three times its area. */
    static const char *const PLACES[] = {"0 .2 2", "0 0 1.8", "0 0 2"};
    static const char *const SIZES[] = {"1 1 1", "1 1 1", "1 3 1"};
    for (int i = 0; i < 3; i++) {
        struct scene s = load_twins(PLACES[i], SIZES[i]);
        assert_int_equal(s.num_lights, 2);
        assert_int_equal(s.num_triangles, 6);
        assert_string_equal(s.note, "");
        assert_true(s.materials[s.objects[1].material].radiance_both_sides);
        scene_free(&s);
    }
}

/* Cameras. */

#define CAMERA(id, angles)                                                                         \
    "<camera id=\"" id "\"><optics><technique_common><perspective>" angles                         \
    "<znear>.5</znear><zfar>50</zfar></perspective></technique_common></optics></camera>"
#define CAMERAS(cameras)     "<library_cameras>" cameras "</library_cameras>"
#define VIEW(id, transforms) "<node>" transforms "<instance_camera url=\"#" id "\"/></node>"
#define WIDE                 "<xfov>60</xfov><aspect_ratio>1.5</aspect_ratio>"

/* In inches, Z up, scaled (which must not show in the axes), turned about x by 90 degrees so that it
 * looks along the file's +Y and its up is the file's +Z: (0,0,-1) -> (0,1,0), (0,1,0) -> (0,0,1).
 * In the world, (x,y,z) -> (-x,z,y): right (-1,0,0), up (0,1,0), view (0,0,1), so backward (0,0,-1);
 * eye (1,2,3) inches -> (-1,3,2) * 0.0254. */
TEST(camera_pose_angles_and_clips)
{
    struct scene s = dae_must_load(
        (struct dae){.asset = "<unit meter=\"0.0254\"/><up_axis>Z_UP</up_axis>",
                     .libraries = CAMERAS(CAMERA("c", WIDE)),
                     .nodes = TRI VIEW("c", "<translate>1 2 3</translate><rotate>1 0 0 90</rotate>"
                                            "<scale>.4 .3 2</scale>")},
        DIALECT_AUTO);
    const struct scene_camera *c = &s.camera;
    assert_true(c->present);
    assert_vec(c->right, -1, 0, 0);
    assert_vec(c->up, 0, 1, 0);
    assert_vec(c->backward, 0, 0, -1);
    assert_vec(c->eye, -0.0254, 3 * 0.0254, 2 * 0.0254);
    assert_near(c->hfov, 60 * DEGREE, 1e-6);
    assert_near(c->vfov, 0, 0);
    assert_near(c->aspect, 1.5, 0);
    assert_near(c->near, 0.5 * 0.0254, 1e-8);
    assert_near(c->far, 50 * 0.0254, 1e-6);
    scene_free(&s);
    s = dae_must_load((struct dae){.nodes = TRI}, DIALECT_AUTO);
    assert_false(s.camera.present);
    scene_free(&s);
    dae_must_fail((struct dae){.libraries = CAMERAS(CAMERA("c", WIDE)),
                               .nodes = TRI VIEW("c", "<matrix>1 .5 0 0 0 1 0 0 0 0 1 0 0 0 0 1"
                                                      "</matrix>")},
                  DIALECT_AUTO, "shear");
}

/* c = unit(M (0,0,-1,1)) with the translation in it: (3,0,4) - (0,0,1) = (3,0,3), so c = (1,0,1) over
 * root 2, right = Y x c = (1,0,-1) over root 2, up = Y. The vertical angle follows from
 * tan(60/2) / 1.5 = 0.3849: 2 * 21.0517 degrees. */
TEST(camera_of_the_assignment)
{
    struct scene s = dae_must_load(
        (struct dae){.libraries =
                         CAMERAS(CAMERA("c", "<xfov>20</xfov><yfov>10</yfov>") CAMERA("d", WIDE)),
                     .nodes = TRI VIEW("c", "") VIEW("d", "<translate>3 0 4</translate>")},
        DIALECT_CGL);
    const struct scene_camera *c = &s.camera;
    double h = sqrt(0.5);
    assert_true(c->present);
    assert_vec(c->backward, h, 0, h);
    assert_vec(c->right, h, 0, -h);
    assert_vec(c->up, 0, 1, 0);
    assert_vec(c->eye, 3, 0, 4);
    assert_near(c->hfov, 60 * DEGREE, 1e-6);
    assert_near(c->vfov, 2 * 21.0517 * DEGREE, 1e-5);
    scene_free(&s);
    /* The camera of CBgems.dae, whose matrix lacks a number: rows (-1 0 0 0) (0 0 1 3) (0 0 0 0)
     * (0 0 1 0), so M (0,0,-1,1) = (0,2,0), and by Z_UP (0,0,2). */
    s = dae_must_load(
        (struct dae){.asset = "<up_axis>Z_UP</up_axis>",
                     .libraries = CAMERAS(CAMERA("c", WIDE)),
                     .nodes = TRI VIEW("c", "<matrix>-1 0 0 0 0 0 1 3 0 0 0 0 0 0 1</matrix>")},
        DIALECT_CGL);
    assert_vec(s.camera.backward, 0, 0, 1);
    assert_vec(s.camera.right, 1, 0, 0);
    scene_free(&s);
    /* A short matrix is for cameras; geometry below it would be squashed. */
    dae_must_fail(
        (struct dae){.nodes = "<node><matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 1</matrix>" INSTANCE(
                         "tri") "</node>"},
        DIALECT_CGL, "last row");
}

TEST(assignment_without_a_camera)
{
    struct scene s = dae_must_load((struct dae){.nodes = TRI}, DIALECT_CGL);
    const struct scene_camera *c = &s.camera;
    assert_false(c->present);
    assert_vec(c->backward, 0, 0, 1);
    assert_vec(c->right, 1, 0, 0);
    assert_vec(c->up, 0, 1, 0);
    assert_near(c->hfov, 50 * DEGREE, 1e-6);
    assert_near(c->vfov, 35 * DEGREE, 1e-6);
    assert_near(c->near, 0.01, 1e-9);
    assert_near(c->far, 100, 0);
    scene_free(&s);
}

/* A file is the assignment's if it has a technique of its profile; ours alone does not make it so. */
TEST(dialect_is_found_in_the_file)
{
    static const struct {
        const char *extra;
        enum dialect expected;
    } CASES[] = {{"", DIALECT_COLLADA}, {RECTANGLE, DIALECT_COLLADA}, {AREA, DIALECT_CGL}};
    for (int i = 0; i < 3; i++) {
        char libraries[1024];
        snprintf(libraries, sizeof libraries, LIGHT("<point><color>1 1 1</color></point>", "%s"),
                 CASES[i].extra);
        const struct dae d = {.libraries = libraries, .nodes = SHINE("")};
        struct scene s = dae_must_load(d, DIALECT_AUTO);
        assert_int_equal(s.dialect, CASES[i].expected);
        scene_free(&s);
        s = dae_must_load(d, DIALECT_CGL);
        assert_int_equal(s.dialect, DIALECT_CGL);
        scene_free(&s);
        if (CASES[i].expected == DIALECT_CGL)
            dae_must_fail(d, DIALECT_COLLADA, "--dialect cgl");
    }
}
