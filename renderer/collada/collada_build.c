/* The scene under construction: growing arrays, transforms to world space, twin lamps. */
#include "collada_internal.h"

#include <assert.h>
#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void *build_grow_now(struct loader *ld, void *data, size_t size, size_t count)
{
    if (ld->failed)
        return data;
    size_t more = count < 8 ? 8 : 2 * count;
    void *p = more <= SIZE_MAX / size ? realloc(data, more * size) : NULL;
    if (p == NULL)
        element_fail_memory(ld);
    return p != NULL ? p : data;
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

uint32_t build_add_material(struct loader *ld, const struct material *m)
{
    struct scene *s = &ld->scene;
    s->materials = build_grow(ld, s->materials, sizeof *s->materials, s->num_materials);
    if (ld->failed)
        return 0;
    s->materials[s->num_materials] = *m;
    return s->num_materials++;
}

void build_add_light(struct loader *ld, const struct light *l)
{
    struct scene *s = &ld->scene;
    s->lights = build_grow(ld, s->lights, sizeof *s->lights, s->num_lights);
    if (!ld->failed)
        s->lights[s->num_lights++] = *l;
}

void build_begin_object(struct loader *ld, const char *name, const char *symbol, uint32_t material,
                        bool is_lamp)
{
    struct scene *s = &ld->scene;
    char full[512];
    s->objects = build_grow(ld, s->objects, sizeof *s->objects, s->num_objects);
    ld->is_lamp = build_grow(ld, ld->is_lamp, sizeof *ld->is_lamp, s->num_objects);
    if (ld->failed)
        return;
    ld->is_lamp[s->num_objects] = is_lamp;
    struct object *o = &s->objects[s->num_objects++];
    *o = (struct object){
        .first_triangle = s->num_triangles, .first_sphere = s->num_spheres, .material = material};
    snprintf(full, sizeof full, "%.255s%s%.255s", name, symbol != NULL ? ":" : "",
             symbol != NULL ? symbol : "");
    build_copy_name(o->name, sizeof o->name, full);
}

vec3 build_to_float(dvec3 v)
{
    return v3((float)v.x, (float)v.y, (float)v.z);
}

vec3 build_place(struct loader *ld, const xmlNode *n, const char *what, const mat4 *m, dvec3 p)
{
    dvec3 w = mat4_point(m, p);
    if (!(fabs(w.x) <= FARTHEST && fabs(w.y) <= FARTHEST && fabs(w.z) <= FARTHEST))
        fail_at(ld, n, "%s is beyond %g or not a number", what, FARTHEST);
    return build_to_float(w);
}

vec3 build_direction(struct loader *ld, const xmlNode *n, dvec3 v)
{
    if (!d3_normalize(&v))
        fail_at(ld, n, "this has no direction");
    return build_to_float(v);
}

double build_transform_sign(struct loader *ld, const xmlNode *n, const mat4 *m)
{
    double det = mat4_det3(m);
    double size =
        d3_length(mat4_column(m, 0)) * d3_length(mat4_column(m, 1)) * d3_length(mat4_column(m, 2));
    if (!mat4_is_affine(m))
        fail_at(ld, n, "the last row of a matrix above is not 0 0 0 1");
    if (!(fabs(det) > 1e-9 * size) || !isfinite(det))
        fail_at(ld, n, "the transforms above are singular");
    return det < 0 ? -1 : 1;
}

void build_add_triangle(struct loader *ld, const xmlNode *n, const mat4 *m, double sign,
                        const struct corner c[3], const struct uv uv[3])
{
    struct scene *s = &ld->scene;
    /* A mirrored triangle keeps its front side by changing its winding. */
    const int order[3] = {0, sign < 0 ? 2 : 1, sign < 0 ? 1 : 2};
    const struct corner *in[3] = {&c[0], &c[order[1]], &c[order[2]]};
    vec3 p[3], normal[3];
    for (int k = 0; k < 3; k++)
        p[k] = build_place(ld, n, "a coordinate", m, in[k]->position);
    vec3 ng = cross(sub(p[1], p[0]), sub(p[2], p[0]));
    if (!(dot(ng, ng) >= FLT_MIN)) {
        s->num_degenerate++;
        return;
    }
    ng = normalize(ng);
    vec3 sum = v3(0, 0, 0);
    for (int k = 0; k < 3; k++) {
        vec3 f = in[k]->normal;
        dvec3 w = d3_scale(mat4_cofactor(m, d3_of(f)), sign);
        normal[k] = d3_normalize(&w) ? build_to_float(w) : ng;
        sum = add(sum, normal[k]);
    }
    if (dot(sum, ng) < 0)
        for (int k = 0; k < 3; k++)
            normal[k] = neg(normal[k]);
    const size_t i = s->num_triangles;
    if (i >= MAX_TRIANGLES)
        fail_at(ld, n, "more than %d triangles", MAX_TRIANGLES);
    s->position = build_grow(ld, s->position, sizeof p, i);
    s->normal = build_grow(ld, s->normal, sizeof normal, i);
    s->tri_material = build_grow(ld, s->tri_material, sizeof *s->tri_material, i);
    s->tri_object = build_grow(ld, s->tri_object, sizeof *s->tri_object, i);
    if (ld->has_textures)
        s->uv = build_grow(ld, s->uv, 3 * sizeof *s->uv, i);
    if (ld->failed)
        return;
    assert(s->num_objects > 0);
    struct object *o = &s->objects[s->num_objects - 1];
    memcpy(s->position + 3 * i, p, sizeof p);
    memcpy(s->normal + 3 * i, normal, sizeof normal);
    for (size_t k = 0; ld->has_textures && k < 3; k++)
        s->uv[3 * i + k] = uv != NULL ? uv[order[k]] : (struct uv){0, 0};
    s->tri_material[i] = o->material;
    s->tri_object[i] = s->num_objects - 1;
    s->num_triangles++;
    o->num_triangles++;
}

/* The factor by which m scales all lengths; 0 if directions differ. */
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

void build_add_sphere(struct loader *ld, const xmlNode *n, const mat4 *m, double radius,
                      float normal_out)
{
    struct scene *s = &ld->scene;
    const uint32_t i = s->num_spheres;
    double factor = uniform_scale(m);
    if (factor == 0)
        fail_at(ld, n, "a sphere under a scale that is not uniform is not supported");
    if (!(radius * factor <= FARTHEST && radius * factor >= 1e-18))
        fail_at(ld, n, "the sphere's radius of %g is out of range", radius * factor);
    vec3 centre = build_place(ld, n, "a coordinate", m, d3(0, 0, 0));
    s->spheres = build_grow(ld, s->spheres, sizeof *s->spheres, i);
    s->sphere_material = build_grow(ld, s->sphere_material, sizeof *s->sphere_material, i);
    s->sphere_object = build_grow(ld, s->sphere_object, sizeof *s->sphere_object, i);
    if (ld->failed)
        return;
    assert(s->num_objects > 0);
    struct object *o = &s->objects[s->num_objects - 1];
    s->spheres[i] = (struct sphere){
        .centre = centre, .radius = (float)(radius * factor), .normal_out = normal_out};
    s->sphere_material[i] = o->material;
    s->sphere_object[i] = s->num_objects - 1;
    s->num_spheres++;
    o->num_spheres++;
}

bool build_find_bounds(const struct loader *ld, bool with_lamps, vec3 *lo, vec3 *hi)
{
    const struct scene *s = &ld->scene;
    *lo = v3(FLT_MAX, FLT_MAX, FLT_MAX);
    *hi = neg(*lo);
    for (uint32_t i = 0; i < scene_num_primitives(s); i++) {
        vec3 its_lo, its_hi;
        if (!with_lamps && i < s->num_triangles && ld->is_lamp[s->tri_object[i]])
            continue;
        scene_primitive_bounds(s, i, &its_lo, &its_hi);
        *lo = vmin(*lo, its_lo);
        *hi = vmax(*hi, its_hi);
    }
    return lo->x <= hi->x;
}

/* Area (returned) and centroid of an object's triangles. */
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

/* True if they lie in one plane and have the same centroid (both within `reach`), and their areas
 * differ by less than a factor of 2. In the assignment's scenes the two rectangles are turned against
 * each other by 90 degrees, so outlines cannot be compared. */
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

/* Removes `gone` elements, from `first` on, from an array of `count`. */
static void cut_out(void *array, size_t size, size_t first, size_t gone, size_t count)
{
    char *at = (char *)array + first * size;
    memmove(at, at + gone * size, (count - first - gone) * size);
}

/* Removes object i, which must have triangles only, from the scene. */
static void remove_object(struct loader *ld, uint32_t i)
{
    struct scene *s = &ld->scene;
    const size_t first = s->objects[i].first_triangle, gone = s->objects[i].num_triangles,
                 count = s->num_triangles;
    cut_out(s->position, 3 * sizeof *s->position, first, gone, count);
    cut_out(s->normal, 3 * sizeof *s->normal, first, gone, count);
    if (s->uv != NULL)
        cut_out(s->uv, 3 * sizeof *s->uv, first, gone, count);
    cut_out(s->tri_material, sizeof *s->tri_material, first, gone, count);
    cut_out(s->tri_object, sizeof *s->tri_object, first, gone, count);
    cut_out(s->objects, sizeof *s->objects, i, 1, s->num_objects);
    cut_out(ld->is_lamp, sizeof *ld->is_lamp, i, 1, s->num_objects);
    s->num_triangles -= (uint32_t)gone;
    s->num_objects--;
    for (size_t t = first; t < s->num_triangles; t++)
        s->tri_object[t]--;
    for (uint32_t k = 0; k < s->num_spheres; k++)
        s->sphere_object[k] -= s->sphere_object[k] > i;
    for (uint32_t k = i; k < s->num_objects; k++)
        s->objects[k].first_triangle -= (uint32_t)gone;
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
