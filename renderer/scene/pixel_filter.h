/* Pixel reconstruction filters: the image's value is the integral of radiance times f(x) f(y),
 * x and y in pixels from the centre. */
#ifndef ASSAY_PIXEL_FILTER_H
#define ASSAY_PIXEL_FILTER_H

#include "renderer/base/err.h"

enum {
    PIXEL_FILTER_TEXT = 64,
    /* The table: shares of one side, 2^-25 to 1/2, binned by exponent and PIXEL_FILTER_BITS of
     * mantissa. */
    PIXEL_FILTER_CUBIC = 4,
    PIXEL_FILTER_BITS = 4,
    PIXEL_FILTER_BINS = 24 << PIXEL_FILTER_BITS,
    PIXEL_FILTER_FIRST = (127 - 25) << PIXEL_FILTER_BITS /* the same bits of 2^-25 */
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
    /* How far from the centre the shares of a bin lie, as cubics of the way through it (pixel_filter_simd.h); 1/2 is a
     * bin, and rows are fetched in pairs. */
    float cubic[PIXEL_FILTER_BINS + 2][PIXEL_FILTER_CUBIC];
};

extern const char *const pixel_filter_names[]; /* by enum pixel_filter_kind; end with NULL */

/* Radius from 0.5, as less would leave light between the pixels out, to 16; sigma, of Gauss alone,
 * from 0.05 to 8. Fails on any other. */
NODISCARD bool pixel_filter_make(struct pixel_filter *f, enum pixel_filter_kind kind, double radius,
                                 double sigma, struct err *e);
/* "box:1", "tent:1", "gauss:SIGMA:RADIUS"; without a radius box:0.5, tent:1, six sigmas of Gauss. */
NODISCARD bool pixel_filter_parse(const char *text, struct pixel_filter *f, struct err *e);
/* The same text again. */
void pixel_filter_print(const struct pixel_filter *f, char text[PIXEL_FILTER_TEXT]);

/* Is it a Gauss that ends at so many sigmas, to a rounding? */
bool pixel_filter_is_gauss(const struct pixel_filter *f, double sigmas);

/* f(x), per pixel. */
double pixel_filter_value(const struct pixel_filter *f, double x);
/* Where pixels share samples (each counts in all filters that reach it): variance (order 2) or third
 * cumulant (3) of the sum over a large square of pixels, relative to the sum of the pixels' own, for
 * noise of constant size. With s(x) the sum of all pixels' filters it is
 * (integral of f s^(order-1) / integral of f^order)^2: 2.25 and 4 for a tent of radius 1. */
double pixel_filter_sharing(const struct pixel_filter *f, int order);

#endif
