/* A submission's images: one run of each, and further ones where checks cannot be decided by the first. */
#ifndef ASSAY_COLLECT_IMAGES_H
#define ASSAY_COLLECT_IMAGES_H

#include "grade_batch.h"

/* Who makes the images, and where: work is the directory for runs, out the one for their images and
 * logs. */
struct collect {
    const struct grade_job *job;
    struct submission *submission;
    const char *work, *out;
};

/* Makes all images of the rubric, one after the other, so that their times do not depend on the
 * number of images, and sets the state of c->submission (submission_conclude()). Fails only for
 * reasons of our own. */
NODISCARD bool collect_images(const struct collect *c, struct submitted_images *h, struct err *e);

/* grade_all_checks(), and again after every purchase: while a check is undecided because of noise
 * and the rubric's budget of CPU seconds lasts, the image whose next run is cheapest is rendered
 * once more. The assignment's programs have no option for a seed, and the same command gives the
 * same bits; so the samples of a run differ from those of every other by a factor of at least 1.2,
 * and {seed}, where the command has one, differs, too. What two runs share of one stream of random
 * numbers then falls into other pixels after the first few. It is tested (difference_correlated()):
 * of correlated runs only the larger counts, and none twice. Noise that does not fall with the
 * samples cannot be mended by them: that image's `fixed` is set, and width costs points. A check
 * that stays undecided keeps its points (result.more). */
NODISCARD bool collect_until_decided(const struct collect *c, struct submitted_images *h,
                                     struct result *out, int *set, struct err *e);

#endif
