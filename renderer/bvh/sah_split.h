/* Splits by the binned surface area heuristic [Wald07]: the builder's passes over all items of a range, compiled once
 * for each instruction set (isa.h). All give the same bits. */
#ifndef ASSAY_SAH_SPLIT_H
#define ASSAY_SAH_SPLIT_H

#include <stdint.h>

enum { WIDE_MAX_BINS = 32 };

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
    float cost;         /* FLT_MAX: no cut, all centres coincide */
    struct wide_box left, right;
};

struct sah_split_passes {
    /* Finds the best cut by the surface area heuristic, a leaf of up to `width` items, a power of two, costing one.
     * centres: box of the doubled centres. */
    void (*split)(const struct wide_item *item, uint32_t n, uint32_t width,
                  const struct wide_box *centres, struct wide_split *out);
    /* Returns how many went left; *left, *right: boxes of the doubled centres of both sides. */
    uint32_t (*partition)(struct wide_item *item, uint32_t n, const struct wide_split *s,
                          struct wide_box *left, struct wide_box *right);
    /* Box of the items and box of their doubled centres. */
    void (*bounds)(const struct wide_item *item, uint32_t n, struct wide_box *box,
                   struct wide_box *centres);
};

extern const struct sah_split_passes sah_split_sse42, sah_split_avx2, sah_split_avx512;

#endif
