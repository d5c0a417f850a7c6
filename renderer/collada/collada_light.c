/* <light> and <camera> as they are instanced. */
#include "collada_internal.h"
#include "renderer/scene/environment.h"

#include <float.h>
#include <string.h>

static const double DEGREE = 3.14159265358979323846 / 180;

static vec3 to_float(dvec3 v)
{
    return v3((float)v.x, (float)v.y, (float)v.z);
}

static bool required_color(struct loader *ld, const xmlNode *n, const char *name, rgb *out)
{
    xmlNode *color;
    if (!element_one_child(ld, n, name, &color))
        return false;
    if (color == NULL)
        return fail_at(ld, n, "<%.60s> without <%s>", (const char *)n->name, name);
    return text_read_color(ld, color, out, NULL);
}

/* A missing number is 0 and *given false. */
static bool optional_number(struct loader *ld, const xmlNode *n, const char *name, bool *given,
                            double *out)
{
    xmlNode *c;
    *out = 0;
    if (!element_one_child(ld, n, name, &c))
        return false;
    *given = c != NULL;
    return c == NULL || text_read_exactly(ld, c, out, 1);
}

static bool required_positive(struct loader *ld, const xmlNode *n, const char *name, double *out)
{
    bool given;
    if (!optional_number(ld, n, name, &given, out))
        return false;
    if (!given)
        return fail_at(ld, n, "<%.60s> without <%s>", (const char *)n->name, name);
    if (!(*out > 0))
        return fail_at(ld, element_child_named(n, name), "<%s> must be positive, not %g", name,
                       *out);
    return true;
}

/* Attenuation over metres. Pure inverse-square falloff is brought to the physical form {0, 0, 1},
 * where the value is an intensity. */
static bool read_attenuation(struct loader *ld, const xmlNode *n, struct light *l)
{
    static const char *const NAMES[3] = {"constant_attenuation", "linear_attenuation",
                                         "quadratic_attenuation"};
    double a[3];
    for (int i = 0; i < 3; i++) {
        bool given;
        if (!optional_number(ld, n, NAMES[i], &given, &a[i]))
            return false;
        if (!given && i == 0)
            a[i] = 1;
        if (!(a[i] >= 0))
            return fail_at(ld, element_child_named(n, NAMES[i]), "<%s> is negative", NAMES[i]);
        a[i] /= i == 0 ? 1 : i == 1 ? ld->unit : ld->unit * ld->unit;
    }
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

static bool add_point(struct loader *ld, const xmlNode *n, const mat4 *m)
{
    struct light l = {.kind = LIGHT_POINT, .attenuation = {1, 0, 0}};
    if (!element_only_children(
            ld, n, "color constant_attenuation linear_attenuation quadratic_attenuation") ||
        !required_color(ld, n, "color", &l.value))
        return false;
    /* The assignment's point lights do not fall off, whatever the file says. */
    if (ld->dialect == DIALECT_COLLADA && !read_attenuation(ld, n, &l))
        return false;
    return place_light(ld, n, m, &l) && build_add_light(ld, &l);
}

/* A point light with a cone around its -Z. */
static bool add_spot(struct loader *ld, const xmlNode *n, const mat4 *m)
{
    struct light l = {.kind = LIGHT_SPOT};
    bool given;
    double angle, exponent;
    if (ld->dialect == DIALECT_CGL)
        return fail_at(ld, n, "spot lights of the assignment are not supported: they never shone");
    if (!element_only_children(
            ld, n,
            "color constant_attenuation linear_attenuation quadratic_attenuation "
            "falloff_angle falloff_exponent") ||
        !required_color(ld, n, "color", &l.value) || !read_attenuation(ld, n, &l) ||
        !optional_number(ld, n, "falloff_exponent", &given, &exponent) ||
        !optional_number(ld, n, "falloff_angle", &given, &angle))
        return false;
    if (!given)
        angle = 180;
    if (!(angle >= 0.1 && angle <= 180))
        return fail_at(ld, element_child_named(n, "falloff_angle"),
                       "<falloff_angle> of %g degrees is not between 0.1 and 180", angle);
    if (!(exponent >= 0 && exponent <= 1e6))
        return fail_at(ld, element_child_named(n, "falloff_exponent"),
                       "<falloff_exponent> of %g is not between 0 and 1e6", exponent);
    l.cos_cutoff = angle < 180 ? (float)cos(0.5 * angle * DEGREE) : 0;
    l.exponent = (float)exponent;
    dvec3 backward = mat4_column(m, 2);
    if (!d3_normalize(&backward))
        return fail_at(ld, n, "the light has no direction");
    l.axis = neg(to_float(backward));
    return place_light(ld, n, m, &l) && build_add_light(ld, &l);
}

static bool add_directional(struct loader *ld, const xmlNode *n, const mat4 *m)
{
    struct light l = {.kind = LIGHT_DIRECTIONAL};
    if (!element_only_children(ld, n, "color") || !required_color(ld, n, "color", &l.value))
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
static bool add_rectangle(struct loader *ld, const xmlNode *n, const char *name, const mat4 *m,
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
        if (!build_add_triangle(ld, n, m, sign, c))
            return false;
    }
    if (ld->scene.num_degenerate != dropped)
        return fail_at(ld, n, "the light has no area");
    return true;
}

static bool add_ambient(struct loader *ld, const xmlNode *n)
{
    struct light l = {.kind = LIGHT_ENVIRONMENT};
    rgb color;
    if (!element_only_children(ld, n, "color") || !required_color(ld, n, "color", &color))
        return false;
    if (rgb_is_zero(color))
        return true;
    if (ld->scene.environment != NULL)
        return fail_at(ld, n, "a second ambient light");
    ld->scene.environment = ld->dialect == DIALECT_CGL ? environment_upper_half(color, ld->err)
                                                       : environment_constant(color, ld->err);
    return ld->scene.environment != NULL ? build_add_light(ld, &l) : fail_memory(ld);
}

bool light_instance(struct loader *ld, const xmlNode *instance, const xmlNode *light,
                    const char *node_name, const mat4 *m)
{
    xmlNode *technique, *common, *kind;
    rgb radiance;
    double sign, width, height;
    if (!element_only_children(ld, instance, "extra") ||
        !element_only_children(ld, light, "asset technique_common technique extra") ||
        !build_transform_sign(ld, instance, m, &sign) ||
        !element_own_technique(ld, light, &technique))
        return false;
    bool is_assay =
        technique != NULL && strcmp(element_attribute(technique, "profile"), "ASSAY") == 0;
    if (technique == NULL) {
        if (!element_one_child(ld, light, "technique_common", &common))
            return false;
        if (common == NULL)
            return fail_at(ld, light, "<light> without <technique_common>");
        technique = common;
    }
    kind = element_first_child(technique);
    if (kind == NULL)
        return fail_at(ld, technique, "<light> without a kind");
    if (element_next_sibling(kind) != NULL)
        return element_fail_unexpected(ld, element_next_sibling(kind));
    bool is_common = element_is(technique, "technique_common");
    if (is_assay && element_is(kind, "rectangle"))
        return element_only_children(ld, kind, "radiance width height") &&
               required_color(ld, kind, "radiance", &radiance) &&
               required_positive(ld, kind, "width", &width) &&
               required_positive(ld, kind, "height", &height) &&
               add_rectangle(ld, kind, node_name, m, width, height, radiance);
    if (!is_assay && !is_common && element_is(kind, "area"))
        return element_only_children(ld, kind, "color") &&
               required_color(ld, kind, "color", &radiance) &&
               add_rectangle(ld, kind, node_name, m, 1, 1, radiance);
    if (!is_assay && element_is(kind, "point"))
        return add_point(ld, kind, m);
    if (!is_assay && element_is(kind, "directional"))
        return add_directional(ld, kind, m);
    if (!is_assay && element_is(kind, "ambient"))
        return add_ambient(ld, kind);
    if (!is_assay && element_is(kind, "spot"))
        return add_spot(ld, kind, m);
    return fail_at(ld, kind, "unknown light tag '%.60s'", (const char *)kind->name);
}

static bool read_angle(struct loader *ld, const xmlNode *n, const char *name, float *out)
{
    bool given;
    double degrees;
    *out = 0;
    if (!optional_number(ld, n, name, &given, &degrees))
        return false;
    if (!given)
        return true;
    if (!(degrees > 0 && degrees < 180))
        return fail_at(ld, element_child_named(n, name),
                       "<%s> of %g degrees is not between 0 and 180", name, degrees);
    *out = (float)(degrees * DEGREE);
    return true;
}

static bool read_perspective(struct loader *ld, const xmlNode *n, struct scene_camera *c)
{
    bool given;
    double near, far, aspect;
    if (!element_only_children(ld, n, "xfov yfov aspect_ratio znear zfar") ||
        !read_angle(ld, n, "xfov", &c->hfov) || !read_angle(ld, n, "yfov", &c->vfov) ||
        !optional_number(ld, n, "aspect_ratio", &given, &aspect) ||
        (given && !required_positive(ld, n, "aspect_ratio", &aspect)) ||
        !required_positive(ld, n, "znear", &near) || !required_positive(ld, n, "zfar", &far))
        return false;
    if (!(far > near) || !(far * ld->unit <= FARTHEST) || aspect > 1e6)
        return fail_at(ld, n, "<zfar> is not beyond <znear>, or something is out of range");
    c->aspect = (float)aspect;
    c->near = (float)(near * ld->unit);
    c->far = (float)(far * ld->unit);
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
    return true;
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
                     const mat4 *m)
{
    xmlNode *optics, *common = NULL, *kind = NULL;
    struct scene_camera c = {.present = true};
    if (ld->num_cameras++ > 0 && ld->dialect == DIALECT_COLLADA)
        return fail_at(ld, instance, "a second camera");
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
    if (element_is(kind, "orthographic"))
        return fail_at(ld, kind, "orthographic cameras are not supported");
    if (!element_is(kind, "perspective"))
        return element_fail_unexpected(ld, kind);
    if (!read_perspective(ld, kind, &c) || !place(ld, instance, m, &c))
        return false;
    ld->scene.camera = c;
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
