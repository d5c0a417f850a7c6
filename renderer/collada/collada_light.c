/* <light> and <camera> as they are instanced. */
#include "collada_internal.h"
#include "renderer/scene/environment.h"

#include <float.h>
#include <string.h>

static const double DEGREE = 3.14159265358979323846 / 180;

#define LENGTH(name, out, needed) name, FIELD_NUMBER, out, needed, .lo = 1e-300, .hi = 1e300

static vec3 to_float(dvec3 v)
{
    return v3((float)v.x, (float)v.y, (float)v.z);
}

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
    l->position = to_float(p);
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
    l.cos_cutoff = angle < 180 ? (float)cos(0.5 * angle * DEGREE) : 0;
    dvec3 backward = mat4_column(m, 2);
    if (!d3_normalize(&backward))
        return fail_at(ld, n, "the light has no direction");
    l.axis = neg(to_float(backward));
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
    l.to_light = to_float(to_light);
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
                                 {LENGTH("width", &width, true)},
                                 {LENGTH("height", &height, true)})) &&
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
    ld->ambient = rgb_add(ld->ambient, color);
    return true;
}

bool light_finish(struct loader *ld)
{
    struct light l = {.kind = LIGHT_ENVIRONMENT};
    if (rgb_is_zero(ld->ambient))
        return true;
    ld->scene.environment = ld->dialect == DIALECT_CGL
                                ? environment_upper_half(ld->ambient, ld->err)
                                : environment_constant(ld->ambient, ld->err);
    return ld->scene.environment != NULL ? build_add_light(ld, &l) : fail_memory(ld);
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
    for (size_t i = 0; i < sizeof LIGHT_TAGS / sizeof *LIGHT_TAGS; i++)
        if (element_is(kind, LIGHT_TAGS[i].name) && strstr(LIGHT_TAGS[i].profiles, profile) != NULL)
            return LIGHT_TAGS[i].add(ld, kind, node_name, m);
    return fail_at(ld, kind, "unknown light tag '%.60s'", (const char *)kind->name);
}

static bool set_clipping(struct loader *ld, const xmlNode *n, double near, double far,
                         struct scene_camera *c)
{
    if (!(far > near) || !(far * ld->unit <= FARTHEST))
        return fail_at(ld, n, "<zfar> is not beyond <znear>, or something is out of range");
    c->near = (float)(near * ld->unit);
    c->far = (float)(far * ld->unit);
    return true;
}

static bool read_orthographic(struct loader *ld, const xmlNode *n, struct scene_camera *c)
{
    double near, far, aspect = 0, x = 0, y = 0;
    if (!field_read_all(ld, n,
                        FIELDS({LENGTH("xmag", &x, false)}, {LENGTH("ymag", &y, false)},
                               {"aspect_ratio", FIELD_NUMBER, &aspect, .lo = 1e-6, .hi = 1e6},
                               {LENGTH("znear", &near, true)}, {LENGTH("zfar", &far, true)})))
        return false;
    if (x == 0 && y == 0)
        return fail_at(ld, n, "<orthographic> needs <xmag> or <ymag>");
    if (fmax(x, y) * ld->unit > FARTHEST)
        return fail_at(ld, n, "<xmag> or <ymag> is out of range");
    c->xmag = (float)(x * ld->unit);
    c->ymag = (float)(y * ld->unit);
    c->aspect = (float)aspect;
    return set_clipping(ld, n, near, far, c);
}

static bool read_perspective(struct loader *ld, const xmlNode *n, struct scene_camera *c)
{
    double near, far, aspect = 0, x = 0, y = 0;
    if (!field_read_all(ld, n,
                        FIELDS({"xfov", FIELD_NUMBER, &x, .lo = 1e-6, .hi = 179.9999},
                               {"yfov", FIELD_NUMBER, &y, .lo = 1e-6, .hi = 179.9999},
                               {"aspect_ratio", FIELD_NUMBER, &aspect, .lo = 1e-6, .hi = 1e6},
                               {LENGTH("znear", &near, true)}, {LENGTH("zfar", &far, true)})))
        return false;
    c->hfov = (float)(x * DEGREE);
    c->vfov = (float)(y * DEGREE);
    c->aspect = (float)aspect;
    if (ld->dialect == DIALECT_CGL) {
        if (c->hfov == 0)
            c->hfov = (float)(50 * DEGREE);
        if (c->vfov == 0 && c->aspect == 0)
            return fail_at(ld, n, "<perspective> needs <yfov> or <aspect_ratio>");
        if (c->vfov == 0)
            c->vfov = 2 * atanf(tanf(c->hfov / 2) / c->aspect);
    }
    if (c->hfov == 0 && c->vfov == 0)
        return fail_at(ld, n, "<perspective> needs <xfov> or <yfov>");
    return set_clipping(ld, n, near, far, c);
}

/* The assignment looks at the scene from the direction c, with world +Y up; straight from above or
 * below its right is +X. */
static void look_cgl(struct scene_camera *out, dvec3 c)
{
    double azimuth = atan2(c.x, c.z);
    dvec3 right = d3(cos(azimuth), 0, -sin(azimuth));
    out->right = to_float(right);
    out->up = to_float(d3_cross(c, right));
    out->backward = to_float(c);
}

static bool place(struct loader *ld, const xmlNode *n, const mat4 *m, struct scene_camera *out)
{
    dvec3 eye = mat4_point(m, d3(0, 0, 0));
    if (!(fabs(eye.x) <= FARTHEST && fabs(eye.y) <= FARTHEST && fabs(eye.z) <= FARTHEST))
        return fail_at(ld, n, "the camera is beyond %g", FARTHEST);
    out->eye = to_float(eye);
    if (ld->dialect == DIALECT_CGL) {
        dvec3 c = mat4_point(m, d3(0, 0, -1));
        if (!d3_normalize(&c))
            return fail_at(ld, n, "the camera has no direction");
        look_cgl(out, c);
        return true;
    }
    double sign;
    if (!build_transform_sign(ld, n, m, &sign))
        return false;
    dvec3 x = mat4_column(m, 0), y = mat4_column(m, 1), z = mat4_column(m, 2);
    if (!d3_normalize(&x) || !d3_normalize(&y) || !d3_normalize(&z))
        return fail_at(ld, n, "the transforms above are singular");
    if (fabs(d3_dot(x, y)) > 1e-4 || fabs(d3_dot(y, z)) > 1e-4 || fabs(d3_dot(z, x)) > 1e-4)
        return fail_at(ld, n, "the transforms above shear the camera");
    if (sign < 0)
        return fail_at(ld, n, "the transforms above mirror the camera: not supported");
    out->right = to_float(x);
    out->up = to_float(y);
    out->backward = to_float(z);
    return true;
}

bool camera_instance(struct loader *ld, const xmlNode *instance, const xmlNode *camera,
                     const char *node_name, const mat4 *m)
{
    xmlNode *optics, *common = NULL, *kind = NULL;
    struct scene *s = &ld->scene;
    struct scene_camera c = {.present = true};
    if (!element_only_children(ld, instance, "extra") ||
        !element_only_children(ld, camera, "asset optics imager extra") ||
        !element_one_child(ld, camera, "optics", &optics))
        return false;
    if (optics != NULL && (!element_only_children(ld, optics, "technique_common technique extra") ||
                           !element_one_child(ld, optics, "technique_common", &common)))
        return false;
    if (common != NULL)
        kind = element_first_child(common);
    if (kind == NULL)
        return fail_at(ld, camera, "<camera> without <optics> of a kind");
    if (element_next_sibling(kind) != NULL)
        return element_fail_unexpected(ld, element_next_sibling(kind));
    bool flat = element_is(kind, "orthographic") && ld->dialect == DIALECT_COLLADA;
    if (!flat && !element_is(kind, "perspective"))
        return element_fail_unexpected(ld, kind);
    if (!(flat ? read_orthographic(ld, kind, &c) : read_perspective(ld, kind, &c)) ||
        !place(ld, instance, m, &c))
        return false;
    build_copy_name(c.name, sizeof c.name, node_name);
    struct scene_camera *grown =
        build_grow(ld, s->cameras, sizeof *grown, s->num_cameras, &ld->cap_cameras);
    if (grown == NULL)
        return false;
    s->cameras = grown;
    if (s->num_cameras == 0 || ld->dialect == DIALECT_CGL)
        s->camera = c;
    grown[s->num_cameras++] = c;
    return true;
}

void camera_default(struct loader *ld)
{
    struct scene_camera *c = &ld->scene.camera;
    c->hfov = (float)(50 * DEGREE);
    c->vfov = (float)(35 * DEGREE);
    c->aspect = tanf(c->hfov / 2) / tanf(c->vfov / 2);
    c->near = 0.01f;
    c->far = 100;
    look_cgl(c, d3(0, 0, 1));
}
