/* A hierarchy of nodes with eight children and leaves of eight primitives, for the kernels of
 * traverse.h. Behind bvh.h: BVH_WIDE. A scene of up to WIDE_FLAT primitives is a list and has no tree;
 * the few largest primitives of others, walls say, are a list beside the tree.
 *
 * Which primitive a ray meets does not depend on the way through the tree: the smallest distance
 * wins, and of primitives at the very same distance the smallest number. So a ray finds the same
 * alone, in a packet, and with any instruction set. */
#ifndef ASSAY_BVH_WIDE_H
#define ASSAY_BVH_WIDE_H

#include "bvh.h"
#include "renderer/base/isa.h"

enum { WIDTH = 8, WIDE_FLAT = 32, WIDE_LINE = 64 };

/* A reference to a node or leaf: its offset in the arena in bytes, a multiple of 64. The low bits tell what
 * it is: none for a node, WIDE_LEAF, or WIDE_LEAF | WIDE_SPHERES. */
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
