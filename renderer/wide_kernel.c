/* The inner loops of the wide hierarchy, compiled once for each instruction set with -DISA=its name:
 * rays against eight boxes, eight primitives against a ray, eight rays against a primitive, and the
 * passes of the builder over its primitives. The tests are those of shape.c, operation by operation,
 * so a hit has the same bits. */
#include "bvh_wide.h"
#include "simd.h"

#include <float.h>

#define JOIN2(a, b) a##b
#define JOIN(a, b)  JOIN2(a, b)

#define LIKELY(x)   __builtin_expect(!!(x), 1)
#define UNLIKELY(x) __builtin_expect(!!(x), 0)

enum {
    /* A node leaves at most seven of its children behind; 64 free levels and 32 of halving. */
    STACK = 7 * 104,
    NOTHING = INT32_MAX /* no primitive yet: more than any */
};

struct stacked {
    float t;
    uint32_t ref;
};

static inline const void *at(const struct wide *w, uint32_t ref)
{
    return w->arena + (size_t)(ref & WIDE_PLACE) * WIDE_LINE;
}

/* The largest float below tmax: a hit is at most that far, and another at the very same distance
 * counts only if its number is smaller. */
static float below(float tmax)
{
    return nextafterf(tmax, -INFINITY);
}

/* What the coordinates of boxes are grown by. The triangle test moves corners by at most 6 half steps
 * of float of their distance from the origin [Woop13 3.3]; reciprocal, products and difference of the
 * slabs come to no more than 4 of distance and coordinate together. Twice that. */
static float growth(const struct wide *w, const float o[3])
{
    float reach = 0, coordinate = 0;
    for (int a = 0; a < 3; a++) {
        reach = maxf(reach, maxf(fabsf(w->min[a] - o[a]), fabsf(w->max[a] - o[a])));
        coordinate = maxf(coordinate, fabsf(o[a]));
    }
    return 10 * FLT_EPSILON * (reach + coordinate);
}

/* 1/d, of zeros and next to them a number as large that neither NaN nor infinity comes up. */
static float inverse(float d, float grow)
{
    float tiny = maxf(1e-18f, grow * 1e-29f);
    return 1 / (fabsf(d) < tiny ? copysignf(tiny, d) : d);
}

/* The axes in the order of the shear [Woop13]: k[2] the one of the largest component. */
static void shear_axes(const float d[3], int k[3])
{
    float x = fabsf(d[0]), y = fabsf(d[1]), z = fabsf(d[2]);
    k[2] = x > y && x > z ? 0 : y > z ? 1 : 2;
    k[0] = (k[2] + 1) % 3;
    k[1] = (k[2] + 2) % 3;
}

/* Lanes where both products rounded to the same: again in double, where they are exact (shape.c). */
static __attribute__((noinline, cold)) void edge_exact(const vf *ax, const vf *ay, const vf *bx,
                                                       const vf *by, vf *e)
{
    for (int i = 0; i < LANES; i++)
        if ((*e)[i] == 0)
            (*e)[i] =
                (float)((double)(*ax)[i] * (double)(*by)[i] - (double)(*ay)[i] * (double)(*bx)[i]);
}

/* triangle_intersect() but for the comparison of t: lanes that pass. o, x, y, z in the order of the
 * shear, corners already moved to the origin along z; s as in struct shear. */
INLINE vi sheared_hit(const vf x[3], const vf y[3], const vf z[3], vf sz, vf *t, vf *u, vf *v)
{
    vf e0 = x[1] * y[2] - y[1] * x[2];
    vf e1 = x[2] * y[0] - y[2] * x[0];
    vf e2 = x[0] * y[1] - y[0] * x[1];
    const vf zero = vf_set(0);
    vi pass = ~(vf_lt(vf_min(vf_min(e0, e1), e2), zero) & vf_lt(zero, vf_max(vf_max(e0, e1), e2)));
    if (!bits(pass))
        return pass;
    if (UNLIKELY(bits(pass & (vf_eq(e0, zero) | vf_eq(e1, zero) | vf_eq(e2, zero))))) {
        edge_exact(&x[1], &y[1], &x[2], &y[2], &e0);
        edge_exact(&x[2], &y[2], &x[0], &y[0], &e1);
        edge_exact(&x[0], &y[0], &x[1], &y[1], &e2);
        pass = ~(vf_lt(vf_min(vf_min(e0, e1), e2), zero) & vf_lt(zero, vf_max(vf_max(e0, e1), e2)));
    }
    /* Of no area: the inverse is infinite, t is NaN, and no comparison lets it through. */
    vf inv = 1 / (e0 + e1 + e2);
    *u = e1 * inv;
    *v = e2 * inv;
    *t = sz * (e0 * inv * z[0] + *u * z[1] + *v * z[2]);
    return pass;
}

/* sphere_intersect(): f from centre to origin. */
INLINE vi sphere_hit(vf fx, vf fy, vf fz, vf dx, vf dy, vf dz, vf radius, vf tmin, vf limit, vf *t)
{
    vf b = -(fx * dx + fy * dy + fz * dz);
    vf cx = fx + b * dx, cy = fy + b * dy, cz = fz + b * dz;
    vf disc = radius * radius - (cx * cx + cy * cy + cz * cz);
    const vf zero = vf_set(0);
    vi pass = vf_le(zero, disc);
    if (!bits(pass))
        return pass;
    vf c = fx * fx + fy * fy + fz * fz - radius * radius;
    vf root = vf_sqrt(disc);
    vf q = b + (vf)((vi)root | ((vi)b & vi_set(INT32_MIN)));
    vf t0 = vf_select(vf_eq(q, zero), zero, c / q), t1 = q;
    vf near = vf_min(t0, t1), far = vf_max(t0, t1);
    vi first = vf_lt(tmin, near) & vf_le(near, limit);
    vi second = vf_lt(tmin, far) & vf_le(far, limit);
    *t = vf_select(first, near, far);
    return pass & (first | second);
}

/* One ray, and what the boxes and leaves want of it, in all lanes. */
struct single {
    vf inv[3], enter[3], leave[3]; /* plane * inv - enter: t where the slab begins */
    vf o[3], sx, sy, sz, tmin;     /* o in the order of the shear */
    float origin[3], d[3], limit, u, v;
    int32_t prim;
    uint32_t ignore;
    int row[3], k[3]; /* planes of entry; axes of the shear */
};

static inline void single_init(const struct wide *w, const struct rays *r, int i, struct single *s)
{
    const float o[3] = {r->o.x[i], r->o.y[i], r->o.z[i]}, d[3] = {r->d.x[i], r->d.y[i], r->d.z[i]};
    float grow = growth(w, o);
    for (int a = 0; a < 3; a++) {
        float inv = inverse(d[a], grow);
        s->inv[a] = vf_set(inv);
        s->enter[a] = vf_set(o[a] * inv + grow * fabsf(inv));
        s->leave[a] = vf_set(o[a] * inv - grow * fabsf(inv));
        s->row[a] = 2 * a + (inv < 0);
        s->origin[a] = o[a];
        s->d[a] = d[a];
    }
    shear_axes(d, s->k);
    float sz = 1 / d[s->k[2]];
    for (int a = 0; a < 3; a++)
        s->o[a] = vf_set(o[s->k[a]]);
    s->sx = vf_set(d[s->k[0]] * sz);
    s->sy = vf_set(d[s->k[1]] * sz);
    s->sz = vf_set(sz);
    s->tmin = vf_set(r->tmin[i]);
    s->limit = below(r->tmax[i]);
    s->prim = NOTHING;
    s->u = s->v = 0;
}

/* Lanes of the leaf that the ray meets inside (tmin, limit]. */
INLINE vi single_leaf(const struct wide_leaf *l, const struct single *s, bool spheres, vf *t, vf *u,
                      vf *v)
{
    vf limit = vf_set(s->limit);
    if (spheres) {
        *u = *v = vf_set(0);
        return sphere_hit(s->origin[0] - vf_load(l->p[0][0]), s->origin[1] - vf_load(l->p[0][1]),
                          s->origin[2] - vf_load(l->p[0][2]), vf_set(s->d[0]), vf_set(s->d[1]),
                          vf_set(s->d[2]), vf_load(l->p[1][0]), s->tmin, limit, t);
    }
    vf x[3], y[3], z[3];
    for (int c = 0; c < 3; c++) {
        z[c] = vf_load(l->p[c][s->k[2]]) - s->o[2];
        x[c] = vf_load(l->p[c][s->k[0]]) - s->o[0] - s->sx * z[c];
        y[c] = vf_load(l->p[c][s->k[1]]) - s->o[1] - s->sy * z[c];
    }
    vi pass = sheared_hit(x, y, z, s->sz, t, u, v);
    if (!bits(pass))
        return pass;
    return pass & vf_lt(s->tmin, *t) & vf_le(*t, limit);
}

INLINE void single_keep_nearest(const struct wide_leaf *l, unsigned hit, vf t, vf u, vf v,
                                struct single *s)
{
    do {
        int i = __builtin_ctz(hit);
        hit &= hit - 1;
        if (t[i] < s->limit || (int32_t)l->prim[i] < s->prim) {
            s->limit = t[i];
            s->u = u[i];
            s->v = v[i];
            s->prim = (int32_t)l->prim[i];
        }
    } while (hit);
}

/* Children that the ray meets within (tmin, limit], and where it enters them. */
INLINE unsigned single_node(const struct wide_node *n, const struct single *s, vf limit, vf *enter)
{
    vf x0 = mul_sub(vf_load(n->plane[s->row[0]]), s->inv[0], s->enter[0]);
    vf y0 = mul_sub(vf_load(n->plane[s->row[1]]), s->inv[1], s->enter[1]);
    vf z0 = mul_sub(vf_load(n->plane[s->row[2]]), s->inv[2], s->enter[2]);
    vf x1 = mul_sub(vf_load(n->plane[s->row[0] ^ 1]), s->inv[0], s->leave[0]);
    vf y1 = mul_sub(vf_load(n->plane[s->row[1] ^ 1]), s->inv[1], s->leave[1]);
    vf z1 = mul_sub(vf_load(n->plane[s->row[2] ^ 1]), s->inv[2], s->leave[2]);
    *enter = vf_max(vf_max(x0, y0), vf_max(z0, s->tmin));
    return bits(vf_le(*enter, vf_min(vf_min(x1, y1), vf_min(z1, limit))));
}

/* Pushes the children, the farthest first, and returns the nearest. */
INLINE uint32_t push_sorted(const struct wide_node *n, unsigned hit, vf enter, struct stacked **top)
{
    float t[LANES] __attribute__((aligned(32)));
    vf_store(t, enter);
    int i = __builtin_ctz(hit), j = __builtin_ctz(hit & (hit - 1));
    hit &= hit - 1;
    hit &= hit - 1;
    struct stacked *base = *top, *p = base;
    *p++ = (struct stacked){t[i], n->child[i]};
    *p++ = (struct stacked){t[j], n->child[j]};
    if (base[0].t < base[1].t) {
        struct stacked swap = base[0];
        base[0] = base[1];
        base[1] = swap;
    }
    while (hit) {
        i = __builtin_ctz(hit);
        hit &= hit - 1;
        struct stacked *q = p++;
        for (; q > base && q[-1].t < t[i]; q--)
            *q = q[-1];
        *q = (struct stacked){t[i], n->child[i]};
    }
    *top = p - 1;
    return p[-1].ref;
}

static void single_closest(const struct wide *w, struct single *s, struct bvh_stats *stats)
{
    struct stacked stack[STACK], *top = stack;
    uint32_t ref = 0;
    vf limit = vf_set(s->limit), t, u, v;
    for (;;) {
        while (!(ref & WIDE_LEAF)) {
            const struct wide_node *n = at(w, ref);
            stats->box_tests++;
            unsigned hit = single_node(n, s, limit, &t);
            if (hit == 0)
                goto pop;
            if ((hit & (hit - 1)) == 0)
                ref = n->child[__builtin_ctz(hit)];
            else
                ref = push_sorted(n, hit, t, &top);
        }
        const struct wide_leaf *l = at(w, ref);
        stats->primitive_tests++;
        unsigned hit = bits(single_leaf(l, s, ref & WIDE_SPHERES, &t, &u, &v));
        if (hit) {
            single_keep_nearest(l, hit, t, u, v, s);
            limit = vf_set(s->limit);
        }
    pop:
        do {
            if (top == stack)
                return;
            top--;
        } while (top->t > s->limit);
        ref = top->ref;
    }
}

static bool single_occluded(const struct wide *w, const struct single *s, struct bvh_stats *stats)
{
    uint32_t stack[STACK], *top = stack;
    uint32_t ref = 0;
    const vf limit = vf_set(s->limit);
    vf t, u, v;
    for (;;) {
        while (!(ref & WIDE_LEAF)) {
            const struct wide_node *n = at(w, ref);
            stats->box_tests++;
            unsigned hit = single_node(n, s, limit, &t);
            if (hit == 0)
                goto pop;
            ref = n->child[__builtin_ctz(hit)];
            for (hit &= hit - 1; hit; hit &= hit - 1)
                *top++ = n->child[__builtin_ctz(hit)];
        }
        const struct wide_leaf *l = at(w, ref);
        stats->primitive_tests++;
        vi met = single_leaf(l, s, ref & WIDE_SPHERES, &t, &u, &v);
        if (bits(met)) {
            vi prim;
            memcpy(&prim, l->prim, sizeof prim);
            if (bits(met & ~vi_eq(prim, vi_set((int32_t)s->ignore))))
                return true;
        }
    pop:
        if (top == stack)
            return false;
        ref = *--top;
    }
}

/* Eight rays with the same axes of the shear, a ray to a lane. A lane with limit -infinity meets
 * nothing. */
struct packet {
    vf o[3], d[3], sx, sy, sz, tmin, limit, u, v; /* o, d by axis */
    vi prim, ignore;
    int k[3];
};

static void packet_init(const struct rays *r, const uint16_t *lane, int n, struct packet *p)
{
    static const float nowhere = -INFINITY;
    for (int i = 0; i < LANES; i++) {
        int from = lane[i < n ? i : 0];
        p->o[0][i] = r->o.x[from];
        p->o[1][i] = r->o.y[from];
        p->o[2][i] = r->o.z[from];
        p->d[0][i] = r->d.x[from];
        p->d[1][i] = r->d.y[from];
        p->d[2][i] = r->d.z[from];
        p->tmin[i] = r->tmin[from];
        p->limit[i] = i < n ? below(r->tmax[from]) : nowhere;
        p->ignore[i] = (int32_t)r->ignore[from];
    }
    const float d[3] = {p->d[0][0], p->d[1][0], p->d[2][0]};
    shear_axes(d, p->k);
    p->sz = 1 / p->d[p->k[2]];
    p->sx = p->d[p->k[0]] * p->sz;
    p->sy = p->d[p->k[1]] * p->sz;
    p->u = p->v = vf_set(0);
    p->prim = vi_set(NOTHING);
}

/* All primitives of a leaf against all rays. Shortens limit to the nearest; any: to -infinity for
 * whoever meets something that it does not ignore. True if a ray met something. */
INLINE bool packet_leaf(const struct wide_leaf *l, struct packet *p, bool spheres, bool any)
{
    vi changed = vi_set(0);
    for (int j = 0; j < WIDTH && l->prim[j] != NO_HIT; j++) {
        vf t, u, v;
        vi hit;
        if (spheres) {
            u = v = vf_set(0);
            hit = sphere_hit(p->o[0] - l->p[0][0][j], p->o[1] - l->p[0][1][j],
                             p->o[2] - l->p[0][2][j], p->d[0], p->d[1], p->d[2],
                             vf_set(l->p[1][0][j]), p->tmin, p->limit, &t);
            if (!bits(hit))
                continue;
        } else {
            vf x[3], y[3], z[3];
            for (int c = 0; c < 3; c++) {
                z[c] = l->p[c][p->k[2]][j] - p->o[p->k[2]];
                x[c] = l->p[c][p->k[0]][j] - p->o[p->k[0]] - p->sx * z[c];
                y[c] = l->p[c][p->k[1]][j] - p->o[p->k[1]] - p->sy * z[c];
            }
            hit = sheared_hit(x, y, z, p->sz, &t, &u, &v);
            if (!bits(hit))
                continue;
            hit &= vf_lt(p->tmin, t) & vf_le(t, p->limit);
        }
        const vi prim = vi_set((int32_t)l->prim[j]);
        if (any) {
            hit &= ~vi_eq(prim, p->ignore);
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

static float smallest(vf a)
{
    float m = a[0];
    for (int i = 1; i < LANES; i++)
        m = minf(m, a[i]);
    return m;
}

static float largest(vf a)
{
    return -smallest(-a);
}

/* All rays of a packet as one: intervals of origins and of inverse directions, all of one sign. */
struct bundle {
    vf inv[3][2], enter[3], leave[3], tmin;
    int row[3];
};

/* False if the rays are not alike: then they go one by one. */
static bool bundle_init(const struct wide *w, const struct packet *p, struct bundle *b)
{
    unsigned negative[3];
    float grow = 0;
    for (int a = 0; a < 3; a++) {
        negative[a] = bits(vf_lt(p->d[a], vf_set(0)));
        if (negative[a] != 0 && negative[a] != 255)
            return false;
        if (largest(p->d[a]) - smallest(p->d[a]) > 0.1f)
            return false;
    }
    for (int a = 0; a < 3; a++) {
        float low = smallest(p->o[a]), high = largest(p->o[a]);
        if (high - low > 0.02f * (w->max[a] - w->min[a]) + 0.01f * fabsf(low))
            return false;
    }
    for (int i = 0; i < LANES; i++) {
        const float o[3] = {p->o[0][i], p->o[1][i], p->o[2][i]},
                    d[3] = {p->d[0][i], p->d[1][i], p->d[2][i]};
        int k[3];
        grow = maxf(grow, growth(w, o));
        shear_axes(d, k);
        if (k[2] != p->k[2])
            return false;
    }
    for (int a = 0; a < 3; a++) {
        float sign = negative[a] ? -1 : 1;
        float d0 = smallest(sign * p->d[a]), d1 = largest(sign * p->d[a]);
        float low = smallest(p->o[a]) - grow, high = largest(p->o[a]) + grow;
        b->inv[a][0] = vf_set(sign * inverse(d0, grow));
        b->inv[a][1] = vf_set(sign * inverse(d1, grow));
        b->enter[a] = vf_set(negative[a] ? low : high);
        b->leave[a] = vf_set(negative[a] ? high : low);
        b->row[a] = 2 * a + (negative[a] != 0);
    }
    b->tmin = vf_set(smallest(p->tmin));
    return true;
}

/* Children that some ray of the bundle may meet, and a bound on where. */
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
    struct stacked stack[STACK], *top = stack;
    uint32_t ref = 0;
    float farthest = largest(p->limit);
    vf limit = vf_set(farthest), t;
    for (;;) {
        while (!(ref & WIDE_LEAF)) {
            const struct wide_node *n = at(w, ref);
            stats->box_tests++;
            unsigned hit = bundle_node(n, b, limit, &t);
            if (hit == 0)
                goto pop;
            if ((hit & (hit - 1)) == 0)
                ref = n->child[__builtin_ctz(hit)];
            else
                ref = push_sorted(n, hit, t, &top);
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
        } while (top->t > farthest);
        ref = top->ref;
    }
}

/* A list: every leaf of it. */
INLINE void packet_list(const struct wide *w, struct packet *p, bool any, struct bvh_stats *stats)
{
    const struct wide_leaf *l = (const struct wide_leaf *)w->arena;
    uint32_t triangles = w->num_leaves - w->num_sphere_leaves;
    stats->primitive_tests += w->num_leaves;
    for (uint32_t i = 0; i < triangles; i++)
        packet_leaf(l + i, p, false, any);
    for (uint32_t i = triangles; i < w->num_leaves; i++)
        packet_leaf(l + i, p, true, any);
}

static void packet_result(const struct packet *p, const struct rays *r, const uint16_t *lane, int n,
                          struct hits *h)
{
    for (int i = 0; i < n; i++) {
        bool none = p->prim[i] == NOTHING;
        h->t[lane[i]] = none ? r->tmax[lane[i]] : p->limit[i];
        h->u[lane[i]] = p->u[i];
        h->v[lane[i]] = p->v[i];
        h->prim[lane[i]] = none ? NO_HIT : (uint32_t)p->prim[i];
    }
}

static void packet_verdict(const struct packet *p, const uint16_t *lane, int n, bool *occluded)
{
    unsigned met = ~bits(vi_eq(p->prim, vi_set(NOTHING)));
    for (int i = 0; i < n; i++)
        occluded[lane[i]] = met >> i & 1;
}

/* Lanes by the axis of the shear, so that eight of them share it: list[k], count[k]. */
struct by_axis {
    uint16_t list[3][BATCH_LANES];
    int count[3];
};

static void sort_by_axis(const struct rays *r, const uint16_t *lane, int n, struct by_axis *a)
{
    a->count[0] = a->count[1] = a->count[2] = 0;
    for (int i = 0; i < n; i++) {
        const float d[3] = {r->d.x[lane[i]], r->d.y[lane[i]], r->d.z[lane[i]]};
        int k[3];
        shear_axes(d, k);
        a->list[k[2]][a->count[k[2]]++] = lane[i];
    }
}

static void list_closest(const struct wide *w, const struct rays *r, const uint16_t *lane, int n,
                         struct hits *h, struct bvh_stats *stats)
{
    struct by_axis a;
    sort_by_axis(r, lane, n, &a);
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < a.count[k]; i += LANES) {
            struct packet p;
            int some = a.count[k] - i < LANES ? a.count[k] - i : LANES;
            packet_init(r, a.list[k] + i, some, &p);
            packet_list(w, &p, false, stats);
            packet_result(&p, r, a.list[k] + i, some, h);
        }
}

static void list_occluded(const struct wide *w, const struct rays *r, const uint16_t *lane, int n,
                          bool *occluded, struct bvh_stats *stats)
{
    struct by_axis a;
    sort_by_axis(r, lane, n, &a);
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < a.count[k]; i += LANES) {
            struct packet p;
            int some = a.count[k] - i < LANES ? a.count[k] - i : LANES;
            packet_init(r, a.list[k] + i, some, &p);
            packet_list(w, &p, true, stats);
            packet_verdict(&p, a.list[k] + i, some, occluded);
        }
}

static void closest(const struct wide *w, const struct rays *r, const uint16_t *lane, int num_lanes,
                    struct hits *h, struct bvh_stats *stats)
{
    stats->rays += (uint64_t)num_lanes;
    if (w->num_nodes == 0) {
        list_closest(w, r, lane, num_lanes, h, stats);
        return;
    }
    for (int k = 0; k < num_lanes;) {
        struct packet p;
        struct bundle b;
        int group = num_lanes - k < LANES ? num_lanes - k : LANES;
        if (group == LANES) {
            packet_init(r, lane + k, LANES, &p);
            if (bundle_init(w, &p, &b)) {
                packet_traverse(w, &b, &p, false, stats);
                packet_result(&p, r, lane + k, LANES, h);
                k += LANES;
                continue;
            }
        }
        for (int end = k + group; k < end; k++) {
            int i = lane[k];
            struct single s;
            single_init(w, r, i, &s);
            single_closest(w, &s, stats);
            bool none = s.prim == NOTHING;
            h->t[i] = none ? r->tmax[i] : s.limit;
            h->u[i] = s.u;
            h->v[i] = s.v;
            h->prim[i] = none ? NO_HIT : (uint32_t)s.prim;
        }
    }
}

static void occluded(const struct wide *w, const struct rays *r, const uint16_t *lane,
                     int num_lanes, bool *occluded, struct bvh_stats *stats)
{
    stats->rays += (uint64_t)num_lanes;
    if (w->num_nodes == 0) {
        list_occluded(w, r, lane, num_lanes, occluded, stats);
        return;
    }
    for (int k = 0; k < num_lanes;) {
        struct packet p;
        struct bundle b;
        int group = num_lanes - k < LANES ? num_lanes - k : LANES;
        if (group == LANES) {
            packet_init(r, lane + k, LANES, &p);
            if (bundle_init(w, &p, &b)) {
                packet_traverse(w, &b, &p, true, stats);
                packet_verdict(&p, lane + k, LANES, occluded);
                k += LANES;
                continue;
            }
        }
        for (int end = k + group; k < end; k++) {
            struct single s;
            single_init(w, r, lane[k], &s);
            s.ignore = r->ignore[lane[k]];
            occluded[lane[k]] = single_occluded(w, &s, stats);
        }
    }
}

/* The builder. Minimum and maximum, or sum and minus sum, change places. */
INLINE vf swap_halves(vf a)
{
    return __builtin_shufflevector(a, a, 4, 5, 6, 7, 0, 1, 2, 3);
}

INLINE vf item_box(const struct wide_item *i)
{
    return vf_load(i->min);
}

INLINE float half_area(vf box)
{
    vf d = -(box + swap_halves(box));
    return d[0] * d[1] + d[1] * d[2] + d[2] * d[0];
}

static void bounds(const struct wide_item *item, uint32_t n, struct wide_box *box,
                   struct wide_box *centres)
{
    vf b = vf_set(FLT_MAX), c = b;
    for (uint32_t i = 0; i < n; i++) {
        vf x = item_box(item + i);
        b = vf_min(x, b);
        c = vf_min(x - swap_halves(x), c);
    }
    vf_store(box->v, b);
    vf_store(centres->v, c);
}

static void split(const struct wide_item *item, uint32_t n, const struct wide_box *centres,
                  struct wide_split *out)
{
    const int bins = n < 512 ? 16 : WIDE_MAX_BINS;
    vf low = vf_load(centres->v), extent = -(low + swap_halves(low)), to_bins = vf_set(0);
    bool usable[3];
    for (int a = 0; a < 3; a++) {
        float f = (float)bins * 0.9999f / extent[a];
        usable[a] = extent[a] > 0 && f < FLT_MAX;
        to_bins[a] = usable[a] ? f : 0;
    }
    vf box[3][WIDE_MAX_BINS];
    uint32_t count[3][WIDE_MAX_BINS] = {{0}};
    for (int a = 0; a < 3; a++)
        for (int k = 0; k < bins; k++)
            box[a][k] = vf_set(FLT_MAX);
    for (uint32_t i = 0; i < n; i++) {
        vf x = item_box(item + i);
        vi k = __builtin_convertvector((x - swap_halves(x) - low) * to_bins, vi);
        for (int a = 0; a < 3; a++) {
            box[a][k[a]] = vf_min(x, box[a][k[a]]);
            count[a][k[a]]++;
        }
    }
    out->cost = FLT_MAX;
    for (int a = 0; a < 3; a++) {
        if (!usable[a])
            continue;
        vf right[WIDE_MAX_BINS];
        float cost[WIDE_MAX_BINS];
        vf sweep = vf_set(FLT_MAX);
        uint32_t m = 0;
        for (int k = bins - 1; k > 0; k--) {
            sweep = vf_min(box[a][k], sweep);
            m += count[a][k];
            right[k] = sweep;
            cost[k] = m == 0 ? FLT_MAX : half_area(sweep) * (float)((m + WIDTH - 1) / WIDTH);
        }
        sweep = vf_set(FLT_MAX);
        m = 0;
        for (int k = 1; k < bins; k++) {
            sweep = vf_min(box[a][k - 1], sweep);
            m += count[a][k - 1];
            if (m == 0)
                continue;
            float total = cost[k] + half_area(sweep) * (float)((m + WIDTH - 1) / WIDTH);
            if (total < out->cost) {
                out->cost = total;
                out->axis = a;
                out->bin = k;
                out->low = low[a];
                out->to_bins = to_bins[a];
                vf_store(out->left.v, sweep);
                vf_store(out->right.v, right[k]);
            }
        }
    }
}

static uint32_t partition(struct wide_item *item, uint32_t n, const struct wide_split *s,
                          struct wide_box *left, struct wide_box *right)
{
    vf cl = vf_set(FLT_MAX), cr = cl;
    uint32_t i = 0, j = n;
    while (i < j) {
        vf x = item_box(item + i), c = x - swap_halves(x);
        if ((int)((c[s->axis] - s->low) * s->to_bins) < s->bin) {
            cl = vf_min(c, cl);
            i++;
        } else {
            cr = vf_min(c, cr);
            struct wide_item swap = item[--j];
            item[j] = item[i];
            item[i] = swap;
        }
    }
    vf_store(left->v, cl);
    vf_store(right->v, cr);
    return i;
}

const struct wide_kernel JOIN(wide_kernel_, ISA) = {
    .closest = closest,
    .occluded = occluded,
    .split = split,
    .partition = partition,
    .bounds = bounds,
};
