/* What an image of a rubric shows, in cells (signature.h): that of an 8-bit file, or what a render of ours would show in one.
 *
 * Cells hold what an image of the rubric's curve and of as many samples as are asked for shows on average: E[min(X, clip)]
 * of each pixel, X normal with the mean and the variance of a render of ours, clip the radiance of the brightest code.
 * Decoded codes are the middle of their bin; half a bin, by which a flat cell may be off and which noise dithers away, is
 * added to the standard deviation of a student's cell, so rounding and clipping are part of every likelihood. Images of
 * adaptive sampling have FACT_SAMPLES, by the rate image. */
#ifndef ASSAY_RUBRIC_SIGHT_H
#define ASSAY_RUBRIC_SIGHT_H

#include "tools/diagnose/signature.h"
#include "grade_checks.h"

/* Radiance of the rubric's brightest code; INFINITY: none. */
double rubric_sight_clip(const struct rubric *r);
/* Is the number of an image's samples a fact (a check of rates)? */
bool rubric_sight_counts(const struct rubric *r, int image);

/* Of a render of ours: mean, variance of the mean, n = samples in a cell. as_asked: of counting images, n as if all had been
 * taken, and FACT_SAMPLES. Fails on a size that is not of whole cells. */
NODISCARD bool rubric_sight_of_render(const struct rubric *r, int image, bool as_asked,
                                      const struct moments *m, struct signature *out,
                                      struct err *e);

/* The variance of a student's cell that has a masked pixel: it says nothing. */
extern const double rubric_sight_masked;

/* Of a student's image, which is there. right: the reference, as_asked of counting images; correct: its cells. A program that
 * is noisier than ours (median of the cells) has that variance. */
NODISCARD bool rubric_sight_of_student(const struct rubric *r, int image,
                                       const struct submitted_images *h, const struct answer *right,
                                       const struct signature *correct, struct signature *out,
                                       struct err *e);

#endif
