/* The cells (signature.h) of an image of a rubric: of a student's 8-bit file, or of a render of ours as
 * it would be in such a file.
 *
 * Cells of a render hold the expected content of an image with the rubric's curve and as many samples as
 * are asked for: E[min(X, clip)] of each pixel, X normal with the mean and the variance of our render,
 * clip the radiance of the brightest code. A student's code stands for the middle of its bin. Half a
 * bin, by which a flat cell may be off and which noise dithers away, is added to the standard deviation
 * of the student's cell; so rounding and clipping are part of every likelihood. Images of adaptive
 * sampling have FACT_SAMPLES, read from the rate image. */
#ifndef ASSAY_RUBRIC_SIGHT_H
#define ASSAY_RUBRIC_SIGHT_H

#include "tools/diagnose/signature.h"
#include "grade_checks.h"

/* Radiance of the rubric's brightest code; INFINITY: none. */
double rubric_sight_clip(const struct rubric *r);
/* Is the image's number of samples a fact, as it has a check of rates? */
bool rubric_sight_counts(const struct rubric *r, int image);

/* Cells of a render of ours: mean, variance of the mean, n = samples in a cell. as_asked: for images
 * whose samples are a fact, n as if all had been taken, and FACT_SAMPLES. Fails on a size that is not a
 * whole number of cells. */
NODISCARD bool rubric_sight_of_render(const struct rubric *r, int image, bool as_asked,
                                      const struct moments *m, struct signature *out,
                                      struct err *e);

/* Variance given to a student's cell with a masked pixel: so large that the cell says nothing. */
extern const double rubric_sight_masked;

/* Cells of a student's image, which has to exist. right: the reference, and `as_asked` for images
 * whose samples are a fact; correct: its cells. If the program is noisier than ours (median over
 * the cells), variances are raised accordingly. */
NODISCARD bool rubric_sight_of_student(const struct rubric *r, int image,
                                       const struct submitted_images *h, const struct answer *right,
                                       const struct signature *correct, struct signature *out,
                                       struct err *e);

#endif
