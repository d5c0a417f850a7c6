/* Packet traversal: LANES rays that are alike go through the tree as one bundle; in a leaf, primitives
 * are tested one by one against all of them. Part of traverse.c. */
#ifndef ASSAY_TRAVERSE_PACKET_H
#define ASSAY_TRAVERSE_PACKET_H

#include "hit_simd.h"
#include "ray_simd.h"
#include "traverse_stack.h"

/* LANES rays with the same axes of the shear, a ray to a lane, and what they have found. */
struct packet {
    const struct rayv *q;
    int k[3];
    vf limit, u, v; /* limit -infinity: the ray is finished */
    vi prim;
};

INLINE void packet_init(const struct rayv *q, struct packet *p)
{
    p->q = q;
    p->k[2] = q->axis[0];
    p->k[0] = (p->k[2] + 1) % 3;
    p->k[1] = (p->k[2] + 2) % 3;
    p->limit = q->limit;
    p->u = q->u;
    p->v = q->v;
    p->prim = q->prim;
}

/* Tests all primitives of a leaf against all rays. Reduces limit to the nearest hit; any: to -infinity
 * for each ray that hits something it does not ignore. True if a ray hit something. */
INLINE bool packet_leaf(const struct wide_leaf *l, struct packet *p, bool spheres, bool any)
{
    const struct rayv *q = p->q;
    vm changed = vm_set(false);
    for (int j = 0; j < LANES && l->prim[j] != NO_HIT; j++) {
        vf t, u, v;
        vm hit;
        if (spheres) {
            u = v = vf_set(0);
            hit = sphere_hit(q->o[0] - l->p[0][0][j], q->o[1] - l->p[0][1][j],
                             q->o[2] - l->p[0][2][j], q->d[0], q->d[1], q->d[2],
                             vf_set(l->p[1][0][j]), q->tmin, p->limit, &t);
            if (!bits(hit))
                continue;
        } else {
            vf x[3], y[3], z[3];
            for (int c = 0; c < 3; c++) {
                z[c] = l->p[c][p->k[2]][j] - q->o[p->k[2]];
                x[c] = l->p[c][p->k[0]][j] - q->o[p->k[0]] - q->sx * z[c];
                y[c] = l->p[c][p->k[1]][j] - q->o[p->k[1]] - q->sy * z[c];
            }
            hit = sheared_hit(x, y, z, q->sz, &t, &u, &v);
            if (!bits(hit))
                continue;
            hit &= vf_lt(q->tmin, t) & vf_le(t, p->limit);
        }
        const vi prim = vi_set((int32_t)l->prim[j]);
        if (any) {
            hit &= ~vi_eq(prim, q->ignore);
            p->limit = vf_select(hit, vf_set(-INFINITY), p->limit);
            p->prim = vi_select(hit, prim, p->prim);
        } else {
            hit &= vf_lt(t, p->limit) | vi_lt(prim, p->prim);
            p->limit = vf_select(hit, t, p->limit);
            p->u = vf_select(hit, u, p->u);
            p->v = vf_select(hit, v, p->v);
            p->prim = vi_select(hit, prim, p->prim);
        }
        changed |= hit;
    }
    return bits(changed) != 0;
}

INLINE float largest(vf a)
{
    return -vf_least(-a);
}

/* All rays of a packet as one: intervals of origins and of inverse directions, all of one sign. */
struct bundle {
    vf inv[3][2], enter[3], leave[3], tmin;
    int row[3];
};

/* True if the rays are alike enough to go together: same signs and same largest axis of the
 * directions, components within 0.1, origins within w->alike. */
INLINE bool are_alike(const struct wide *w, const struct rayv *q)
{
    vm alike = vi_eq(q->axis, vi_set(q->axis[0]));
    for (int a = 0; a < 3; a++) {
        unsigned negative = bits(vf_lt(q->inv[a], vf_set(0)));
        if (negative != 0 && negative != ALL_LANES)
            return false;
        alike &= vf_lt(vf_abs(q->d[a] - q->d[a][0]), vf_set(0.1f));
        alike &= vf_le(vf_abs(q->o[a] - q->o[a][0]), vf_set(w->alike));
    }
    return bits(alike) == ALL_LANES;
}

static void bundle_init(const struct wide *w, const struct rayv *q, struct bundle *b)
{
    float grow = largest(growth(w, q));
    for (int a = 0; a < 3; a++) {
        bool negative = q->inv[a][0] < 0;
        float low = vf_least(q->o[a]) - grow, high = largest(q->o[a]) + grow;
        b->inv[a][0] = vf_set(vf_least(q->inv[a]));
        b->inv[a][1] = vf_set(largest(q->inv[a]));
        b->enter[a] = vf_set(negative ? low : high);
        b->leave[a] = vf_set(negative ? high : low);
        b->row[a] = 2 * a + negative;
    }
    b->tmin = vf_set(vf_least(q->tmin));
}

/* Mask of the children that some ray of the bundle may meet; *enter: lower bounds of the entries. */
INLINE unsigned bundle_node(const struct wide_node *n, const struct bundle *b, vf limit, vf *enter)
{
    vf t0 = b->tmin, t1 = limit;
    for (int a = 0; a < 3; a++) {
        vf to = vf_load(n->plane[b->row[a]]) - b->enter[a];
        t0 = vf_max(t0, vf_min(to * b->inv[a][0], to * b->inv[a][1]));
        to = vf_load(n->plane[b->row[a] ^ 1]) - b->leave[a];
        t1 = vf_min(t1, vf_max(to * b->inv[a][0], to * b->inv[a][1]));
    }
    *enter = t0;
    return bits(vf_le(t0, t1));
}

INLINE void packet_traverse(const struct wide *w, const struct bundle *b, struct packet *p,
                            bool any, struct bvh_stats *stats)
{
    stacked stack[STACK], *top = stack;
    uint32_t ref = 0;
    float farthest = largest(p->limit);
    vf limit = vf_set(farthest), t;
    for (;;) {
        while (!(ref & WIDE_LEAF)) {
            const struct wide_node *n = (const struct wide_node *)(w->arena + ref);
            stats->box_tests++;
            unsigned hit = bundle_node(n, b, limit, &t);
            if (hit == 0)
                goto pop;
            ref = next_of(w, n, hit, t, true, &top);
        }
        stats->primitive_tests++;
        const struct wide_leaf *l = at(w, ref);
        if (ref & WIDE_SPHERES ? packet_leaf(l, p, true, any) : packet_leaf(l, p, false, any)) {
            farthest = largest(p->limit);
            limit = vf_set(farthest);
        }
    pop:
        do {
            if (top == stack)
                return;
            top--;
        } while (stacked_t(*top) > farthest);
        ref = stacked_ref(*top);
    }
}

static void packet_result(const struct packet *p, const uint16_t *lane, struct hits *h)
{
    vm none = vi_eq(p->prim, vi_set(NOTHING));
    rayv_store(p->q, lane, vf_select(none, p->q->tmax, p->limit), p->u, p->v,
               vi_select(none, vi_set(-1), p->prim), h);
}

static void packet_verdict(const struct packet *p, const uint16_t *lane, bool *occluded)
{
    rayv_store_flags(p->q, lane, ~vi_eq(p->prim, vi_set(NOTHING)), occluded);
}

#endif
