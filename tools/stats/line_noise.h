/* Noise that the pixels of a row or a column share, as where a time, a wavelength or a seed is drawn once for a line:
 * sums of neighbouring lines then differ by more than their pixels' noise says. Second differences of these sums see
 * no smooth difference of two images, and their median none that is in a few lines only, as an edge. */
#ifndef ASSAY_LINE_NOISE_H
#define ASSAY_LINE_NOISE_H

#include <stdbool.h>
#include <stddef.h>

/* Writes the squared second differences of the n sums over their variances if pixels are independent, which it is given
 * too; at most n - 2 into `square`, none where a variance is not positive. Returns their number. */
size_t line_noise_squares(const double *sum, const double *variance, size_t n, double *square);

/* The variance of sums over what was expected of it, from the median of num > 0 squares, which are sorted. Times *dof it is
 * about a chi-square with these degrees of freedom if the noise is normal: 2 over the relative variance of the median. */
double line_noise_ratio(double *square, size_t num, double *dof);

/* Lines of which each begins the same stream of random numbers (a generator seeded for each row, with one seed) share
 * noise where they begin, and ever less further on: sums of whole lines show that late. Looks at blocks of 8 x 4 values of
 * `num` images of width x height, one after the other, and at strips 4 wide along the borders: there, do the values of one
 * column, less the mean of 8 beside them in their row, agree from row to row? Turning the signs of a whole row makes the
 * sum over a block of the products of rows, over the root of the sum of their squares, a variable of mean 0 and variance 1
 * whatever the law; 4 standard deviations of the sum over all blocks, or 3.5 of that over a strip, are asked for. A
 * difference of the images cancels but for its edges, and blocks in which hardly any value has the other sign are left
 * out, as there is no noise; where rows and columns both agree it is taken for a difference, or for a filter. */
bool line_noise_begins_alike(const double *v, int num, int width, int height);

#endif
