/* The binary tree from which the wide one is made, and the choice of its parts that become the
 * children of each wide node, `width` at most. */
#ifndef ASSAY_WIDE_BUILD_H
#define ASSAY_WIDE_BUILD_H

#include "bvh_wide.h"
#include "sah_split.h"

/* Items [first, first + count), and how many cuts led here. */
struct wide_range {
    uint32_t first, count;
    int depth; /* cuts */
    struct wide_box box, centres;
};

/* A subtree of the binary tree, with the table of the dynamic programme that makes the wide tree
 * [Ylitie17]. cost[i]: the least expected number of tests, each weighted with half the area of its
 * box, if the subtree may use at most i + 1 child slots of the node above. left_slots[i]: how many
 * of these slots go to its left half; 0: it takes one slot as a whole. left_slots[0]: if it becomes
 * a node, how many of that node's slots go to the left half. */
struct wide_part {
    struct wide_box box;
    uint32_t first, count;
    uint32_t left; /* left and left + 1 are the halves; 0: a leaf */
    float cost[WIDE_MOST];
    uint8_t left_slots[WIDE_MOST];
};

struct wide_build {
    uint32_t width;         /* of nodes and leaves: set before wide_build_make() */
    struct wide_part *part; /* 0 is the root */
    size_t num, room;
};

/* Half the surface area of a box. */
static inline float wide_half_area(const struct wide_box *b)
{
    float x = -b->v[4] - b->v[0], y = -b->v[5] - b->v[1], z = -b->v[6] - b->v[2];
    return x * y + y * z + z * x;
}

/* Cuts the items in `all` in two, by the surface area heuristic [Wald07], until each part is a leaf of up
 * to p->width triangles or as many spheres (numbers from num_triangles on), and chooses the children of
 * wide nodes [Ylitie17]. There must be more items, so that the root is no leaf; they are put
 * into the order of the leaves. *p must be empty otherwise; free it with wide_build_free(), in either case. The tree
 * is the same on any number of threads, but its parts may be numbered otherwise. False if out of memory. */
NODISCARD bool wide_build_make(const struct sah_split_passes *s, struct wide_item *item,
                               uint32_t num_triangles, const struct wide_range *all, int threads,
                               struct wide_build *p);
/* The children of part i, which is no leaf, as a wide node. Returns how many. */
int wide_build_children(const struct wide_build *p, uint32_t i, uint32_t child[WIDE_MOST]);
void wide_build_free(struct wide_build *p);

#endif
