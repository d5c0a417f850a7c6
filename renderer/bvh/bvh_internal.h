/* What bvh.c and the builder of its binary trees share. */
#ifndef ASSAY_BVH_INTERNAL_H
#define ASSAY_BVH_INTERNAL_H

#include "bvh.h"

struct box {
    vec3 min, max;
};

/* Inner: count 0, children at first and first+1, split along axis. Leaf: primitives first.. in
 * order[]. */
struct node {
    struct box box;
    uint32_t first;
    uint16_t count, axis;
};

struct wide;

struct bvh {
    struct wide *wide; /* BVH_WIDE, and then nothing else is set */
    const struct scene *scene;
    struct node *nodes;         /* node 0 is the root; NULL: brute force */
    uint32_t *order;            /* primitive numbers in leaf order */
    struct triangle *triangles; /* in leaf order; unused entries for spheres */
    uint32_t num_nodes, num_primitives;
    int depth;
};

static inline float half_area(struct box b)
{
    vec3 d = sub(b.max, b.min);
    return d.x < 0 ? 0 : d.x * d.y + d.y * d.z + d.z * d.x;
}

enum { BVH_MAX_DEPTH = 96 }; /* cuts between the root and a leaf, whatever the primitives */

/* Fills nodes, order, num_nodes and depth of a tree whose scene, num_primitives and order (any
 * permutation) are set: BVH_CENTROID or BVH_SAH. False if out of memory. */
NODISCARD bool bvh_build_tree(struct bvh *t, enum bvh_kind kind);

#endif
