#include "triangulate.h"

#include <stdlib.h>

struct point {
    double x, y;
};

/* The ring of vertices that are not clipped yet, in plane coordinates of about unit size. */
struct ring {
    const struct point *p;
    uint32_t *next, *prev;
};

/* Areas below this, relative to the squared size of the polygon, count as zero. */
static const double TINY = 1e-12;

/* Twice the signed area. */
static double orient(struct point a, struct point b, struct point c)
{
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

static bool same(struct point a, struct point b)
{
    return a.x == b.x && a.y == b.y;
}

/* Projects the polygon onto the plane of its vector area (summed over a fan from the first vertex), into
 * coordinates of about unit size in which its signed area is positive: *area, doubled. */
static enum triangulate_result project(const dvec3 *p, uint32_t n, struct point *out, double *area)
{
    dvec3 normal = {0, 0, 0};
    double size2 = 0, largest = 0;
    for (uint32_t i = 1; i < n; i++) {
        dvec3 a = d3_sub(p[i], p[0]);
        size2 = fmax(size2, d3_dot(a, a));
        if (i + 1 < n) {
            dvec3 c = d3_cross(a, d3_sub(p[i + 1], p[0]));
            normal = d3_add(normal, c);
            largest = fmax(largest, d3_length(c));
        }
    }
    if (!(d3_length(normal) > TINY * size2) || !d3_normalize(&normal))
        return largest <= TINY * size2 ? TRIANGULATE_FLAT : TRIANGULATE_CROSSED;
    dvec3 helper = fabs(normal.x) < 0.6 ? d3(1, 0, 0) : d3(0, 1, 0);
    dvec3 s = d3_cross(helper, normal);
    (void)d3_normalize(&s);
    dvec3 t = d3_cross(normal, s);
    double inverse = 1 / sqrt(size2);
    for (uint32_t i = 0; i < n; i++) {
        dvec3 a = d3_scale(d3_sub(p[i], p[0]), inverse);
        out[i] = (struct point){d3_dot(a, s), d3_dot(a, t)};
    }
    *area = 0;
    for (uint32_t i = 1; i + 1 < n; i++)
        *area += orient(out[0], out[i], out[i + 1]);
    return TRIANGULATE_OK;
}

/* True if two edges cross. Touching does not count: holes are joined to the rim by an edge that is
 * traversed twice. */
static bool crosses_itself(const struct point *p, uint32_t n)
{
    for (uint32_t i = 0; i + 2 < n; i++) {
        for (uint32_t j = i + 2; j < n; j++) {
            if (i == 0 && j == n - 1)
                continue;
            struct point a = p[i], b = p[i + 1], c = p[j], d = p[j + 1 < n ? j + 1 : 0];
            double abc = orient(a, b, c), abd = orient(a, b, d);
            double cda = orient(c, d, a), cdb = orient(c, d, b);
            bool split_ab = (abc > TINY && abd < -TINY) || (abc < -TINY && abd > TINY);
            bool split_cd = (cda > TINY && cdb < -TINY) || (cda < -TINY && cdb > TINY);
            if (split_ab && split_cd)
                return true;
        }
    }
    return false;
}

/* Which ears are accepted; a later pass is tried only if the earlier ones find none. */
enum pass {
    PASS_CLEAR, /* a proper corner, its closed triangle free of other vertices */
    PASS_LINE,  /* a vertex on the line between its neighbours: a triangle without area */
    PASS_TOUCH, /* a proper corner whose triangle others only touch */
    NUM_PASSES
};

static bool is_ear(const struct ring *r, uint32_t b, enum pass pass)
{
    uint32_t a = r->prev[b], c = r->next[b];
    struct point pa = r->p[a], pb = r->p[b], pc = r->p[c];
    double corner = orient(pa, pb, pc);
    if (pass == PASS_LINE)
        return fabs(corner) <= TINY;
    if (corner <= TINY)
        return false;
    double margin = pass == PASS_CLEAR ? -TINY : TINY;
    for (uint32_t v = r->next[c]; v != a; v = r->next[v]) {
        struct point q = r->p[v];
        if (same(q, pa) || same(q, pb) || same(q, pc))
            continue;
        if (orient(pa, pb, q) > margin && orient(pb, pc, q) > margin && orient(pc, pa, q) > margin)
            return false;
    }
    return true;
}

/* Clips ears until three vertices are left. Returns false if none can be found. */
static bool clip(struct ring *r, uint32_t n, uint32_t *index)
{
    uint32_t left = n, v = 0;
    while (left > 3) {
        bool found = false;
        for (enum pass pass = PASS_CLEAR; pass < NUM_PASSES && !found; pass++) {
            for (uint32_t tries = 0; tries < left; tries++, v = r->next[v]) {
                if (is_ear(r, v, pass)) {
                    found = true;
                    break;
                }
            }
        }
        if (!found)
            return false;
        uint32_t a = r->prev[v], c = r->next[v];
        *index++ = a;
        *index++ = v;
        *index++ = c;
        r->next[a] = c;
        r->prev[c] = a;
        left--;
        /* Going on with every other corner keeps the triangles of a round polygon from being slivers. */
        v = r->next[c];
    }
    *index++ = r->prev[v];
    *index++ = v;
    *index++ = r->next[v];
    return true;
}

static void fan(uint32_t n, uint32_t *index)
{
    for (uint32_t i = 1; i + 1 < n; i++) {
        *index++ = 0;
        *index++ = i;
        *index++ = i + 1;
    }
}

enum triangulate_result triangulate(const dvec3 *p, uint32_t n, uint32_t *index)
{
    if (n == 3) {
        fan(n, index);
        return TRIANGULATE_OK;
    }
    enum triangulate_result result = TRIANGULATE_MEMORY;
    struct point *q = malloc(n * sizeof *q);
    uint32_t *link = malloc(2 * (size_t)n * sizeof *link);
    if (q == NULL || link == NULL)
        goto done;
    double area;
    result = project(p, n, q, &area);
    if (result == TRIANGULATE_FLAT)
        fan(n, index);
    if (result != TRIANGULATE_OK)
        goto done;
    result = TRIANGULATE_CROSSED;
    if (crosses_itself(q, n))
        goto done;
    struct ring r = {.p = q, .next = link, .prev = link + n};
    for (uint32_t i = 0; i < n; i++) {
        r.next[i] = i + 1 < n ? i + 1 : 0;
        r.prev[i] = i > 0 ? i - 1 : n - 1;
    }
    if (!clip(&r, n, index))
        goto done;
    /* Signed areas always add up to the polygon's; their magnitudes do only if none is negative. */
    double sum = 0;
    for (uint32_t i = 0; i < n - 2; i++)
        sum += fabs(orient(q[index[3 * i]], q[index[3 * i + 1]], q[index[3 * i + 2]]));
    if (sum <= area * (1 + 1e-6))
        result = TRIANGULATE_OK;
done:
    if (result == TRIANGULATE_CROSSED)
        fan(n, index);
    free(q);
    free(link);
    return result;
}
