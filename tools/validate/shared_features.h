/* What the claims that differ have in common and the others lack: a hint if no known bug explains the
 * differences. */
#ifndef ASSAY_SHARED_FEATURES_H
#define ASSAY_SHARED_FEATURES_H

#include "renderer/base/err.h"

#include <jansson.h>

/* Writes to text what the claims share that are DIFFERENT but should be EQUIVALENT: the likeliest trait
 * (claim_traits.h) or pair of traits, how many EQUIVALENT claims have it too, what is nearly as likely, and
 * the scenes; or that they share nothing, of which a few scenes say nothing. Method: tools/docs/background/diagnosis.md. The text is cut at
 * size; it is empty if there is nothing to say, and if no claim differs the suite in suite_dir is not opened. */
NODISCARD bool shared_features_tell(const json_t *results, const char *suite_dir, char *text,
                                    size_t size, struct err *e);

#endif
