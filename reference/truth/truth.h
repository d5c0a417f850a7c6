/* Closed forms as images. Each is evaluated from the numbers in the scene's .json, which are
 * derived and explained in its .md; nothing of the renderer's camera, loader or light code is used,
 * so that a mistake there cannot hide.
 *
 * kind      "values" in the .json (all keys needed, no others; triples are R, G, B)
 * furnace   emission [W sr^-1 m^-2], albedo
 *
 * The other kinds are listed in truth_lamps.h, truth_sun.h, truth_lens.h,
 * truth_mirrors_and_glass.h, truth_ggx.h and truth_sky.h, those of truth_texture.c below. */
#ifndef ASSAY_TRUTH_H
#define ASSAY_TRUTH_H

#include "renderer/image/moments.h"
#include "reference/suite/suite.h"

/* Fails if the kind is unknown, or not known for the scene's pixel filter. */
NODISCARD bool truth_knows(const struct suite_scene *scene, const struct suite_reference *ref,
                           struct err *e);

/* Fills *out (unit "exact", spp 0) for that reference of that scene. Fails on an unknown kind, on
 * missing, unknown or impossible values, on a depth at which the form does not hold, on a filter for which
 * it is not known, and where a quadrature over a pixel has not converged (to 1e-10 of the pixel's value;
 * pixels with edges: truth_pixel_mean.h). The caller frees *out. */
NODISCARD bool truth_render(const struct suite_scene *scene, const struct suite_reference *ref,
                            struct moments *out, struct err *e);

/* Radiance inside a closed room whose walls all emit `emission` and reflect `albedo` by Lambert's
 * law, counting paths of 0 .. depth bounces: emission * sum_{k=0}^{depth} albedo^k. */
double truth_furnace(double emission, double albedo, int depth);

/* A closed form by name. fill() sets all of out->mean, out->width x out->height pixels, from
 * ref->values; of the scene it may use depth, lens_radius and focal_distance, and with by_any_filter the filter. */
struct truth_kind {
    const char *name;
    bool (*fill)(const struct suite_scene *scene, const struct suite_reference *ref,
                 struct moments *out, struct err *e);
    bool by_any_filter; /* holds for any pixel filter; else only for the box of one pixel */
};

/* Fails if the scene's depth is 0, as the form includes one bounce (direct light). */
NODISCARD bool truth_check_depth(const struct suite_scene *scene, struct err *e);

/* Pictures that face the camera, each with a texture (truth_texture.c).
 *
 * kind       "values" in the .json (all keys needed, no others)
 * pictures   width (texels of a row), rows [by rows from the top: R, G, B of each texel, bytes of sRGB], boards: list of
 *            place [left, top, right, bottom: shares of the image], uv [u, v at the left top; u, v at the right bottom],
 *            wrap [of u, of v: WRAP, MIRROR, CLAMP or BORDER], nearest [true or false], factor [R, G, B]
 *
 * A plane parallel to the image plane is imaged without distortion, so a pixel is the mean of the infinitely repeated
 * texture over a rectangle: for each texel the integral of its box or hat function along u times the one along v. The
 * radiance is `factor` times that. Boards do not overlap. */
extern const struct truth_kind truth_texture[]; /* ends with a NULL name */
/* Integral from minus infinity to t of a texel's reconstruction filter, distances in texels from its centre: a box of
 * width 1 (nearest) or a hat of width 2. */
double truth_texel_share(double t, bool nearest);

#endif
