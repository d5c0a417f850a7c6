/* The rays of a batch against a tree or a list, compiled once for each instruction set. The parts are
 * headers, so that each loop is one piece to the compiler. */
#include "wide_kernel.h"
#include "wide_list.h"
#include "wide_packet.h"
#include "wide_single.h"

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

const struct wide_kernel FOR_ISA(wide_kernel) = {.closest = closest, .occluded = occluded};
