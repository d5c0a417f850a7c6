/* Locates a mistake that has no name: what wrong images have in common and right images have not. */
#ifndef ASSAY_LOCATED_H
#define ASSAY_LOCATED_H

#include "grade_checks.h"

struct located {
    char text
        [240]; /* "only in light that bounced off a surface first"; "": nothing is known */
    int image; /* that shows it; -1: none */
};

/* share: of all checks, against right images. An image is wrong if an `equal` or `exact` check of it
 * lost points, right if it has such checks and none lost points. Names the facts about scene, options
 * and bounces that all wrong images have and no right one has. */
struct located located_by(const struct grading *g, const double *share);

#endif
