/* Bounds of the third cumulants of sides whose files have a mean and a variance only, from the files themselves.
 *
 * Skewness harms a test by k3A - k3B, and a third cumulant is the covariance of a pixel's mean with its estimated
 * variance v. So second differences r of A - B and of vA + vB, by the kernel (1 -2 1) x (1 -2 1)/6 which is blind to what
 * varies smoothly, have a product whose mean is k3A - k3B; sums of it over 17 x 17 pixels come with their own
 * standard error. By Cauchy and Schwarz it is besides at most sqrt(V Var V), V = vA + vB, and as the sides are
 * independent, (vA - vB)^2 is Var V in the mean, more where the laws differ. The number of samples counts in both: v of n
 * samples varies like 1/sqrt n of itself. In units of V^1.5 the bound of a pixel is
 *     min((|sum r r'| + 2 SE) / sum V^1.5, sqrt(R)), SE^2 = 4 sum (r r')^2, R = max(sum (vA - vB)^2 / sum V^2, own),
 * own being the same of this pixel, which an outlier makes 1; never more, as a sample's third moment is at most its
 * second to the power of 3/2. Where fewer than 16 pixels of a window have any variance, sums are those of the image; where
 * that has fewer, the bound is 1. */
#ifndef ASSAY_THIRD_MOMENT_H
#define ASSAY_THIRD_MOMENT_H

#include "renderer/image/moments.h"

/* Sets M3 of the sides that lack it (at least one) from n >= 3, mean and M2 of both, so that k3A - k3B is the bound, and
 * that k3A^2/vA + k3B^2/vB, by which compare.c tells degrees of freedom, is R V^2 if both lack it. An exact side has no
 * variance, and keeps M3 = 0. Fails only out of memory. */
NODISCARD bool third_moment_bound(struct moments *a, struct moments *b, bool lacks_a, bool lacks_b,
                                  struct err *e);

#endif
