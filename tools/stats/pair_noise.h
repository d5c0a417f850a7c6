/* The noise of two images that are compared, where a side states none, and whose noise it is. */
#ifndef ASSAY_PAIR_NOISE_H
#define ASSAY_PAIR_NOISE_H

#include "renderer/image/moments.h"

/* Is one of the two a single image of unknown noise (moments_noise_is_unknown())? Then pair_noise_estimate() makes what
 * can be compared. */
bool pair_noise_is_unknown(const struct moments *a, const struct moments *b);

/* Copies both means and estimates their noise from A - B (noise_estimate.h); images that are the same to the bit (an
 * unchanged program without seeds) count as exact. The sizes are equal. The caller frees both, even after a failure. */
NODISCARD bool pair_noise_estimate(const struct moments *a, const struct moments *b,
                                   struct moments out[2], struct err *e);

/* The share of side a in the variance of the difference, summed over pixels and channels; 1 where there is none. */
double pair_noise_share(const struct moments *a, const struct moments *b);

/* How many times the samples of side a alone leave as little noise as `times` those of both; INFINITY: no number does. */
double pair_noise_samples_of_a(double share_a, double times);

#endif
