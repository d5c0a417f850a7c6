/* Closed form of a thin lens in front of glowing half planes.
 *
 * kind         "values" in the .json (all keys needed, no others; triples are R, G, B)
 * lens_steps   background [W sr^-1 m^-2], panels (1 to 8 of {radiance, distance, normal [x, y],
 *              offset}), footprint {x: [left, right], y: [top, bottom]}
 *
 * The camera is at the origin and looks along -Z, image up being +Y. A panel covers the half plane
 * z = -distance, normal . (x, y) > offset; `normal` is of unit length. Behind all panels is the
 * background. All surfaces emit and reflect nothing, so every depth gives the same image.
 * footprint is what the image shows at distance 1. The lens is that of the scene: lens_radius and
 * focal_distance. Panels may not cover each other in any pixel, not even partly, and no edge may be
 * in focus or parallel to the pixels' rows or columns. */
#ifndef ASSAY_TRUTH_LENS_H
#define ASSAY_TRUTH_LENS_H

#include "truth.h"

extern const struct truth_kind truth_lens[]; /* ends with a NULL name */

/* Share of a disc of radius 1 that lies beyond the line at the signed distance k from its centre:
 * 1 for k <= -1, 0 for k >= 1. */
double truth_disc_share(double k);

/* The mean of truth_disc_share(k) over k = k0 + a u + b v, (u, v) in the unit square; a and b are
 * not 0. Exact: derived in scenes/17_lens_step.md. */
double truth_disc_share_mean(double k0, double a, double b);

#endif
