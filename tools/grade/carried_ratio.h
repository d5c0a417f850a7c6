/* One mistake is paid once, also without a name: what an earlier part lost points for is no reason to lose them again. */
#ifndef ASSAY_CARRIED_RATIO_H
#define ASSAY_CARRIED_RATIO_H

#include "rubric_bugs.h"

/* result: of all checks; those that gain are changed, and `carried` says why. share: what each had against right images. paid: of parts, whose
 * checks are left alone, as a mistake that has a name is paid there.
 * `equal` with `after IMAGE`, where a check of an earlier part on that image lost points: R = (P'/P)/(B'/B), P the
 * image's mean luminance, B that of IMAGE, primes the student's, of any accepted deviations; log R against the margin `carried`. Where IMAGE
 * is direct light, P has the factor B'/B at every bounce (a wrong BSDF), or as B (wrong light), whichever is nearer. An image that is
 * the other one again, or what that should be of fewer bounces (its direct light may depend on -l), or does not look like what it should show (where there is something to
 * see, or no other image of the scene is right), carries nothing on.
 * `rates` of a scene of which an earlier part lost points: the logarithm of the number of samples over ours against that margin, or
 * grade_checks_rates(), whichever is more.
 * `noise`: against another image of the program's own with more samples, instead of the right one. False: out of memory. */
bool carried_by_ratio(const struct grading *g, int set, const double *share, const bool *paid,
                      struct result *result, struct err *e);

#endif
