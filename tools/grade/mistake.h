/* What a program did wrong: a known bug's name, if one explains its images, else where it shows. Points
 * that other parts lost by the same mistake come back. */
#ifndef ASSAY_MISTAKE_H
#define ASSAY_MISTAKE_H

#include "located.h"
#include "rubric_bugs.h"

struct mistake {
    bool judged;            /* points were lost */
    bool looked;            /* images were compared with the catalogue */
    struct diagnosis found; /* named or not; never FINDING_CORRECT, as points were lost */
    int with;               /* the deviations on top of which */
    char why[200];          /* why there is no diagnosis; or "" */
    struct located located; /* set where no bug is named */
    struct diagnosis of_part[RUBRIC_PARTS]; /* likewise: a bug of that part's code, by its images alone */
};

/* result: all checks, as graded with the deviations of *set; points lost by a mistake that another
 * part already pays for come back. If a bug is found on top of other accepted deviations, *set
 * becomes those. Only for programs that lost points. Fails only for reasons of our own, such as
 * memory. */
NODISCARD bool mistake_judge(const struct grading *g, int *set, struct result *result,
                             struct mistake *out, struct err *e);

/* What of it follows from the checks that students may see now (rubric_is_shown()) and their images alone, as the
 * name of a mistake also tells what the other checks found. share: of all checks, against right images with the
 * deviations of `set`. Nothing is `judged` where the checks that are shown lost nothing. Fails as above. */
NODISCARD bool mistake_shown(const struct grading *g, int set, const double *share,
                             struct mistake *out, struct err *e);

#endif
