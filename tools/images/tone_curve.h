/* Inverse tone curves of 8-bit and 16-bit images: from a code to linear radiance. */
#ifndef ASSAY_TONE_CURVE_H
#define ASSAY_TONE_CURVE_H

#include "renderer/base/err.h"

struct curve {
    enum { CURVE_LINEAR, CURVE_SRGB, CURVE_GAMMA, CURVE_EXPOSURE, CURVE_CGL } kind;
    double gamma;    /* of CURVE_GAMMA: code = radiance^(1/gamma) */
    double exposure; /* of CURVE_EXPOSURE */
};

/* "srgb, linear, gamma=G, exposure=E, cgl": for messages. */
#define TONE_CURVES "srgb, linear, gamma=G, exposure=E, cgl"

/* "linear", "srgb" (IEC 61966-2-1), "gamma=2.2" (in [0.2, 5]), "exposure=1" (in [0.001, 1000]: sRGB of 1 - exp(-E L), as
 * Scotty3D writes its images) or "cgl" (the assignment's: (sqrt(2) L)^(1/2.2), cut off to the step below). The others are
 * taken to be rounded to the nearest step. */
NODISCARD bool tone_curve_parse(const char *text, struct curve *out, struct err *e);

/* The radiance of a code in [0, 1]; strictly increasing. Code 1 of CURVE_EXPOSURE is INFINITY. */
double tone_curve_decode(const struct curve *c, double code);

/* The interval [*lo, *hi] of radiance that code k of 0 .. steps stands for, if the image is not dithered. *hi may be
 * INFINITY. */
void tone_curve_bin(const struct curve *c, int k, int steps, double *lo, double *hi);

#endif
