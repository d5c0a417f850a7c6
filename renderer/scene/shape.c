#include "shape.h"

#include "shape_simd.h"

#include <float.h>

struct shear shape_shear(const ray *r)
{
    const float d[3] = {r->d.x, r->d.y, r->d.z};
    float x = fabsf(d[0]), y = fabsf(d[1]), z = fabsf(d[2]);
    int kz = x > y && x > z ? 0 : y > z ? 1 : 2;
    struct shear s = {.o = {r->o.x, r->o.y, r->o.z},
                      .kx = (kz + 1) % 3,
                      .ky = (kz + 2) % 3,
                      .kz = kz,
                      .sz = 1 / d[kz]};
    s.sx = d[s.kx] * s.sz;
    s.sy = d[s.ky] * s.sz;
    return s;
}

/* Twice the signed area of triangle (origin, a, b). Neighbours that share the edge get the same
 * number, or exactly its negative, and rounding is monotonic, so its sign is right unless both
 * products round to the same; products of two floats are exact in double. */
static float edge_function(float ax, float ay, float bx, float by)
{
    float e = ax * by - ay * bx;
    return e != 0 ? e : (float)((double)ax * (double)by - (double)ay * (double)bx);
}

bool triangle_intersect(const struct triangle *tri, const ray *r, const struct shear *s, float *t,
                        float *u, float *v)
{
    float x[3], y[3], z[3];
    for (int k = 0; k < 3; k++) {
        z[k] = tri->p[k][s->kz] - s->o[s->kz];
        x[k] = tri->p[k][s->kx] - s->o[s->kx] - s->sx * z[k];
        y[k] = tri->p[k][s->ky] - s->o[s->ky] - s->sy * z[k];
    }
    float e0 = edge_function(x[1], y[1], x[2], y[2]);
    float e1 = edge_function(x[2], y[2], x[0], y[0]);
    float e2 = edge_function(x[0], y[0], x[1], y[1]);
    if ((e0 < 0 || e1 < 0 || e2 < 0) && (e0 > 0 || e1 > 0 || e2 > 0))
        return false;
    float det = e0 + e1 + e2;
    if (det == 0)
        return false;
    float inv = 1 / det;
    float bu = e1 * inv, bv = e2 * inv;
    float d = s->sz * (e0 * inv * z[0] + bu * z[1] + bv * z[2]);
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

/* 32 float steps: in tests/renderer/bvh/test_bvh.c (no_self_intersection) 1 step already prevents self-hits, and a
 * lamp 1 cm under a ceiling is still far away. */
static float coordinate_error(float magnitude)
{
    return 32 * FLT_EPSILON * maxf(magnitude, FLT_MIN);
}

static struct surface triangle_surface(const struct scene *s, uint32_t prim, float u, float v)
{
    const vec3 *p = s->position + 3 * (size_t)prim, *n = s->normal + 3 * (size_t)prim;
    vec3 e1 = sub(p[1], p[0]), e2 = sub(p[2], p[0]);
    vec3 ng = triangle_normal(e1, e2);
    vec3 ns = interpolate_normals(n[0], n[1], n[2], ng, u, v);
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
    vec3 n, p = sphere_place(sp->centre, sp->radius, sp->normal_out, r->o, r->d, t, &n);
    return (struct surface){
        .p = p, .ng = n, .ns = n, .eps = coordinate_error(max_abs(sp->centre) + sp->radius)};
}
