/* FLIP: the difference that one sees when flipping between two images, 0 to 1 per pixel. LDR-FLIP after [Andersson20],
 * HDR-FLIP after [Andersson21] with the ACES tone curve. It ignores noise and decides nothing: it is shown beside the
 * statistics.
 *
 * Images are linear BT.709 RGB, 3 doubles per pixel, row 0 at the top; maps have one float per pixel. Beyond the
 * border the edge pixels are repeated. */
#ifndef ASSAY_FLIP_H
#define ASSAY_FLIP_H

#include "renderer/base/err.h"

#include <stddef.h>

/* Pixels per degree of visual angle, as in the papers: 0.7 m from a screen that is 0.7 m and 3840 pixels wide. */
#define FLIP_PPD (0.7 * (3840 / 0.7) * (3.14159265358979323846 / 180))

/* LDR-FLIP of `test` against `reference`, values in [0, 1] (clamped), into map. Symmetric. Fails only out of
 * memory. */
NODISCARD bool flip_ldr(const double *reference, const double *test, int width, int height,
                        double ppd, float *map, struct err *e);

/* Exposures of HDR-FLIP, in stops: num of them, evenly spaced from start to stop. */
struct flip_exposures {
    double start, stop;
    int num;
};

/* From the exposure at which the brightest pixel's luminance has the tone value 0.85 to that at which the median has
 * it [Andersson21, 4.1], a stop or somewhat more apart, at least 2. Fails if the reference is black. Not in the
 * paper: if half of the pixels or more are black, the median of the others is used. */
NODISCARD bool flip_exposures(const double *reference, size_t pixels, struct flip_exposures *out,
                              struct err *e);

/* HDR-FLIP: the largest LDR-FLIP of each pixel over those exposures. Negative radiance counts as 0. Not symmetric,
 * as the exposures are those of the reference. */
NODISCARD bool flip_hdr(const double *reference, const double *test, int width, int height,
                        double ppd, const struct flip_exposures *exposures, float *map,
                        struct err *e);

double flip_mean(const float *map, size_t pixels);

/* Parts of it, for tests. */

/* The ACES curve in Narkowicz' fit, including its exposure factor of 0.6; clamped to [0, 1]. */
double flip_tone(double radiance);

enum flip_channel { FLIP_ACHROMATIC, FLIP_RED_GREEN, FLIP_BLUE_YELLOW };
/* The channel's contrast sensitivity as a filter: the weight at the offset (x, y) from the centre, |x|, |y| <=
 * flip_csf_radius(ppd); the weights sum to 1. */
double flip_csf(enum flip_channel channel, double ppd, int x, int y);
int flip_csf_radius(double ppd);

#endif
