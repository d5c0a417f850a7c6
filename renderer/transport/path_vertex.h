/* Single lanes of the scalar integrator, for what the vector stages leave to it. All of them read the
 * batch at lane i: the ray, the hit, the surface, throughput and pdf_w. */
#ifndef ASSAY_PATH_VERTEX_H
#define ASSAY_PATH_VERTEX_H

#include "renderer/shading/bsdf.h"
#include "integrator.h"

/* What the environment adds, where the ray has left the scene. */
rgb lane_environment(const struct integrator *it, const struct batch *b, int i);
/* What light `light` adds, that the ray has met on surface s of material m. */
rgb lane_emission(const struct integrator *it, const struct batch *b, int i, uint32_t light,
                  const struct material *m, const struct surface *s);
/* f(wo, wi) cos(theta_i) and, if pdf_w is not NULL, the BSDF's own density of wi; 0 unless wi
 * leaves on wo's side of the true surface. */
rgb lane_scatter_towards(const struct integrator *it, const struct batch *b, int i, vec3 wi,
                         float *pdf_w);

#endif
