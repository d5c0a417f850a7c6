/* Merges shares of one image: cells are put side by side, sample ranges are added up. */
#ifndef ASSAY_MERGE_H
#define ASSAY_MERGE_H

#include "renderer/transport/film.h"
#include "renderer/image/moments.h"

/* Values of a pixel in a part: the ten of a moments file (mean, M2, M3 of R, G, B; n), then the layers. */
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
    uint32_t (*range)[2]; /* sample numbers [0] .. [1]-1, in order and disjoint */
    int num_ranges;
    /* An image that was merged from several sample ranges keeps them (attribute assay:parts, "0:4,4:9", and channels
     * "0:4.R" ..), so that merging it further gives the bits of merging all at once. Any other has one part, itself. In
     * order. */
    struct share_part *part;
    int num_parts;
};

/* Reads a share. Fails with a line on a file that is not an image of pathtracer or lacks the metadata. The caller calls
 * share_free(). */
NODISCARD bool share_read(const char *path, struct share *out, struct err *e);
void share_free(struct share *s);

/* Merges num >= 1 shares into the moments of all their samples [Pebay08], with the layers of --aov if all have
 * them. The bits are the same in any order and grouping: the parts of a pixel are added in the order of their
 * samples, whichever files they come from (the shares are sorted in place). Exact up to the float32 of the files,
 * and to the bit if cells are only put side by side. Fails with a line if two files differ in version, scene,
 * settings, seed or adaptive mode, if they share samples, if cells overlap without being the same, if cells have
 * different samples, if the cells do not fill a rectangle, if ranges of a cell were rendered with the assignment's
 * adaptive rule, or if there are more than 162 ranges to keep (408 without layers). The caller frees *out. */
NODISCARD bool merge_shares(struct share *share, int num, struct share *out, struct err *e);

/* Writes the image as pathtracer would, with `command` as its attribute assay:command. */
NODISCARD bool share_write(const char *path, const struct share *s, const char *command,
                           struct err *e);

#endif
