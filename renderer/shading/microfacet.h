/* Rough surfaces as many small mirrors: distribution D of their normals m, Smith shadowing, sampling of
 * the normals that are visible from wo [Heitz14]. Local frame, normal on +Z; alpha at least
 * MICROFACET_MIN_ALPHA, directions above the surface by more than 1e-15. */
#ifndef ASSAY_MICROFACET_H
#define ASSAY_MICROFACET_H

#include "renderer/scene/scene.h"

/* Density of normals per steradian of m and unit of macroscopic area [Walter07 eq. 25, 33]. */
float microfacet_d(enum microfacet_kind kind, float alpha, vec3 m);

/* Smith's auxiliary function; the fraction of facets visible from w is 1/(1 + lambda)
 * [Heitz14 eq. 72; Walter07 eq. 34 for GGX; the exact error function for Beckmann]. */
float microfacet_lambda(enum microfacet_kind kind, float alpha, vec3 w);

/* Both seen from wo and lit from wi: of the whole surface's height at once (correlated), or as if
 * the two were independent (separable). MICROFACET_BECKMANN_STARTER: of the whole surface, with a pi for the
 * sqrt(pi) of its lambda; more than 1 where the surface is seen and lit from above. */
float microfacet_g2(enum microfacet_kind kind, float alpha, bool separable, vec3 wo, vec3 wi);

/* A normal with density D(m) max(0, wo.m) / ((1 + lambda(wo)) wo.z), per steradian: GGX [Heitz18];
 * Beckmann by inverting the distribution of visible slopes numerically. wo.z > 0. */
vec3 microfacet_sample(enum microfacet_kind kind, float alpha, vec3 wo, float u, float v);

#endif
