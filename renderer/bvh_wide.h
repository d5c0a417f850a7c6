/* A hierarchy of nodes with eight children and leaves of eight primitives, for the kernels of
 * wide_kernel.c. Behind bvh.h: BVH_WIDE. A scene of up to WIDE_FLAT primitives is a list of leaves
 * and has no tree.
 *
 * Which primitive a ray meets does not depend on the way through the tree: the smallest distance
 * wins, and of primitives at the very same distance the smallest number. So a ray finds the same
 * alone, in a packet, and with any instruction set. */
#ifndef ASSAY_BVH_WIDE_H
#define ASSAY_BVH_WIDE_H

#include "bvh.h"
#include "isa.h"

enum { WIDTH = 8, WIDE_FLAT = 32, WIDE_LINE = 64, WIDE_MAX_BINS = 32 };

/* A reference to a node or leaf: its place in the arena in bytes, a multiple of 64, and in the low bits
 * what it is; nothing for a node. */
#define WIDE_LEAF    1u
#define WIDE_SPHERES 2u
#define WIDE_PLACE   0xffffffc0u

/* Planes: x low, x high, y low, ...; an empty child has low = infinity, high = -infinity. */
struct wide_node {
    float plane[6][WIDTH];
    uint32_t child[WIDTH];
    uint32_t unused[WIDTH];
};

/* p[corner][axis][lane]; of spheres p[0] is the centre and p[1][0] the radius. Empty lanes come last
 * and have prim = NO_HIT and NaNs, which no test lets through. Primitive numbers ascend. */
struct wide_leaf {
    float p[3][3][WIDTH];
    uint32_t prim[WIDTH];
};

struct wide_kernel;

struct wide {
    char *arena; /* nodes and leaves; at 0 the root, or the leaves of a list */
    size_t used; /* bytes */
    const struct wide_kernel *kernel;
    float min[3], max[3];           /* of the scene */
    uint32_t num_nodes, num_leaves; /* num_nodes 0: a list */
    uint32_t num_sphere_leaves;     /* of a list: the last ones */
    uint32_t num_triangles;         /* of the scene: sphere i is primitive num_triangles + i */
    int depth;
    float
        alike; /* rays that start as near to each other may go as a packet: a few leaves of a surface
                    that fills the scene */
    double cost; /* expected tests of a node or leaf for a random ray */
};

/* ISA_AUTO: the widest. NULL on failure (out of memory; no such instructions). */
struct wide *wide_build(const struct scene *s, enum isa isa, struct err *e)
    __attribute__((warn_unused_result));
void wide_free(struct wide *w);

/* What is compiled once for each instruction set. */
struct wide_item { /* a primitive to the builder; aligned to 32 */
    float min[3];
    uint32_t prim;
    float minus_max[3];
    float unused;
};

/* Boxes as {min, ?, -max, ?}: the union is the minimum, lane by lane. */
struct wide_box {
    float v[8];
} __attribute__((aligned(32)));

/* Where to cut a list of items: those whose doubled centre falls into a bin below `bin` along `axis`
 * go left. */
struct wide_split {
    int axis, bin;
    float low, to_bins; /* bin of c = (int)((c - low) to_bins) */
    float cost;         /* FLT_MAX: nowhere, all centres coincide */
    struct wide_box left, right;
};

struct wide_kernel {
    void (*closest)(const struct wide *w, const struct rays *r, const uint16_t *lane, int num_lanes,
                    struct hits *h, struct bvh_stats *stats);
    void (*occluded)(const struct wide *w, const struct rays *r, const uint16_t *lane,
                     int num_lanes, bool *occluded, struct bvh_stats *stats);
    /* By the surface area heuristic, a leaf of up to eight costing one. centres: box of the doubled
     * centres. */
    void (*split)(const struct wide_item *item, uint32_t n, const struct wide_box *centres,
                  struct wide_split *out);
    /* How many went left; the boxes of the doubled centres of both sides. */
    uint32_t (*partition)(struct wide_item *item, uint32_t n, const struct wide_split *s,
                          struct wide_box *left, struct wide_box *right);
    /* Box and box of the doubled centres. */
    void (*bounds)(const struct wide_item *item, uint32_t n, struct wide_box *box,
                   struct wide_box *centres);
};

extern const struct wide_kernel wide_kernel_sse42, wide_kernel_avx2, wide_kernel_avx512;

#endif
