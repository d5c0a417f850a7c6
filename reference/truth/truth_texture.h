/* Pictures that face the camera, each with a texture.
 *
 * kind       "values" in the .json (all keys needed, no others)
 * pictures   width (texels of a row), rows [by rows from the top: R, G, B of each texel, bytes of sRGB], boards: list of
 *            place [left, top, right, bottom: shares of the image], uv [u, v at the left top; u, v at the right bottom],
 *            wrap [of u, of v: WRAP, MIRROR, CLAMP or BORDER], nearest [true or false], factor [R, G, B]
 *
 * A plane parallel to the image's maps to it without distortion, so a pixel is the mean of the endless texture over a rectangle: for
 * each texel the integral of its box or hat function along u times the one along v. The radiance is `factor` times that. Boards do
 * not overlap. */
#ifndef ASSAY_TRUTH_TEXTURE_H
#define ASSAY_TRUTH_TEXTURE_H

#include "truth.h"

extern const struct truth_kind truth_texture[]; /* ends with a NULL name */

/* Integral from minus infinity to t of a texel's share at distance t from its centre, in texels: a box of width 1 (nearest), or a hat of
 * width 2. */
double truth_texel_share(double t, bool nearest);

#endif
