/* A hierarchy of nodes with eight children and leaves of eight primitives, sixteen with AVX-512, for the
 * kernels of traverse.h. Behind bvh.h: BVH_WIDE. A scene of up to WIDE_FLAT primitives is a list and has no tree;
 * the few largest primitives of others, walls say, are a list beside the tree.
 *
 * Which primitive a ray meets does not depend on the way through the tree: the smallest distance
 * wins, and of primitives at the very same distance the smallest number. So a ray finds the same
 * alone, in a packet, and with any instruction set. What differs is how many nodes it visits. */
#ifndef ASSAY_BVH_WIDE_H
#define ASSAY_BVH_WIDE_H

#include "bvh.h"
#include "renderer/base/isa.h"

enum { WIDE_MOST = 16, WIDE_FLAT = 32, WIDE_LINE = 64 };

/* A reference to a node or leaf: its offset in the arena in bytes, a multiple of 64. The low bits tell what
 * it is: none for a node, WIDE_LEAF, or WIDE_LEAF | WIDE_SPHERES. */
#define WIDE_LEAF    1u
#define WIDE_SPHERES 2u
#define WIDE_PLACE   0xffffffc0u

/* Nodes and leaves are rows of kernel->width floats or uint32_t, eight or WIDE_MOST.
 * A node, in whole lines of the cache: six rows of planes (x low, x high, y low, ...) and one of references to the
 * children. An empty child has low = infinity, high = -infinity.
 * A leaf: nine rows of corners (x, y and z of the first ones, of the second, of the third) and one of primitive
 * numbers, which ascend; of spheres the first three rows are the centres, the fourth the radii. Empty lanes come last
 * and have NO_HIT and NaNs, which no test lets through. */
#define WIDE_NODE_SIZE(width) (((size_t)(width)*7 * 4 + WIDE_LINE - 1) / WIDE_LINE * WIDE_LINE)
#define WIDE_LEAF_SIZE(width) ((size_t)(width)*10 * 4)

struct traverse;
struct small_scene;
struct small_scene_trace;

struct wide {
    struct small_scene *flat; /* the list; NULL: there is none */
    char *arena;              /* nodes and leaves; at 0 the root */
    size_t used;              /* bytes */
    const struct traverse *kernel;
    const struct small_scene_trace *list; /* the list's kernel */
    float min[3], max[3];                 /* of the scene */
    float tree_min[3], tree_max[3];       /* of what is in the tree */
    uint32_t num_list_leaves;             /* leaf tests that the list counts as */
    uint32_t num_nodes, num_leaves;       /* num_nodes 0: only a list */
    uint32_t num_triangles; /* of the scene: sphere i is primitive num_triangles + i */
    int depth;
    bool in_turns; /* rays advance through the tree in turns (bvh_wide.c) */
    float
        alike; /* largest distance between origins of rays that may go as a packet: a few leaves of
                    a surface that fills the scene */
    double cost; /* expected tests of a node or leaf for a random ray */
};

/* ISA_AUTO: the widest. The same bits on any number of threads. NULL on failure (out of memory; no such
 * instructions). */
NODISCARD struct wide *wide_build(const struct scene *s, enum isa isa, int threads, struct err *e);
void wide_free(struct wide *w);

#endif
