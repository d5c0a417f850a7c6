/* What must hold before anything is compared (tools/docs/background/verdict.md, "Checks of the input").
 * Used by compare.c and two_stage.c. */
#ifndef ASSAY_INPUT_CHECKS_H
#define ASSAY_INPUT_CHECKS_H

#include "region.h"

/* Each failure is a line in e: see compare_moments(). On success *j holds everything that regions
 * share, except what depends on their number (z_guard, num_tests). */
NODISCARD bool input_checks_run(const struct moments *a, const struct moments *b,
                                const struct compare_options *opt, struct judge *j, struct err *e);

#endif
