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

/* A node or leaf that waits: the bits of the distance where it begins, and its reference. As numbers
 * they are in order of distance as far as that is positive; elsewhere only the order of visits
 * suffers. */
typedef int64_t stacked;

static inline const void *at(const struct wide *w, uint32_t ref)
{
    return w->arena + (ref & WIDE_PLACE);
}

/* Eight rays as the lists of them are read, lane by lane what boxes and primitives want of each. */
struct octet {
    vf o[3], d[3], sx, sy, sz, tmin;
    vf limit; /* the largest float below tmax: a hit is at most that far, and another at the very same
                 distance counts only if its number is smaller */
    vf inv[3], enter[3], leave[3]; /* plane * inv - enter: t where the slab begins */
    vi axis;                       /* of the largest component of d, the third of the shear */
    vi ignore;
};

/* a[lane[0]], ..., a[lane[7]] */
INLINE vf gather(const float *a, const uint16_t *lane, bool in_row)
{
    vf v;
    if (in_row)
        memcpy(&v, a + lane[0], sizeof v);
    else
        v = (vf){a[lane[0]], a[lane[1]], a[lane[2]], a[lane[3]],
                 a[lane[4]], a[lane[5]], a[lane[6]], a[lane[7]]};
    return v;
}

/* As shear_of(). */
INLINE void octet_shear(struct octet *q)
{
    vf x = vf_abs(q->d[0]), y = vf_abs(q->d[1]), z = vf_abs(q->d[2]);
    vi is_x = vf_lt(y, x) & vf_lt(z, x), is_y = ~is_x & vf_lt(z, y);
    q->axis = vi_select(is_x, vi_set(0), vi_select(is_y, vi_set(1), vi_set(2)));
    q->sz = 1 / vf_select(is_x, q->d[0], vf_select(is_y, q->d[1], q->d[2]));
    q->sx = vf_select(is_x, q->d[1], vf_select(is_y, q->d[2], q->d[0])) * q->sz;
    q->sy = vf_select(is_x, q->d[2], vf_select(is_y, q->d[0], q->d[1])) * q->sz;
}

INLINE void octet_init(const struct rays *r, const uint16_t lane[LANES], struct octet *q)
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
    vi tmax = (vi)gather(r->tmax, lane, in_row);
    vi zero = vf_eq((vf)tmax, vf_set(0));
    q->limit = (vf)vi_select(zero, vi_set(INT32_MIN + 1), tmax + 1 + 2 * vi_lt(vi_set(-1), tmax));
    octet_shear(q);
}

INLINE void octet_ignore(const struct rays *r, const uint16_t lane[LANES], struct octet *q)
{
    const uint32_t *a = r->ignore;
    q->ignore =
        (vi){(int32_t)a[lane[0]], (int32_t)a[lane[1]], (int32_t)a[lane[2]], (int32_t)a[lane[3]],
             (int32_t)a[lane[4]], (int32_t)a[lane[5]], (int32_t)a[lane[6]], (int32_t)a[lane[7]]};
}

/* What the coordinates of boxes are grown by. The triangle test moves corners by at most 6 half steps
 * of float of their distance from the origin [Woop13 3.3]; reciprocal, products and difference of the
 * slabs come to no more than 4 of distance and coordinate together. Twice that. */
INLINE vf growth(const struct wide *w, const struct octet *q)
{
    vf reach = vf_set(0), coordinate = reach;
    for (int a = 0; a < 3; a++) {
        reach = vf_max(reach, vf_max(vf_abs(w->min[a] - q->o[a]), vf_abs(w->max[a] - q->o[a])));
        coordinate = vf_max(coordinate, vf_abs(q->o[a]));
    }
    return 10 * FLT_EPSILON * (reach + coordinate);
}

/* 1/d, of zeros and next to them a number as large that neither NaN nor infinity comes up. */
INLINE vf inverse(vf d, vf grow)
{
    vf tiny = vf_max(vf_set(1e-18f), grow * 1e-29f), sign = (vf)((vi)d & vi_set(INT32_MIN));
    return 1 / vf_select(vf_lt(vf_abs(d), tiny), (vf)((vi)tiny | (vi)sign), d);
}

INLINE void octet_slabs(const struct wide *w, struct octet *q)
{
    vf grow = growth(w, q);
    for (int a = 0; a < 3; a++) {
        vf inv = q->inv[a] = inverse(q->d[a], grow), by = grow * vf_abs(inv);
        q->enter[a] = q->o[a] * inv + by;
        q->leave[a] = q->o[a] * inv - by;
    }
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

enum { ROW = sizeof(vf) };

/* One ray, and what it has found. */
struct single {
    const struct octet *q; /* lane `lane` of it */
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

INLINE void single_init(const struct octet *q, int lane, struct single *s)
{
    static const int shear[3][3] = {{1, 2, 0}, {2, 0, 1}, {0, 1, 2}};
    s->q = q;
    s->lane = lane;
    for (int a = 0; a < 3; a++) {
        s->row[a] = ROW * (2 * (size_t)a + (lane_of(&q->inv[a], lane) < 0));
        s->k[a] = shear[((const int32_t *)&q->axis)[lane]][a];
    }
    s->limit = lane_of(&q->limit, lane);
    s->u = s->v = 0;
    s->prim = NOTHING;
}

/* Lanes of the leaf that the ray meets inside (tmin, limit]. */
INLINE vi single_leaf(const struct wide_leaf *l, const struct single *s, bool spheres, vf limit,
                      vf *t, vf *u, vf *v)
{
    const struct octet *q = s->q;
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
    vi pass = sheared_hit(x, y, z, splat(&q->sz, i), t, u, v);
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

/* A ray to the boxes, in registers. */
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

INLINE void fetch_ahead(const struct wide *w, uint32_t ref)
{
    const char *p = at(w, ref);
    __builtin_prefetch(p);
    __builtin_prefetch(p + 64);
    __builtin_prefetch(p + 128);
    __builtin_prefetch(p + 192);
}

INLINE stacked stack_entry(float t, uint32_t ref)
{
    uint32_t of_t;
    memcpy(&of_t, &t, sizeof t);
    return (stacked)((uint64_t)of_t << 32 | ref);
}

INLINE float stacked_t(stacked s)
{
    uint32_t of_t = (uint32_t)((uint64_t)s >> 32);
    float t;
    memcpy(&t, &of_t, sizeof t);
    return t;
}

INLINE uint32_t stacked_ref(stacked s)
{
    return (uint32_t)s;
}

/* Without a branch: which of two is nearer cannot be predicted. */
INLINE void order(stacked *near, stacked *far)
{
    stacked a = *near, b = *far;
    *near = a < b ? a : b;
    *far = a < b ? b : a;
}

/* Pushes the children, two or more, the farthest first, but returns the nearest. */
INLINE uint32_t push_sorted(const struct wide *w, const struct wide_node *n, unsigned hit, vf enter,
                            stacked **top)
{
    float t[LANES] __attribute__((aligned(32)));
    vf_store(t, enter);
    int i = __builtin_ctz(hit);
    hit &= hit - 1;
    int j = __builtin_ctz(hit);
    hit &= hit - 1;
    stacked near = stack_entry(t[i], n->child[i]), far = stack_entry(t[j], n->child[j]);
    fetch_ahead(w, n->child[i]);
    fetch_ahead(w, n->child[j]);
    order(&near, &far);
    stacked *p = *top;
    if (hit) {
        i = __builtin_ctz(hit);
        hit &= hit - 1;
        fetch_ahead(w, n->child[i]);
        stacked third = stack_entry(t[i], n->child[i]);
        order(&near, &third);
        order(&far, &third);
        *p++ = third;
        while (hit) {
            i = __builtin_ctz(hit);
            hit &= hit - 1;
            fetch_ahead(w, n->child[i]);
            stacked next = stack_entry(t[i], n->child[i]);
            order(&near, &next);
            order(&far, &next);
            stacked *q = p++;
            for (; q > *top && q[-1] < next; q--)
                *q = q[-1];
            *q = next;
        }
    }
    *p++ = far;
    *top = p;
    return stacked_ref(near);
}

INLINE uint32_t next_of(const struct wide *w, const struct wide_node *n, unsigned hit, vf enter,
                        stacked **top)
{
    if ((hit & (hit - 1)) == 0)
        return n->child[__builtin_ctz(hit)];
    return push_sorted(w, n, hit, enter, top);
}

/* The root: for all rays of an octet before any of them goes on, so that one does not wait for
 * another. */
INLINE void single_root(const struct wide *w, struct single *s)
{
    const struct slabs b = single_slabs(s);
    s->hit = single_node((const struct wide_node *)w->arena, &b, vf_set(s->limit), &s->enter);
}

static void single_closest(const struct wide *w, struct single *s, struct bvh_stats *stats)
{
    stats->box_tests++;
    if (s->hit == 0)
        return;
    stacked stack[STACK], *top = stack;
    uint32_t ref = next_of(w, (const struct wide_node *)w->arena, s->hit, s->enter, &top);
    const struct slabs b = single_slabs(s);
    vf limit = vf_set(s->limit), t, u, v;
    uint64_t nodes = 0, leaves = 0;
    for (;;) {
        while (!(ref & WIDE_LEAF)) {
            const struct wide_node *n = (const struct wide_node *)(w->arena + ref);
            nodes++;
            unsigned hit = single_node(n, &b, limit, &t);
            if (hit == 0)
                goto pop;
            ref = next_of(w, n, hit, t, &top);
        }
        const struct wide_leaf *l = at(w, ref);
        leaves++;
        unsigned hit = bits(single_leaf(l, s, ref & WIDE_SPHERES, limit, &t, &u, &v));
        if (hit) {
            single_keep_nearest(l, hit, t, u, v, s);
            limit = vf_set(s->limit);
        }
    pop:
        do {
            if (top == stack)
                goto done;
            top--;
        } while (stacked_t(*top) > s->limit);
        ref = stacked_ref(*top);
    }
done:
    stats->box_tests += nodes;
    stats->primitive_tests += leaves;
}

static bool single_occluded(const struct wide *w, const struct single *s, struct bvh_stats *stats)
{
    stats->box_tests++;
    if (s->hit == 0)
        return false;
    stacked stack[STACK], *top = stack;
    uint32_t ref = next_of(w, (const struct wide_node *)w->arena, s->hit, s->enter, &top);
    const struct slabs b = single_slabs(s);
    const vf limit = vf_set(s->limit);
    vf t, u, v;
    uint64_t nodes = 0, leaves = 0;
    bool met_something = false;
    for (;;) {
        while (!(ref & WIDE_LEAF)) {
            const struct wide_node *n = (const struct wide_node *)(w->arena + ref);
            nodes++;
            unsigned hit = single_node(n, &b, limit, &t);
            if (hit == 0)
                goto pop;
            ref = next_of(w, n, hit, t, &top);
        }
        const struct wide_leaf *l = at(w, ref);
        leaves++;
        vi met = single_leaf(l, s, ref & WIDE_SPHERES, limit, &t, &u, &v);
        if (bits(met)) {
            vi prim;
            memcpy(&prim, l->prim, sizeof prim);
            if (bits(met & ~vi_eq(prim, vi_set(((const int32_t *)&s->q->ignore)[s->lane])))) {
                met_something = true;
                break;
            }
        }
    pop:
        if (top == stack)
            break;
        ref = stacked_ref(*--top);
    }
    stats->box_tests += nodes;
    stats->primitive_tests += leaves;
    return met_something;
}

/* Eight rays with the same axes of the shear, a ray to a lane, and what they have found. */
struct packet {
    const struct octet *q;
    int k[3];
    vf limit, u, v; /* limit -infinity: the ray meets nothing any more */
    vi prim;
};

/* The first `n` lanes. */
INLINE void packet_init(const struct octet *q, int n, struct packet *p)
{
    const vi number = {0, 1, 2, 3, 4, 5, 6, 7};
    p->q = q;
    p->k[2] = q->axis[0];
    p->k[0] = (p->k[2] + 1) % 3;
    p->k[1] = (p->k[2] + 2) % 3;
    p->limit = vf_select(vi_lt(number, vi_set(n)), q->limit, vf_set(-INFINITY));
    p->u = p->v = vf_set(0);
    p->prim = vi_set(NOTHING);
}

/* All primitives of a leaf against all rays. Shortens limit to the nearest; any: to -infinity for
 * whoever meets something that it does not ignore. True if a ray met something. */
INLINE bool packet_leaf(const struct wide_leaf *l, struct packet *p, bool spheres, bool any)
{
    const struct octet *q = p->q;
    vi changed = vi_set(0);
    for (int j = 0; j < WIDTH && l->prim[j] != NO_HIT; j++) {
        vf t, u, v;
        vi hit;
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

INLINE float smallest(vf a)
{
    a = vf_min(a, __builtin_shufflevector(a, a, 4, 5, 6, 7, 0, 1, 2, 3));
    a = vf_min(a, __builtin_shufflevector(a, a, 2, 3, 0, 1, 6, 7, 4, 5));
    a = vf_min(a, __builtin_shufflevector(a, a, 1, 0, 3, 2, 5, 4, 7, 6));
    return a[0];
}

INLINE float largest(vf a)
{
    return -smallest(-a);
}

/* All rays of a packet as one: intervals of origins and of inverse directions, all of one sign. */
struct bundle {
    vf inv[3][2], enter[3], leave[3], tmin;
    int row[3];
};

/* Are the rays alike enough to go together? One sign and one largest axis, directions within a few
 * degrees, origins within w->alike. */
INLINE bool are_alike(const struct wide *w, const struct octet *q)
{
    vi alike = vi_eq(q->axis, vi_set(q->axis[0]));
    for (int a = 0; a < 3; a++) {
        unsigned negative = bits((vi)q->inv[a]);
        if (negative != 0 && negative != 255)
            return false;
        alike &= vf_lt(vf_abs(q->d[a] - q->d[a][0]), vf_set(0.1f));
        alike &= vf_le(vf_abs(q->o[a] - q->o[a][0]), vf_set(w->alike));
    }
    return bits(alike) == 255;
}

static void bundle_init(const struct wide *w, const struct octet *q, struct bundle *b)
{
    float grow = largest(growth(w, q));
    for (int a = 0; a < 3; a++) {
        bool negative = q->inv[a][0] < 0;
        float low = smallest(q->o[a]) - grow, high = largest(q->o[a]) + grow;
        b->inv[a][0] = vf_set(smallest(q->inv[a]));
        b->inv[a][1] = vf_set(largest(q->inv[a]));
        b->enter[a] = vf_set(negative ? low : high);
        b->leave[a] = vf_set(negative ? high : low);
        b->row[a] = 2 * a + negative;
    }
    b->tmin = vf_set(smallest(q->tmin));
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
            ref = next_of(w, n, hit, t, &top);
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

/* A list: every leaf of it. */
INLINE void packet_list(const struct wide *w, struct packet *p, bool any, struct bvh_stats *stats)
{
    const struct wide_leaf *l = (const struct wide_leaf *)w->arena;
    uint32_t triangles = w->num_leaves - w->num_sphere_leaves;
    stats->primitive_tests += w->num_leaves;
    for (uint32_t i = 0; i < w->num_leaves; i++) {
        bool met =
            i < triangles ? packet_leaf(l + i, p, false, any) : packet_leaf(l + i, p, true, any);
        if (any && met && !bits(vf_lt(vf_set(-INFINITY), p->limit)))
            return;
    }
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

/* Lanes by the axis of the shear, so that eight of them share it: list[k], count[k]. A list has room
 * for the repeats of its last lane that fill up eight. */
struct by_axis {
    uint16_t list[3][BATCH_LANES + LANES];
    int count[3];
};

static void sort_by_axis(const struct rays *r, const uint16_t *lane, int n, struct by_axis *a)
{
    a->count[0] = a->count[1] = a->count[2] = 0;
    for (int i = 0; i < n; i++) {
        float x = fabsf(r->d.x[lane[i]]), y = fabsf(r->d.y[lane[i]]), z = fabsf(r->d.z[lane[i]]);
        int is_x = (x > y) & (x > z), is_y = y > z;
        int k = is_x ? 0 : 2 - is_y;
        a->list[k][a->count[k]++] = lane[i];
    }
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < LANES && a->count[k] > 0; i++)
            a->list[k][a->count[k] + i] = a->list[k][a->count[k] - 1];
}

static void list_closest(const struct wide *w, const struct rays *r, const uint16_t *lane, int n,
                         struct hits *h, struct bvh_stats *stats)
{
    struct by_axis a;
    sort_by_axis(r, lane, n, &a);
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < a.count[k]; i += LANES) {
            struct octet q;
            struct packet p;
            int some = a.count[k] - i < LANES ? a.count[k] - i : LANES;
            octet_init(r, a.list[k] + i, &q);
            packet_init(&q, some, &p);
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
            struct octet q;
            struct packet p;
            int some = a.count[k] - i < LANES ? a.count[k] - i : LANES;
            octet_init(r, a.list[k] + i, &q);
            octet_ignore(r, a.list[k] + i, &q);
            packet_init(&q, some, &p);
            packet_list(w, &p, true, stats);
            packet_verdict(&p, a.list[k] + i, some, occluded);
        }
}

/* Lanes k .. k+7 of a list of n; behind its end the last again. */
static const uint16_t *eight_of(const uint16_t *lane, int k, int n, uint16_t filled[LANES])
{
    if (n - k >= LANES)
        return lane + k;
    for (int i = 0; i < LANES; i++)
        filled[i] = lane[k + i < n ? k + i : n - 1];
    return filled;
}

/* One batch: rays that are alike go in packets, the others one by one. h is NULL: occlusion. */
INLINE void trace(const struct wide *w, const struct rays *r, const uint16_t *lane, int num_lanes,
                  bool any, struct hits *h, bool *occluded, struct bvh_stats *stats)
{
    struct octet octet, *o = &octet;
    for (int k = 0; k < num_lanes; k += LANES) {
        uint16_t filled[LANES];
        const uint16_t *eight = eight_of(lane, k, num_lanes, filled);
        int some = num_lanes - k < LANES ? num_lanes - k : LANES;
        octet_init(r, eight, o);
        if (any)
            octet_ignore(r, eight, o);
        octet_slabs(w, o);
        if (some == LANES && are_alike(w, o)) {
            struct packet p;
            struct bundle b;
            packet_init(o, LANES, &p);
            bundle_init(w, o, &b);
            packet_traverse(w, &b, &p, any, stats);
            if (any)
                packet_verdict(&p, eight, LANES, occluded);
            else
                packet_result(&p, r, eight, LANES, h);
            continue;
        }
        struct single single[LANES];
        for (int j = 0; j < some; j++) {
            single_init(o, j, &single[j]);
            single_root(w, &single[j]);
        }
        for (int j = 0; j < some; j++) {
            int i = eight[j];
            struct single *s = &single[j];
            if (any) {
                occluded[i] = single_occluded(w, s, stats);
                continue;
            }
            single_closest(w, s, stats);
            bool none = s->prim == NOTHING;
            h->t[i] = none ? r->tmax[i] : s->limit;
            h->u[i] = s->u;
            h->v[i] = s->v;
            h->prim[i] = none ? NO_HIT : (uint32_t)s->prim;
        }
    }
}

static void closest(const struct wide *w, const struct rays *r, const uint16_t *lane, int num_lanes,
                    struct hits *h, struct bvh_stats *stats)
{
    stats->rays += (uint64_t)num_lanes;
    if (w->num_nodes == 0)
        list_closest(w, r, lane, num_lanes, h, stats);
    else
        trace(w, r, lane, num_lanes, false, h, NULL, stats);
}

static void occluded(const struct wide *w, const struct rays *r, const uint16_t *lane,
                     int num_lanes, bool *occluded, struct bvh_stats *stats)
{
    stats->rays += (uint64_t)num_lanes;
    if (w->num_nodes == 0)
        list_occluded(w, r, lane, num_lanes, occluded, stats);
    else
        trace(w, r, lane, num_lanes, true, NULL, occluded, stats);
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
