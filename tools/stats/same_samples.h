/* Are two images sums of the same samples, added up in other ways: in one go, in shares that were merged, with a pause between,
 * until a rule stopped them? Then they have the same n, mean, M2 and M3 but for rounding, whatever the noise: there is no
 * chance in the answer, and a lost cross term of a merge, sums that a pause forgot and an n that was not counted show in every
 * pixel. Their means may all be right. */
#ifndef ASSAY_SAME_SAMPLES_H
#define ASSAY_SAME_SAMPLES_H

#include "renderer/image/moments.h"

/* How many pixels differ, and in reason the first one, in half a sentence. Only pixels that have n samples in b; 0: all. Of the
 * same size, else all differ. Both may have been stored as floats, their shares too: each mean is allowed a relative error of e = 4e-7,
 * with which a merge of n samples changes M2 by up to e mean sqrt(n M2) + n (e mean)^2, and M3, which is at most M2^1.5, by 1e-5 of
 * that. */
int same_samples_differing(const struct moments *a, const struct moments *b, double n,
                           char reason[128]);

#endif
