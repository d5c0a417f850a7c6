#include "bvh.h"
#include "bvh_wide.h"
#include "wide_kernel.h"
#include "shape.h"

#include <float.h>
#include <stdlib.h>

enum {
    MAX_LEAF = 4,
    NUM_BINS = 16,
    /* Past this depth a node is split in the middle of its list, so a path has at most
     * MAX_FREE_DEPTH + 32 nodes however the primitives lie, and the stacks below suffice. */
    MAX_FREE_DEPTH = 64,
    STACK = 112
};

struct box {
    vec3 min, max;
};

/* Inner: count 0, children at first and first+1, split along axis. Leaf: primitives first.. in
 * order[]. */
struct node {
    struct box box;
    uint32_t first;
    uint16_t count, axis;
};

struct bvh {
    struct wide *wide; /* BVH_WIDE, and then nothing else is set */
    const struct scene *scene;
    struct node *nodes;         /* node 0 is the root; NULL: brute force */
    uint32_t *order;            /* primitive numbers in leaf order */
    struct triangle *triangles; /* in leaf order; unused entries for spheres */
    uint32_t num_nodes, num_primitives;
    int depth;
};

const char *const bvh_kind_names[] = {"bruteforce", "centroid", "sah", "wide", NULL};

static const struct box empty_box = {{FLT_MAX, FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX, -FLT_MAX}};

static struct box box_union(struct box a, struct box b)
{
    return (struct box){vmin(a.min, b.min), vmax(a.max, b.max)};
}

static struct box box_add(struct box a, vec3 p)
{
    return (struct box){vmin(a.min, p), vmax(a.max, p)};
}

static float half_area(struct box b)
{
    vec3 d = sub(b.max, b.min);
    return d.x < 0 ? 0 : d.x * d.y + d.y * d.z + d.z * d.x;
}

static float axis_of(vec3 v, int axis)
{
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

static vec3 centre(struct box b)
{
    return scale(add(b.min, b.max), 0.5f);
}

static struct box primitive_box(const struct scene *s, uint32_t prim)
{
    if (prim < s->num_triangles) {
        const vec3 *p = s->position + 3 * (size_t)prim;
        return box_add(box_add((struct box){p[0], p[0]}, p[1]), p[2]);
    }
    const struct sphere *sp = &s->spheres[prim - s->num_triangles];
    vec3 r = v3(sp->radius, sp->radius, sp->radius);
    return (struct box){sub(sp->centre, r), add(sp->centre, r)};
}

struct build {
    struct bvh *bvh;
    enum bvh_kind kind;
    struct box *boxes; /* by primitive */
};

/* Where to cut primitives [first, first+count) of the list: along which axis, and how many of them
 * go left after a partition by value; false if no cut along an axis helps. */
static bool choose_centroid_split(const struct build *b, uint32_t first, uint32_t count,
                                  struct box centroids, int *axis, float *value)
{
    vec3 extent = sub(centroids.max, centroids.min);
    *axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
    double sum = 0;
    for (uint32_t i = first; i < first + count; i++)
        sum += axis_of(centre(b->boxes[b->bvh->order[i]]), *axis);
    *value = (float)(sum / count);
    return axis_of(extent, *axis) > 0;
}

static int bin_of(float c, float lo, float scale_to_bins)
{
    int k = (int)((c - lo) * scale_to_bins);
    return k < 0 ? 0 : k >= NUM_BINS ? NUM_BINS - 1 : k;
}

static bool choose_sah_split(const struct build *b, uint32_t first, uint32_t count, struct box node,
                             struct box centroids, int *axis, float *value)
{
    float best = FLT_MAX;
    for (int a = 0; a < 3; a++) {
        float lo = axis_of(centroids.min, a), hi = axis_of(centroids.max, a);
        if (!(hi > lo))
            continue;
        float to_bins = NUM_BINS / (hi - lo);
        struct box bin[NUM_BINS], right[NUM_BINS];
        uint32_t in_bin[NUM_BINS] = {0}, in_right[NUM_BINS];
        for (int k = 0; k < NUM_BINS; k++)
            bin[k] = empty_box;
        for (uint32_t i = first; i < first + count; i++) {
            struct box pb = b->boxes[b->bvh->order[i]];
            int k = bin_of(axis_of(centre(pb), a), lo, to_bins);
            bin[k] = box_union(bin[k], pb);
            in_bin[k]++;
        }
        struct box sweep = empty_box;
        uint32_t n = 0;
        for (int k = NUM_BINS - 1; k > 0; k--) {
            sweep = box_union(sweep, bin[k]);
            n += in_bin[k];
            right[k] = sweep;
            in_right[k] = n;
        }
        sweep = empty_box;
        n = 0;
        for (int k = 0; k + 1 < NUM_BINS; k++) {
            sweep = box_union(sweep, bin[k]);
            n += in_bin[k];
            if (n == 0 || in_right[k + 1] == 0)
                continue;
            float cost =
                half_area(sweep) * (float)n + half_area(right[k + 1]) * (float)in_right[k + 1];
            if (cost < best) {
                best = cost;
                *axis = a;
                *value = (float)(k + 1);
            }
        }
    }
    if (best == FLT_MAX)
        return false;
    return count > MAX_LEAF || best + half_area(node) < half_area(node) * (float)count;
}

/* Partitions the list by the chosen cut; how many went left. */
static uint32_t partition(const struct build *b, uint32_t first, uint32_t count,
                          struct box centroids, int axis, float value)
{
    float lo = axis_of(centroids.min, axis), hi = axis_of(centroids.max, axis);
    uint32_t *list = b->bvh->order + first, left = 0;
    for (uint32_t i = 0; i < count; i++) {
        float c = axis_of(centre(b->boxes[list[i]]), axis);
        bool goes_left =
            b->kind == BVH_SAH ? bin_of(c, lo, NUM_BINS / (hi - lo)) < (int)value : c < value;
        if (goes_left) {
            uint32_t swap = list[i];
            list[i] = list[left];
            list[left++] = swap;
        }
    }
    return left;
}

static void build_node(struct build *b, uint32_t index, uint32_t first, uint32_t count, int depth)
{
    struct bvh *t = b->bvh;
    struct box node = empty_box, centroids = empty_box;
    for (uint32_t i = first; i < first + count; i++) {
        struct box pb = b->boxes[t->order[i]];
        node = box_union(node, pb);
        centroids = box_add(centroids, centre(pb));
    }
    t->nodes[index] = (struct node){.box = node, .first = first, .count = (uint16_t)count};
    if (depth > t->depth)
        t->depth = depth;
    if (count <= (b->kind == BVH_SAH ? 1 : MAX_LEAF))
        return;
    int axis = 0;
    float value = 0;
    bool split = b->kind == BVH_SAH
                     ? choose_sah_split(b, first, count, node, centroids, &axis, &value)
                     : choose_centroid_split(b, first, count, centroids, &axis, &value);
    uint32_t left = 0;
    if (split && depth < MAX_FREE_DEPTH)
        left = partition(b, first, count, centroids, axis, value);
    if (left == 0 || left == count) {
        if (count <= MAX_LEAF)
            return;
        left = count / 2; /* coincident centroids, or a tree grown too deep */
    }
    uint32_t child = t->num_nodes;
    t->num_nodes += 2;
    t->nodes[index].first = child;
    t->nodes[index].count = 0;
    t->nodes[index].axis = (uint16_t)axis;
    build_node(b, child, first, left, depth + 1);
    build_node(b, child + 1, first + left, count - left, depth + 1);
}

static bool build_tree(struct bvh *t, enum bvh_kind kind)
{
    struct build b = {.bvh = t, .kind = kind};
    b.boxes = malloc(t->num_primitives * sizeof *b.boxes);
    t->nodes = malloc(2 * (size_t)t->num_primitives * sizeof *t->nodes);
    if (b.boxes == NULL || t->nodes == NULL) {
        free(b.boxes);
        return false;
    }
    for (uint32_t i = 0; i < t->num_primitives; i++)
        b.boxes[i] = primitive_box(t->scene, i);
    t->num_nodes = 1;
    build_node(&b, 0, 0, t->num_primitives, 0);
    free(b.boxes);
    return true;
}

struct bvh *bvh_build(const struct scene *s, enum bvh_kind kind, struct err *e)
{
    return bvh_build_for(s, kind, ISA_AUTO, e);
}

struct bvh *bvh_build_for(const struct scene *s, enum bvh_kind kind, enum isa isa, struct err *e)
{
    struct bvh *t = calloc(1, sizeof *t);
    if (t == NULL)
        goto fail;
    if (kind == BVH_WIDE) {
        t->wide = wide_build(s, isa == ISA_SCALAR ? ISA_AUTO : isa, e);
        if (t->wide != NULL)
            return t;
        free(t);
        return NULL;
    }
    t->scene = s;
    t->num_primitives = scene_num_primitives(s);
    t->order = malloc(t->num_primitives * sizeof *t->order);
    t->triangles = calloc(t->num_primitives, sizeof *t->triangles);
    if (t->order == NULL || t->triangles == NULL)
        goto fail;
    for (uint32_t i = 0; i < t->num_primitives; i++)
        t->order[i] = i;
    if (kind != BVH_BRUTE_FORCE && !build_tree(t, kind))
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
        return sizeof *t + sizeof *t->wide + t->wide->used;
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

/* A ray as the boxes want it. */
struct slab_ray {
    vec3 before, behind, inv; /* origin for the lower and for the upper planes; 1/d */
};

/* The triangle test moves the corners by its own rounding, at most 6 half steps of float of their
 * distance from the origin. A box has to be hit by every ray that the test lets hit what is in it,
 * or rays slip through the edges of neighbours in different boxes [Woop13 3.3]; so the boxes are
 * grown by 8, of the largest distance and coordinate there is. */
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

/* Entry and exit of the slabs, the exit widened by the rounding of three operations [Ize13]. */
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
    const struct shear s = shear_of(&r);
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
    const struct shear s = shear_of(r);
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
