/* Shares of one image put together: cells beside each other, sample ranges on top of each other. */
#ifndef ASSAY_MERGE_H
#define ASSAY_MERGE_H

#include "renderer/transport/film.h"
#include "renderer/image/moments.h"

/* What one pixel brings of its samples: the ten values of moments as a file has them, then the layers. */
enum { PART_VALUES = 10 + NUM_LAYERS };

/* Samples first .. last-1 of a share, as one render had them. A pixel without any has n = 0. */
struct share_part {
    uint32_t first, last;
    int channel[PART_VALUES]; /* of the share's image; those of layers -1 where it has none */
};

/* An image of pathtracer with what its metadata says about its part in the whole. Owns m and im;
 * the texts belong to im. */
struct share {
    const char *path;
    struct moments m;
    struct image im;
    int cell[6];          /* x y dx dy of W H, origin at the bottom left */
    uint32_t (*range)[2]; /* sample numbers [0] .. [1]-1, in order, apart from each other */
    int num_ranges;
    /* An image that was merged from several sample ranges keeps them (attribute assay:parts, "0:4,4:9", and channels "0:4.R" ..), so
     * that it is merged further as they would have been. Any other has one part, itself. In order. */
    struct share_part *part;
    int num_parts;
};

/* Reads one. Fails with a line on a file that is no image of pathtracer or lacks the metadata. */
NODISCARD bool share_read(const char *path, struct share *out, struct err *e);
void share_free(struct share *s);

/* The union of num >= 1 shares, as the moments of all their samples [Pebay08] and with the layers of
 * --aov where all have them. To the same bits in any order and in any grouping: a pixel's parts are added in the order of
 * their samples, whichever files they come from (the shares are sorted in place). Exact up to the float32 of the
 * files, and to the bit where cells only lie beside each other. Fails with a
 * line that names two files if they differ in version, scene, settings, seed or adaptive mode, if
 * they share samples, if cells overlap without being the same, if cells have different samples, if
 * the cells do not fill a rectangle, if sample ranges stopped each by the assignment's adaptive
 * rule, or if the ranges to keep are more than 162. */
NODISCARD bool merge_shares(struct share *share, int num, struct share *out, struct err *e);

/* Writes it as pathtracer would, with `command` as its origin. */
NODISCARD bool share_write(const char *path, const struct share *s, const char *command,
                           struct err *e);

#endif
