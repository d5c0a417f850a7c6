/* The rule of OpenImageIO's idiff, with the thresholds of Blender's own render tests: quoted beside our verdicts,
 * never part of them. A is the tested image, B the reference; same sizes. Nothing here fails. */
#ifndef ASSAY_IDIFF_H
#define ASSAY_IDIFF_H

#include "renderer/image/moments.h"

#include <stdint.h>

/* Blender, tests/python/modules/render_report.py (read at commit 002f5b8): idiff -fail 0.016
 * -failpercent 1 on 8-bit images. A pixel fails if any of its channels differs by more than `fail`;
 * the image fails if more than `percent` of the pixels do [OpenImageIO idiff]. */
#define BLENDER_FAIL    0.016
#define BLENDER_PERCENT 1.0
/* The 8-bit sRGB image of the means, 3 bytes a pixel; radiance `white` is 255. */
void idiff_quantise(const struct moments *m, double white, uint8_t *rgb8);
/* Histogram over pixels of the largest channel difference, in units of 1/255. */
void idiff_histogram(const uint8_t *a, const uint8_t *b, size_t pixels, size_t count[256]);
bool idiff_differs(const size_t count[256], size_t pixels, double fail, double percent);
/* Percentage of the pixels that fail. */
double idiff_percent_score(const size_t count[256], size_t pixels, double fail);

#endif
