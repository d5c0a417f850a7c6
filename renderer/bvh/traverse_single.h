/* Single-ray traversal: one ray against the boxes of a node, LANES at a time, then against the primitives of a
 * leaf. Part of traverse.c. */
#ifndef ASSAY_TRAVERSE_SINGLE_H
#define ASSAY_TRAVERSE_SINGLE_H

#include "hit_simd.h"
#include "ray_simd.h"
#include "traverse_stack.h"

enum { ROW = sizeof(vf) };

/* One ray, and what it has found. */
struct single {
    const struct rayv *q; /* lane `lane` of it */
    int lane;
    size_t row[3]; /* planes of entry, in bytes from the start of a node */
    int k[3];      /* axes of the shear */
    float limit, u, v;
    int32_t prim;
    unsigned hit; /* children of the root, and where the ray enters them */
    vf enter;
};

INLINE float lane_of(const vf *a, int i)
{
    return ((const float *)a)[i];
}

INLINE vf splat(const vf *a, int i)
{
    return vf_set(lane_of(a, i));
}

INLINE void single_init(const struct rayv *q, int lane, struct single *s)
{
    static const int shear[3][3] = {{1, 2, 0}, {2, 0, 1}, {0, 1, 2}};
    s->q = q;
    s->lane = lane;
    for (int a = 0; a < 3; a++) {
        s->row[a] = ROW * (2 * (size_t)a + (lane_of(&q->inv[a], lane) < 0));
        s->k[a] = shear[((const int32_t *)&q->axis)[lane]][a];
    }
    s->limit = lane_of(&q->limit, lane);
    s->u = lane_of(&q->u, lane);
    s->v = lane_of(&q->v, lane);
    s->prim = ((const int32_t *)&q->prim)[lane];
}

/* Lanes of the leaf that the ray meets inside (tmin, limit]. */
INLINE vm single_leaf(const struct wide_leaf *l, const struct single *s, bool spheres, vf limit,
                      vf *t, vf *u, vf *v)
{
    const struct rayv *q = s->q;
    const int i = s->lane;
    if (spheres) {
        *u = *v = vf_set(0);
        return sphere_hit(
            splat(&q->o[0], i) - vf_load(l->p[0][0]), splat(&q->o[1], i) - vf_load(l->p[0][1]),
            splat(&q->o[2], i) - vf_load(l->p[0][2]), splat(&q->d[0], i), splat(&q->d[1], i),
            splat(&q->d[2], i), vf_load(l->p[1][0]), splat(&q->tmin, i), limit, t);
    }
    const int kx = s->k[0], ky = s->k[1], kz = s->k[2];
    vf ox = splat(&q->o[kx], i), oy = splat(&q->o[ky], i), oz = splat(&q->o[kz], i);
    vf sx = splat(&q->sx, i), sy = splat(&q->sy, i), x[3], y[3], z[3];
    for (int c = 0; c < 3; c++) {
        z[c] = vf_load(l->p[c][kz]) - oz;
        x[c] = vf_load(l->p[c][kx]) - ox - sx * z[c];
        y[c] = vf_load(l->p[c][ky]) - oy - sy * z[c];
    }
    vm pass = sheared_hit(x, y, z, splat(&q->sz, i), t, u, v);
    if (!bits(pass))
        return pass;
    return pass & vf_lt(splat(&q->tmin, i), *t) & vf_le(*t, limit);
}

INLINE void single_keep_nearest(const struct wide_leaf *l, unsigned hit, vf t, vf u, vf v,
                                struct single *s)
{
    do {
        int i = __builtin_ctz(hit);
        hit &= hit - 1;
        if (lane_of(&t, i) < s->limit || (int32_t)l->prim[i] < s->prim) {
            s->limit = lane_of(&t, i);
            s->u = lane_of(&u, i);
            s->v = lane_of(&v, i);
            s->prim = (int32_t)l->prim[i];
        }
    } while (hit);
}

/* A ray's data for the slab test, kept in registers. */
struct slabs {
    vf inv[3], enter[3], leave[3], tmin;
    size_t row[3];
};

INLINE struct slabs single_slabs(const struct single *s)
{
    struct slabs b = {.tmin = splat(&s->q->tmin, s->lane)};
    for (int a = 0; a < 3; a++) {
        b.row[a] = s->row[a];
        b.inv[a] = splat(&s->q->inv[a], s->lane);
        b.enter[a] = splat(&s->q->enter[a], s->lane);
        b.leave[a] = splat(&s->q->leave[a], s->lane);
    }
    return b;
}

INLINE vf row_at(const void *node, size_t row)
{
    return *(const vf *)((const char *)node + row);
}

/* Children that the ray meets within (tmin, limit], and where it enters them. */
INLINE unsigned single_node(const struct wide_node *n, const struct slabs *b, vf limit, vf *enter)
{
    vf x0 = mul_sub(row_at(n, b->row[0]), b->inv[0], b->enter[0]);
    vf y0 = mul_sub(row_at(n, b->row[1]), b->inv[1], b->enter[1]);
    vf z0 = mul_sub(row_at(n, b->row[2]), b->inv[2], b->enter[2]);
    vf x1 = mul_sub(row_at(n, b->row[0] ^ ROW), b->inv[0], b->leave[0]);
    vf y1 = mul_sub(row_at(n, b->row[1] ^ ROW), b->inv[1], b->leave[1]);
    vf z1 = mul_sub(row_at(n, b->row[2] ^ ROW), b->inv[2], b->leave[2]);
    *enter = vf_max(vf_max(x0, y0), vf_max(z0, b->tmin));
    return bits(vf_le(*enter, vf_min(vf_min(x1, y1), vf_min(z1, limit))));
}

/* Tests the children of the root. Done for LANES rays before any of them goes on, so that none
 * waits for another. */
INLINE void single_root(const struct wide *w, struct single *s)
{
    const struct slabs b = single_slabs(s);
    s->hit = single_node((const struct wide_node *)w->arena, &b, vf_set(s->limit), &s->enter);
}

/* Descends from *ref to a leaf, always to the nearest child; pushes the other children hit. False: the
 * ray meets no child of a node. */
INLINE bool single_descend(const struct wide *w, const struct slabs *b, vf limit, uint32_t *ref,
                           stacked **top, uint64_t *nodes)
{
    while (!(*ref & WIDE_LEAF)) {
        const struct wide_node *n = (const struct wide_node *)(w->arena + *ref);
        vf enter;
        ++*nodes;
        unsigned hit = single_node(n, b, limit, &enter);
        if (hit == 0)
            return false;
        *ref = next_of(w, n, hit, enter, true, top);
    }
    return true;
}

/* Tests a leaf. True: the ray is finished, which only an occlusion test can be here. */
INLINE bool single_visit(const struct wide *w, struct single *s, uint32_t ref, vf limit, bool any)
{
    const struct wide_leaf *l = at(w, ref);
    vf t, u, v;
    vm met = single_leaf(l, s, ref & WIDE_SPHERES, limit, &t, &u, &v);
    if (!bits(met))
        return false;
    if (!any) {
        single_keep_nearest(l, bits(met), t, u, v, s);
        return false;
    }
    const vi ignore = vi_set(((const int32_t *)&s->q->ignore)[s->lane]);
    if (!bits(met & ~vi_eq(vi_load_any(l->prim), ignore)))
        return false;
    s->prim = 0; /* whichever */
    return true;
}

/* Pops into *ref the next entry that is not beyond the ray's limit. False if there is none. */
INLINE bool single_pop(const struct single *s, bool any, const stacked *stack, stacked **top,
                       uint32_t *ref)
{
    do {
        if (*top == stack)
            return false;
        --*top;
    } while (!any && stacked_t(**top) > s->limit);
    *ref = stacked_ref(**top);
    return true;
}

/* Takes one ray from the root's children to its end. any: s->prim then only tells, by not being NOTHING, that it is
 * occluded. */
INLINE void single_alone(const struct wide *w, struct single *s, bool any, struct bvh_stats *stats)
{
    stats->box_tests++;
    if (s->hit == 0)
        return;
    stacked stack[STACK], *top = stack;
    uint32_t ref = next_of(w, (const struct wide_node *)w->arena, s->hit, s->enter, true, &top);
    const struct slabs b = single_slabs(s);
    vf limit = vf_set(s->limit);
    uint64_t nodes = 0, leaves = 0;
    do {
        if (!single_descend(w, &b, limit, &ref, &top, &nodes))
            continue;
        leaves++;
        if (single_visit(w, s, ref, limit, any))
            break;
        if (!any)
            limit = vf_set(s->limit);
    } while (single_pop(s, any, stack, &top, &ref));
    stats->box_tests += nodes;
    stats->primitive_tests += leaves;
}

/* A ray on its way: the reference that is next, and its stack. */
struct way {
    struct single *s;
    stacked *stack, *top;
    uint32_t ref;
};

/* Visits one node or leaf. False: the ray is finished. */
INLINE bool way_step(const struct wide *w, struct way *on, bool any, uint64_t *nodes,
                     uint64_t *leaves)
{
    struct single *s = on->s;
    if (on->ref & WIDE_LEAF) {
        ++*leaves;
        return !single_visit(w, s, on->ref, vf_set(s->limit), any) &&
               single_pop(s, any, on->stack, &on->top, &on->ref);
    }
    const struct wide_node *n = (const struct wide_node *)(w->arena + on->ref);
    const struct slabs b = single_slabs(s);
    vf enter;
    ++*nodes;
    unsigned hit = single_node(n, &b, vf_set(s->limit), &enter);
    if (hit == 0)
        return single_pop(s, any, on->stack, &on->top, &on->ref);
    on->ref = next_of(w, n, hit, enter, false, &on->top);
    return true;
}

/* The same for up to LANES rays, one step each in turn: while one waits for memory the others go on. */
static __attribute__((noinline)) void single_in_turns(const struct wide *w, struct single *s, int n,
                                                      bool any, struct bvh_stats *stats)
{
    stacked stack[LANES][STACK];
    struct way way[LANES], *end = way;
    uint64_t nodes = (uint64_t)n, leaves = 0;
    for (int k = 0; k < n; k++, s++)
        if (s->hit != 0) {
            *end = (struct way){.s = s, .stack = stack[k], .top = stack[k]};
            end->ref =
                next_of(w, (const struct wide_node *)w->arena, s->hit, s->enter, false, &end->top);
            end++;
        }
    while (end > way)
        for (struct way *on = way; on < end;)
            if (way_step(w, on, any, &nodes, &leaves)) {
                fetch_ahead(w, on->ref, true);
                __builtin_prefetch((const char *)at(w, on->ref) + sizeof(struct wide_node));
                on++;
            } else {
                *on = *--end;
            }
    stats->box_tests += nodes;
    stats->primitive_tests += leaves;
}

#endif
