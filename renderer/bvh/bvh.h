/* Ray queries, the nearest hit and occlusion, over all primitives of a scene: by brute force, or by
 * a bounding volume hierarchy, binary or wide. Rays come in batches, so that vector kernels
 * fit behind the same interface. */
#ifndef ASSAY_BVH_H
#define ASSAY_BVH_H

#include "renderer/math/ray_batch.h"
#include "renderer/base/isa.h"
#include "renderer/scene/scene.h"

enum bvh_kind {
    BVH_BRUTE_FORCE, /* every primitive for every ray: the oracle */
    BVH_CENTROID,    /* the assignment's: split the longest axis at the mean centroid */
    BVH_SAH,         /* binned surface area heuristic [Wald07] */
    BVH_WIDE         /* eight or sixteen wide, by vector kernels (bvh_wide.h) */
};

/* What the rays of one thread cost. BVH_WIDE counts nodes and leaves (of as many boxes or
 * primitives as its kernels have lanes); a visit of a packet counts once. */
struct bvh_stats {
    uint64_t rays, box_tests, primitive_tests;
};

static inline void bvh_stats_add(struct bvh_stats *sum, const struct bvh_stats *more)
{
    sum->rays += more->rays;
    sum->box_tests += more->box_tests;
    sum->primitive_tests += more->primitive_tests;
}

struct bvh; /* opaque; refers to the scene, which must outlive it */

/* NULL on failure (out of memory). */
NODISCARD struct bvh *bvh_build(const struct scene *s, enum bvh_kind kind, struct err *e);
/* The same with a choice of the instruction set (BVH_WIDE only, which has no scalar version:
 * ISA_SCALAR acts as ISA_AUTO) and of the number of threads that build (BVH_WIDE only; the tree does
 * not depend on it). Also fails if the machine lacks the instructions. */
NODISCARD struct bvh *bvh_build_on(const struct scene *s, enum bvh_kind kind, enum isa isa,
                                   int threads, struct err *e);
void bvh_free(struct bvh *b);

/* Expected cost of a random ray, in primitive tests, where a box test counts as one [MacDonald90].
 * Then the size of the tree; bvh_size() is in bytes. */
double bvh_sah_cost(const struct bvh *b);
int bvh_depth(const struct bvh *b);
uint32_t bvh_num_nodes(const struct bvh *b);
size_t bvh_size(const struct bvh *b);

/* For the listed lanes: stores the nearest hit inside (tmin, tmax) in *h, h->prim = NO_HIT if there is
 * none, and adds the cost to *stats. */
void bvh_closest(const struct bvh *b, const struct rays *r, const uint16_t *lane, int num_lanes,
                 struct hits *h, struct bvh_stats *stats);
/* For the listed lanes: sets occluded[lane] if there is any hit inside (tmin, tmax), else clears it. */
void bvh_occluded(const struct bvh *b, const struct rays *r, const uint16_t *lane, int num_lanes,
                  bool *occluded, struct bvh_stats *stats);

extern const char *const bvh_kind_names[]; /* by enum bvh_kind; ends with NULL */

#endif
