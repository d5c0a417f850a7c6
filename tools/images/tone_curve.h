/* Inverse tone curves of 8-bit and 16-bit images: from a code to linear radiance. */
#ifndef ASSAY_TONE_CURVE_H
#define ASSAY_TONE_CURVE_H

#include "renderer/base/err.h"

struct curve {
    enum { CURVE_LINEAR, CURVE_SRGB, CURVE_GAMMA, CURVE_CGL } kind;
    double gamma; /* of CURVE_GAMMA: code = radiance^(1/gamma) */
};

/* "linear", "srgb" (IEC 61966-2-1), "gamma=2.2" (in [0.2, 5]) or "cgl" (the assignment's: (sqrt(2)
 * L)^(1/2.2), cut off to the step below). The others are taken to be rounded to the nearest step. */
NODISCARD bool tone_curve_parse(const char *text, struct curve *out, struct err *e);

/* The radiance of a code in [0, 1]; strictly increasing. */
double tone_curve_decode(const struct curve *c, double code);

/* The interval [*lo, *hi] of radiance that code k of 0 .. steps stands for, if the image is not dithered. */
void tone_curve_bin(const struct curve *c, int k, int steps, double *lo, double *hi);

#endif
