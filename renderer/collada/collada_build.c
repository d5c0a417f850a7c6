/* The scene under construction: growing arrays, transforms to world space, twin lamps. */
#include "collada_internal.h"

#include <assert.h>
#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void *build_grow(struct loader *ld, void *data, size_t size, size_t count, size_t *capacity)
{
    if (count < *capacity)
        return data;
    size_t more = *capacity < 8 ? 8 : 2 * *capacity;
    void *p = more <= SIZE_MAX / size ? realloc(data, more * size) : NULL;
    if (p == NULL)
        fail_memory(ld);
    else
        *capacity = more;
    return p;
}

void build_copy_name(char *out, size_t size, const char *name)
{
    size_t n = strlen(name);
    if (n >= size) {
        n = size - 1;
        while (n > 0 && ((unsigned char)name[n] & 0xc0) == 0x80)
            n--;
    }
    memcpy(out, name, n);
    out[n] = '\0';
    for (size_t i = 0; i < n; i++)
        if ((unsigned char)out[i] < 0x20 || out[i] == 0x7f)
            out[i] = '_';
}

bool build_add_material(struct loader *ld, const struct material *m, uint32_t *index)
{
    struct scene *s = &ld->scene;
    struct material *p =
        build_grow(ld, s->materials, sizeof *p, s->num_materials, &ld->cap_materials);
    if (p == NULL)
        return false;
    s->materials = p;
    *index = s->num_materials;
    p[s->num_materials++] = *m;
    return true;
}

bool build_add_light(struct loader *ld, const struct light *l)
{
    struct scene *s = &ld->scene;
    struct light *p = build_grow(ld, s->lights, sizeof *p, s->num_lights, &ld->cap_lights);
    if (p == NULL)
        return false;
    s->lights = p;
    p[s->num_lights++] = *l;
    return true;
}

bool build_begin_object(struct loader *ld, const char *name, const char *symbol, uint32_t material,
                        bool is_lamp)
{
    struct scene *s = &ld->scene;
    size_t capacity = ld->cap_objects;
    struct object *o = build_grow(ld, s->objects, sizeof *o, s->num_objects, &capacity);
    if (o == NULL)
        return false;
    s->objects = o;
    bool *lamps = build_grow(ld, ld->is_lamp, sizeof *lamps, s->num_objects, &ld->cap_objects);
    if (lamps == NULL)
        return false;
    ld->is_lamp = lamps;
    lamps[s->num_objects] = is_lamp;
    o = &o[s->num_objects++];
    *o = (struct object){
        .first_triangle = s->num_triangles, .first_sphere = s->num_spheres, .material = material};
    char full[512];
    snprintf(full, sizeof full, "%.255s%s%.255s", name, symbol != NULL ? ":" : "",
             symbol != NULL ? symbol : "");
    build_copy_name(o->name, sizeof o->name, full);
    return true;
}

static bool reserve_triangle(struct loader *ld)
{
    struct scene *s = &ld->scene;
    size_t count = s->num_triangles, cap[5];
    for (int i = 0; i < 5; i++)
        cap[i] = ld->cap_triangles;
    vec3 *p = build_grow(ld, s->position, 3 * sizeof *p, count, &cap[0]);
    if (p == NULL)
        return false;
    s->position = p;
    p = build_grow(ld, s->normal, 3 * sizeof *p, count, &cap[1]);
    if (p == NULL)
        return false;
    s->normal = p;
    uint32_t *id = build_grow(ld, s->tri_material, sizeof *id, count, &cap[2]);
    if (id == NULL)
        return false;
    s->tri_material = id;
    id = build_grow(ld, s->tri_object, sizeof *id, count, &cap[3]);
    if (id == NULL)
        return false;
    s->tri_object = id;
    if (ld->has_textures) {
        struct uv *uv = build_grow(ld, s->uv, 3 * sizeof *uv, count, &cap[4]);
        if (uv == NULL)
            return false;
        s->uv = uv;
    }
    ld->cap_triangles = cap[0];
    return true;
}

vec3 build_to_float(dvec3 v)
{
    return v3((float)v.x, (float)v.y, (float)v.z);
}

static bool to_world(struct loader *ld, const xmlNode *n, const mat4 *m, dvec3 p, vec3 *out)
{
    dvec3 w = mat4_point(m, p);
    if (!(fabs(w.x) <= FARTHEST && fabs(w.y) <= FARTHEST && fabs(w.z) <= FARTHEST))
        return fail_at(ld, n, "a coordinate is beyond %g or not a number", FARTHEST);
    *out = v3((float)w.x, (float)w.y, (float)w.z);
    return true;
}

bool build_transform_sign(struct loader *ld, const xmlNode *n, const mat4 *m, double *sign)
{
    if (!mat4_is_affine(m))
        return fail_at(ld, n, "the last row of a matrix above is not 0 0 0 1");
    double det = mat4_det3(m);
    double size =
        d3_length(mat4_column(m, 0)) * d3_length(mat4_column(m, 1)) * d3_length(mat4_column(m, 2));
    if (!(fabs(det) > 1e-9 * size) || !isfinite(det))
        return fail_at(ld, n, "the transforms above are singular");
    *sign = det < 0 ? -1 : 1;
    return true;
}

bool build_add_triangle(struct loader *ld, const xmlNode *n, const mat4 *m, double sign,
                        const struct corner c[3], const struct uv uv[3])
{
    struct scene *s = &ld->scene;
    /* A mirrored triangle keeps its front side by changing its winding. */
    const int order[3] = {0, sign < 0 ? 2 : 1, sign < 0 ? 1 : 2};
    const struct corner *in[3] = {&c[0], &c[order[1]], &c[order[2]]};
    vec3 p[3], normal[3];
    for (int k = 0; k < 3; k++)
        if (!to_world(ld, n, m, in[k]->position, &p[k]))
            return false;
    vec3 ng = cross(sub(p[1], p[0]), sub(p[2], p[0]));
    if (!(dot(ng, ng) >= FLT_MIN)) {
        s->num_degenerate++;
        return true;
    }
    ng = normalize(ng);
    vec3 sum = v3(0, 0, 0);
    for (int k = 0; k < 3; k++) {
        const float *f = in[k]->normal;
        dvec3 w = d3_scale(mat4_cofactor(m, d3(f[0], f[1], f[2])), sign);
        normal[k] = d3_normalize(&w) ? v3((float)w.x, (float)w.y, (float)w.z) : ng;
        sum = add(sum, normal[k]);
    }
    if (dot(sum, ng) < 0)
        for (int k = 0; k < 3; k++)
            normal[k] = neg(normal[k]);
    if (s->num_triangles >= MAX_TRIANGLES)
        return fail_at(ld, n, "more than %d triangles", MAX_TRIANGLES);
    if (!reserve_triangle(ld))
        return false;
    assert(s->num_objects > 0);
    struct object *o = &s->objects[s->num_objects - 1];
    uint32_t i = s->num_triangles++;
    memcpy(s->position + 3 * (size_t)i, p, sizeof p);
    memcpy(s->normal + 3 * (size_t)i, normal, sizeof normal);
    for (size_t k = 0; ld->has_textures && k < 3; k++)
        s->uv[3 * (size_t)i + k] = uv != NULL ? uv[order[k]] : (struct uv){0, 0};
    s->tri_material[i] = o->material;
    s->tri_object[i] = s->num_objects - 1;
    o->num_triangles++;
    return true;
}

/* The one factor by which m scales all lengths; 0 if there is none. */
static double uniform_scale(const mat4 *m)
{
    dvec3 a[3] = {mat4_column(m, 0), mat4_column(m, 1), mat4_column(m, 2)};
    double s2 = (d3_dot(a[0], a[0]) + d3_dot(a[1], a[1]) + d3_dot(a[2], a[2])) / 3;
    for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++)
            if (!(fabs(d3_dot(a[i], a[j]) - (i == j ? s2 : 0)) <= 2e-5 * s2))
                return 0;
    return sqrt(s2);
}

bool build_add_sphere(struct loader *ld, const xmlNode *n, const mat4 *m, double radius,
                      float normal_out)
{
    struct scene *s = &ld->scene;
    double factor = uniform_scale(m);
    if (factor == 0)
        return fail_at(ld, n, "a sphere under a scale that is not uniform is not supported");
    if (!(radius * factor <= FARTHEST && radius * factor >= 1e-18))
        return fail_at(ld, n, "the sphere's radius of %g is out of range", radius * factor);
    struct sphere sphere = {.radius = (float)(radius * factor), .normal_out = normal_out};
    if (!to_world(ld, n, m, d3(0, 0, 0), &sphere.centre))
        return false;
    size_t cap[3] = {ld->cap_spheres, ld->cap_spheres, ld->cap_spheres};
    struct sphere *p = build_grow(ld, s->spheres, sizeof *p, s->num_spheres, &cap[0]);
    if (p == NULL)
        return false;
    s->spheres = p;
    uint32_t *id = build_grow(ld, s->sphere_material, sizeof *id, s->num_spheres, &cap[1]);
    if (id == NULL)
        return false;
    s->sphere_material = id;
    id = build_grow(ld, s->sphere_object, sizeof *id, s->num_spheres, &cap[2]);
    if (id == NULL)
        return false;
    s->sphere_object = id;
    ld->cap_spheres = cap[0];
    assert(s->num_objects > 0);
    struct object *o = &s->objects[s->num_objects - 1];
    s->spheres[s->num_spheres] = sphere;
    s->sphere_material[s->num_spheres] = o->material;
    s->sphere_object[s->num_spheres++] = s->num_objects - 1;
    o->num_spheres++;
    return true;
}

bool build_find_bounds(const struct loader *ld, bool with_lamps, vec3 *lo, vec3 *hi)
{
    const struct scene *s = &ld->scene;
    *lo = v3(FLT_MAX, FLT_MAX, FLT_MAX);
    *hi = neg(*lo);
    for (size_t k = 0; k < 3 * (size_t)s->num_triangles; k++) {
        if (!with_lamps && ld->is_lamp[s->tri_object[k / 3]])
            continue;
        *lo = vmin(*lo, s->position[k]);
        *hi = vmax(*hi, s->position[k]);
    }
    for (uint32_t i = 0; i < s->num_spheres; i++) {
        vec3 r = v3(s->spheres[i].radius, s->spheres[i].radius, s->spheres[i].radius);
        *lo = vmin(*lo, sub(s->spheres[i].centre, r));
        *hi = vmax(*hi, add(s->spheres[i].centre, r));
    }
    return lo->x <= hi->x;
}

/* Area and centre of area of an object's triangles. */
static float surface_centre(const struct scene *s, const struct object *o, vec3 *centre)
{
    vec3 sum = v3(0, 0, 0);
    float area = 0;
    for (uint32_t t = o->first_triangle; t < o->first_triangle + o->num_triangles; t++) {
        const vec3 *p = s->position + 3 * (size_t)t;
        float a = 0.5f * length(cross(sub(p[1], p[0]), sub(p[2], p[0])));
        sum = mad(sum, a / 3, add(p[0], add(p[1], p[2])));
        area += a;
    }
    *centre = area > 0 ? scale(sum, 1 / area) : sum;
    return area;
}

/* Do they lie in one plane, with one centre (both within `reach`), and differ less than twofold in
 * area? In the assignment's scenes the two rectangles are turned against each other by 90 degrees,
 * so outlines cannot be compared. */
static bool are_twins(const struct scene *s, const struct object *lamp, const struct object *mesh,
                      float reach)
{
    vec3 a, b;
    float lamp_area = surface_centre(s, lamp, &a), mesh_area = surface_centre(s, mesh, &b);
    if (!(length(sub(a, b)) <= reach) || !(mesh_area < 2 * lamp_area && lamp_area < 2 * mesh_area))
        return false;
    const vec3 *q = s->position + 3 * (size_t)lamp->first_triangle;
    vec3 n = normalize(cross(sub(q[1], q[0]), sub(q[2], q[0])));
    for (size_t k = 3 * (size_t)mesh->first_triangle;
         k < 3 * ((size_t)mesh->first_triangle + mesh->num_triangles); k++)
        if (!(fabsf(dot(n, sub(s->position[k], a))) <= reach))
            return false;
    return true;
}

/* Takes an object that has triangles only out of the scene. */
static void remove_object(struct loader *ld, uint32_t i)
{
    struct scene *s = &ld->scene;
    const struct object o = s->objects[i];
    size_t from = o.first_triangle + o.num_triangles, tail = s->num_triangles - from;
    memmove(s->position + 3 * (size_t)o.first_triangle, s->position + 3 * from,
            3 * tail * sizeof *s->position);
    memmove(s->normal + 3 * (size_t)o.first_triangle, s->normal + 3 * from,
            3 * tail * sizeof *s->normal);
    if (s->uv != NULL)
        memmove(s->uv + 3 * (size_t)o.first_triangle, s->uv + 3 * from, 3 * tail * sizeof *s->uv);
    memmove(s->tri_material + o.first_triangle, s->tri_material + from,
            tail * sizeof *s->tri_material);
    memmove(s->tri_object + o.first_triangle, s->tri_object + from, tail * sizeof *s->tri_object);
    s->num_triangles -= o.num_triangles;
    for (uint32_t t = o.first_triangle; t < s->num_triangles; t++)
        s->tri_object[t]--;
    for (uint32_t k = 0; k < s->num_spheres; k++)
        if (s->sphere_object[k] > i)
            s->sphere_object[k]--;
    s->num_objects--;
    memmove(s->objects + i, s->objects + i + 1, (s->num_objects - i) * sizeof *s->objects);
    memmove(ld->is_lamp + i, ld->is_lamp + i + 1, (s->num_objects - i) * sizeof *ld->is_lamp);
    for (uint32_t k = i; k < s->num_objects; k++)
        s->objects[k].first_triangle -= o.num_triangles;
}

void build_drop_twin_lamps(struct loader *ld)
{
    struct scene *s = &ld->scene;
    vec3 lo, hi;
    build_find_bounds(ld, true, &lo, &hi);
    float reach = 0.01f * length(sub(hi, lo));
    unsigned dropped = 0;
    for (uint32_t lamp = 0; lamp < s->num_objects; lamp++) {
        if (!ld->is_lamp[lamp] || s->objects[lamp].num_triangles == 0)
            continue;
        for (uint32_t i = 0; i < s->num_objects; i++) {
            const struct object *o = &s->objects[i];
            if (ld->is_lamp[i] || o->num_triangles == 0 || o->num_spheres != 0 ||
                rgb_is_zero(s->materials[o->material].radiance) ||
                !are_twins(s, &s->objects[lamp], o, reach))
                continue;
            if (dropped++ == 0)
                snprintf(s->note, sizeof s->note,
                         "the area light '%s' is the lamp; the emissive mesh '%s' in its place is "
                         "left out",
                         s->objects[lamp].name, o->name);
            remove_object(ld, i);
            if (i < lamp)
                lamp--;
            i--;
        }
    }
    if (dropped > 1) {
        size_t n = strlen(s->note);
        snprintf(s->note + n, sizeof s->note - n, " (and %u more like it)", dropped - 1);
    }
}
