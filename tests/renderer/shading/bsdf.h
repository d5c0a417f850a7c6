/* renderer/shading/bsdf_simd.h for one material and one pair of directions, compiled for one lane. */
#ifndef ASSAY_BSDF_H
#define ASSAY_BSDF_H

#include "renderer/scene/scene.h"

/* struct bsdf_samplev */
struct bsdf_sample {
    vec3 wi;
    rgb weight;
    float pdf_w;
    bool delta;
    float eta2;
};

rgb bsdf_eval(const struct material *m, vec3 wo, vec3 wi);
float bsdf_pdf_w(const struct material *m, vec3 wo, vec3 wi);
struct bsdf_sample bsdf_sample_direction(const struct material *m, bool front, vec3 wo, float u,
                                         float v, float lobe);

/* Whether f is 0 for every pair of directions, so that light sampling is useless. */
bool bsdf_is_delta(const struct material *m);

#endif
