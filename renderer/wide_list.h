/* A scene without a tree: each ray against every leaf, eight rays of the same largest axis at a time.
 * Part of wide_kernel.c. */
#ifndef ASSAY_WIDE_LIST_H
#define ASSAY_WIDE_LIST_H

#include "wide_packet.h"

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

#endif
