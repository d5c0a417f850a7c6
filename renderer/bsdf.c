#include "bsdf.h"

#include "warp.h"

rgb bsdf_eval(const struct material *m, vec3 wo, vec3 wi)
{
    switch (m->kind) {
    case MATERIAL_DIFFUSE:
        return wo.z > 0 && wi.z > 0 ? rgb_scale(m->reflectance, INV_PI_F) : grey(0);
    }
    return grey(0);
}

float bsdf_pdf_w(const struct material *m, vec3 wo, vec3 wi)
{
    switch (m->kind) {
    case MATERIAL_DIFFUSE: return wo.z > 0 ? warp_cosine_hemisphere_pdf_w(wi) : 0;
    }
    return 0;
}

struct bsdf_sample bsdf_sample_direction(const struct material *m, vec3 wo, float u, float v)
{
    struct bsdf_sample s = {0};
    if (wo.z <= 0)
        return s;
    switch (m->kind) {
    case MATERIAL_DIFFUSE:
        s.wi = warp_cosine_hemisphere(u, v);
        s.pdf_w = warp_cosine_hemisphere_pdf_w(s.wi);
        s.weight = m->reflectance; /* (albedo/pi) cos / (cos/pi) */
        break;
    }
    return s;
}
