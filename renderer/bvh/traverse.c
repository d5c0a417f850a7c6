/* Tests the rays of a batch against the list, if there is one, and then against the tree; compiled once for each
 * instruction set. Its parts are headers, so that the compiler sees each loop as a whole. */
#include "traverse.h"
#include "traverse_packet.h"
#include "traverse_single.h"

/* Traces one batch: rays that are alike go in packets, the others one by one, as do all in a tree so large that they go
 * in turns, whose triangles are smaller than the rays' distance. h NULL: tests occlusion. */
INLINE void trace(const struct wide *w, const struct rays *r, const uint16_t *lane, int num_lanes,
                  struct hits *h, bool *occluded, struct bvh_stats *stats)
{
    const bool any = h == NULL;
    struct rayv together, *o = &together;
    for (int k = 0; k < num_lanes; k += LANES) {
        uint16_t filled[LANES];
        const uint16_t *of = rayv_from(lane, k, num_lanes, filled);
        unsigned open = lanes_there(k, num_lanes);
        const bool full = open == ALL_LANES;
        rayv_init(r, of, o);
        if (any)
            rayv_ignore(r, of, o);
        else if (w->flat != NULL)
            rayv_go_on(h, of, o);
        rayv_slabs(w, o);
        if (full && !w->in_turns && are_alike(w, o)) {
            struct packet p;
            struct bundle b;
            packet_init(o, &p);
            bundle_init(w, o, &b);
            packet_traverse(w, &b, &p, any, stats);
            if (any)
                packet_verdict(&p, of, occluded);
            else
                packet_result(&p, of, h);
            continue;
        }
        struct single single[LANES];
        int n = 0;
        for (; open; open &= open - 1, n++) {
            single_init(o, __builtin_ctz(open), &single[n]);
            single_root(w, &single[n]);
        }
        if (w->in_turns)
            single_in_turns(w, single, n, any, stats);
        for (int j = 0; j < n; j++) {
            struct single *s = &single[j];
            int i = of[s->lane];
            if (!w->in_turns)
                single_alone(w, s, any, stats);
            if (any) {
                occluded[i] = s->prim != NOTHING;
                continue;
            }
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
    uint16_t left[BATCH_LANES];
    stats->rays += (uint64_t)num_lanes;
    if (w->flat != NULL) {
        num_lanes = w->list->closest(w, r, lane, num_lanes, h, left, stats);
        lane = left;
    }
    trace(w, r, lane, num_lanes, h, NULL, stats);
}

static void occluded(const struct wide *w, const struct rays *r, const uint16_t *lane,
                     int num_lanes, bool *occluded, struct bvh_stats *stats)
{
    uint16_t left[BATCH_LANES];
    stats->rays += (uint64_t)num_lanes;
    if (w->flat != NULL) {
        num_lanes = w->list->occluded(w, r, lane, num_lanes, occluded, left, stats);
        lane = left;
    }
    trace(w, r, lane, num_lanes, NULL, occluded, stats);
}

const struct traverse FOR_ISA(traverse) = {
    .width = LANES, .closest = closest, .occluded = occluded};
