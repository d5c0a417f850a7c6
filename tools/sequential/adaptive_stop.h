/* Does adaptive sampling stop where it is told to? The rule of the assignment: after each batch of
 * samples a pixel stops once 1.96 sqrt(v/n) <= tolerance x mean, v the variance of the luminance of its
 * samples. A rule that stops too early after the first batch, or never, leaves every mean right.
 *
 * For images in which all samples have one colour (one lamp, direct light), so that the channels of a
 * pixel are proportional and each of them has the relative interval of luminance. Then, from n, mean and
 * M2 of a pixel alone and without any chance of error but for rounding, which is allowed 0.1 %:
 *
 *   too early   n < most, and the interval at n is above the tolerance, or n is no multiple of the batch
 *   too late    n > batch, and the rule must have held one batch before: with a = n - batch samples
 *               M2_a <= M2_n, and the mean was at least mean_n - sqrt(M2_n batch/(n a)) */
#ifndef ASSAY_ADAPTIVE_STOP_H
#define ASSAY_ADAPTIVE_STOP_H

#include "renderer/image/moments.h"

struct adaptive_stop {
    int too_early, too_late; /* pixels */
};

/* Checks a render with at most `most` samples a pixel. A black pixel may stop after any batch, or never;
 * n > most counts as too late. */
struct adaptive_stop adaptive_stop_check(const struct moments *m, int batch, double tolerance,
                                         int most);

#endif
