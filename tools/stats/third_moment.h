/* Bounds of the third cumulants of sides whose files have a mean and a variance only, from the files themselves.
 *
 * Skewness affects a test through k3A - k3B, and a third cumulant is the covariance of a pixel's mean with its
 * estimated variance v. So the product of the second differences r of A - B and r' of V = vA + vB, by the kernel
 * (1 -2 1) x (1 -2 1)/6, which does not see what varies smoothly, has the mean k3A - k3B; its sum over 17 x 17 pixels
 * has a standard error of its own. Besides, |k3A - k3B| <= sqrt(V Var V) by the Cauchy-Schwarz inequality, and as the
 * sides are independent, the mean of (vA - vB)^2 is Var V, more if the distributions differ. Both reflect the number
 * of samples: v of n samples has a relative error of about 1/sqrt n. In units of V^1.5 the bound of a pixel is
 *     min((|sum r r'| + SE) / sum V^1.5, sqrt(R)), SE^2 = 4 sum (r r')^2, R = max(sum (vA - vB)^2 / sum V^2, own),
 * but at least sqrt(6/pixels)/n, the standard error of third moments of normal noise. own is the ratio of this pixel
 * alone, near 1 for an outlier. R is at most 1, which is enough: sums of cubes are at most sums of squares to the power
 * of 3/2, so that k3 of a mean is hardly above v^1.5. If fewer than 16 pixels of a window have any variance, the sums
 * are those of the image; if the image has fewer, the bound is 1. */
#ifndef ASSAY_THIRD_MOMENT_H
#define ASSAY_THIRD_MOMENT_H

#include "renderer/image/moments.h"

/* Sets M3 of the sides that lack it (at least one) from n >= 3, mean and M2 of both, so that k3A - k3B is the bound, and
 * k3A^2/vA + k3B^2/vB, from which comparisons get their degrees of freedom, is R V^2 if both lack it. An exact side has
 * no variance and keeps M3 = 0. Fails only out of memory. */
NODISCARD bool third_moment_bound(struct moments *a, struct moments *b, bool lacks_a, bool lacks_b,
                                  struct err *e);

#endif
