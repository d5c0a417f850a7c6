/* Rays of a batch in lanes, with what the tests of boxes and primitives need. Part of traverse.c and
 * small_scene_trace.c. */
#ifndef ASSAY_RAY_SIMD_H
#define ASSAY_RAY_SIMD_H

#include "bvh_wide.h"
#include "renderer/math/simd.h"

#include <float.h>

enum { NOTHING = INT32_MAX /* no primitive yet: above any number */ };

struct rayv {
    vf o[3], d[3], sx, sy, sz, tmin, tmax;
    vf limit; /* the largest float below tmax: a hit is at most that far, and another at the very same
                 distance counts only if its number is smaller */
    vf u, v; /* with prim: what has been met so far */
    vi prim;
    bool in_row;                   /* the lanes are consecutive */
    vf inv[3], enter[3], leave[3]; /* plane * inv - enter: t of entry; - leave: of exit */
    vi axis;                       /* of the largest component of d, the third of the shear */
    vi ignore;
};

/* a[lane[0]], a[lane[1]], ... of floats or whole numbers */
INLINE vf gather(const void *a, const uint16_t *lane, bool in_row)
{
    const char *at = a;
    float v[LANES];
    if (in_row)
        return vf_load_any(at + sizeof *v * lane[0]);
    for (int i = 0; i < LANES; i++)
        memcpy(v + i, at + sizeof *v * lane[i], sizeof *v);
    return vf_load_any(v);
}

/* As shape_shear(). */
INLINE void rayv_shear(struct rayv *q)
{
    vf x = vf_abs(q->d[0]), y = vf_abs(q->d[1]), z = vf_abs(q->d[2]);
    vm is_x = vf_lt(y, x) & vf_lt(z, x), is_y = ~is_x & vf_lt(z, y);
    q->axis = vi_select(is_x, vi_set(0), vi_select(is_y, vi_set(1), vi_set(2)));
    q->sz = 1 / vf_select(is_x, q->d[0], vf_select(is_y, q->d[1], q->d[2]));
    q->sx = vf_select(is_x, q->d[1], vf_select(is_y, q->d[2], q->d[0])) * q->sz;
    q->sy = vf_select(is_x, q->d[2], vf_select(is_y, q->d[0], q->d[1])) * q->sz;
}

/* Loads origins, directions, tmin and tmax. */
INLINE void rayv_load(const struct rays *r, const uint16_t lane[LANES], struct rayv *q)
{
    bool in_row = true;
    for (int i = 1; i < LANES; i++)
        in_row &= lane[i] == lane[0] + i;
    q->o[0] = gather(r->o.x, lane, in_row);
    q->o[1] = gather(r->o.y, lane, in_row);
    q->o[2] = gather(r->o.z, lane, in_row);
    q->d[0] = gather(r->d.x, lane, in_row);
    q->d[1] = gather(r->d.y, lane, in_row);
    q->d[2] = gather(r->d.z, lane, in_row);
    q->tmin = gather(r->tmin, lane, in_row);
    q->tmax = gather(r->tmax, lane, in_row);
    q->in_row = in_row;
}

/* Stores the results of all lanes; prim -1: nothing hit. */
INLINE void rayv_store(const struct rayv *q, const uint16_t lane[LANES], vf t, vf u, vf v, vi prim,
                       struct hits *h)
{
    if (q->in_row) {
        vf_store_any(h->t + lane[0], t);
        vf_store_any(h->u + lane[0], u);
        vf_store_any(h->v + lane[0], v);
        vf_store_any(h->prim + lane[0], (vf)prim);
        return;
    }
    for (int i = 0; i < LANES; i++) {
        h->t[lane[i]] = t[i];
        h->u[lane[i]] = u[i];
        h->v[lane[i]] = v[i];
        h->prim[lane[i]] = (uint32_t)prim[i];
    }
}

INLINE void rayv_store_flags(const struct rayv *q, const uint16_t lane[LANES], vm mask, bool *flag)
{
    bool flags[LANES];
    store_flags(flags, mask);
    if (q->in_row)
        memcpy(flag + lane[0], flags, sizeof flags);
    else
        for (int i = 0; i < LANES; i++)
            flag[lane[i]] = flags[i];
}

/* The largest float below a. */
INLINE vf below(vf a)
{
    vi b = (vi)a, one = vi_select(vi_lt(vi_set(-1), b), vi_set(-1), vi_set(1));
    return (vf)vi_select(vf_eq(a, vf_set(0)), vi_set(INT32_MIN + 1), b + one);
}

INLINE void rayv_init(const struct rays *r, const uint16_t lane[LANES], struct rayv *q)
{
    rayv_load(r, lane, q);
    q->limit = below(q->tmax);
    rayv_shear(q);
    q->u = q->v = vf_set(0);
    q->prim = vi_set(NOTHING);
}

/* Takes over the hits so far from *h. */
INLINE void rayv_go_on(const struct hits *h, const uint16_t lane[LANES], struct rayv *q)
{
    vi prim = (vi)gather(h->prim, lane, q->in_row);
    vm met = vi_lt(vi_set(-1), prim);
    q->limit = vf_select(met, gather(h->t, lane, q->in_row), q->limit);
    q->prim = vi_select(met, prim, q->prim);
    q->u = gather(h->u, lane, q->in_row);
    q->v = gather(h->v, lane, q->in_row);
}

/* LANES entries of a list of n from entry k on; past the end the last one is repeated (in `filled`). */
static inline const uint16_t *rayv_from(const uint16_t *lane, int k, int n, uint16_t filled[LANES])
{
    if (n - k >= LANES)
        return lane + k;
    for (int i = 0; i < LANES; i++)
        filled[i] = lane[k + i < n ? k + i : n - 1];
    return filled;
}

INLINE void rayv_ignore(const struct rays *r, const uint16_t lane[LANES], struct rayv *q)
{
    q->ignore = (vi)gather(r->ignore, lane, q->in_row);
}

/* By how much boxes are grown. Rounding in the triangle test displaces corners by at most 6 half ulps of
 * their distance from the ray's origin [Woop13 3.3]; the reciprocal, products and difference of the slab
 * test add at most 4 half ulps of the distance plus the coordinate. Twice the sum. */
INLINE vf growth(const struct wide *w, const struct rayv *q)
{
    vf reach = vf_set(0), coordinate = reach;
    for (int a = 0; a < 3; a++) {
        reach = vf_max(reach, vf_max(vf_abs(w->min[a] - q->o[a]), vf_abs(w->max[a] - q->o[a])));
        coordinate = vf_max(coordinate, vf_abs(q->o[a]));
    }
    return 10 * FLT_EPSILON * (reach + coordinate);
}

/* 1/d, with components of d near zero replaced by a number large enough that no NaN or infinity arises. */
INLINE vf inverse(vf d, vf grow)
{
    vf tiny = vf_max(vf_set(1e-18f), grow * 1e-29f), sign = (vf)((vi)d & vi_set(INT32_MIN));
    return 1 / vf_select(vf_lt(vf_abs(d), tiny), (vf)((vi)tiny | (vi)sign), d);
}

INLINE void rayv_slabs(const struct wide *w, struct rayv *q)
{
    vf grow = growth(w, q);
    for (int a = 0; a < 3; a++) {
        vf inv = q->inv[a] = inverse(q->d[a], grow), by = grow * vf_abs(inv);
        q->enter[a] = q->o[a] * inv + by;
        q->leave[a] = q->o[a] * inv - by;
    }
}

/* Lanes that meet the tree's box within (tmin, limit]. */
INLINE unsigned rayv_box(const struct wide *w, const struct rayv *q)
{
    vf begin = q->tmin, end = q->limit;
    for (int a = 0; a < 3; a++) {
        vm backwards = vf_lt(q->inv[a], vf_set(0));
        vf low = vf_set(w->tree_min[a]), high = vf_set(w->tree_max[a]);
        begin = vf_max(begin, mul_sub(vf_select(backwards, high, low), q->inv[a], q->enter[a]));
        end = vf_min(end, mul_sub(vf_select(backwards, low, high), q->inv[a], q->leave[a]));
    }
    return bits(vf_le(begin, end));
}

#endif
