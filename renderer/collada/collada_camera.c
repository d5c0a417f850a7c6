/* <camera> as it is instanced. */
#include "collada_internal.h"

static const double DEGREE = 3.14159265358979323846 / 180;

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
    if (!field_read_all(
            ld, n,
            FIELDS({FIELD_OF_LENGTH("xmag", &x, false)}, {FIELD_OF_LENGTH("ymag", &y, false)},
                   {"aspect_ratio", FIELD_NUMBER, &aspect, .lo = 1e-6, .hi = 1e6},
                   {FIELD_OF_LENGTH("znear", &near, true)}, {FIELD_OF_LENGTH("zfar", &far, true)})))
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
                               {FIELD_OF_LENGTH("znear", &near, true)},
                               {FIELD_OF_LENGTH("zfar", &far, true)})))
        return false;
    c->hfov = (float)(x * DEGREE);
    c->vfov = (float)(y * DEGREE);
    c->aspect = (float)aspect;
    /* Blender writes the angle of the larger side for <xfov>, unless told which is meant. */
    ld->num_left_out[LEFT_OUT_UPRIGHT] +=
        ld->blender_version > 0 && ld->dialect == DIALECT_COLLADA && aspect > 0 && aspect < 1;
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
    out->right = build_to_float(right);
    out->up = build_to_float(d3_cross(c, right));
    out->backward = build_to_float(c);
}

static bool place(struct loader *ld, const xmlNode *n, const mat4 *m, struct scene_camera *out)
{
    dvec3 eye = mat4_point(m, d3(0, 0, 0));
    if (!(fabs(eye.x) <= FARTHEST && fabs(eye.y) <= FARTHEST && fabs(eye.z) <= FARTHEST))
        return fail_at(ld, n, "the camera is beyond %g", FARTHEST);
    out->eye = build_to_float(eye);
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
    out->right = build_to_float(x);
    out->up = build_to_float(y);
    out->backward = build_to_float(z);
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
