/* From the tests and intervals of a claim to its verdict, with the sentence that says why. Used by
 * compare.c only. */
#ifndef ASSAY_VERDICT_H
#define ASSAY_VERDICT_H

#include "compare.h"

/* Fills verdict, reason and extra_factor; all else of c is filled but for the images' pixels. `tiles`
 * are the luminance regions of the tiles_x x tiles_y reporting tiles. */
void verdict_decide(struct comparison *c, const struct compare_options *opt,
                    const struct region *tiles);

#endif
