/* How the report turns numbers into colours: how radiance is exposed (the curve is that of
 * renderer/image/tone.h) and two maps, for signed quantities and for others. */
#ifndef ASSAY_PLOT_COLOUR_H
#define ASSAY_PLOT_COLOUR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The radiance that is shown as white: the 99th percentile of the n luminances is shown at 0.8 of
 * white. Where a lamp fills so much of the image that this would leave all else black (it is over
 * 6 times the median of the positive luminances), 6 times that median takes its place and *capped is
 * true. 1 if no luminance is positive. Sorts `luminances`. */
double plot_display_white(double *luminances, size_t n, bool *capped);

/* Blue - white - red for t in [-1, 1] (clamped); grey where t is not a number. Piecewise linear in
 * CIE L*a*b* (D65) with the same L* and the same speed (2.9 units for 1/32) on both sides, so that
 * equal steps look equal, and blue against red so that the colour blind can tell the signs apart.
 */
void plot_diverging_rgb8(double t, uint8_t rgb[3]);

/* Dark violet - green - yellow for t in [0, 1] (clamped); grey where t is not a number. L* rises all the
 * way, so that it can be read without colours, and equal steps are equally far apart in L*a*b*. */
void plot_sequential_rgb8(double t, uint8_t rgb[3]);

#endif
