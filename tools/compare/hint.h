/* What a difference looks like: the known change that, made to B, removes it. */
#ifndef ASSAY_HINT_H
#define ASSAY_HINT_H

#include "compare.h"

/* Makes each change of error_modes.h to B, with the amount that leaves least, and measures the squared difference
 * that remains, noise removed (tools/docs/background/verdict.md, "Naming"). Unless c is EQUIVALENT, c->hint becomes the one
 * that removes most, if that is at least nine tenths, and c->reason ends with it. Flips and exchanges come first,
 * where several remove as much. Of large images a part is looked at. The same with any number of threads. Fails only out
 * of memory. */
NODISCARD bool hint_add(const struct moments *a, const struct moments *b, int threads,
                        struct comparison *c, struct err *e);

#endif
