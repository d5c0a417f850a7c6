/* A rough metal under a uniform sky: the directional albedo by quadrature.
 *
 * kind         "values" in the .json (all keys needed, no others; triples are R, G, B)
 * ggx_sphere   view (truth_pixel_mean.h), centre, radius, sky [radiance from everywhere], alpha, eta, k
 * beckmann_sphere   the same
 *
 * A sphere that fills the image, with facets distributed by GGX or Beckmann, correlated Smith
 * shadowing and the reflectance of a conductor of index eta + i k; facets scatter once. */
#ifndef ASSAY_TRUTH_GGX_H
#define ASSAY_TRUTH_GGX_H

#include "truth.h"

extern const struct truth_kind truth_ggx[]; /* ends with a NULL name */

/* Unpolarised reflectance of a conductor against vacuum [Born99 14.2]; cos_i in (0,1]. */
double truth_fresnel_conductor(double cos_i, double eta, double k);

/* Share of light from the direction with cosine cos_o (above 0) that is reflected: the integral of
 * f(wo, wi) cos(theta_i) over the hemisphere of wi, by a Gauss-Legendre product rule of `points` x
 * `points` points in theta_i and azimuth. f = F D G2 / (4 cos_o cos_i) [Walter07 eq. 20]. */
double truth_ggx_albedo(double alpha, double eta, double k, double cos_o, int points);

/* The same with Beckmann's D = exp(-tan^2/alpha^2) / (pi alpha^2 cos^4) and Lambda = (exp(-a^2) / (a
 * sqrt pi) - erfc a)/2, a = 1/(alpha tan) [Walter07, Heitz14]. */
double truth_beckmann_albedo(double alpha, double eta, double k, double cos_o, int points);

#endif
