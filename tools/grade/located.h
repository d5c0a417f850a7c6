/* Where a mistake without a name sits: what images that are wrong have in common that right ones have not. */
#ifndef ASSAY_LOCATED_H
#define ASSAY_LOCATED_H

#include "grade_checks.h"

struct located {
    char text
        [240]; /* "only in light that bounced off a surface first"; "" where nothing is to be said */
    int image; /* that shows it; -1: none */
};

/* share: of all checks, against right images. An image that is there is wrong if an `equal` or `exact` check of it lost points, right if it
 * has such checks and none lost. Said of facts about scene, options and bounces that all wrong images share and no right one has. */
struct located located_by(const struct grading *g, const double *share);

#endif
