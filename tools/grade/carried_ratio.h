/* Each mistake costs points once, also one without a name: later parts are judged relative to an image
 * of an earlier part that lost points. */
#ifndef ASSAY_CARRIED_RATIO_H
#define ASSAY_CARRIED_RATIO_H

#include "rubric_bugs.h"

/* result: of all checks; those that gain points are changed, and `carried` says why. share: what each
 * had against right images. paid: parts in which a mistake that has a name costs points; their checks
 * are left alone. By kind of check:
 *
 * equal   With `after IMAGE`, where a check of an earlier part on IMAGE lost points. Let P be the mean
 *         luminance of the check's image, B that of IMAGE, P' and B' those of the student, with any
 *         accepted deviations. log R, R = (P'/P)/(B'/B), is judged by the margin `carried`. Where IMAGE
 *         is direct light, P may have the factor B'/B at every bounce (a wrong BSDF) or once (wrong
 *         light); the nearer one counts. Nothing is carried on by an image that is IMAGE again, or
 *         IMAGE with fewer bounces (whose direct light may depend on -l), or that does not look like
 *         what it should show (where there is something to see, or where no other image of the scene
 *         is right).
 * rates   Of a scene of which an earlier part lost points: the logarithm of the student's number of
 *         samples over ours, by the same margin, or grade_checks_rates(), whichever gives more.
 * noise   Against an image of the program's own with more samples, instead of the right one.
 *
 * False: out of memory. */
bool carried_by_ratio(const struct grading *g, int set, const double *share, const bool *paid,
                      struct result *result, struct err *e);

#endif
