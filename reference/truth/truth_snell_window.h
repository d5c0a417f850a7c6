/* The surface of glass seen from inside: Snell's window.
 *
 * kind           "values" in the .json (all keys needed, no others; triples are R, G, B)
 * snell_window   view (truth_pixel_mean.h), ior, sky, floor [radiance]
 *
 * The plane y = 0 bounds glass of index `ior` below it. The eye is in the glass and looks up. Above, the
 * radiance `sky` comes from everywhere; what the surface reflects comes from a floor of radiance
 * `floor`. */
#ifndef ASSAY_TRUTH_SNELL_WINDOW_H
#define ASSAY_TRUTH_SNELL_WINDOW_H

#include "truth.h"

extern const struct truth_kind truth_snell_window[]; /* ends with a NULL name */

/* Shares of floor and sky in the radiance inside that is seen under the angle with that cosine from the
 * normal: F and n^2 (1 - F), F by Fresnel's equations from inside [Veach97 5.2]. */
void truth_window_shares(double cosine, double n, double *floor, double *sky);

#endif
