/* What a difference looks like: the known change that, made to B, removes it. */
#ifndef ASSAY_HINT_H
#define ASSAY_HINT_H

#include "compare.h"

/* Applies each change of error_modes.h to B, by the amount that leaves the smallest difference, and measures the
 * squared difference that remains, corrected for noise (tools/docs/background/verdict.md, "Naming"). Unless c is
 * EQUIVALENT or NO DIFFERENCE FOUND, c->hint becomes the change that removes most, if that is at least nine tenths, and c->reason ends with
 * it. If several remove as much, flips and exchanges are preferred. Large images are sampled. The result does not
 * depend on the number of threads. Fails only out of memory. */
NODISCARD bool hint_add(const struct moments *a, const struct moments *b, int threads,
                        struct comparison *c, struct err *e);

#endif
