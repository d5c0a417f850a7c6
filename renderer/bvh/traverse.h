/* Traversal of the wide hierarchy, or of a scene that is a list, compiled once for each instruction
 * set (isa.h). */
#ifndef ASSAY_TRAVERSE_H
#define ASSAY_TRAVERSE_H

#include "bvh_wide.h"

/* As bvh_closest() and bvh_occluded(), over nodes and leaves of `width`, which are tested at once. */
struct traverse {
    uint32_t width;
    void (*closest)(const struct wide *w, const struct rays *r, const uint16_t *lane, int num_lanes,
                    struct hits *h, struct bvh_stats *stats);
    void (*occluded)(const struct wide *w, const struct rays *r, const uint16_t *lane,
                     int num_lanes, bool *occluded, struct bvh_stats *stats);
};

/* The same for the list alone. Returns how many lanes it puts into left[]: those that still need the tree. */
struct small_scene_trace {
    int (*closest)(const struct wide *w, const struct rays *r, const uint16_t *lane, int num_lanes,
                   struct hits *h, uint16_t *left, struct bvh_stats *stats);
    int (*occluded)(const struct wide *w, const struct rays *r, const uint16_t *lane, int num_lanes,
                    bool *occluded, uint16_t *left, struct bvh_stats *stats);
};

extern const struct traverse traverse_sse42, traverse_avx2, traverse_avx512;
extern const struct small_scene_trace small_scene_trace_sse42, small_scene_trace_avx2,
    small_scene_trace_avx512;

#endif
