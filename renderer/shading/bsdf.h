/* Scattering at a surface. Directions are unit, point away from the surface, and stand in the local
 * frame of the shading normal, which is turned to the side of wo: wo.z > 0. wi.z < 0 is light that
 * comes through the surface. `front` tells if wo is on the side that the geometric normal of the
 * scene points to: in front of glass, not inside it. */
#ifndef ASSAY_BSDF_H
#define ASSAY_BSDF_H

#include "renderer/scene/scene.h"

/* One sampled direction. weight = f |cos(theta_i)| / pdf_w, so the caller multiplies and is done.
 * pdf_w 0: nothing scatters (the path ends). */
struct bsdf_sample {
    vec3 wi;
    rgb weight;
    float pdf_w; /* 1 if delta */
    bool delta;  /* one of the directions that light sampling cannot find */
    /* What the radiance behind a refracting boundary is divided by, (n_behind / n_here)^2; 1 else.
     * It is in weight, and leaves it again where the path comes out. */
    float eta2;
};

/* f(wo, wi) in sr^-1, without the cosine; 0 for delta lobes. */
rgb bsdf_eval(const struct material *m, vec3 wo, vec3 wi);
/* Density with which bsdf_sample_direction() picks wi, per steradian; 0 for delta lobes. */
float bsdf_pdf_w(const struct material *m, vec3 wo, vec3 wi);
/* u, v in [0,1) choose the direction, lobe the part of the material. */
struct bsdf_sample bsdf_sample_direction(const struct material *m, bool front, vec3 wo, float u,
                                         float v, float lobe);

/* No direction has f > 0: light sampling is in vain. */
bool bsdf_is_delta(const struct material *m);

#endif
