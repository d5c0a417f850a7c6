/* The way of rays through the wide hierarchy, compiled once for each instruction set (isa.h). */
#ifndef ASSAY_TRAVERSE_H
#define ASSAY_TRAVERSE_H

#include "bvh_wide.h"

/* As bvh_closest() and bvh_occluded(). */
struct traverse {
    void (*closest)(const struct wide *w, const struct rays *r, const uint16_t *lane, int num_lanes,
                    struct hits *h, struct bvh_stats *stats);
    void (*occluded)(const struct wide *w, const struct rays *r, const uint16_t *lane,
                     int num_lanes, bool *occluded, struct bvh_stats *stats);
};

extern const struct traverse traverse_sse42, traverse_avx2, traverse_avx512;

#endif
