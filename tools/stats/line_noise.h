/* Noise that the pixels of a row or a column share, as where a time, a wavelength or a seed is drawn once for a line:
 * sums of neighbouring lines then differ by more than their pixels' noise says. Second differences of these sums see
 * no smooth difference of two images, and their median none that is in a few lines only, as an edge. */
#ifndef ASSAY_LINE_NOISE_H
#define ASSAY_LINE_NOISE_H

#include <stddef.h>

/* Writes the squared second differences of the n sums over their variances if pixels are independent, which it is given
 * too; at most n - 2 into `square`, none where a variance is not positive. Returns their number. */
size_t line_noise_squares(const double *sum, const double *variance, size_t n, double *square);

/* The variance of sums over what was expected of it, from the median of num > 0 squares, which are sorted. Times *dof it is
 * about a chi-square with these degrees of freedom if the noise is normal: 2 over the relative variance of the median. */
double line_noise_ratio(double *square, size_t num, double *dof);

#endif
