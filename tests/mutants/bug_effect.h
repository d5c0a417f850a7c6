/* Shared by the makers of both catalogues of known bugs: the list of patches, and the effect of a
 * bug. */
#ifndef ASSAY_TESTS_BUG_EFFECT_H
#define ASSAY_TESTS_BUG_EFFECT_H

#include "tools/diagnose/catalogue.h"

/* Adds all NAME.patch of a directory to c->bug, sorted by name; catalogue_free() frees it. Fails if
 * there is none. */
NODISCARD bool bug_list(const char *dir, struct catalogue *c, struct err *e);

/* *out: the mean of bug[k] - correct[k], of the same seed, over `batches`. Its variance is that of
 * independent renders, var bug + var correct, times `level`, or, with level 0, times the scatter of
 * the differences over the batches relative to it; more[] is added to it (NULL: nothing). An effect
 * within its noise (chi^2 below its mean + 6 standard deviations) is stored as none. The facts are
 * those of *a, the bug's average, which the caller provides. */
void bug_effect(const struct signature *bug, const struct signature *correct, int batches,
                double level, const double *more, const struct signature *a, struct effect *out);

#endif
