/* Closed forms as images. Each is evaluated from the numbers in the scene's .json, which are
 * derived and explained in its .md; nothing of the renderer's camera, loader or light code is used,
 * so that a mistake there cannot hide. Where radiance varies over a pixel, the box-filtered value
 * is the Gauss-Legendre quadrature (GSL) of the closed form over the pixel.
 *
 * kind                   "values" in the .json (all keys needed, no others; triples are R, G, B)
 * furnace                emission [W sr^-1 m^-2], albedo
 * point_over_plane       intensity [W sr^-1], albedo, light [x, height, z], footprint
 * rectangle_over_plane   radiance [W sr^-1 m^-2], albedo, height, emitter {x: [lo, hi],
 *                        z: [lo, hi]}, footprint
 *
 * The plane is y = 0 and reflects by Lambert's law. footprint {x: [left, right], z: [top, bottom]}
 * is the part of it that the whole picture covers: column 0 begins at x = left, row 0 (the top row)
 * at z = top. */
#ifndef ASSAY_TRUTH_H
#define ASSAY_TRUTH_H

#include "../renderer/moments.h"
#include "suite.h"

/* Fills *out (unit "exact", spp 0) for that reference of that scene. Fails on an unknown kind, on
 * missing, unknown or impossible values, on a depth at which the form does not hold, and where the
 * quadrature has not converged to 1e-10 of the pixel's value. The caller frees. */
bool truth_render(const struct suite_scene *scene, const struct suite_reference *ref,
                  struct moments *out, struct err *e) __attribute__((warn_unused_result));

/* Radiance inside a closed room whose walls all emit `emission` and reflect `albedo` by Lambert's
 * law, counting paths of 0 .. depth bounces: emission * sum_{k=0}^{depth} albedo^k. */
double truth_furnace(double emission, double albedo, int depth);

/* Irradiance [W m^-2] at the point (x, 0, z), normal +Y, from an isotropic point light of radiant
 * intensity 1 W/sr at `light`, light[1] > 0: inverse square and cosine law. */
double truth_point_irradiance(const double light[3], double x, double z);

/* Irradiance [W m^-2] at the point (x, 0, z), normal +Y, from the rectangle ex[0]..ex[1] by
 * ez[0]..ez[1] at height > 0 that emits radiance 1 downwards: four corner terms, derived in
 * scenes/13_square_patch.md. They cancel far away: the rounding error is about 1e-15, absolute. */
double truth_rectangle_irradiance(double height, const double ex[2], const double ez[2], double x,
                                  double z);

/* A closed form by name. fill() sets all of out->mean, out->width x out->height pixels, from
 * `values`; of the scene it may use depth, lens_radius and focal_distance. */
struct truth_kind {
    const char *name;
    bool (*fill)(const struct suite_scene *scene, json_t *values, struct moments *out,
                 struct err *e);
};

/* Fails, naming the channel, unless all three lie in [0, hi]; `hi` may be HUGE_VAL. */
bool truth_check_triple(const char *name, const double v[3], double hi, struct err *e)
    __attribute__((warn_unused_result));

#endif
