/* The means of square blocks of each image of a reference; its moments hold sums over images alone. With them another
 * version of the program that is given the same seeds is compared image by image: what noise both have in common
 * cancels in the difference of a pair (common random numbers [Glasserman92]). */
#ifndef ASSAY_BLOCK_MEANS_H
#define ASSAY_BLOCK_MEANS_H

#include "renderer/image/moments.h"

#include <jansson.h>

struct block_means {
    int width, height; /* of the image, pixels */
    int side;          /* of a block, pixels */
    int nx,
        ny; /* blocks; the last of a row or column takes what is left over: it is half to one and a half as wide */
    int num, capacity; /* images */
    /* num x ny x nx x RGB: the sum over a block's pixels / side^2, so that in sums over blocks each pixel counts as
     * much as any other. */
    float *value;
};

/* Without images. The side of a block is a power of two that divides that of a tile, and if possible so large that
 * there are no more than three numbers for each pixel of the image. The caller frees with block_means_free(). */
NODISCARD bool block_means_alloc(struct block_means *b, int width, int height, int tile,
                                 int capacity, struct err *e);
void block_means_free(struct block_means *b);
/* RGB, 3 floats a pixel. Fails only out of memory. */
NODISCARD bool block_means_add(struct block_means *b, const float *pixels_rgb, struct err *e);

/* {"side": .., "values": ..}, float32, least significant byte first, in base64; a new reference, NULL: out of memory.
 * Reading fails with a line on anything else than whole images of width x height pixels. */
json_t *block_means_to_json(const struct block_means *b);
NODISCARD bool block_means_from_json(const json_t *json, int width, int height,
                                     struct block_means *b, struct err *e);

/* For a comparison by pairs: *pairs are moments, of which a pixel is a block, of the observations (mean of all b) +
 * a[k] - b[k], for the images k that both have; *mean is that mean, exact. Without any noise pairs are exact, too.
 * Fails if sizes differ, or out of memory. */
NODISCARD bool block_means_pair(const struct block_means *a, const struct block_means *b,
                                struct moments *pairs, struct moments *mean, struct err *e);

#endif
