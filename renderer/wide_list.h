/* A scene without a tree: eight rays at a time against every primitive, each ray sheared along its own
 * largest axis. Part of wide_kernel.c. */
#ifndef ASSAY_WIDE_LIST_H
#define ASSAY_WIDE_LIST_H

#include "wide_flat.h"
#include "wide_hit.h"
#include "wide_octet.h"

/* Corners as the rays see them; edge functions in both directions, so that a triangle finds its own. */
struct list {
    vf x[FLAT_CORNERS], y[FLAT_CORNERS], z[FLAT_CORNERS], edge[FLAT_EDGES][2];
};

INLINE void list_init(const struct wide_flat *f, const struct octet *q, struct list *l)
{
    const vi is_x = vi_eq(q->axis, vi_set(0)), is_y = vi_eq(q->axis, vi_set(1));
    for (int i = 0; i < f->num_corners; i++) {
        vf x = f->corner[i][0] - q->o[0], y = f->corner[i][1] - q->o[1];
        vf z = f->corner[i][2] - q->o[2];
        vf along = vf_select(is_x, x, vf_select(is_y, y, z));
        l->z[i] = along;
        l->x[i] = vf_select(is_x, y, vf_select(is_y, z, x)) - q->sx * along;
        l->y[i] = vf_select(is_x, z, vf_select(is_y, x, y)) - q->sy * along;
    }
    const vf zero = vf_set(0);
    vi touched = vi_set(0);
    for (int i = 0; i < f->num_edges; i++) {
        const int a = f->edge[i][0], b = f->edge[i][1];
        vf e = l->x[a] * l->y[b] - l->y[a] * l->x[b];
        touched |= vf_eq(e, zero);
        l->edge[i][0] = e;
        l->edge[i][1] = 0 - e;
    }
    if (__builtin_expect(bits(touched) != 0, 0))
        for (int i = 0; i < f->num_edges; i++) {
            const int a = f->edge[i][0], b = f->edge[i][1];
            edge_exact(&l->x[a], &l->y[a], &l->x[b], &l->y[b], &l->edge[i][0]);
            l->edge[i][1] = 0 - l->edge[i][0];
        }
}

/* Triangle i against all rays, as sheared_hit(); lanes that meet it inside (tmin, limit). No branches:
 * some ray of eight is almost always inside, and when not cannot be predicted. */
INLINE vi list_triangle(const struct wide_flat *f, const struct list *l, int i,
                        const struct octet *q, vf limit, vf *t, vf *u, vf *v)
{
    const uint8_t *c = f->triangle[i].corner, *e = f->triangle[i].edge;
    const vf *edge = l->edge[0], zero = vf_set(0);
    vf e0 = edge[e[0]], e1 = edge[e[1]], e2 = edge[e[2]];
    vi pass = ~(vf_lt(vf_min(vf_min(e0, e1), e2), zero) & vf_lt(zero, vf_max(vf_max(e0, e1), e2)));
    vf inv = 1 / (e0 + e1 + e2);
    *u = e1 * inv;
    *v = e2 * inv;
    *t = q->sz * (e0 * inv * l->z[c[0]] + *u * l->z[c[1]] + *v * l->z[c[2]]);
    return pass & vf_lt(q->tmin, *t) & vf_lt(*t, limit);
}

/* The largest float below a. */
INLINE vf below(vf a)
{
    vi b = (vi)a, zero = vf_eq(a, vf_set(0));
    return (vf)vi_select(zero, vi_set(INT32_MIN + 1), b + 1 + 2 * vi_lt(vi_set(-1), b));
}

INLINE vi list_sphere(const struct wide_flat *f, int i, const struct octet *q, vf limit, vf *t)
{
    const float *s = f->sphere[i];
    return sphere_hit(q->o[0] - s[0], q->o[1] - s[1], q->o[2] - s[2], q->d[0], q->d[1], q->d[2],
                      vf_set(s[3]), q->tmin, below(limit), t);
}

static void list_closest(const struct wide *w, const struct rays *r, const uint16_t *lane, int n,
                         struct hits *h, struct bvh_stats *stats)
{
    const struct wide_flat *f = w->flat;
    for (int k = 0; k < n; k += LANES) {
        struct octet q;
        struct list l;
        uint16_t filled[LANES];
        const uint16_t *eight = eight_of(lane, k, n, filled);
        bool in_row = octet_init(r, eight, &q);
        list_init(f, &q, &l);
        vf limit = q.tmax, best_u = vf_set(0), best_v = vf_set(0), t, u, v;
        vi prim = vi_set(-1);
        for (int i = 0; i < f->num_triangles; i++) {
            vi hit = list_triangle(f, &l, i, &q, limit, &t, &u, &v);
            limit = vf_select(hit, t, limit);
            best_u = vf_select(hit, u, best_u);
            best_v = vf_select(hit, v, best_v);
            prim = vi_select(hit, vi_set(i), prim);
        }
        for (int i = 0; i < f->num_spheres; i++) {
            vi hit = list_sphere(f, i, &q, limit, &t);
            if (!bits(hit))
                continue;
            limit = vf_select(hit, t, limit);
            best_u = vf_select(hit, vf_set(0), best_u);
            best_v = vf_select(hit, vf_set(0), best_v);
            prim = vi_select(hit, vi_set(f->num_triangles + i), prim);
        }
        stats->primitive_tests += w->num_leaves;
        if (in_row) {
            memcpy(h->t + eight[0], &limit, sizeof limit);
            memcpy(h->u + eight[0], &best_u, sizeof best_u);
            memcpy(h->v + eight[0], &best_v, sizeof best_v);
            memcpy(h->prim + eight[0], &prim, sizeof prim);
            continue;
        }
        for (int i = 0; i < LANES; i++) {
            h->t[eight[i]] = limit[i];
            h->u[eight[i]] = best_u[i];
            h->v[eight[i]] = best_v[i];
            h->prim[eight[i]] = (uint32_t)prim[i];
        }
    }
}

static void list_occluded(const struct wide *w, const struct rays *r, const uint16_t *lane, int n,
                          bool *occluded, struct bvh_stats *stats)
{
    const struct wide_flat *f = w->flat;
    for (int k = 0; k < n; k += LANES) {
        struct octet q;
        struct list l;
        uint16_t filled[LANES];
        const uint16_t *eight = eight_of(lane, k, n, filled);
        octet_init(r, eight, &q);
        octet_ignore(r, eight, &q);
        list_init(f, &q, &l);
        vi met = vi_set(0);
        vf t, u, v;
        for (int i = 0; i < f->num_triangles; i++)
            met |= list_triangle(f, &l, i, &q, q.tmax, &t, &u, &v) &
                   ~vi_eq(q.ignore, vi_set(i));
        for (int i = 0; i < f->num_spheres; i++)
            met |= list_sphere(f, i, &q, q.tmax, &t) &
                   ~vi_eq(q.ignore, vi_set(f->num_triangles + i));
        stats->primitive_tests += w->num_leaves;
        unsigned which = bits(met);
        for (int i = 0; i < LANES; i++)
            occluded[eight[i]] = which >> i & 1;
    }
}

#endif
