/* Renders what a pinhole camera sees: the mean of a closed form over each pixel's square, or weighted by a pixel
 * filter. No code is shared with the renderer's camera: the camera's frame is given as numbers in the .json. */
#ifndef ASSAY_TRUTH_PIXEL_MEAN_H
#define ASSAY_TRUTH_PIXEL_MEAN_H

#include "renderer/image/moments.h"
#include "reference/suite/suite.h"

#include <jansson.h>

/* right, up and forward are unit and orthogonal. The point (u, v) of the image, both -1 at the left
 * and the top edge of a square image and +1 at the right and the bottom, is seen in the direction
 * forward + tan_half (u right - v up). */
struct truth_view {
    double eye[3], right[3], up[3], forward[3], tan_half;
    const struct pixel_filter *filter; /* borrowed */
    double edge; /* largest |u| and |v| that contribute to any pixel: 1, with a filter more */
};

/* The "view" of the values, {"eye": [x,y,z], "right": [..], "up": [..], "forward": [..], "tan_half": t}: these keys, no others;
 * the frame orthonormal to 1e-12. The filter is the scene's. */
NODISCARD bool truth_view_read(const json_t *values, const struct suite_scene *scene,
                               struct truth_view *view, struct err *e);

/* Direction of (u, v), unit length. */
void truth_view_direction(const struct truth_view *view, double u, double v, double d[3]);

/* True if the ray from the point o in the unit direction d meets the sphere from outside; then cos_i,
 * the cosine of incidence, and the outward unit normal there. */
bool truth_sphere_hit(const double o[3], const double d[3], const double centre[3], double radius,
                      double *cos_i, double normal[3]);

/* The smallest cosine of incidence on a sphere that fills the image, filter margin included. Fails if it does not. */
NODISCARD bool truth_view_filled(const struct truth_view *view, const double centre[3],
                                 double radius, double *min_cos, struct err *e);

/* Radiance that arrives at the eye from the unit direction d. The returned number tells the smooth
 * pieces of the image apart: within one, light is a smooth function of d, up to a square root at its edge. */
typedef int truth_shade(const void *form, const double eye[3], const double d[3], double light[3]);

/* Means over the pixels of a square image. A pixel within one piece: Gauss-Legendre rules with 8 x 8 and
 * 16 x 16 points, which must agree to 1e-10 of the value. Any other: scan lines, cut where the piece changes
 * (found by bisection); each part, and the lines themselves, are bisected until Gauss-Legendre rules agree to
 * 1e-6 of the value. With a filter, each quarter around the pixel's centre is integrated by itself, as a filter
 * has a kink there. Fails if the rules do not agree, and on images that are not square. */
NODISCARD bool truth_view_render(const struct truth_view *view, truth_shade *shade,
                                 const void *form, struct moments *out, struct err *e);

#endif
