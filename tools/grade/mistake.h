/* What a program did wrong: named, if a known bug explains its images, or located; and paid once. */
#ifndef ASSAY_MISTAKE_H
#define ASSAY_MISTAKE_H

#include "located.h"
#include "rubric_bugs.h"

struct mistake {
    bool judged;            /* points were lost: */
    bool looked;            /* images were held against the catalogue: */
    struct diagnosis found; /* named or not; never FINDING_CORRECT, as points were lost */
    int with;               /* the deviations on top of which */
    char why[200];          /* there is no diagnosis; "" */
    struct located located; /* where nothing is named */
};

/* result: of all checks as graded with the deviations of *set; points that were lost for what another part pays come back. Where a bug is found on
 * top of other accepted deviations, *set becomes those. Only for programs that
 * lost points. Fails only for our own trouble. */
NODISCARD bool mistake_judge(const struct grading *g, int *set, struct result *result,
                             struct mistake *out, struct err *e);

#endif
