/* Do two images hold the same samples, accumulated in different ways (in one go, in merged shares, with a pause, until
 * a rule stopped)? Then n, mean, M2 and M3 agree up to rounding, whatever the noise: the answer is not statistical. A
 * cross term lost in a merge, sums lost in a pause, or samples not counted in n show in every pixel, even if all means
 * are right. */
#ifndef ASSAY_SAME_SAMPLES_H
#define ASSAY_SAME_SAMPLES_H

#include "renderer/image/moments.h"

/* How many pixels differ; reason: the first of them, as a phrase. n: compare only pixels with n samples in b; 0: all.
 * Images of different size differ in all pixels. Both, and their shares, may have been stored as floats: each mean is
 * allowed a relative error of e = 4e-7, with which a merge of n samples changes M2 by up to e mean sqrt(n M2) + n (e
 * mean)^2, and M3, which is at most M2^1.5, by 1e-5 of that. */
int same_samples_differing(const struct moments *a, const struct moments *b, double n,
                           char reason[128]);

#endif
