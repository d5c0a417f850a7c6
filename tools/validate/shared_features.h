/* What the claims that differ have in common and the others have not: a hint where no known bug explains
 * the differences. */
#ifndef ASSAY_SHARED_FEATURES_H
#define ASSAY_SHARED_FEATURES_H

#include "renderer/base/err.h"

#include <jansson.h>

/* Writes what the claims share that are DIFFERENT and should be EQUIVALENT: the likeliest trait
 * (claim_traits.h) or pair of traits, how many claims that came out EQUIVALENT have it too, what is nearly
 * as likely, and the scenes; or that they share nothing. How: tools/docs/background/diagnosis.md. The text
 * is empty if no claim differs; else the suite of results (results.json) is opened. */
NODISCARD bool shared_features_tell(const json_t *results, const char *suite_dir, char *text,
                                    size_t size, struct err *e);

#endif
