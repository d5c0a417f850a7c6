/* What the claims that differ have in common, and those that agree do not: a place to look where no bug has a name. */
#ifndef ASSAY_SHARED_FEATURES_H
#define ASSAY_SHARED_FEATURES_H

#include "reference/suite/suite.h"

/* One sentence about the claims that are DIFFERENT and should be EQUIVALENT: the feature of a scene (features.h, light
 * of more than one bounce, a reference, a variant of ours), or two of them, that all of these have and fewest of those
 * that came out EQUIVALENT. Empty if none differs. Opens the scenes of results (results.json). */
bool shared_features_tell(const json_t *results, const struct suite *suite, char *text, size_t size,
                          struct err *e) __attribute__((warn_unused_result));

#endif
