/* Closed forms of direct light on a Lambertian plane, without occluders.
 *
 * kind                   "values" in the .json (all keys needed, no others; triples are R, G, B)
 * point_over_plane       intensity [W sr^-1], albedo, light [x, height, z], footprint
 * spot_over_plane        intensity [W sr^-1, on the axis], albedo, light, axis [x, y, z: where it
 *                        shines; any length], exponent, cutoff [degrees from the axis], footprint
 * rectangle_over_plane   radiance [W sr^-1 m^-2], albedo, height, emitter {x: [lo, hi],
 *                        z: [lo, hi]}, footprint
 * sphere_over_plane      radiance [W sr^-1 m^-2], albedo, centre [x, height, z], radius, footprint
 * lamps_over_plane       albedo, footprint, lamps: 1 to 8 of {radiance, height, x: [lo, hi], z: [lo, hi]}, a
 *                        rectangle that emits downwards, or {intensity, light}, a point
 *
 * The plane is y = 0. footprint {x: [left, right], z: [top, bottom]} is the part of it that the
 * whole image covers: column 0 begins at x = left, row 0 (the top row) at z = top. The box-filtered
 * value of a pixel is the Gauss-Legendre quadrature (GSL) of the closed form over it. */
#ifndef ASSAY_TRUTH_LAMPS_H
#define ASSAY_TRUTH_LAMPS_H

#include "truth.h"

extern const struct truth_kind truth_lamps[]; /* ends with a NULL name */

/* Irradiance [W m^-2] at the point (x, 0, z), normal +Y, from an isotropic point light of radiant
 * intensity 1 W/sr at `light`, light[1] > 0: inverse square and cosine law. */
double truth_point_irradiance(const double light[3], double x, double z);

/* Irradiance [W m^-2] at the point (x, 0, z), normal +Y, from the rectangle ex[0]..ex[1] by
 * ez[0]..ez[1] at height > 0 that emits radiance 1 downwards: four corner terms, derived in
 * scenes/13_square_patch.md. They cancel far away: the rounding error is about 1e-15, absolute. */
double truth_rectangle_irradiance(double height, const double ex[2], const double ez[2], double x,
                                  double z);

/* Irradiance [W m^-2] at the point (x, 0, z), normal +Y, from a sphere of radiance 1 that lies
 * above the plane, centre[1] > radius: derived in scenes/33_sphere_light.md. */
double truth_sphere_irradiance(const double centre[3], double radius, double x, double z);

#endif
