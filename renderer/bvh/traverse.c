/* The rays of a batch against a tree or a list, compiled once for each instruction set. The parts are
 * headers, so that each loop is one piece to the compiler. */
#include "traverse.h"
#include "small_scene_hit.h"
#include "traverse_packet.h"
#include "traverse_single.h"

/* The list beside the tree, first: results of all lanes, what is met so far into o, and the lanes that the
 * tree is for. Functions of their own, or gcc takes minutes with sanitizers. */
static __attribute__((noinline)) unsigned closest_beside(const struct wide *w, struct ray8 *o,
                                                         const uint16_t *eight, struct hits *h)
{
    struct list_hits best;
    list_closest_eight(w->flat, o, &best);
    int32_t place[LANES];
    vf_store_any(place, (vf)best.prim);
    for (int i = 0; i < LANES; i++)
        place[i] = place[i] < 0 ? -1 : w->flat->number[place[i]];
    vi prim = vi_load_any(place), met = vi_lt(vi_set(-1), prim);
    octet_store(o, eight, best.t, best.u, best.v, prim, h);
    o->limit = vf_select(met, best.t, o->limit);
    o->prim = vi_select(met, prim, o->prim);
    o->u = best.u;
    o->v = best.v;
    return octet_box(w, o);
}

static __attribute__((noinline)) unsigned occluded_beside(const struct wide *w, struct ray8 *o,
                                                          const uint16_t *eight, bool *occluded)
{
    vi met = list_occluded_eight(w->flat, o, true);
    octet_store_flags(o, eight, bits(met), occluded);
    o->limit = vf_select(met, vf_set(-INFINITY), o->limit);
    o->prim = vi_select(met, vi_set(0), o->prim);
    return octet_box(w, o);
}

/* One batch: rays that are alike go in packets, the others one by one. h is NULL: occlusion. */
INLINE void trace(const struct wide *w, const struct rays *r, const uint16_t *lane, int num_lanes,
                  bool any, struct hits *h, bool *occluded, struct bvh_stats *stats)
{
    struct ray8 octet, *o = &octet;
    for (int k = 0; k < num_lanes; k += LANES) {
        uint16_t filled[LANES];
        const uint16_t *eight = eight_of(lane, k, num_lanes, filled);
        unsigned open = num_lanes - k < LANES ? (1u << (num_lanes - k)) - 1 : 255;
        const bool full = open == 255;
        octet_init(r, eight, o);
        if (any)
            octet_ignore(r, eight, o);
        octet_slabs(w, o);
        if (w->flat != NULL) {
            stats->primitive_tests += w->num_list_leaves;
            open &= any ? occluded_beside(w, o, eight, occluded) : closest_beside(w, o, eight, h);
        }
        if (open == 0)
            continue;
        if (full && are_alike(w, o)) {
            struct packet p;
            struct bundle b;
            packet_init(o, &p);
            bundle_init(w, o, &b);
            packet_traverse(w, &b, &p, any, stats);
            if (any)
                packet_verdict(&p, eight, occluded);
            else
                packet_result(&p, eight, h);
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
            int i = eight[s->lane];
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

const struct traverse FOR_ISA(traverse) = {.closest = closest, .occluded = occluded};
