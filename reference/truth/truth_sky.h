/* Closed forms of light from the sky on Lambertian surfaces.
 *
 * kind          "values" in the .json (all keys needed, no others; triples are R, G, B)
 * sky_and_wall  view (truth_pixel_mean.h), sky [radiance from everywhere], albedo, floor_edge [x],
 *               wall {x, z: [lo, hi], height}
 * sky_gradient  view, centre, radius, albedo, mean, gradient {x, y, z}
 *
 * sky_and_wall: the floor is y = 0 for all x below floor_edge, beyond is the sky. A black wall stands on
 * the floor in the plane wall.x, left of all that is seen. Depth 1 or more.
 * sky_gradient: from the direction w comes the radiance mean + x w_x + y w_y + z w_z, per channel; a
 * sphere that fills the image reflects it. Depth 1 or more. */
#ifndef ASSAY_TRUTH_SKY_H
#define ASSAY_TRUTH_SKY_H

#include "truth.h"

extern const struct truth_kind truth_sky[]; /* ends with a NULL name */

/* The share of the cosine-weighted hemisphere over a floor point that an upright rectangle fills: the
 * floor point is at (distance, 0, 0) in front of it, the rectangle is x = 0, 0 <= y <= height,
 * z[0] <= z <= z[1]. Derived in scenes/34_sky_constant.md. */
double truth_wall_share(double distance, const double z[2], double height);

/* Radiance of one channel: mean + gradient . w. */
struct truth_gradient {
    double mean[3], gradient[3][3]; /* gradient[axis][channel] */
};

/* What a Lambertian surface with the unit normal n and albedo 1 reflects under that sky if nothing
 * stands in the way: mean + 2/3 gradient . n. Derived in scenes/35_sky_gradient.md. */
double truth_gradient_reflected(const struct truth_gradient *g, int channel, const double n[3]);

/* Value of texel (col, row) of a latitude-longitude map of width x height texels (conventions of
 * renderer/scene/environment.h) that stands for that sky: bilinear interpolation between texel centres
 * attenuates a sinusoid by a known factor, by which the texels are amplified. */
double truth_gradient_texel(const struct truth_gradient *g, int channel, int width, int height,
                            int col, int row);

/* Reads "mean" and "gradient" of a sky_gradient; skips its other keys and fails on any others. */
NODISCARD bool truth_gradient_read(const json_t *values, struct truth_gradient *g, struct err *e);

#endif
