/* What the claims that differ have in common, and those that agree do not: a place to look where no bug has a name. */
#ifndef ASSAY_SHARED_FEATURES_H
#define ASSAY_SHARED_FEATURES_H

#include "renderer/base/err.h"

#include <jansson.h>

/* One sentence about the claims that are DIFFERENT and should be EQUIVALENT: the feature of a scene (features.h, light
 * of more than one bounce, a reference, a variant of ours), or two of them, that all of these have and fewest of those
 * that came out EQUIVALENT. Empty if none differs; else the suite of results (results.json) is opened. */
bool shared_features_tell(const json_t *results, const char *suite_dir, char *text, size_t size,
                          struct err *e) __attribute__((warn_unused_result));

#endif
