#include "bvh.h"
#include "bvh_internal.h"
#include "small_scene.h"
#include "traverse.h"
#include "renderer/scene/shape.h"

#include <float.h>
#include <stdlib.h>

enum { STACK = BVH_MAX_DEPTH + 16 };

const char *const bvh_kind_names[] = {"bruteforce", "centroid", "sah", "wide", NULL};

struct bvh *bvh_build(const struct scene *s, enum bvh_kind kind, struct err *e)
{
    return bvh_build_on(s, kind, ISA_AUTO, 1, e);
}

struct bvh *bvh_build_on(const struct scene *s, enum bvh_kind kind, enum isa isa, int threads,
                         struct err *e)
{
    struct bvh *t = calloc(1, sizeof *t);
    if (t == NULL)
        goto fail;
    if (scene_num_primitives(s) == 0)
        kind = BVH_BRUTE_FORCE;
    if (kind == BVH_WIDE) {
        t->wide = wide_build(s, isa == ISA_SCALAR ? ISA_AUTO : isa, threads, e);
        if (t->wide != NULL)
            return t;
        free(t);
        return NULL;
    }
    t->scene = s;
    t->num_primitives = scene_num_primitives(s);
    t->order = malloc(((size_t)t->num_primitives + 1) * sizeof *t->order);
    t->triangles = calloc((size_t)t->num_primitives + 1, sizeof *t->triangles);
    if (t->order == NULL || t->triangles == NULL)
        goto fail;
    for (uint32_t i = 0; i < t->num_primitives; i++)
        t->order[i] = i;
    if (kind != BVH_BRUTE_FORCE && !bvh_build_tree(t, kind))
        goto fail;
    for (uint32_t i = 0; i < t->num_primitives; i++) {
        uint32_t prim = t->order[i];
        if (prim >= s->num_triangles)
            continue;
        const vec3 *p = s->position + 3 * (size_t)prim;
        for (int k = 0; k < 3; k++) {
            t->triangles[i].p[k][0] = p[k].x;
            t->triangles[i].p[k][1] = p[k].y;
            t->triangles[i].p[k][2] = p[k].z;
        }
    }
    return t;
fail:
    bvh_free(t);
    err_set(e, "out of memory for the acceleration structure of %u primitives",
            scene_num_primitives(s));
    return NULL;
}

void bvh_free(struct bvh *t)
{
    if (t == NULL)
        return;
    wide_free(t->wide);
    free(t->nodes);
    free(t->order);
    free(t->triangles);
    free(t);
}

double bvh_sah_cost(const struct bvh *t)
{
    if (t->wide != NULL)
        return t->wide->cost;
    if (t->nodes == NULL)
        return t->num_primitives;
    double root = half_area(t->nodes[0].box), cost = 0;
    for (uint32_t i = 0; i < t->num_nodes; i++) {
        double p = root > 0 ? half_area(t->nodes[i].box) / root : 1;
        cost += p * (t->nodes[i].count > 0 ? t->nodes[i].count : 2);
    }
    return cost;
}

int bvh_depth(const struct bvh *t)
{
    return t->wide != NULL ? t->wide->depth : t->depth;
}

uint32_t bvh_num_nodes(const struct bvh *t)
{
    return t->wide != NULL ? t->wide->num_nodes : t->num_nodes;
}

size_t bvh_size(const struct bvh *t)
{
    if (t->wide != NULL)
        return sizeof *t + sizeof *t->wide + t->wide->used +
               (t->wide->flat != NULL ? sizeof *t->wide->flat : 0);
    return sizeof *t + t->num_nodes * sizeof *t->nodes +
           t->num_primitives * (sizeof *t->order + sizeof *t->triangles);
}

/* 1/d with zeros replaced by something tiny, so that no 0 * inf = NaN comes up below. */
static vec3 safe_inverse(vec3 d)
{
    const float tiny = 1e-18f;
    return v3(1 / (fabsf(d.x) < tiny ? copysignf(tiny, d.x) : d.x),
              1 / (fabsf(d.y) < tiny ? copysignf(tiny, d.y) : d.y),
              1 / (fabsf(d.z) < tiny ? copysignf(tiny, d.z) : d.z));
}

/* A ray prepared for the slab test. */
struct slab_ray {
    vec3 before, behind, inv; /* origin for the lower and for the upper planes; 1/d */
};

/* Rounding in the triangle test displaces corners by at most 6 half ulps of their distance from the
 * ray's origin. A box must be hit by every ray for which the test accepts a primitive in it, or rays
 * slip through edges that different boxes share [Woop13 3.3]; so boxes are grown by 8 half ulps of
 * the sum of the largest distance and the largest coordinate. */
static struct slab_ray slab_ray(const struct bvh *t, const ray *r)
{
    const struct box *root = &t->nodes[0].box;
    vec3 a = sub(root->min, r->o), b = sub(root->max, r->o);
    float reach = maxf(maxf(maxf(fabsf(a.x), fabsf(b.x)), maxf(fabsf(a.y), fabsf(b.y))),
                       maxf(fabsf(a.z), fabsf(b.z)));
    float coordinate = maxf(fabsf(r->o.x), maxf(fabsf(r->o.y), fabsf(r->o.z)));
    float e = 4 * FLT_EPSILON * (reach + coordinate);
    vec3 grow = v3(e, e, e);
    return (struct slab_ray){add(r->o, grow), sub(r->o, grow), safe_inverse(r->d)};
}

/* Slab test; the exit distance is increased by the rounding of three operations [Ize13]. */
static bool box_hit(const struct box *b, const struct slab_ray *r, float tmin, float tmax)
{
    float x0 = (b->min.x - r->before.x) * r->inv.x, x1 = (b->max.x - r->behind.x) * r->inv.x;
    float y0 = (b->min.y - r->before.y) * r->inv.y, y1 = (b->max.y - r->behind.y) * r->inv.y;
    float z0 = (b->min.z - r->before.z) * r->inv.z, z1 = (b->max.z - r->behind.z) * r->inv.z;
    float near = maxf(maxf(minf(x0, x1), minf(y0, y1)), maxf(minf(z0, z1), tmin));
    float far = minf(minf(maxf(x0, x1), maxf(y0, y1)), minf(maxf(z0, z1), tmax));
    return near <= far * (1 + 4 * FLT_EPSILON);
}

static bool primitive_hit(const struct bvh *t, uint32_t i, const ray *r, const struct shear *s,
                          float *d, float *u, float *v)
{
    uint32_t prim = t->order[i];
    if (prim < t->scene->num_triangles)
        return triangle_intersect(&t->triangles[i], r, s, d, u, v);
    *u = *v = 0;
    return sphere_intersect(&t->scene->spheres[prim - t->scene->num_triangles], r, d);
}

/* Shortens r->tmax to the nearest hit among list entries [first, last). */
static bool leaf_closest(const struct bvh *t, uint32_t first, uint32_t last, ray *r,
                         const struct shear *s, float *u, float *v, uint32_t *prim)
{
    bool any = false;
    for (uint32_t i = first; i < last; i++) {
        float d, bu, bv;
        if (!primitive_hit(t, i, r, s, &d, &bu, &bv))
            continue;
        r->tmax = d;
        *u = bu;
        *v = bv;
        *prim = t->order[i];
        any = true;
    }
    return any;
}

static void closest(const struct bvh *t, ray r, float *d, float *u, float *v, uint32_t *prim,
                    struct bvh_stats *stats)
{
    *prim = NO_HIT;
    stats->rays++;
    const struct shear s = shape_shear(&r);
    if (t->nodes == NULL) {
        stats->primitive_tests += t->num_primitives;
        leaf_closest(t, 0, t->num_primitives, &r, &s, u, v, prim);
        *d = r.tmax;
        return;
    }
    const struct slab_ray slabs = slab_ray(t, &r);
    const bool backwards[3] = {r.d.x < 0, r.d.y < 0, r.d.z < 0};
    uint32_t stack[STACK];
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const struct node *n = &t->nodes[stack[--top]];
        stats->box_tests++;
        if (!box_hit(&n->box, &slabs, r.tmin, r.tmax))
            continue;
        if (n->count > 0) {
            stats->primitive_tests += n->count;
            leaf_closest(t, n->first, n->first + n->count, &r, &s, u, v, prim);
        } else {
            uint32_t near = backwards[n->axis];
            stack[top++] = n->first + 1 - near;
            stack[top++] = n->first + near;
        }
    }
    *d = r.tmax;
}

static bool is_occluded(const struct bvh *t, const ray *r, uint32_t ignore, struct bvh_stats *stats)
{
    float d, u, v;
    const struct shear s = shape_shear(r);
    stats->rays++;
    if (t->nodes == NULL) {
        for (uint32_t i = 0; i < t->num_primitives; i++) {
            stats->primitive_tests++;
            if (t->order[i] != ignore && primitive_hit(t, i, r, &s, &d, &u, &v))
                return true;
        }
        return false;
    }
    const struct slab_ray slabs = slab_ray(t, r);
    uint32_t stack[STACK];
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const struct node *n = &t->nodes[stack[--top]];
        stats->box_tests++;
        if (!box_hit(&n->box, &slabs, r->tmin, r->tmax))
            continue;
        if (n->count == 0) {
            stack[top++] = n->first + 1;
            stack[top++] = n->first;
            continue;
        }
        for (uint32_t i = n->first; i < n->first + n->count; i++) {
            stats->primitive_tests++;
            if (t->order[i] != ignore && primitive_hit(t, i, r, &s, &d, &u, &v))
                return true;
        }
    }
    return false;
}

void bvh_closest(const struct bvh *t, const struct rays *r, const uint16_t *lane, int num_lanes,
                 struct hits *h, struct bvh_stats *stats)
{
    if (t->wide != NULL) {
        t->wide->kernel->closest(t->wide, r, lane, num_lanes, h, stats);
        return;
    }
    for (int k = 0; k < num_lanes; k++) {
        int i = lane[k];
        closest(t, rays_get(r, i), &h->t[i], &h->u[i], &h->v[i], &h->prim[i], stats);
    }
}

void bvh_occluded(const struct bvh *t, const struct rays *r, const uint16_t *lane, int num_lanes,
                  bool *occluded, struct bvh_stats *stats)
{
    if (t->wide != NULL) {
        t->wide->kernel->occluded(t->wide, r, lane, num_lanes, occluded, stats);
        return;
    }
    for (int k = 0; k < num_lanes; k++) {
        ray one = rays_get(r, lane[k]);
        occluded[lane[k]] = is_occluded(t, &one, r->ignore[lane[k]], stats);
    }
}
