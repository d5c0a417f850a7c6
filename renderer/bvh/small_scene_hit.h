/* Rays, a lane each, against every primitive of a list, each ray sheared along its own largest axis. Part of
 * small_scene_trace.c. */
#ifndef ASSAY_SMALL_SCENE_HIT_H
#define ASSAY_SMALL_SCENE_HIT_H

#include "small_scene.h"
#include "hit_simd.h"
#include "ray_simd.h"

/* Corners in the rays' sheared frames, and edge functions in both directions, of which a triangle looks up its own. */
struct list {
    vf x[FLAT_CORNERS], y[FLAT_CORNERS], z[FLAT_CORNERS], edge[FLAT_EDGES][2];
};

INLINE void list_init(const struct small_scene *f, const struct rayv *q, struct list *l)
{
    const vm is_x = vi_eq(q->axis, vi_set(0)), is_y = vi_eq(q->axis, vi_set(1));
    for (int i = 0; i < f->num_corners; i++) {
        vf x = f->corner[i][0] - q->o[0], y = f->corner[i][1] - q->o[1];
        vf z = f->corner[i][2] - q->o[2];
        vf along = vf_select(is_x, x, vf_select(is_y, y, z));
        l->z[i] = along;
        l->x[i] = vf_select(is_x, y, vf_select(is_y, z, x)) - q->sx * along;
        l->y[i] = vf_select(is_x, z, vf_select(is_y, x, y)) - q->sy * along;
    }
    const vf zero = vf_set(0);
    vm touched = vm_set(false);
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
            /* Not by negation: a result that underflows keeps its sign, which 0 - e would lose. */
            edge_exact(&l->x[b], &l->y[b], &l->x[a], &l->y[a], &l->edge[i][1]);
        }
}

/* Tests triangle i against all rays like sheared_hit(); returns the lanes that meet it inside (tmin, limit).
 * Branch-free: of eight or more rays one is almost always inside, and when none is cannot be predicted. */
INLINE vm list_triangle(const struct small_scene *f, const struct list *l, int i,
                        const struct rayv *q, vf limit, vf *t, vf *u, vf *v)
{
    const uint8_t *c = f->triangle[i].corner, *e = f->triangle[i].edge;
    const vf *edge = l->edge[0];
    vf e0 = edge[e[0]], e1 = edge[e[1]], e2 = edge[e[2]];
    vm pass = edges_agree(e0, e1, e2);
    vf inv = 1 / (e0 + e1 + e2);
    *u = e1 * inv;
    *v = e2 * inv;
    *t = q->sz * (e0 * inv * l->z[c[0]] + *u * l->z[c[1]] + *v * l->z[c[2]]);
    return pass & vf_lt(q->tmin, *t) & vf_lt(*t, limit);
}

INLINE vm list_sphere(const struct small_scene *f, int i, const struct rayv *q, vf limit, vf *t)
{
    const float *s = f->sphere[i];
    return sphere_hit(q->o[0] - s[0], q->o[1] - s[1], q->o[2] - s[2], q->d[0], q->d[1], q->d[2],
                      vf_set(s[3]), q->tmin, below(limit), t);
}

/* The nearest hit of each ray. prim: index in the list, -1: none. */
struct list_hits {
    vf t, u, v;
    vi prim;
};

static __attribute__((noinline)) void
list_closest_exact(const struct small_scene *f, const struct rayv *q, struct list_hits *best)
{
    struct list l;
    vf t = vf_set(0), u, v;
    list_init(f, q, &l);
    *best = (struct list_hits){q->tmax, vf_set(0), vf_set(0), vi_set(-1)};
    for (int i = 0; i < f->num_triangles; i++) {
        vm hit = list_triangle(f, &l, i, q, best->t, &t, &u, &v);
        best->t = vf_select(hit, t, best->t);
        best->u = vf_select(hit, u, best->u);
        best->v = vf_select(hit, v, best->v);
        best->prim = vi_select(hit, vi_set(i), best->prim);
    }
    for (int i = 0; i < f->num_spheres; i++) {
        vm hit = list_sphere(f, i, q, best->t, &t);
        best->t = vf_select(hit, t, best->t);
        best->u = vf_select(hit, vf_set(0), best->u);
        best->v = vf_select(hit, vf_set(0), best->v);
        best->prim = vi_select(hit, vi_set(f->num_triangles + i), best->prim);
    }
}

INLINE vm does_not_ignore(const struct small_scene *f, int i, const struct rayv *q)
{
    return ~vi_eq(q->ignore, vi_set(f->number[i]));
}

static __attribute__((noinline)) vm list_occluded_exact(const struct small_scene *f,
                                                        const struct rayv *q)
{
    struct list l;
    vf t, u, v;
    vm met = vm_set(false);
    list_init(f, q, &l);
    for (int i = 0; i < f->num_triangles; i++)
        met |= list_triangle(f, &l, i, q, q->tmax, &t, &u, &v) & does_not_ignore(f, i, q);
    for (int i = 0; i < f->num_spheres; i++)
        met |= list_sphere(f, i, q, q->tmax, &t) & does_not_ignore(f, f->num_triangles + i, q);
    return met;
}

/* What the quick form needs of the rays: error bounds, to be divided by |normal.d|, and the lanes that it serves. */
struct quick {
    vf error, slack; /* FLAT_ERROR m^2, FLAT_SLACK m */
    vf end;          /* where the ray ends, or has left the scene */
    vm fit;
};

INLINE struct quick quick_init(const struct small_scene *f, const struct rayv *q)
{
    vf m = vf_max(vf_max(vf_abs(q->o[0]), vf_abs(q->o[1])), vf_abs(q->o[2]));
    m = vf_max(vf_set(f->reach), m);
    return (struct quick){FLAT_ERROR * m * m, FLAT_SLACK * m, vf_min(4 * m, q->tmax),
                          vf_lt(m, vf_set(1e5f))};
}

/* Where a ray meets a face's plane. inside: distance from the rim, in u or v, negative outside, with an
 * error of at most `error`. t lies in (low, high). sum: u + v. */
struct quick_hit {
    vf inside, error, low, high, sum;
};

/* normal.d, and the distance of the plane from the ray's origin along the normal. */
struct quick_plane {
    vf nd, no;
};

INLINE struct quick_plane quick_plane(const struct flat_face *face, const struct rayv *q)
{
    const float *n = face->normal;
    const vf *o = q->o, *d = q->d;
    vf nd = mul_add(vf_set(n[0]), d[0], mul_add(vf_set(n[1]), d[1], n[2] * d[2]));
    vf no = face->offset - mul_add(vf_set(n[0]), o[0], mul_add(vf_set(n[1]), o[1], n[2] * o[2]));
    return (struct quick_plane){nd, no};
}

/* Lanes whose rays begin and end on the same side of the plane, too far from it for rounding to matter; at
 * the end twice as far, since k->end can be four times m. */
INLINE vm quick_clear(const struct flat_face *face, const struct quick_plane *p,
                      const struct quick *k)
{
    vf end = mul_add(-k->end, p->nd, p->no), slack = k->slack * face->slack;
    return vf_lt(slack, vf_min(p->no, end - slack)) | vf_lt(vf_max(p->no, end + slack), -slack);
}

INLINE struct quick_hit quick_face(const struct flat_face *face, const struct quick_plane *p,
                                   const struct rayv *q, const struct quick *k)
{
    const float *ur = face->u_row, *vr = face->v_row;
    const vf *o = q->o, *d = q->d, nd = p->nd, no = p->no;
    /* For rays parallel to the plane t and its error are huge, but finite. */
    vf inv = 1 / (nd + 1e-20f), t = no * inv;
    vf x = mul_add(t, d[0], o[0]), y = mul_add(t, d[1], o[1]), z = mul_add(t, d[2], o[2]);
    vf u = mul_add(vf_set(ur[0]), x,
                   mul_add(vf_set(ur[1]), y, mul_add(vf_set(ur[2]), z, vf_set(ur[3]))));
    vf v = mul_add(vf_set(vr[0]), x,
                   mul_add(vf_set(vr[1]), y, mul_add(vf_set(vr[2]), z, vf_set(vr[3]))));
    vf steep = vf_abs(inv);
    struct quick_hit h = {.error = k->error * (face->per_area * steep), .sum = u + v};
    vf off = k->slack * face->slack * steep, rim = vf_min(u, v);
    h.inside = face->is_triangle ? vf_min(rim, 1 - h.sum) : vf_min(rim, vf_min(1 - u, 1 - v));
    h.low = t - off;
    h.high = t + off;
    return h;
}

/* Lanes of points inside the room by more than the margin: one slack where rays begin, of which ROOM_TOLERANCE is a quarter
 * and the exact test's rounding less than the rest; two where they end, since that is computed; four beside an edge, so
 * that the next wall is met clearly later. */
INLINE vm in_room(const struct small_scene *f, const vf p[3], vf margin)
{
    vm in = vm_set(true);
    for (int a = 0; a < 3; a++)
        in &= vf_lt(f->low[a] + margin, p[a]) & vf_lt(p[a], f->high[a] - margin);
    return in;
}

/* What a quick search has found: prim, between the distances low and high. It is right if sure > 0 and high < second,
 * where the next candidate may begin. worst: the largest error met. */
struct nearest {
    vf low, high, second, sure, worst;
    vi prim;
};

/* Starts with the wall where rays from inside the room leave it. Returns the lanes whose exit is so far from the room's
 * edges that neither tolerance nor rounding can put another wall before it. */
INLINE vm leave_room(const struct small_scene *f, const struct rayv *q, const struct quick *k,
                     struct nearest *n)
{
    const vf far = vf_set(INFINITY), zero = vf_set(0), margin = 4 * k->slack;
    vf t = far, steep = zero, w[COLUMNS], p[3];
    vi side = vi_set(0);
    vm safe = vm_set(true);
    int32_t number[LANES];
    for (int a = 0; a < 3; a++) {
        vm down = vf_lt(q->d[a], zero);
        vf inv = 1 / vf_abs(q->d[a]);
        vf at = vf_abs(vf_select(down, vf_set(f->low[a]), vf_set(f->high[a])) - q->o[a]) * inv;
        vm nearer = vf_lt(at, t);
        t = vf_min(at, t);
        steep = vf_select(nearer, inv, steep);
        side = vi_select(nearer, vi_set(2 * a) + vi_where(down, vi_set(1)), side);
    }
    for (int a = 0; a < 3; a++) {
        p[a] = mul_add(t, q->d[a], q->o[a]);
        vm in = vf_lt(f->low[a] + margin, p[a]) & vf_lt(p[a], f->high[a] - margin);
        safe &= in | vi_eq(side & vi_set(6), vi_set(2 * a));
    }
    vi_store_any(number, side);
    gather_columns(f->side[0], SIDE_WORDS, number, w);
    vf beyond = mul_add(w[0], p[0], mul_add(w[1], p[1], mul_add(w[2], p[2], w[3])));
    vf error = k->error * (w[SIDE_PER_AREA] * steep), off = 2 * k->slack * steep;
    n->prim = vi_select(vf_lt(zero, beyond), as_vi(w[SIDE_PRIM + 1]), as_vi(w[SIDE_PRIM]));
    vm open = vi_lt(as_vi(w[SIDE_PRIM]), vi_set(0));
    n->prim = vi_select(open, vi_set(-1), n->prim);
    n->low = vf_select(open, far, t - off);
    n->high = vf_select(open, far, t + off);
    n->sure = vf_abs(beyond) - 2 * error;
    n->worst = vf_select(open, zero, error);
    return safe;
}

/* Nearest hits by the quick form. Returns the lanes that it could decide; *best is undefined in the
 * others. */
INLINE vm list_closest_quick(const struct small_scene *f, const struct rayv *q,
                             struct list_hits *best)
{
    const struct quick k = quick_init(f, q);
    const vf far = vf_set(INFINITY), zero = vf_set(0);
    struct nearest n = {far, far, far, zero, zero, vi_set(-1)};
    vf sphere_t = far;
    vm safe = vm_set(true);
    int num_faces = f->num_faces;
    if (f->num_walls > 0 && bits(in_room(f, q->o, k.slack)) == ALL_LANES) {
        safe = leave_room(f, q, &k, &n);
        num_faces -= f->num_walls;
    }
    for (int i = 0; i < num_faces; i++) {
        const struct flat_face *face = &f->face[i];
        const struct quick_plane p = quick_plane(face, q);
        struct quick_hit h = quick_face(face, &p, q, &k);
        vm out = vf_lt(h.inside + h.error, zero) | vf_lt(h.high, q->tmin);
        vf begin = vf_select(out, far, h.low), surely = h.inside - h.error;
        vi number = vi_set(face->prim[0]);
        if (!face->is_triangle) {
            vf beyond = h.sum - 1;
            surely = vf_min(surely, vf_abs(beyond) - 2 * h.error);
            number = vi_select(vf_lt(zero, beyond), vi_set(face->prim[1]), number);
        }
        vm nearer = vf_lt(begin, n.low);
        n.second = vf_min(n.second, vf_max(begin, n.low));
        n.low = vf_min(begin, n.low);
        n.high = vf_select(nearer, h.high, n.high);
        n.sure = vf_select(nearer, surely, n.sure);
        n.prim = vi_select(nearer, number, n.prim);
        n.worst = vf_max(h.error, n.worst);
    }
    for (int i = 0; i < f->num_spheres; i++) {
        vf t = far;
        vm hit = list_sphere(f, i, q, q->tmax, &t);
        if (!bits(hit))
            continue;
        vf begin = vf_select(hit, t, far);
        vm nearer = vf_lt(begin, n.low);
        n.second = vf_min(n.second, vf_max(begin, n.low));
        n.low = vf_min(begin, n.low);
        n.high = vf_select(nearer, t, n.high);
        sphere_t = vf_select(nearer, t, sphere_t);
        n.sure = vf_select(nearer, vf_set(1), n.sure);
        n.prim = vi_select(nearer, vi_set(f->num_triangles + i), n.prim);
    }
    vm nothing = vf_lt(q->tmax, n.low) | vf_eq(n.low, far);
    vm known = vf_lt(zero, n.sure) & vf_lt(q->tmin, n.low) & vf_lt(n.high, q->tmax) &
               vf_lt(n.high, n.second);
    known &= ~nothing;
    n.prim = vi_select(known, n.prim, vi_set(-1));
    /* Distance and barycentric coordinates are recomputed by the exact test. */
    const vm is_x = vi_eq(q->axis, vi_set(0)), is_y = vi_eq(q->axis, vi_set(1));
    vm flat = vi_lt(n.prim, vi_set(f->num_triangles));
    int32_t number[LANES];
    vf w[2][COLUMNS], x[3], y[3], z[3], t = far, u = zero, v = zero;
    vf_store_any(number, (vf)vi_where(flat & ~vi_lt(n.prim, vi_set(0)), n.prim));
    gather_columns(f->row[0], FLAT_ROW, number, w[0]);
    gather_columns(f->row[0] + COLUMNS, FLAT_ROW, number, w[1]);
    for (int c = 0; c < 3; c++) {
        vf a = w[0][3 * c] - q->o[0], b = (c < 2 ? w[0][3 * c + 1] : w[0][7]) - q->o[1];
        vf e = (c < 2 ? w[0][3 * c + 2] : w[1][0]) - q->o[2];
        z[c] = vf_select(is_x, a, vf_select(is_y, b, e));
        x[c] = vf_select(is_x, b, vf_select(is_y, e, a)) - q->sx * z[c];
        y[c] = vf_select(is_x, e, vf_select(is_y, a, b)) - q->sy * z[c];
    }
    vm pass = sheared_hit(x, y, z, q->sz, &t, &u, &v) & vf_lt(q->tmin, t) & vf_lt(t, q->tmax);
    vm ball = known & ~flat;
    best->t = vf_select(nothing, q->tmax, vf_select(ball, sphere_t, t));
    best->u = vf_select(known & flat, u, zero);
    best->v = vf_select(known & flat, v, zero);
    best->prim = n.prim;
    return k.fit & safe & vf_lt(n.worst, far) & (nothing | ball | (known & pass));
}

/* Lanes that are occluded; *known: lanes that the quick form could decide. */
INLINE vm list_occluded_quick(const struct small_scene *f, const struct rayv *q, vm *known)
{
    const struct quick k = quick_init(f, q);
    const vf zero = vf_set(0);
    vf worst = zero;
    vm met = vm_set(false), maybe = met;
    int num_faces = f->num_faces;
    if (f->num_walls > 0) {
        const vf end[3] = {mul_add(k.end, q->d[0], q->o[0]), mul_add(k.end, q->d[1], q->o[1]),
                           mul_add(k.end, q->d[2], q->o[2])};
        if (bits(in_room(f, q->o, k.slack) & in_room(f, end, 2 * k.slack)) == ALL_LANES)
            num_faces -= f->num_walls;
    }
    for (int i = 0; i < num_faces; i++) {
        const struct quick_plane p = quick_plane(&f->face[i], q);
        if (bits(quick_clear(&f->face[i], &p, &k)) == ALL_LANES)
            continue;
        struct quick_hit h = quick_face(&f->face[i], &p, q, &k);
        vm out = vf_lt(h.inside + h.error, zero) | vf_lt(h.high, q->tmin) | vf_lt(q->tmax, h.low);
        met |= vf_lt(h.error, h.inside) & vf_lt(q->tmin, h.low) & vf_lt(h.high, q->tmax);
        maybe |= ~out;
        worst = vf_max(h.error, worst);
    }
    for (int i = 0; i < f->num_spheres; i++) {
        vf t;
        met |= list_sphere(f, i, q, q->tmax, &t) & does_not_ignore(f, f->num_triangles + i, q);
    }
    *known = k.fit & vf_lt(worst, vf_set(INFINITY)) & (met | ~maybe);
    return met;
}

/* Nearest hits in the list. The rays must be sheared (rayv_shear()). */
INLINE void list_closest(const struct small_scene *f, const struct rayv *q, struct list_hits *best)
{
    if (!f->quick || bits(list_closest_quick(f, q, best)) != ALL_LANES)
        list_closest_exact(f, q, best);
}

/* Lanes that are occluded. The rays need not be sheared, and may be afterwards. */
INLINE vm list_occluded(const struct small_scene *f, struct rayv *q)
{
    vm known = vm_set(false), met = known;
    if (f->quick)
        met = list_occluded_quick(f, q, &known);
    if (bits(known) == ALL_LANES)
        return met;
    rayv_shear(q);
    return list_occluded_exact(f, q);
}

#endif
