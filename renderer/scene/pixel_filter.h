/* Pixel reconstruction filters: the image's value is the integral of radiance times f(x) f(y),
 * x and y in pixels from the centre. */
#ifndef ASSAY_PIXEL_FILTER_H
#define ASSAY_PIXEL_FILTER_H

#include "renderer/base/err.h"

enum {
    PIXEL_FILTER_TEXT = 64,
    /* Table of the quantile function: shares of one tail, 2^-25 to 1/2, binned by exponent and
     * PIXEL_FILTER_BITS of mantissa. */
    PIXEL_FILTER_CUBIC = 4,
    PIXEL_FILTER_BITS = 4,
    PIXEL_FILTER_BINS = 24 << PIXEL_FILTER_BITS,
    PIXEL_FILTER_FIRST = (127 - 25) << PIXEL_FILTER_BITS /* these bits of 2^-25 */
};
#define PIXEL_FILTER_LEAST 0x1p-25f

enum pixel_filter_kind { PIXEL_FILTER_BOX, PIXEL_FILTER_TENT, PIXEL_FILTER_GAUSS };

/* f is 0 beyond the radius, and else proportional to 1 (box), 1 - |x|/radius (tent), exp(-x^2/(2
 * sigma^2)) less its value at the radius (Gauss, as pbrt and Mitsuba have it). All zero is the box
 * of one pixel. */
struct pixel_filter {
    enum pixel_filter_kind kind;
    double radius, sigma; /* pixels; radius 0: the box of one pixel */
    double top;           /* f's factor, so that its integral is 1 */
    /* Distances from the centre for the shares of each bin, as cubics in the position within the bin
     * (pixel_filter_simd.h). Two rows more: of zeros, for 1/2, and since gather_columns() reads a second row. */
    float cubic[PIXEL_FILTER_BINS + 2][PIXEL_FILTER_CUBIC];
};

extern const char *const pixel_filter_names[]; /* by enum pixel_filter_kind; end with NULL */

/* radius: 0.5 (less would leave out light between the pixels) to 16; sigma, for Gauss only: 0.05 to
 * 8. Fails outside these ranges. */
NODISCARD bool pixel_filter_make(struct pixel_filter *f, enum pixel_filter_kind kind, double radius,
                                 double sigma, struct err *e);
/* "box:1", "tent:1", "gauss:SIGMA:RADIUS". Default radius: box 0.5, tent 1, Gauss six sigmas, at most 16. */
NODISCARD bool pixel_filter_parse(const char *text, struct pixel_filter *f, struct err *e);
/* Writes a text that pixel_filter_parse() reads as this filter. */
void pixel_filter_print(const struct pixel_filter *f, char text[PIXEL_FILTER_TEXT]);

/* True for a Gauss whose radius is that many sigmas, to 1e-6 pixels. */
bool pixel_filter_is_gauss(const struct pixel_filter *f, double sigmas);

/* f(x), per pixel. */
double pixel_filter_value(const struct pixel_filter *f, double x);
/* Where pixels share samples (each counts in all filters that reach it): variance (order 2) or third
 * cumulant (3) of the sum over a large square of pixels, relative to the sum of the pixels' own, for
 * noise of constant size. With s(x) the sum of all pixels' filters it is
 * (integral of f s^(order-1) / integral of f^order)^2: 2.25 and 4 for a tent of radius 1. */
double pixel_filter_sharing(const struct pixel_filter *f, int order);

#endif
