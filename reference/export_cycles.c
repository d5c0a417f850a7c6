#include "export_cycles.h"

#include "../renderer/fs.h"
#include "../renderer/mat4.h"

#include <assert.h>
#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_DEPTH = 1025 }; /* Blender's limit of 1024 bounces is one less than ours */

/* Blender's range of focal lengths for a 36 mm sensor, mm. */
#define LENS_MIN 1.0
#define LENS_MAX 5000.0

/* Normals closer than this to the geometric one are the geometric one: text with six digits. */
#define FLAT 1e-5

static dvec3 wide(vec3 v)
{
    return d3(v.x, v.y, v.z);
}

/* Twice the triangle's area along its geometric normal. */
static dvec3 area_normal(const vec3 *p)
{
    return d3_cross(d3_sub(wide(p[1]), wide(p[0])), d3_sub(wide(p[2]), wide(p[0])));
}

/* Along one axis, from p to the interval of a, b, c. */
static double gap(float p, float a, float b, float c)
{
    return fmax(0, fmax((double)fminf(a, fminf(b, c)) - p, (double)p - fmaxf(a, fmaxf(b, c))));
}

/* Nearest and furthest distance of the scene from the eye. The nearest may be too small: for a
 * triangle it is the distance to its plane or its bounding box. */
static void find_range(const struct scene *s, vec3 eye, double *nearest, double *furthest)
{
    *nearest = INFINITY;
    *furthest = 0;
    for (uint32_t i = 0; i < s->num_triangles; i++) {
        const vec3 *p = s->position + 3 * (size_t)i;
        dvec3 n = area_normal(p), to_eye = d3_sub(wide(eye), wide(p[0]));
        double plane = fabs(d3_dot(n, to_eye)) / d3_length(n);
        double box =
            d3_length(d3(gap(eye.x, p[0].x, p[1].x, p[2].x), gap(eye.y, p[0].y, p[1].y, p[2].y),
                         gap(eye.z, p[0].z, p[1].z, p[2].z)));
        *nearest = fmin(*nearest, fmax(plane, box));
        for (int k = 0; k < 3; k++)
            *furthest = fmax(*furthest, d3_length(d3_sub(wide(p[k]), wide(eye))));
    }
    for (uint32_t i = 0; i < s->num_spheres; i++) {
        double d = d3_length(d3_sub(wide(s->spheres[i].centre), wide(eye)));
        double r = s->spheres[i].radius;
        *nearest = fmin(*nearest, fabs(d - r));
        *furthest = fmax(*furthest, d + r);
    }
}

static json_t *numbers3(double x, double y, double z)
{
    return json_pack("[fff]", x, y, z);
}
static json_t *from_vec3(vec3 v)
{
    return numbers3(v.x, v.y, v.z);
}
static json_t *from_rgb(rgb c, double scale)
{
    return numbers3(c.r * scale, c.g * scale, c.b * scale);
}

/* Names are only labels here; a cut one may end inside a UTF-8 sequence. */
static json_t *from_name(const char *name)
{
    char ascii[64];
    size_t n = strnlen(name, sizeof ascii - 1);
    for (size_t i = 0; i < n; i++)
        ascii[i] = name[i] >= ' ' && name[i] <= '~' ? name[i] : '?';
    ascii[n] = '\0';
    return json_string(ascii);
}

/* json_array_append_new() that remembers a failure: *array is then NULL. */
static void push(json_t **array, json_t *value)
{
    if (json_array_append_new(*array, value) == 0)
        return;
    json_decref(*array);
    *array = NULL;
}

static void push3(json_t **array, vec3 v, float sign)
{
    push(array, json_real(sign * v.x));
    push(array, json_real(sign * v.y));
    push(array, json_real(sign * v.z));
}

static json_t *camera_json(const struct scene *s, const struct camera *c, struct err *e)
{
    if (c->lens_radius > 0) {
        err_set(e, "Cycles: a thin lens is not matched yet");
        return NULL;
    }
    double tan_h = c->tan_h, lens = 18 / tan_h, square = tan_h * c->height / c->width;
    if (!(fabs(c->tan_v / square - 1) < 1e-5)) {
        err_set(e, "Cycles: the camera's pixels are not square (tan_h %g, tan_v %g, %d x %d)",
                tan_h, (double)c->tan_v, c->width, c->height);
        return NULL;
    }
    if (!(lens >= LENS_MIN && lens <= LENS_MAX)) {
        err_set(e,
                "Cycles: horizontal angle of view out of Blender's range (tan of its half is %g)",
                tan_h);
        return NULL;
    }
    /* Blender keeps a rotation, not a matrix. */
    dvec3 right = wide(c->right), up = wide(c->up), back = wide(c->backward);
    if (!(d3_length(d3_sub(d3_cross(right, up), back)) < 1e-5 && fabs(d3_dot(right, up)) < 1e-5)) {
        err_set(e, "Cycles: the camera's axes are not orthogonal");
        return NULL;
    }
    double nearest, furthest;
    find_range(s, c->eye, &nearest, &furthest);
    if (!(nearest > c->near && nearest > 0)) {
        err_set(e, "Cycles: geometry at distance %g from the eye, the near plane is at %g", nearest,
                (double)c->near);
        return NULL;
    }
    if (!(furthest < c->far)) {
        err_set(e, "Cycles: geometry at distance %g from the eye, the far plane is at %g", furthest,
                (double)c->far);
        return NULL;
    }
    /* Cycles clips by depth, we by distance: take planes that clip nothing in either. */
    double corner = sqrt(1 + tan_h * tan_h + square * square);
    return json_pack("{so,so,so,so,sf,s[ff]}", "right", from_vec3(c->right), "up", from_vec3(c->up),
                     "backward", from_vec3(c->backward), "eye", from_vec3(c->eye), "tan_h", tan_h,
                     "clip", 0.5 * nearest / corner, 2 * furthest);
}

static json_t *materials_json(const struct scene *s)
{
    json_t *out = json_array();
    for (uint32_t i = 0; i < s->num_materials; i++) {
        const struct material *m = &s->materials[i];
        push(&out, json_pack("{so,so,so,sb}", "name", from_name(m->name), "reflectance",
                             from_rgb(m->reflectance, 1), "radiance", from_rgb(m->radiance, 1),
                             "both_sides", m->radiance_both_sides));
    }
    return out;
}

static bool check_materials(const struct scene *s, struct err *e)
{
    for (uint32_t i = 0; i < s->num_materials; i++)
        if (s->materials[i].kind != MATERIAL_DIFFUSE)
            return err_set(e, "Cycles: material '%s' is not diffuse, which is not matched yet",
                           s->materials[i].name);
    return true;
}

/* A triangle's shading normals: +1 all on the geometric normal's side, -1 all on the other (the
 * renderer turns them), 0 mixed. *flat: they are the geometric normal, of either sign. */
static int normals_side(const vec3 *p, const vec3 *n, bool *flat)
{
    dvec3 ng = area_normal(p);
    ng = d3_scale(ng, 1 / d3_length(ng));
    int positive = 0;
    double worst = 0;
    for (int k = 0; k < 3; k++) {
        double cosine = d3_dot(wide(n[k]), ng);
        positive += cosine > 0;
        worst = fmax(worst, d3_length(d3_sub(wide(n[k]), d3_scale(ng, cosine > 0 ? 1 : -1))));
    }
    *flat = worst < FLAT && positive % 3 == 0;
    return positive == 3 ? 1 : positive == 0 ? -1 : 0;
}

/* The flat or the smooth triangles of one object; appended if there are any. */
static bool push_mesh(json_t **out, const struct scene *s, const struct object *o, bool smooth,
                      struct err *e)
{
    json_t *positions = json_array(), *normals = json_array();
    bool ok = true;
    for (uint32_t i = o->first_triangle; ok && i < o->first_triangle + o->num_triangles; i++) {
        const vec3 *p = s->position + 3 * (size_t)i, *n = s->normal + 3 * (size_t)i;
        bool flat;
        int side = normals_side(p, n, &flat);
        if (side == 0)
            ok = err_set(
                e, "Cycles: object '%s': triangle %u has shading normals on both of its sides",
                o->name, i - o->first_triangle);
        for (int k = 0; ok && flat != smooth && k < 3; k++) {
            push3(&positions, p[k], 1);
            if (smooth)
                push3(&normals, n[k], (float)side);
        }
    }
    if (ok && (positions == NULL || json_array_size(positions) > 0))
        push(out,
             json_pack("{so,si,sO,sO}", "name", from_name(o->name), "material", (int)o->material,
                       "positions", positions, "normals", smooth ? normals : json_null()));
    json_decref(positions);
    json_decref(normals);
    return ok;
}

static json_t *meshes_json(const struct scene *s, struct err *e)
{
    json_t *out = json_array();
    for (uint32_t i = 0; i < s->num_objects; i++) {
        const struct object *o = &s->objects[i];
        if (!push_mesh(&out, s, o, false, e) || !push_mesh(&out, s, o, true, e)) {
            json_decref(out);
            return NULL;
        }
    }
    return out;
}

static json_t *spheres_json(const struct scene *s, vec3 eye)
{
    json_t *out = json_array();
    for (uint32_t i = 0; i < s->num_spheres; i++) {
        const struct sphere *sp = &s->spheres[i];
        /* Analytic spheres are invisible from inside and no lights; an opaque sphere is seen from
         * inside only by an eye that is there. */
        bool inside = d3_length(d3_sub(wide(eye), wide(sp->centre))) < sp->radius;
        bool dark = rgb_is_zero(s->materials[s->sphere_material[i]].radiance);
        push(&out, json_pack("{so,si,so,sf,si,sb}", "name",
                             from_name(s->objects[s->sphere_object[i]].name), "material",
                             (int)s->sphere_material[i], "centre", from_vec3(sp->centre), "radius",
                             (double)sp->radius, "normal_out", sp->normal_out > 0 ? 1 : -1, "exact",
                             dark && !inside));
    }
    return out;
}

static json_t *lights_json(const struct scene *s, struct err *e)
{
    json_t *out = json_array();
    for (uint32_t i = 0; i < s->num_lights; i++) {
        const struct light *l = &s->lights[i];
        switch (l->kind) {
        case LIGHT_POINT: {
            const float *a = l->attenuation;
            bool constant = a[0] > 0 && a[1] == 0 && a[2] == 0;
            bool quadratic = a[0] == 0 && a[1] == 0 && a[2] > 0;
            if (!constant && !quadratic) {
                err_set(e,
                        "Cycles: light %u: falloff 1/(%g + %g d + %g d^2) is neither constant nor "
                        "purely quadratic",
                        i, (double)a[0], (double)a[1], (double)a[2]);
                json_decref(out);
                return NULL;
            }
            push(&out,
                 json_pack("{ss,so,so,ss}", "kind", "point", "position", from_vec3(l->position),
                           "intensity", from_rgb(l->value, 1 / (double)(constant ? a[0] : a[2])),
                           "falloff", constant ? "constant" : "quadratic"));
            break;
        }
        case LIGHT_DIRECTIONAL:
            push(&out, json_pack("{ss,so,so}", "kind", "directional", "to_light",
                                 from_vec3(l->to_light), "irradiance", from_rgb(l->value, 1)));
            break;
        case LIGHT_SPOT:
        case LIGHT_ENVIRONMENT:
            err_set(e, "Cycles: light %u: %s is not matched yet", i,
                    l->kind == LIGHT_SPOT ? "a spot light" : "an environment");
            json_decref(out);
            return NULL;
        case LIGHT_TRIANGLES:
        case LIGHT_SPHERE: break; /* by their material */
        }
    }
    return out;
}

static bool write_json(const json_t *root, const char *path, struct err *e)
{
    struct out_file o;
    if (!out_open(&o, path, e))
        return false;
    if (json_dumpf(root, o.f, JSON_COMPACT | JSON_REAL_PRECISION(9)) != 0 ||
        fputc('\n', o.f) == EOF) {
        out_abandon(&o);
        return err_set(e, "%s: cannot write", path);
    }
    return out_commit(&o, e);
}

bool export_cycles(const struct scene *s, const struct camera *c, int depth, const char *path,
                   struct err *e)
{
    assert(depth >= 0 && c->width > 0 && c->height > 0);
    double extent = d3_length(d3_sub(wide(s->bounds_max), wide(s->bounds_min)));
    json_t *camera = NULL, *meshes = NULL, *lights = NULL, *root = NULL;
    struct err why = {"out of memory"};
    if (depth > MAX_DEPTH)
        return err_set(e, "Cycles: depth %d, at most %d are possible", depth, MAX_DEPTH);
    bool ok = check_materials(s, &why) && (camera = camera_json(s, c, &why)) != NULL &&
              (meshes = meshes_json(s, &why)) != NULL && (lights = lights_json(s, &why)) != NULL;
    if (ok) {
        root = json_pack("{si,si,si,si,sf,sO,so,sO,so,sO}", "assay_cycles", 1, "depth", depth,
                         "width", c->width, "height", c->height, "extent", extent, "camera", camera,
                         "materials", materials_json(s), "meshes", meshes, "spheres",
                         spheres_json(s, c->eye), "lights", lights);
        ok = root != NULL && write_json(root, path, &why);
    }
    json_decref(root);
    json_decref(camera);
    json_decref(meshes);
    json_decref(lights);
    return ok || err_set(e, "%s", why.msg);
}
