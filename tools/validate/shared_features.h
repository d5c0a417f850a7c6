/* What the claims that differ have in common, and those that agree do not: a place to look where no bug has a name. */
#ifndef ASSAY_SHARED_FEATURES_H
#define ASSAY_SHARED_FEATURES_H

#include "renderer/base/err.h"

#include <jansson.h>

/* What the claims that are DIFFERENT and should be EQUIVALENT share: the likeliest trait (claim_traits.h), or two of them,
 * how many of those that came out EQUIVALENT have it too, what is nearly as likely, and their scenes; or that they share
 * nothing. How: tools/docs/background/diagnosis.md. Empty if none differs; else the suite of results (results.json) is
 * opened. */
NODISCARD bool shared_features_tell(const json_t *results, const char *suite_dir, char *text,
                                    size_t size, struct err *e);

#endif
