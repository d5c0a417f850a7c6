/* What both catalogues of known bugs are made with: the list of patches, and what a bug does to a sight. */
#ifndef ASSAY_TESTS_BUG_EFFECT_H
#define ASSAY_TESTS_BUG_EFFECT_H

#include "tools/diagnose/catalogue.h"

/* All NAME.patch of a directory into c->bug, beside those that are there, by name; catalogue_free() frees it. */
NODISCARD bool bug_list(const char *dir, struct catalogue *c, struct err *e);

/* The mean of bug[k] - correct[k] over `batches` of the same seeds each. Its variance is that of independent renders,
 * var bug + var correct, times `level`; 0: times the level at which the differences scatter over the batches. more[] is
 * added to it; NULL: nothing. An effect within its noise (chi^2 below its mean + 6 standard deviations) is none.
 * The facts are those of the bug's average *a, which the caller has made. */
void bug_effect(const struct signature *bug, const struct signature *correct, int batches,
                double level, const double *more, const struct signature *a, struct effect *out);

#endif
