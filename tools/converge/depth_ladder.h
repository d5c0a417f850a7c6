/* The depth ladder of `assay converge`: the image's mean radiance against the greatest number of bounces. */
#ifndef ASSAY_DEPTH_LADDER_H
#define ASSAY_DEPTH_LADDER_H

#include "converge_engine.h"

/* "depths" of an element of "convergence" (convergence_results.h), in *out (a new reference):
 *   {"samples": 64, "rungs": [{"depth": 0, "mean": .12, "se": .0004, "truth": .1201}, ...]}
 * Rendered with our independent sampler at depths 0 to 8, then 1.5 times as many each time, up to the scene's.
 * mean: luminance, averaged over the image; se: its standard error, channels taken as fully correlated (an upper
 * bound). truth: the same of the closed form, if `truth` (may be NULL) is known at that depth. All images have the
 * same seed, so that steps are less noisy than values. Fails if an image cannot be rendered. */
NODISCARD bool depth_ladder_measure(const struct converge_job *job,
                                    const struct suite_reference *truth, int spp, json_t **out,
                                    struct err *e);

#endif
