/* Tests the rays of a batch against a list, alone or beside a tree; compiled once for each instruction set. */
#include "small_scene_hit.h"
#include "traverse.h"

/* As many rays as the list has lanes count as one. */
static void count(const struct wide *w, int num_lanes, struct bvh_stats *stats)
{
    stats->primitive_tests +=
        (uint64_t)w->num_list_leaves * (((uint64_t)num_lanes + LANES - 1) / LANES);
}

/* Appends to left[], which has num entries, the lanes of the mask that meet the tree's box. Returns the new number. */
INLINE int keep(const struct wide *w, struct rayv *q, const uint16_t *from, unsigned there,
                uint16_t *left, int num)
{
    rayv_slabs(w, q);
    for (there &= rayv_box(w, q); there; there &= there - 1)
        left[num++] = from[__builtin_ctz(there)];
    return num;
}

static int closest(const struct wide *w, const struct rays *r, const uint16_t *lane, int num_lanes,
                   struct hits *h, uint16_t *left, struct bvh_stats *stats)
{
    int num = 0;
    count(w, num_lanes, stats);
    for (int k = 0; k < num_lanes; k += LANES) {
        struct rayv q;
        struct list_hits best;
        uint16_t filled[LANES];
        const uint16_t *from = rayv_from(lane, k, num_lanes, filled);
        rayv_load(r, from, &q);
        rayv_shear(&q);
        list_closest(w->flat, &q, &best);
        if (w->num_nodes == 0) {
            rayv_store(&q, from, best.t, best.u, best.v, best.prim, h);
            continue;
        }
        int32_t place[LANES];
        vi_store_any(place, best.prim);
        for (int i = 0; i < LANES; i++)
            place[i] = place[i] < 0 ? -1 : w->flat->number[place[i]];
        rayv_store(&q, from, best.t, best.u, best.v, vi_load_any(place), h);
        q.limit = best.t;
        num = keep(w, &q, from, lanes_there(k, num_lanes), left, num);
    }
    return num;
}

static int occluded(const struct wide *w, const struct rays *r, const uint16_t *lane, int num_lanes,
                    bool *occluded, uint16_t *left, struct bvh_stats *stats)
{
    int num = 0;
    count(w, num_lanes, stats);
    for (int k = 0; k < num_lanes; k += LANES) {
        struct rayv q;
        uint16_t filled[LANES];
        const uint16_t *from = rayv_from(lane, k, num_lanes, filled);
        rayv_load(r, from, &q);
        rayv_ignore(r, from, &q);
        vm met = list_occluded(w->flat, &q);
        rayv_store_flags(&q, from, met, occluded);
        if (w->num_nodes == 0)
            continue;
        q.limit = q.tmax;
        num = keep(w, &q, from, lanes_there(k, num_lanes) & ~bits(met), left, num);
    }
    return num;
}

const struct small_scene_trace FOR_ISA(small_scene_trace) = {.closest = closest,
                                                             .occluded = occluded};
