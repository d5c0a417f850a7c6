/* The traversal stack: nodes and leaves that a ray, or a packet of rays, still has to visit. The
 * nearest child is visited at once, the others are pushed in order of distance. Part of traverse.c. */
#ifndef ASSAY_TRAVERSE_STACK_H
#define ASSAY_TRAVERSE_STACK_H

#include "bvh_wide.h"
#include "renderer/math/simd.h"

/* Rows of LANES, laid out as bvh_wide.h says. */
struct wide_node {
    float plane[6][LANES];
    uint32_t child[LANES];
} __attribute__((aligned(WIDE_LINE)));

struct wide_leaf {
    float p[3][3][LANES]; /* corner, axis */
    uint32_t prim[LANES];
};

_Static_assert(sizeof(struct wide_node) == WIDE_NODE_SIZE(LANES) &&
                   sizeof(struct wide_leaf) == WIDE_LEAF_SIZE(LANES),
               "as the builder lays them out");

/* A node pushes all but one of its children; 64 free levels, 32 of halving and some to spare. */
enum { STACK = (LANES - 1) * 104 };

/* A waiting node or leaf: the bits of the distance at which a ray enters it, and its reference. As
 * integers they sort by distance where that is positive; elsewhere only the order of visits
 * suffers. */
typedef int64_t stacked;

static inline const void *at(const struct wide *w, uint32_t ref)
{
    return w->arena + (ref & WIDE_PLACE);
}

INLINE void fetch_ahead(const struct wide *w, uint32_t ref, bool ahead)
{
    const char *p = at(w, ref);
    for (size_t k = 0; ahead && k < sizeof(struct wide_node); k += WIDE_LINE)
        __builtin_prefetch(p + k);
}

INLINE stacked stack_entry(float t, uint32_t ref)
{
    uint32_t of_t;
    memcpy(&of_t, &t, sizeof t);
    return (stacked)((uint64_t)of_t << 32 | ref);
}

INLINE float stacked_t(stacked s)
{
    uint32_t of_t = (uint32_t)((uint64_t)s >> 32);
    float t;
    memcpy(&t, &of_t, sizeof t);
    return t;
}

INLINE uint32_t stacked_ref(stacked s)
{
    return (uint32_t)s;
}

/* Branch-free: which of two is nearer cannot be predicted. */
INLINE void order(stacked *near, stacked *far)
{
    stacked a = *near, b = *far;
    *near = a < b ? a : b;
    *far = a < b ? b : a;
}

/* Pushes the children, two or more, the farthest first, but returns the nearest. */
INLINE uint32_t push_sorted(const struct wide *w, const struct wide_node *n, unsigned hit, vf enter,
                            bool ahead, stacked **top)
{
    float t[LANES] __attribute__((aligned(64)));
    vf_store(t, enter);
    int i = __builtin_ctz(hit);
    hit &= hit - 1;
    int j = __builtin_ctz(hit);
    hit &= hit - 1;
    stacked near = stack_entry(t[i], n->child[i]), far = stack_entry(t[j], n->child[j]);
    fetch_ahead(w, n->child[i], ahead);
    fetch_ahead(w, n->child[j], ahead);
    order(&near, &far);
    stacked *p = *top;
    if (hit) {
        i = __builtin_ctz(hit);
        hit &= hit - 1;
        fetch_ahead(w, n->child[i], ahead);
        stacked third = stack_entry(t[i], n->child[i]);
        order(&near, &third);
        order(&far, &third);
        *p++ = third;
        while (hit) {
            i = __builtin_ctz(hit);
            hit &= hit - 1;
            fetch_ahead(w, n->child[i], ahead);
            stacked next = stack_entry(t[i], n->child[i]);
            order(&near, &next);
            order(&far, &next);
            stacked *q = p++;
            for (; q > *top && q[-1] < next; q--)
                *q = q[-1];
            *q = next;
        }
    }
    *p++ = far;
    *top = p;
    return stacked_ref(near);
}

/* Returns the nearest of the children hit and pushes the others. ahead: prefetches them if there are several. */
INLINE uint32_t next_of(const struct wide *w, const struct wide_node *n, unsigned hit, vf enter,
                        bool ahead, stacked **top)
{
    if ((hit & (hit - 1)) == 0)
        return n->child[__builtin_ctz(hit)];
    return push_sorted(w, n, hit, enter, ahead, top);
}

#endif
