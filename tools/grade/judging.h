/* One check being judged: its images, their comparable pixels and their noise. Only for the judges
 * of the kinds of checks (grade_checks.c, grade_checks_rates.c); judging_samples() also for those who
 * name bugs (rubric_bugs.c). */
#ifndef ASSAY_JUDGING_H
#define ASSAY_JUDGING_H

#include "grade_checks.h"
#include "stopping_rule.h"

struct judging {
    const struct grading *g;
    const struct rubric_check *check;
    int set;                           /* of accepted deviations */
    unsigned char *use;                /* pixels that can be compared; NULL: not looked for */
    struct submitted_image compare[2]; /* what images are compared with */
};

/* Image k of the check: in the rubric; the student's; as it should be (NULL: the rubric gives
 * none); and a render of ours that says how its samples vary. */
const struct rubric_image *judging_image(const struct judging *w, int k);
const struct submitted_image *judging_student(const struct judging *w, int k);
const struct moments *judging_reference(const struct judging *w, int k);
const struct moments *judging_expected(const struct judging *w, int k);

/* Does the rubric leave out pixel p of s? */
bool judging_masks(const struct judging *w, const struct submitted_image *s, size_t p);

/* Can more samples be had of all its images? */
bool judging_can_buy(const struct judging *w);

/* Sets the noise that a student's image should have, if it shows the deviations of `set`; call it before
 * the next two functions. Fails only out of memory. */
NODISCARD bool judging_expect_noise(const struct grading *g, int set, int image, struct err *e);

/* Fills w->use, the pixels that can be compared, which the caller frees, and out->noise. Around the
 * clipping point a program that is noisier than ours loses more pixels. If fewer than 30 % would be
 * left, out->more asks for more samples instead. False: out of memory. */
NODISCARD bool judging_find_usable(struct judging *w, struct result *out, struct err *e);

/* What the stopping rule may do to an adaptive image with as much noise as the student's: the range
 * of bias and of samples. Needs w->use. The caller frees with stopping_rule_free(). */
NODISCARD bool judging_stopping(const struct judging *w, struct stopping *out, struct err *e);

/* How many samples image `image` takes by each rule with its own light and noise, if it shows the deviations of
 * `set` (stopping_rule_samples()). Fails out of memory, and where the image cannot be compared. */
NODISCARD bool judging_samples(const struct grading *g, int set, int image,
                               struct stopping out[NUM_STOPPING_KINDS], struct err *e);

/* The judge of checks of kind rates (grade_checks_rates.c). */
NODISCARD bool grade_checks_judge_rates(struct judging *w, struct result *out, struct err *e);

#endif
