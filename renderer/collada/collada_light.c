/* <light> as it is instanced. */
#include "collada_internal.h"
#include "renderer/scene/environment.h"

#include <float.h>
#include <string.h>

static const double PI = 3.14159265358979323846;

/* The attenuation of the light as the file has it. */
#define ATTENUATION(a)                                                                             \
    {"constant_attenuation", FIELD_NUMBER, &(a)[0], .hi = 1e300},                                  \
        {"linear_attenuation", FIELD_NUMBER, &(a)[1], .hi = 1e300},                                \
    {                                                                                              \
        "quadratic_attenuation", FIELD_NUMBER, &(a)[2], .hi = 1e300                                \
    }

/* To attenuation over metres. Pure inverse-square falloff is brought to the physical form {0, 0, 1},
 * where the value is an intensity. */
static bool set_attenuation(struct loader *ld, const xmlNode *n, double a[3], struct light *l)
{
    a[1] /= ld->unit;
    a[2] /= ld->unit * ld->unit;
    if (a[0] + a[1] + a[2] == 0)
        return fail_at(ld, n, "all attenuations of the light are 0");
    if (!(a[0] + a[1] + a[2] <= FLT_MAX) || (a[0] == 0 && a[1] == 0 && !(1 / a[2] <= FLT_MAX)))
        return fail_at(ld, n, "the attenuation is out of range");
    if (a[0] == 0 && a[1] == 0) {
        l->value = rgb_scale(l->value, (float)(1 / a[2]));
        a[2] = 1;
    }
    for (int i = 0; i < 3; i++)
        l->attenuation[i] = (float)a[i];
    return true;
}

static bool place_light(struct loader *ld, const xmlNode *n, const mat4 *m, struct light *l)
{
    dvec3 p = mat4_point(m, d3(0, 0, 0));
    if (!(fabs(p.x) <= FARTHEST && fabs(p.y) <= FARTHEST && fabs(p.z) <= FARTHEST))
        return fail_at(ld, n, "the light is beyond %g", FARTHEST);
    l->position = build_to_float(p);
    return true;
}

static bool add_point(struct loader *ld, const xmlNode *n, const char *name, const mat4 *m)
{
    struct light l = {.kind = LIGHT_POINT, .attenuation = {1, 0, 0}};
    double a[3] = {1, 0, 0};
    (void)name;
    /* The assignment's point lights do not fall off, whatever the file says. */
    return field_read_all(ld, n, FIELDS({FIELD_OF_COLOR("color", &l.value, 0)}, ATTENUATION(a))) &&
           (ld->dialect == DIALECT_CGL || set_attenuation(ld, n, a, &l)) &&
           place_light(ld, n, m, &l) && build_add_light(ld, &l);
}

/* A point light with a cone around its -Z. */
static bool add_spot(struct loader *ld, const xmlNode *n, const char *name, const mat4 *m)
{
    struct light l = {.kind = LIGHT_SPOT};
    double a[3] = {1, 0, 0}, angle = 180;
    (void)name;
    if (ld->dialect == DIALECT_CGL)
        return fail_at(ld, n, "spot lights of the assignment are not supported: they never shone");
    if (!field_read_all(
            ld, n,
            FIELDS({FIELD_OF_COLOR("color", &l.value, 0)}, ATTENUATION(a),
                   {"falloff_angle", FIELD_NUMBER, &angle, .lo = 0.1, .hi = 180},
                   {"falloff_exponent", FIELD_FLOAT, &l.exponent, .lo = 0, .hi = 1e6})) ||
        !set_attenuation(ld, n, a, &l))
        return false;
    l.cos_cutoff = angle < 180 ? (float)cos(0.5 * angle * (PI / 180)) : 0;
    dvec3 backward = mat4_column(m, 2);
    if (!d3_normalize(&backward))
        return fail_at(ld, n, "the light has no direction");
    l.axis = neg(build_to_float(backward));
    return place_light(ld, n, m, &l) && build_add_light(ld, &l);
}

static bool add_directional(struct loader *ld, const xmlNode *n, const char *name, const mat4 *m)
{
    struct light l = {.kind = LIGHT_DIRECTIONAL};
    (void)name;
    if (!field_read_all(ld, n, FIELDS({FIELD_OF_COLOR("color", &l.value, 0)})))
        return false;
    /* It shines along its -Z. The assignment takes the point (0,0,-1) with the translation for the
     * direction towards the light. */
    dvec3 to_light = ld->dialect == DIALECT_CGL ? mat4_point(m, d3(0, 0, -1)) : mat4_column(m, 2);
    if (!d3_normalize(&to_light))
        return fail_at(ld, n, "the light has no direction");
    l.to_light = build_to_float(to_light);
    return build_add_light(ld, &l);
}

/* A rectangle that emits to its -Z side is geometry: so what light sampling aims at and what a ray
 * hits are the same thing. */
static bool add_lamp(struct loader *ld, const xmlNode *n, const char *name, const mat4 *m,
                     double width, double height, rgb radiance)
{
    struct material lamp = {.kind = MATERIAL_DIFFUSE, .radiance = radiance};
    uint32_t material;
    double sign, x = width / 2, y = height / 2;
    build_copy_name(lamp.name, sizeof lamp.name, name);
    if (!build_transform_sign(ld, n, m, &sign) || !build_add_material(ld, &lamp, &material) ||
        !build_begin_object(ld, name, NULL, material, true))
        return false;
    /* Counter-clockwise seen from -Z. */
    const dvec3 p[4] = {{-x, -y, 0}, {-x, y, 0}, {x, y, 0}, {x, -y, 0}};
    unsigned dropped = ld->scene.num_degenerate;
    for (int t = 0; t < 2; t++) {
        struct corner c[3] = {{.position = p[0]}, {.position = p[1 + t]}, {.position = p[2 + t]}};
        if (!build_add_triangle(ld, n, m, sign, c, NULL))
            return false;
    }
    if (ld->scene.num_degenerate != dropped)
        return fail_at(ld, n, "the light has no area");
    return true;
}

static bool add_rectangle(struct loader *ld, const xmlNode *n, const char *name, const mat4 *m)
{
    double width, height;
    rgb radiance;
    return field_read_all(ld, n,
                          FIELDS({FIELD_OF_COLOR("radiance", &radiance, 0)},
                                 {FIELD_OF_LENGTH("width", &width, true)},
                                 {FIELD_OF_LENGTH("height", &height, true)})) &&
           add_lamp(ld, n, name, m, width, height, radiance);
}

static bool add_area(struct loader *ld, const xmlNode *n, const char *name, const mat4 *m)
{
    rgb radiance;
    return field_read_all(ld, n, FIELDS({FIELD_OF_COLOR("color", &radiance, 0)})) &&
           add_lamp(ld, n, name, m, 1, 1, radiance);
}

static bool add_ambient(struct loader *ld, const xmlNode *n, const char *name, const mat4 *m)
{
    rgb color;
    (void)name;
    (void)m;
    if (!field_read_all(ld, n, FIELDS({FIELD_OF_COLOR("color", &color, 0)})))
        return false;
    bool is_first = rgb_is_zero(ld->ambient) && !rgb_is_zero(color);
    ld->ambient = rgb_add(ld->ambient, color);
    return !is_first || build_add_light(ld, &(struct light){.kind = LIGHT_ENVIRONMENT});
}

bool light_finish(struct loader *ld)
{
    if (rgb_is_zero(ld->ambient))
        return true;
    ld->scene.environment = ld->dialect == DIALECT_CGL
                                ? environment_upper_half(ld->ambient, ld->err)
                                : environment_constant(ld->ambient, ld->err);
    return ld->scene.environment != NULL || fail_memory(ld);
}

/* To support one more, give it a reader here. A technique of no profile is <technique_common>. */
static const struct light_tag {
    const char *profiles, *name;
    bool (*add)(struct loader *ld, const xmlNode *n, const char *name, const mat4 *m);
} LIGHT_TAGS[] = {
    {"ASSAY", "rectangle", add_rectangle},  {"CGL", "area", add_area},
    {"CGL common", "point", add_point},     {"CGL common", "directional", add_directional},
    {"CGL common", "ambient", add_ambient}, {"CGL common", "spot", add_spot},
};

/* What Blender's exporter wrote beside, from 2.80 on, of a light that is as it wrote it; else NULL. */
static const xmlNode *blender_technique(const struct loader *ld, const xmlNode *light,
                                        const xmlNode *kind)
{
    const xmlNode *extra = element_child_named(light, "extra"),
                  *t = extra != NULL ? element_child_named(extra, "technique") : NULL,
                  *falloff = element_child_named(kind, "constant_attenuation");
    const char *profile = t != NULL ? element_attribute(t, "profile") : NULL;
    bool is_its = profile != NULL && strcmp(profile, "blender") == 0 && falloff != NULL &&
                  falloff->children != NULL &&
                  strcmp((const char *)falloff->children->content, "1") == 0;
    return is_its && ld->blender_version >= 2.8 && ld->dialect == DIALECT_COLLADA ? t : NULL;
}

/* Blender's exporter writes colour times watts as if they were an intensity, with a falloff that no
 * renderer of Blender's has, and an area light as a point. Of the light added last, which is a point
 * or a spot, to what Cycles takes it for. */
static bool mean_blender(struct loader *ld, const xmlNode *technique, const char *name,
                         const mat4 *m)
{
    enum { BLENDER_AREA = 4, BLENDER_SQUARE = 0, BLENDER_RECTANGLE = 1 };
    struct light *l = &ld->scene.lights[ld->scene.num_lights - 1];
    double type, shape, blend, size[2], sign;
    const struct {
        const char *name;
        double *to;
    } numbers[] = {{"type", &type},
                   {"area_shape", &shape},
                   {"spotblend", &blend},
                   {"area_size", &size[0]},
                   {"area_sizey", &size[1]}};
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
        const xmlNode *n = element_child_named(technique, numbers[i].name);
        if (n == NULL)
            return fail_at(ld, technique, "a light of Blender without <%s>", numbers[i].name);
        if (!text_read_exactly(ld, n, numbers[i].to, 1))
            return false;
    }
    if (type != BLENDER_AREA) {
        l->value = rgb_scale(l->value, (float)(ld->unit * ld->unit / (4 * PI)));
        l->attenuation[0] = l->attenuation[1] = 0;
        l->attenuation[2] = 1;
        l->exponent = l->kind == LIGHT_SPOT; /* Cycles' cones are dimmer towards their edge */
        ld->num_left_out[LEFT_OUT_RADIUS]++;
        ld->num_left_out[LEFT_OUT_BLEND] += l->kind == LIGHT_SPOT && blend > 0;
        return true;
    }
    if (shape != BLENDER_SQUARE && shape != BLENDER_RECTANGLE)
        return fail_at(ld, technique, "a round area light of Blender is not supported");
    if (shape == BLENDER_SQUARE)
        size[1] = size[0];
    if (!(size[0] > 0 && size[1] > 0))
        return fail_at(ld, technique, "an area light of Blender without area");
    rgb radiance = rgb_scale(l->value, (float)(0.25 / (size[0] * size[1])));
    ld->scene.num_lights--;
    return build_transform_sign(ld, technique, m, &sign) &&
           add_lamp(ld, technique, name, m, size[0], size[1], radiance);
}

bool light_instance(struct loader *ld, const xmlNode *instance, const xmlNode *light,
                    const char *node_name, const mat4 *m)
{
    xmlNode *technique, *common, *kind;
    double sign;
    if (!element_only_children(ld, instance, "extra") ||
        !element_only_children(ld, light, "asset technique_common technique extra") ||
        !build_transform_sign(ld, instance, m, &sign) ||
        !element_own_technique(ld, light, &technique) ||
        !element_one_child(ld, light, "technique_common", &common))
        return false;
    const char *profile = technique != NULL ? element_attribute(technique, "profile") : "common";
    technique = technique != NULL ? technique : common;
    if (technique == NULL)
        return fail_at(ld, light, "<light> without <technique_common>");
    kind = element_first_child(technique);
    if (kind == NULL)
        return fail_at(ld, technique, "<light> without a kind");
    if (element_next_sibling(kind) != NULL)
        return element_fail_unexpected(ld, element_next_sibling(kind));
    const xmlNode *blender = technique == common ? blender_technique(ld, light, kind) : NULL;
    for (size_t i = 0; i < sizeof LIGHT_TAGS / sizeof *LIGHT_TAGS; i++)
        if (element_is(kind, LIGHT_TAGS[i].name) && strstr(LIGHT_TAGS[i].profiles, profile) != NULL)
            return LIGHT_TAGS[i].add(ld, kind, node_name, m) &&
                   (blender == NULL || mean_blender(ld, blender, node_name, m));
    return fail_at(ld, kind, "unknown light tag '%.60s'", (const char *)kind->name);
}
