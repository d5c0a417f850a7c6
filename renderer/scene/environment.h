/* Environment light, from infinitely far away: a constant, or an image in latitude and longitude.
 * The image lies as in the assignment: theta = acos(y) from the top row to the bottom row, phi =
 * atan2(-z, x) + pi from the left column to the right one; so -X is the left and right edge, +Z a
 * quarter from the left, +X the middle, -Z a quarter from the right.
 *
 * Radiance is interpolated between the centres of texels, around the circle of longitude and
 * constant beyond the centres of the first and last row, so that a coarse map shows no squares to a
 * camera or in a mirror. A direction is sampled for a surface in three steps: one of up to 16 x 32
 * regions, in proportion to its luminance times solid angle times about its cosine with the rounded
 * surface normal; a cell between four texel centres in it, in proportion to the mean luminance of
 * its corners times its solid angle; a direction within the cell, uniform in solid angle. The
 * density (per steradian) is exact, and positive wherever light reaches that side. A constant
 * environment is sampled in proportion to the cosine. */
#ifndef ASSAY_ENVIRONMENT_H
#define ASSAY_ENVIRONMENT_H

#include "renderer/base/err.h"
#include "renderer/image/image.h"
#include "renderer/math/vec.h"

struct environment; /* opaque; const once made */

enum environment_kind { ENVIRONMENT_CONSTANT, ENVIRONMENT_UPPER_HALF, ENVIRONMENT_IMAGE };

/* The contents of an environment, for exporters. */
struct environment_parts {
    enum environment_kind kind;
    rgb radiance; /* constant, upper half */
    uint32_t width, height;
    const rgb *texel; /* image: width x height by rows from the top; the environment's own */
};

/* The same radiance from all directions. This and the next three return NULL on failure; the caller
 * frees with environment_free(). */
NODISCARD struct environment *environment_constant(rgb radiance, struct err *e);
/* The assignment's ambient light: constant from the half space y > 0, nothing from below, and
 * hidden. */
NODISCARD struct environment *environment_upper_half(rgb radiance, struct err *e);
/* From channels R, G and B of an image. `where` starts the error line. Fails if one is missing, on a
 * texel that is negative or not finite (which the line names), and if all texels are black. */
NODISCARD struct environment *environment_from_image(const struct image *im, const char *where,
                                                     struct err *e);
/* The same from an .exr or .hdr file, whose values are radiance. Other formats are refused, since
 * their values are not linear. */
NODISCARD struct environment *environment_read(const char *path, struct err *e);
void environment_free(struct environment *env);

/* Radiance that arrives from direction w (unit). */
rgb environment_radiance(const struct environment *env, vec3 w);

/* Lights rough surfaces only: neither the camera nor a mirror sees it. */
bool environment_is_hidden(const struct environment *env);
struct environment_parts environment_parts(const struct environment *env);
/* Luminance integrated over all directions, W m^-2; of an image by the mean of each cell's corners. */
double environment_total(const struct environment *env);

#endif
