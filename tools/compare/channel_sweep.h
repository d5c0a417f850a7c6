/* Tests all regions of one channel of a claim, one band of rows after the other. For luminance it
 * also fills the maps of the comparison (z and relative difference). Used by compare.c only. */
#ifndef ASSAY_CHANNEL_SWEEP_H
#define ASSAY_CHANNEL_SWEEP_H

#include "matched_filter.h"
#include "region.h"

/* The region with the smallest p so far; begin with log10_p = 1. */
struct worst_region {
    struct cell cell;
    struct rect rect;
    int channel, side;
    double log10_p, z;
};

struct channel_sweep {
    int channel;
    struct pyramid above;          /* the reporting tiles and what lies above */
    size_t tested[PYRAMID_LEVELS]; /* of each level of the image */
    struct worst_region worst[2];  /* of the image and of all smaller ones */
    struct pyramid band;           /* what is smaller, of some rows */
    /* Of R, G, B, chi_square.h: of the largest band, and of the tiles; room for them twice. */
    struct part *part, *tiles;
    double squared; /* sum over pixels of d^2 - v: without bias for the sum of squared biases */
    /* Of luminance. */
    struct matched_filter directed;
    double *root[2]; /* pyramid_build()'s root, or NULL */
};

/* A region, and what is around it: that of four times its side, or the image. */
struct measured channel_sweep_measure(const struct judge *j, const struct pyramid *p, int level,
                                      size_t i);

/* Tests them; of luminance, fills the images of `out` too, and touches nothing else of it. `levels`
 * are the image's. Fails only out of memory. Release with channel_sweep_close() in any case. */
NODISCARD bool channel_sweep_run(const struct judge *j, const struct moments *a,
                                 const struct moments *b, const struct pyramid *levels, int channel,
                                 struct channel_sweep *s, struct comparison *out, struct err *e);
void channel_sweep_close(struct channel_sweep *s);

#endif
