/* FLIP: how much the eye sees when two images are swapped in place, 0 to 1 a pixel. LDR-FLIP after [Andersson20], HDR-FLIP
 * after [Andersson21] with the ACES tone curve. It knows nothing of noise and judges nothing: it stands beside the
 * statistics.
 *
 * Images are linear RGB of BT.709, 3 doubles a pixel, row 0 at the top; maps one float a pixel. Beyond its
 * border an image goes on as its last pixel. */
#ifndef ASSAY_FLIP_H
#define ASSAY_FLIP_H

#include "renderer/base/err.h"

#include <stddef.h>

/* Pixels in a degree of sight. The papers': 0.7 m from a screen that is 0.7 m and 3840 pixels wide. */
#define FLIP_PPD (0.7 * (3840 / 0.7) * (3.14159265358979323846 / 180))

/* LDR-FLIP of `test` against `reference`, values in [0, 1] (clamped), into map. Symmetric. Fails only out of
 * memory. */
NODISCARD bool flip_ldr(const double *reference, const double *test, int width, int height,
                        double ppd, float *map, struct err *e);

/* Stops at which HDR-FLIP looks: num of them, evenly from start to stop. */
struct flip_exposures {
    double start, stop;
    int num;
};

/* From the brightest pixel's luminance and the median one at 0.85 after the tone curve [Andersson21, 4.1]; a stop
 * apart or a little less, at least 2. False if the reference is black. Beyond the paper, which has no median there:
 * where more than half of the pixels are black, the median of the others. */
NODISCARD bool flip_exposures(const double *reference, size_t pixels, struct flip_exposures *out,
                              struct err *e);

/* HDR-FLIP: the largest LDR-FLIP of each pixel over those exposures. Negative radiance counts as 0. Not symmetric,
 * as the exposures are those of the reference. */
NODISCARD bool flip_hdr(const double *reference, const double *test, int width, int height,
                        double ppd, const struct flip_exposures *exposures, float *map,
                        struct err *e);

double flip_mean(const float *map, size_t pixels);

/* The parts, for those who check them. */

/* The ACES curve in Narkowicz' fit, less its exposure of 0.6; clamped to [0, 1]. */
double flip_tone(double radiance);

enum flip_channel { FLIP_ACHROMATIC, FLIP_RED_GREEN, FLIP_BLUE_YELLOW };
/* The channel's contrast sensitivity as a filter: weight of the pixel (x, y) from the middle, |x|, |y| <=
 * flip_csf_radius(ppd); they sum to 1. */
double flip_csf(enum flip_channel channel, double ppd, int x, int y);
int flip_csf_radius(double ppd);

#endif
