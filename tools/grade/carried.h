/* Each mistake costs points once. A bug in an earlier part of the assignment spoils the images of
 * later parts too, so those are compared with references that contain the same bug. Which part
 * loses the points, and the formulas: tools/docs/background/grading.md. */
#ifndef ASSAY_CARRIED_H
#define ASSAY_CARRIED_H

#include "rubric_bugs.h"

/* For bugs that were named (needs found->num_named > 0) on top of the deviations `with`. Each costs
 * points in one part, whose paid[] becomes true. Checks of other parts that lost points are judged
 * again against the right image plus the bug's effect, cell by cell; the better result stays, and
 * its `carried` says so. result: all checks, judged against right images; updated in place. Fails
 * only for reasons of our own. */
NODISCARD bool carried_by_name(const struct grading *g, int with, const struct diagnosis *found,
                               struct result *result, bool paid[RUBRIC_PARTS], struct err *e);

/* Index of the rubric's part that a bug belongs to, found by the catalogue's words ("part 3, direct
 * light: ...", "project 3-2, glass: ...") in the `where` of the checks; -1: none. */
int carried_part_of(const struct rubric *r, const struct bug *b);

#endif
