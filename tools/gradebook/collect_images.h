/* A submission's images: one run of each, and further ones where checks cannot be decided by the first. */
#ifndef ASSAY_COLLECT_IMAGES_H
#define ASSAY_COLLECT_IMAGES_H

#include "grade_batch.h"

/* Who makes the images, and where: directories for its runs, and for what they hand out. */
struct collect {
    const struct grade_job *job;
    struct submission *submission;
    const char *work, *out;
};

/* All images of the rubric, one after the other, so that a student's time does not depend on how many others there are; what
 * they say of the whole submission is in it then (submission_conclude()). */
NODISCARD bool collect_images(const struct collect *c, struct submitted_images *h, struct err *e);

/* grade_all_checks(), and again after every purchase: as long as a check is undecided for its noise and the rubric's budget
 * of CPU seconds lasts, the image that is cheapest to mend is rendered once more. The assignment's programs have no option
 * for a seed, and the same command gives the same bits; so each run has another number of samples, 1.35 times that of the last
 * or more, and another {seed} where the command has one. What two runs share of one stream of random numbers then
 * falls into other pixels after the first few. It is tested (difference_correlated()): of runs that go together only the larger
 * counts, and none twice. Noise that does not fall with the samples is none that samples can mend: that image's `fixed` is
 * set, and width costs points. What is undecided in the end keeps its points (result.more). */
NODISCARD bool collect_until_decided(const struct collect *c, struct submitted_images *h,
                                     struct result *out, int *set, struct err *e);

#endif
