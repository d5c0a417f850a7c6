/* The depth ladder of `assay converge`: the image's mean radiance if paths end after so many bounces. */
#ifndef ASSAY_DEPTH_LADDER_H
#define ASSAY_DEPTH_LADDER_H

#include "converge_engine.h"

/* "depths" of an element of "convergence" (convergence_results.h), in *out (a new reference):
 *   {"samples": 64, "rungs": [{"depth": 0, "mean": .12, "se": .0004, "truth": .1201}, ...]}
 * Our independent sampler at depths 0 to 8 and then half as many again each time, up to the scene's own. mean: luminance,
 * mean over the image; se: its standard error for channels that err together (an upper bound). truth: of the closed
 * form, where `truth` (may be NULL) holds at that depth. All images have the same seed, so that steps are less noisy
 * than the values. Fails where an image cannot be rendered. */
NODISCARD bool depth_ladder_measure(const struct converge_job *job,
                                    const struct suite_reference *truth, int spp, json_t **out,
                                    struct err *e);

#endif
