#include "shape.h"

#include <float.h>

bool triangle_intersect(const struct triangle *tri, const ray *r, float *t, float *u, float *v)
{
    vec3 h = cross(r->d, tri->e2);
    float det = dot(tri->e1, h);
    if (det == 0)
        return false;
    float inv = 1 / det;
    vec3 s = sub(r->o, tri->p);
    float bu = inv * dot(s, h);
    if (!(bu >= 0 && bu <= 1))
        return false;
    vec3 q = cross(s, tri->e1);
    float bv = inv * dot(r->d, q);
    if (!(bv >= 0 && bu + bv <= 1))
        return false;
    float d = inv * dot(tri->e2, q);
    if (!(d > r->tmin && d < r->tmax))
        return false;
    *t = d;
    *u = bu;
    *v = bv;
    return true;
}

bool sphere_intersect(const struct sphere *s, const ray *r, float *t)
{
    vec3 f = sub(r->o, s->centre);
    float b = -dot(f, r->d);
    /* The discriminant from the closest approach, not from b^2 - c: far spheres keep their digits.
     */
    vec3 closest = mad(f, b, r->d);
    float disc = s->radius * s->radius - dot(closest, closest);
    if (disc < 0)
        return false;
    float c = dot(f, f) - s->radius * s->radius;
    float q = b + copysignf(sqrtf(disc), b);
    float t0 = q != 0 ? c / q : 0, t1 = q;
    if (t0 > t1) {
        float swap = t0;
        t0 = t1;
        t1 = swap;
    }
    if (t0 > r->tmin && t0 < r->tmax)
        *t = t0;
    else if (t1 > r->tmin && t1 < r->tmax)
        *t = t1;
    else
        return false;
    return true;
}

static float max_abs(vec3 p)
{
    return maxf(fabsf(p.x), maxf(fabsf(p.y), fabsf(p.z)));
}

/* 32 steps: in the self-hit test of tests/test_bvh.c hits end at 1, and a lamp 1 cm under a ceiling
 * is still far. */
static float coordinate_error(float magnitude)
{
    return 32 * FLT_EPSILON * maxf(magnitude, FLT_MIN);
}

static struct surface triangle_surface(const struct scene *s, uint32_t prim, float u, float v)
{
    const vec3 *p = s->position + 3 * (size_t)prim, *n = s->normal + 3 * (size_t)prim;
    vec3 e1 = sub(p[1], p[0]), e2 = sub(p[2], p[0]);
    vec3 ng = normalize(cross(e1, e2));
    vec3 ns = mad(mad(scale(n[0], 1 - u - v), u, n[1]), v, n[2]);
    float l = length(ns);
    ns = l > 0 ? scale(ns, 1 / l) : ng;
    if (dot(ns, ng) < 0)
        ns = neg(ns);
    float magnitude = maxf(max_abs(p[0]), maxf(max_abs(p[1]), max_abs(p[2])));
    return (struct surface){
        .p = mad(mad(p[0], u, e1), v, e2), .ng = ng, .ns = ns, .eps = coordinate_error(magnitude)};
}

struct surface surface_at(const struct scene *s, uint32_t prim, const ray *r, float t, float u,
                          float v)
{
    if (prim < s->num_triangles)
        return triangle_surface(s, prim, u, v);
    const struct sphere *sp = &s->spheres[prim - s->num_triangles];
    vec3 n = normalize(sub(mad(r->o, t, r->d), sp->centre));
    /* Back onto the sphere: the hit of a distant ray is off by its own rounding. */
    vec3 p = mad(sp->centre, sp->radius, n);
    n = scale(n, sp->normal_out);
    return (struct surface){
        .p = p, .ng = n, .ns = n, .eps = coordinate_error(max_abs(sp->centre) + sp->radius)};
}

vec3 surface_origin(const struct surface *s, vec3 w)
{
    return mad(s->p, dot(w, s->ng) < 0 ? -s->eps : s->eps, s->ng);
}
