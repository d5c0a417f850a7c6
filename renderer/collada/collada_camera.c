/* <camera> as it is instanced. */
#include "collada_internal.h"

/* A length in metres; 0 if the element is missing. */
static float read_length(struct loader *ld, const xmlNode *n, const char *name)
{
    double v = ld->unit * field_number(ld, n, name, 0, ANY_LENGTH);
    if (v > FARTHEST)
        fail_at(ld, n, "<%s> is out of range", name);
    return (float)v;
}

/* <perspective> or <orthographic>. */
static void read_kind(struct loader *ld, const xmlNode *n, struct scene_camera *c)
{
    bool is_flat = element_is(n, "orthographic");
    element_check(ld, n,
                  is_flat ? "xmag? ymag? aspect_ratio? znear zfar"
                          : "xfov? yfov? aspect_ratio? znear zfar");
    c->near = read_length(ld, n, "znear");
    c->far = read_length(ld, n, "zfar");
    c->xmag = read_length(ld, n, "xmag");
    c->ymag = read_length(ld, n, "ymag");
    c->hfov = (float)(field_number(ld, n, "xfov", 0, 1e-6, 179.9999) * DEGREE);
    c->vfov = (float)(field_number(ld, n, "yfov", 0, 1e-6, 179.9999) * DEGREE);
    c->aspect = (float)field_number(ld, n, "aspect_ratio", 0, 1e-6, 1e6);
    if (!(c->far > c->near))
        fail_at(ld, n, "<zfar> is not beyond <znear>");
    if (is_flat && c->xmag == 0 && c->ymag == 0)
        fail_at(ld, n, "<orthographic> needs <xmag> or <ymag>");
    if (is_flat)
        return;
    /* Blender writes the angle of the larger side as <xfov>, unless its sensor fit is set. */
    ld->num_left_out[LEFT_OUT_UPRIGHT] +=
        ld->blender_version > 0 && ld->dialect == DIALECT_COLLADA && c->aspect > 0 && c->aspect < 1;
    if (ld->dialect == DIALECT_CGL) {
        if (c->hfov == 0)
            c->hfov = (float)(50 * DEGREE);
        if (c->vfov == 0 && c->aspect == 0)
            fail_at(ld, n, "<perspective> needs <yfov> or <aspect_ratio>");
        if (c->vfov == 0)
            c->vfov = 2 * atanf(tanf(c->hfov / 2) / c->aspect);
    }
    if (c->hfov == 0 && c->vfov == 0)
        fail_at(ld, n, "<perspective> needs <xfov> or <yfov>");
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

static void place(struct loader *ld, const xmlNode *n, const mat4 *m, struct scene_camera *out)
{
    out->eye = build_place(ld, n, "the camera", m, d3(0, 0, 0));
    if (ld->dialect == DIALECT_CGL) {
        dvec3 c = mat4_point(m, d3(0, 0, -1));
        if (!d3_normalize(&c))
            fail_at(ld, n, "the camera has no direction");
        look_cgl(out, c);
        return;
    }
    dvec3 x = mat4_column(m, 0), y = mat4_column(m, 1), z = mat4_column(m, 2);
    if (build_transform_sign(ld, n, m) < 0)
        fail_at(ld, n, "the transforms above mirror the camera: not supported");
    if (!d3_normalize(&x) || !d3_normalize(&y) || !d3_normalize(&z) || fabs(d3_dot(x, y)) > 1e-4 ||
        fabs(d3_dot(y, z)) > 1e-4 || fabs(d3_dot(z, x)) > 1e-4)
        fail_at(ld, n, "the transforms above shear the camera");
    out->right = build_to_float(x);
    out->up = build_to_float(y);
    out->backward = build_to_float(z);
}

void camera_instance(struct loader *ld, const xmlNode *instance, const xmlNode *camera,
                     const char *node_name, const mat4 *m)
{
    struct scene *s = &ld->scene;
    struct scene_camera c = {.present = true};
    element_check(ld, instance, "extra*");
    element_check(ld, camera, "asset? optics imager? extra*");
    const xmlNode *optics = element_child(camera, "optics");
    element_check(ld, optics, "technique_common technique* extra*");
    const xmlNode *common = element_child(optics, "technique_common");
    element_check(ld, common,
                  ld->dialect == DIALECT_CGL ? "perspective" : "perspective|orthographic");
    read_kind(ld, element_first(common), &c);
    place(ld, instance, m, &c);
    build_copy_name(c.name, sizeof c.name, node_name);
    s->cameras = build_grow(ld, s->cameras, sizeof *s->cameras, s->num_cameras);
    if (ld->failed)
        return;
    if (s->num_cameras == 0 || ld->dialect == DIALECT_CGL)
        s->camera = c;
    s->cameras[s->num_cameras++] = c;
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
