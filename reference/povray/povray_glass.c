#include "povray_glass.h"

#include <stdlib.h>
#include <string.h>

/* How far touching bodies may overlap, relative to the extent. */
#define TOUCH 1e-4

struct box {
    vec3 lo, hi;
};

bool povray_is_glass(const struct material *m)
{
    return m->kind == MATERIAL_GLASS || m->kind == MATERIAL_REFRACTION;
}

static bool refracts_only(const struct scene *s, const struct object *o)
{
    const struct material *m = &s->materials[o->material];
    return m->kind == MATERIAL_REFRACTION && !material_is_black(m);
}

bool povray_hides_total_reflection(const struct scene *s)
{
    for (uint32_t i = 0; i < s->num_objects; i++)
        if (s->objects[i].num_triangles > 0 && refracts_only(s, &s->objects[i]))
            return true;
    return false;
}

static struct box triangle_box(const vec3 *p)
{
    return (struct box){vmin(p[0], vmin(p[1], p[2])), vmax(p[0], vmax(p[1], p[2]))};
}

static bool boxes_meet(const struct box *a, const struct box *b, double touch)
{
    vec3 lo = vmax(a->lo, b->lo), hi = vmin(a->hi, b->hi);
    return (double)lo.x < (double)hi.x - touch && (double)lo.y < (double)hi.y - touch &&
           (double)lo.z < (double)hi.z - touch;
}

static double distance_to_box(vec3 p, const struct box *b)
{
    vec3 near = vmin(vmax(p, b->lo), b->hi);
    return (double)length(sub(p, near));
}

static int by_ends(const void *a, const void *b)
{
    return memcmp(a, b, 2 * sizeof(vec3));
}

/* *is_closed: each edge occurs exactly once in each direction, and the volume is positive. Fails only out of memory. */
static bool look_if_closed(const struct scene *s, const struct object *o, bool *is_closed,
                           struct err *e)
{
    size_t n = 3 * (size_t)o->num_triangles;
    vec3 *edge = malloc(4 * n * sizeof *edge);
    if (edge == NULL)
        return err_set(e, "POV-Ray: out of memory for the glass '%s'", o->name);
    vec3 *back = edge + 2 * n;
    double volume = 0;
    for (size_t i = 0; i < n; i++) {
        const vec3 *p = &s->position[3 * (size_t)o->first_triangle + i / 3 * 3];
        vec3 zero = {0}; /* so that no coordinate is -0: edges are compared by their bytes */
        vec3 a = add(p[i % 3], zero), b = add(p[(i + 1) % 3], zero);
        edge[2 * i] = back[2 * i + 1] = a;
        edge[2 * i + 1] = back[2 * i] = b;
        if (i % 3 == 0)
            volume += (double)dot(p[0], cross(p[1], p[2]));
    }
    qsort(edge, n, 2 * sizeof *edge, by_ends);
    qsort(back, n, 2 * sizeof *back, by_ends);
    bool closed = memcmp(edge, back, 2 * n * sizeof *edge) == 0;
    for (size_t i = 1; closed && i < n; i++)
        closed = by_ends(&edge[2 * i - 2], &edge[2 * i]) != 0;
    free(edge);
    *is_closed = closed && volume > 0;
    return true;
}

static bool check_material(const struct material *m, struct err *e)
{
    if (!rgb_is_zero(m->radiance))
        return err_set(e, "POV-Ray: material '%s' is glass that emits, which is not verified",
                       m->name);
    if (m->kind == MATERIAL_GLASS && m->schlick)
        return err_set(e, "POV-Ray has Fresnel's equations, not Schlick's approximation ('%s')",
                       m->name);
    rgb r = m->reflectance;
    if (m->kind == MATERIAL_GLASS && (r.r != 1 || r.g != 1 || r.b != 1))
        return err_set(
            e, "POV-Ray cannot express glass '%s': the factor of its reflected ray is not 1",
            m->name);
    if (!(m->ior >= 1.001f))
        return err_set(e, "POV-Ray is not verified with the index %g of '%s': it must be above 1",
                       (double)m->ior, m->name);
    return true;
}

static bool collides(const struct object *o, const char *with, struct err *e)
{
    return err_set(e, "POV-Ray: %s may be inside the glass '%s' or touch it", with, o->name);
}

/* Checks the triangles of object o as one body. */
static bool check_mesh(const struct scene *s, const struct object *o, vec3 eye, double touch,
                       struct err *e)
{
    struct box body = triangle_box(&s->position[3 * (size_t)o->first_triangle]), other;
    for (uint32_t i = 1; i < o->num_triangles; i++) {
        struct box t = triangle_box(&s->position[3 * ((size_t)o->first_triangle + i)]);
        body = (struct box){vmin(body.lo, t.lo), vmax(body.hi, t.hi)};
    }
    bool is_closed = false;
    if (!look_if_closed(s, o, &is_closed, e))
        return false;
    if (!is_closed)
        return err_set(e, "POV-Ray: the glass '%s' is not a closed surface with its front outside",
                       o->name);
    if (distance_to_box(eye, &body) <= touch)
        return collides(o, "the camera", e);
    for (uint32_t i = 0; i < s->num_triangles; i++) {
        if (i - o->first_triangle < o->num_triangles)
            continue;
        other = triangle_box(&s->position[3 * (size_t)i]);
        if (boxes_meet(&body, &other, touch))
            return collides(o, s->objects[s->tri_object[i]].name, e);
    }
    for (uint32_t i = 0; i < s->num_spheres; i++) {
        vec3 p = s->spheres[i].centre;
        vec3 far = vmax(sub(p, body.lo), sub(body.hi, p)); /* to the corner furthest away */
        double r = (double)s->spheres[i].radius;
        if (distance_to_box(p, &body) < r - touch && (double)length(far) > r + touch)
            return collides(o, s->objects[s->sphere_object[i]].name, e);
    }
    return true;
}

static bool check_ball(const struct scene *s, const struct object *o, uint32_t ball, vec3 eye,
                       double touch, struct err *e)
{
    const struct sphere *b = &s->spheres[ball];
    double radius = (double)b->radius;
    if (b->normal_out < 0)
        return err_set(e, "POV-Ray: the glass '%s' is a sphere whose front is inside", o->name);
    if ((double)length(sub(eye, b->centre)) <= radius + touch)
        return collides(o, "the camera", e);
    for (uint32_t i = 0; i < s->num_triangles; i++) {
        struct box t = triangle_box(&s->position[3 * (size_t)i]);
        if (distance_to_box(b->centre, &t) < radius - touch)
            return collides(o, s->objects[s->tri_object[i]].name, e);
    }
    for (uint32_t i = 0; i < s->num_spheres; i++) {
        const struct sphere *c = &s->spheres[i];
        double d = (double)length(sub(c->centre, b->centre)), r = (double)c->radius;
        bool apart = d > radius + r - touch, around = d + radius < r + touch;
        if (i != ball && !apart && !around)
            return collides(o, s->objects[s->sphere_object[i]].name, e);
    }
    return true;
}

/* Is there a mirror, glass or environment, which would make total reflection visible? */
static bool shows_reflection(const struct scene *s)
{
    bool shows = s->environment != NULL;
    for (uint32_t i = 0; i < s->num_objects; i++) {
        const struct material *m = &s->materials[s->objects[i].material];
        shows |= (m->kind == MATERIAL_MIRROR || m->kind == MATERIAL_GLASS) && !material_is_black(m);
    }
    return shows;
}

bool povray_check_glass(const struct scene *s, const struct camera *c, double extent, struct err *e)
{
    double touch = TOUCH * extent;
    for (uint32_t k = 0; k < s->num_objects; k++) {
        const struct object *o = &s->objects[k];
        const struct material *m = &s->materials[o->material];
        if (!povray_is_glass(m) || material_is_black(m))
            continue;
        if (!check_material(m, e))
            return false;
        if (o->num_triangles > 0 && !check_mesh(s, o, c->eye, touch, e))
            return false;
        for (uint32_t i = 0; i < o->num_spheres; i++)
            if (!check_ball(s, o, o->first_sphere + i, c->eye, touch, e))
                return false;
    }
    if (povray_hides_total_reflection(s) && shows_reflection(s))
        return err_set(e,
                       "POV-Ray reflects totally where refraction alone has nothing, which shows "
                       "beside mirrors, glass or an environment");
    return true;
}
