/* Closed forms of direct light on Lambertian surfaces: one light, nothing in its way, surfaces that
 * do not see each other.
 *
 * kind                   "values" in the .json (all keys needed, no others; triples are R, G, B)
 * point_over_plane       intensity [W sr^-1], albedo, light [x, height, z], footprint
 * spot_over_plane        intensity [W sr^-1, on the axis], albedo, light, axis [x, y, z: where it
 *                        shines; any length], exponent, cutoff [degrees from the axis], footprint
 * rectangle_over_plane   radiance [W sr^-1 m^-2], albedo, height, emitter {x: [lo, hi],
 *                        z: [lo, hi]}, footprint
 * sphere_over_plane      radiance [W sr^-1 m^-2], albedo, centre [x, height, z], radius, footprint
 * sun_on_pyramid         irradiance [W m^-2, on a surface that faces the sun], albedo,
 *                        to_light [x, y, z: any length],
 *                        drop [left top, right top, right bottom, left bottom]
 *
 * The plane is y = 0. footprint {x: [left, right], z: [top, bottom]} is the part of it that the
 * whole picture covers: column 0 begins at x = left, row 0 (the top row) at z = top. The box-filtered
 * value of a pixel is the Gauss-Legendre quadrature (GSL) of the closed form over it.
 *
 * The pyramid is seen from above along an axis -Y through its apex, picture up being -Z. Its four
 * edges go down from the apex along (-1, -drop[0], -1), (1, -drop[1], -1), (1, -drop[2], 1) and
 * (-1, -drop[3], 1), so that the diagonals of the (square) picture are their images. */
#ifndef ASSAY_TRUTH_LIGHTS_H
#define ASSAY_TRUTH_LIGHTS_H

#include "truth.h"

extern const struct truth_kind truth_lights[]; /* ends with a NULL name */

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

/* Cosines between the light and the normals of the pyramid's facets: top, right, bottom, left. The
 * drops are as above. Negative where a facet faces away. */
void truth_pyramid_cosines(const double drop[4], const double to_light[3], double cosine[4]);

#endif
