/* Tests against known kinds of error (tools/docs/background/verdict.md, "Directed"). Used by compare.c only. */
#ifndef ASSAY_MATCHED_FILTER_H
#define ASSAY_MATCHED_FILTER_H

#include "error_modes.h"
#include "region.h"

/* All directions that apply to this size of image. Counts its tests in j->num_tests. *found is the
 * direction of the smallest p, *log10_p (0 if none could be tested). Fails only out of memory. */
bool matched_filter_test(const struct moments *a, const struct moments *b, struct judge *j,
                         enum error_mode_kind *found, double *log10_p, struct err *e)
    __attribute__((warn_unused_result));

#endif
