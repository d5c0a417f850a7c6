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
    size_t tested[PYRAMID_LEVELS]; /* regions, per level of the image */
    struct worst_region worst[2];  /* [0] the image, [1] all smaller regions */
    struct pyramid band;           /* the levels below the tiles, of some rows */
    /* Only of R, G, B (chi_square.h): parts of the largest band, and of the tiles; each with room
     * for twice as many. */
    struct part *part, *tiles;
    double squared; /* sum over pixels of d^2 - v: unbiased for the sum of squared biases */
    /* Only of luminance. */
    struct matched_filter directed;
    double *root[2]; /* pyramid_build()'s root, or NULL */
};

/* Measures a region with its surroundings: the region of four times its side, or the image. */
struct measured channel_sweep_measure(const struct judge *j, const struct pyramid *p, int level,
                                      size_t i);

/* Tests all regions of a channel; for luminance, also fills the maps of `out` and touches nothing
 * else of it. `levels` are the image's. Fails only out of memory. Release with
 * channel_sweep_close() in any case. */
NODISCARD bool channel_sweep_run(const struct judge *j, const struct moments *a,
                                 const struct moments *b, const struct pyramid *levels, int channel,
                                 struct channel_sweep *s, struct comparison *out, struct err *e);
void channel_sweep_close(struct channel_sweep *s);

#endif
