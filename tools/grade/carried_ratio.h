/* Each mistake costs points once, even one that has no name: later parts are judged relative to an
 * image of an earlier part that lost points. */
#ifndef ASSAY_CARRIED_RATIO_H
#define ASSAY_CARRIED_RATIO_H

#include "rubric_bugs.h"

/* result: all checks; those that gain points are updated, and `carried` says why. share: the share of
 * each check when judged against right images. paid: parts where a named mistake costs points; their
 * checks stay as they are. By kind of check:
 *
 * equal   With `after IMAGE`, where a check of an earlier part on IMAGE lost points. Let P be the mean
 *         luminance of the check's image, B that of IMAGE, P' and B' those of the student, with any
 *         accepted deviations. log R, R = (P'/P)/(B'/B), is judged by the margin `carried`. Where IMAGE
 *         is direct light, P may have the factor B'/B at every bounce (a wrong BSDF) or once (wrong
 *         light); the nearer one counts. No points are gained by an image that is the same file as
 *         IMAGE, that agrees with the reference of IMAGE although it should have more bounces, or whose
 *         tiles do not correlate with the right image's (two nearly uniform images pass if R should
 *         differ from 1 by more than 10 %, or if an earlier image of the scene is right).
 * rates   In a scene in which an earlier part lost points: the logarithm of the student's number of
 *         samples over ours, by the same margin, or grade_checks_rates(), whichever gives more.
 * noise   Measured against the program's own image with more samples, instead of the right one.
 * growth  Timed even if the image is wrong, as long as it shows the scene.
 *
 * False: out of memory. */
bool carried_by_ratio(const struct grading *g, int set, const double *share, const bool *paid,
                      struct result *result, struct err *e);

#endif
