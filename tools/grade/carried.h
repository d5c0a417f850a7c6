/* Each mistake costs points once. A bug in an earlier part of the assignment spoils the images of
 * later parts too, so those are compared with references that contain the same bug. Which part
 * loses the points, and the formulas: tools/docs/background/grading.md. */
#ifndef ASSAY_CARRIED_H
#define ASSAY_CARRIED_H

#include "rubric_bugs.h"

/* By bugs that were named (found->num_named > 0) on top of the deviations `with`: checks of another part than that
 * in which a bug is paid get the points that they have against the right image with the bug's effect added, cell by
 * cell, if those are more. result: of all checks, as judged against right images; `carried` says what was done. paid: becomes true of the parts that pay. */
NODISCARD bool carried_by_name(const struct grading *g, int with, const struct diagnosis *found,
                               struct result *result, bool paid[RUBRIC_PARTS], struct err *e);

/* The part of the rubric in which a bug stands, by the catalogue's words ("part 3, direct light: ...", "project 3-2,
 * glass: ...") and the `where` of the checks; -1: none. */
int carried_part_of(const struct rubric *r, const struct bug *b);

#endif
