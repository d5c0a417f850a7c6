/* <light> as it is instanced. */
#include "collada_internal.h"
#include "renderer/scene/environment.h"

#include <float.h>
#include <string.h>

/* Reads the attenuation, for distances in metres. A pure inverse-square falloff is brought to the physical
 * form {0, 0, 1}, in which the value is a radiant intensity. */
static void read_attenuation(struct loader *ld, const xmlNode *n, struct light *l)
{
    double a[3] = {field_number(ld, n, "constant_attenuation", 1, 0, 1e300),
                   field_number(ld, n, "linear_attenuation", 0, 0, 1e300) / ld->unit,
                   field_number(ld, n, "quadratic_attenuation", 0, 0, 1e300) /
                       (ld->unit * ld->unit)};
    if (a[0] + a[1] + a[2] == 0)
        fail_at(ld, n, "all attenuations of the light are 0");
    if (!(a[0] + a[1] + a[2] <= FLT_MAX) || (a[0] == 0 && a[1] == 0 && !(1 / a[2] <= FLT_MAX)))
        fail_at(ld, n, "the attenuation is out of range");
    if (a[0] == 0 && a[1] == 0) {
        l->value = rgb_scale(l->value, (float)(1 / a[2]));
        a[2] = 1;
    }
    for (int i = 0; i < 3; i++)
        l->attenuation[i] = (float)a[i];
}

#define POINT "color constant_attenuation? linear_attenuation? quadratic_attenuation?"

/* <point>, or <spot>: a point light with a cone around its -Z. */
static void add_point(struct loader *ld, const xmlNode *n, const mat4 *m)
{
    bool is_spot = element_is(n, "spot"), is_cgl = ld->dialect == DIALECT_CGL;
    struct light l = {.kind = is_spot ? LIGHT_SPOT : LIGHT_POINT, .attenuation = {1, 0, 0}};
    if (is_spot && is_cgl)
        fail_at(ld, n, "spot lights of the assignment are not supported: they never shone");
    element_check(ld, n, is_spot ? POINT " falloff_angle? falloff_exponent?" : POINT);
    l.value = field_color(ld, n, "color", FLT_MAX);
    l.position = build_place(ld, n, "the light", m, d3(0, 0, 0));
    /* The assignment's point lights do not fall off, whatever the file says. */
    if (!is_cgl)
        read_attenuation(ld, n, &l);
    if (is_spot) {
        double angle = field_number(ld, n, "falloff_angle", 180, 0.1, 180);
        l.cos_cutoff = angle < 180 ? (float)cos(0.5 * angle * (PI / 180)) : 0;
        l.exponent = (float)field_number(ld, n, "falloff_exponent", 0, 0, 1e6);
        l.axis = neg(build_direction(ld, n, mat4_column(m, 2)));
    }
    build_add_light(ld, &l);
}

/* It shines along its -Z. The assignment transforms (0,0,-1) as a point, with the translation, and
 * takes the result as the direction towards the light. */
static void add_directional(struct loader *ld, const xmlNode *n, const mat4 *m)
{
    element_check(ld, n, "color");
    dvec3 to_light = ld->dialect == DIALECT_CGL ? mat4_point(m, d3(0, 0, -1)) : mat4_column(m, 2);
    build_add_light(ld, &(struct light){.kind = LIGHT_DIRECTIONAL,
                                        .value = field_color(ld, n, "color", FLT_MAX),
                                        .to_light = build_direction(ld, n, to_light)});
}

/* Adds a rectangle that emits to its -Z side, as geometry, so that light sampling and rays find the
 * same thing. */
static void add_lamp(struct loader *ld, const xmlNode *n, const char *name, const mat4 *m,
                     double width, double height, rgb radiance)
{
    struct material lamp = {.kind = MATERIAL_DIFFUSE, .radiance = radiance};
    double sign = build_transform_sign(ld, n, m), x = width / 2, y = height / 2;
    unsigned dropped = ld->scene.num_degenerate;
    build_copy_name(lamp.name, sizeof lamp.name, name);
    build_begin_object(ld, name, NULL, build_add_material(ld, &lamp), true);
    /* Counter-clockwise seen from -Z. */
    const dvec3 p[4] = {{-x, -y, 0}, {-x, y, 0}, {x, y, 0}, {x, -y, 0}};
    for (int t = 0; t < 2; t++) {
        struct corner c[3] = {{.position = p[0]}, {.position = p[1 + t]}, {.position = p[2 + t]}};
        build_add_triangle(ld, n, m, sign, c, NULL);
    }
    if (ld->scene.num_degenerate != dropped)
        fail_at(ld, n, "the light has no area");
}

/* <rectangle>, or the assignment's <area>, which is 1 x 1. */
static void add_rectangle(struct loader *ld, const xmlNode *n, const char *name, const mat4 *m)
{
    bool is_area = element_is(n, "area");
    element_check(ld, n, is_area ? "color" : "radiance width height");
    add_lamp(ld, n, name, m, field_number(ld, n, "width", 1, ANY_LENGTH),
             field_number(ld, n, "height", 1, ANY_LENGTH),
             field_color(ld, n, is_area ? "color" : "radiance", FLT_MAX));
}

static void add_ambient(struct loader *ld, const xmlNode *n)
{
    element_check(ld, n, "color");
    rgb color = field_color(ld, n, "color", FLT_MAX);
    if (rgb_is_zero(ld->ambient) && !rgb_is_zero(color))
        build_add_light(ld, &(struct light){.kind = LIGHT_ENVIRONMENT});
    ld->ambient = rgb_add(ld->ambient, color);
}

void light_finish(struct loader *ld)
{
    if (ld->failed || rgb_is_zero(ld->ambient))
        return;
    ld->scene.environment = ld->dialect == DIALECT_CGL
                                ? environment_upper_half(ld->ambient, ld->err)
                                : environment_constant(ld->ambient, ld->err);
    if (ld->scene.environment == NULL)
        element_fail_memory(ld);
}

/* The technique that Blender's exporter adds to a light from 2.80 on; NULL if there is none or the light's falloff was
 * edited. */
static const xmlNode *blender_technique(const struct loader *ld, const xmlNode *light,
                                        const xmlNode *kind)
{
    const xmlNode *t = element_child(element_child(light, "extra"), "technique"),
                  *falloff = element_child(kind, "constant_attenuation");
    const char *profile = element_attribute(t, "profile");
    bool is_its = profile != NULL && strcmp(profile, "blender") == 0 && falloff != NULL &&
                  falloff->children != NULL &&
                  strcmp((const char *)falloff->children->content, "1") == 0;
    return is_its && ld->blender_version >= 2.8 && ld->dialect == DIALECT_COLLADA ? t : NULL;
}

/* Blender's exporter writes colour times watts as if that were an intensity, with a falloff that no
 * renderer of Blender's has, and an area light as a point. Turns the light added last, a point or a
 * spot, into what Cycles would make of it. */
static void mean_blender(struct loader *ld, const xmlNode *technique, const char *name,
                         const mat4 *m)
{
    enum { BLENDER_AREA = 4, BLENDER_SQUARE = 0, BLENDER_RECTANGLE = 1 };
    if (!element_check(ld, technique, "type area_shape spotblend area_size area_sizey *"))
        return;
    struct light *l = &ld->scene.lights[ld->scene.num_lights - 1];
    double type = field_number(ld, technique, "type", 0, ANY_NUMBER),
           shape = field_number(ld, technique, "area_shape", 0, ANY_NUMBER),
           width = field_number(ld, technique, "area_size", 0, ANY_NUMBER),
           height = field_number(ld, technique, "area_sizey", 0, ANY_NUMBER);
    if (type != BLENDER_AREA) {
        l->value = rgb_scale(l->value, (float)(ld->unit * ld->unit / (4 * PI)));
        l->attenuation[0] = l->attenuation[1] = 0;
        l->attenuation[2] = 1;
        l->exponent = l->kind == LIGHT_SPOT; /* Cycles' cones are dimmer towards their edge */
        ld->num_left_out[LEFT_OUT_RADIUS]++;
        ld->num_left_out[LEFT_OUT_BLEND] +=
            l->kind == LIGHT_SPOT && field_number(ld, technique, "spotblend", 0, ANY_NUMBER) > 0;
        return;
    }
    if (shape != BLENDER_SQUARE && shape != BLENDER_RECTANGLE)
        fail_at(ld, technique, "a round area light of Blender is not supported");
    if (shape == BLENDER_SQUARE)
        height = width;
    if (!(width > 0 && height > 0))
        fail_at(ld, technique, "an area light of Blender without area");
    rgb radiance = rgb_scale(l->value, (float)(0.25 / (width * height)));
    ld->scene.num_lights--;
    add_lamp(ld, technique, name, m, width, height, radiance);
}

void light_instance(struct loader *ld, const xmlNode *instance, const xmlNode *light,
                    const char *node_name, const mat4 *m)
{
    element_check(ld, instance, "extra*");
    element_check(ld, light, "asset? technique_common? technique* extra*");
    build_transform_sign(ld, instance, m);
    const xmlNode *own = element_own_technique(ld, light),
                  *technique = own != NULL ? own : element_child(light, "technique_common"),
                  *kind = element_first(technique);
    if (technique == NULL)
        fail_at(ld, light, "<light> without <technique_common>");
    if (own == NULL)
        element_check(ld, technique, "point|spot|directional|ambient");
    else if (strcmp(element_attribute(own, "profile"), "CGL") == 0)
        element_check(ld, own, "area|point|spot|directional|ambient");
    else
        element_check(ld, own, "rectangle");
    if (element_is_one_of(kind, "rectangle area"))
        add_rectangle(ld, kind, node_name, m);
    else if (element_is(kind, "directional"))
        add_directional(ld, kind, m);
    else if (element_is(kind, "ambient"))
        add_ambient(ld, kind);
    else
        add_point(ld, kind, m);
    const xmlNode *blender = own == NULL ? blender_technique(ld, light, kind) : NULL;
    if (blender != NULL && !ld->failed)
        mean_blender(ld, blender, node_name, m);
}
