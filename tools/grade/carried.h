/* Each mistake costs points once. A bug in an earlier part of the assignment spoils the images of
 * later parts too, so those are compared with references that contain the same bug. Which part
 * loses the points, and the formulas: tools/docs/background/grading.md. */
#ifndef ASSAY_CARRIED_H
#define ASSAY_CARRIED_H

#include "rubric_bugs.h"

/* For bugs that were named (found->num_named > 0) on top of the deviations `with`. A bug costs points
 * in one part, whose paid[] becomes true. Checks of other parts are judged again against the right
 * image with the bug's effect added, cell by cell, and keep what gives more points; their `carried`
 * says so. result: of all checks, as judged against right images. */
NODISCARD bool carried_by_name(const struct grading *g, int with, const struct diagnosis *found,
                               struct result *result, bool paid[RUBRIC_PARTS], struct err *e);

/* The part of the rubric that a bug belongs to, by the catalogue's words ("part 3, direct light:
 * ...", "project 3-2, glass: ...") and the `where` of the checks; -1: none. */
int carried_part_of(const struct rubric *r, const struct bug *b);

#endif
