/* Closed form of a directional light on a Lambertian pyramid.
 *
 * kind             "values" in the .json (all keys needed, no others; triples are R, G, B)
 * sun_on_pyramid   irradiance [W m^-2, on a surface that faces the sun], albedo, to_light [x, y, z:
 *                  any length], apex [x, y, z], ridges [a point on each: right, bottom, left, top],
 *                  centre [share of width, share of height]
 *
 * The pyramid is seen from above. In the render its ridges are the lines from `centre`, the image of
 * the apex, straight to the right, down, to the left and up; it is convex and fills the image. Only
 * the geometry of the .dae makes it so: nothing here can check it. */
#ifndef ASSAY_TRUTH_SUN_H
#define ASSAY_TRUTH_SUN_H

#include "truth.h"

extern const struct truth_kind truth_sun[]; /* ends with a NULL name */

/* A pyramid of four facets: facet k lies between the ridges k and k+1 (mod 4), which go from the apex
 * to the points ridge[k]; seen from above they follow each other clockwise. */
struct truth_pyramid {
    double apex[3], ridge[4][3], to_light[3];
};

/* Cosine between the light and the upper normal of each facet; negative where it faces away. */
void truth_pyramid_cosines(const struct truth_pyramid *p, double cosine[4]);

#endif
