/* Scattering at a surface. Directions are unit, in the local frame of the shading normal (+Z), and
 * point away from the surface; both lie on the same side, +Z, after the frame is turned to wo. */
#ifndef ASSAY_BSDF_H
#define ASSAY_BSDF_H

#include "scene.h"

/* One sampled direction. weight = f cos(theta_i) / pdf_w, so the caller multiplies and is done.
 * pdf_w 0: nothing scatters (the path ends). */
struct bsdf_sample {
    vec3 wi;
    rgb weight;
    float pdf_w;
};

/* f(wo, wi) in sr^-1, without the cosine; 0 below the surface. */
rgb bsdf_eval(const struct material *m, vec3 wo, vec3 wi);
/* Density with which bsdf_sample_direction() picks wi, per steradian. */
float bsdf_pdf_w(const struct material *m, vec3 wo, vec3 wi);
/* u, v in [0,1) choose the direction. */
struct bsdf_sample bsdf_sample_direction(const struct material *m, vec3 wo, float u, float v);

#endif
