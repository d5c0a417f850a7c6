#include "bsdf.h"

#include "fresnel.h"
#include "microfacet.h"
#include "renderer/math/warp.h"

static rgb mirror_reflectance(const struct material *m, float cos_m)
{
    if (!m->conductor)
        return m->reflectance;
    return (rgb){fresnel_conductor(cos_m, m->eta.r, m->k.r),
                 fresnel_conductor(cos_m, m->eta.g, m->k.g),
                 fresnel_conductor(cos_m, m->eta.b, m->k.b)};
}

/* Closer to the surface than this, squares of cosines leave the range of float32. */
#define LOWEST_COS 1e-15f

/* F D G / (4 cos_o cos_i) [Walter07 eq. 20]. */
static rgb eval_microfacet(const struct material *m, vec3 wo, vec3 wi)
{
    if (wo.z < LOWEST_COS || wi.z < LOWEST_COS)
        return grey(0);
    vec3 h = normalize(add(wo, wi));
    float d = microfacet_d(m->microfacet, m->alpha, h);
    float g = microfacet_g2(m->microfacet, m->alpha, m->separable, wo, wi);
    /* Between two grazing directions the rounding of h can be more than its cosine. */
    return rgb_scale(mirror_reflectance(m, maxf(LOWEST_COS, dot(wo, h))),
                     d * g / (4 * wo.z * wi.z));
}

/* Normals are sampled; a solid angle of them is 4 wo.m times as large in mirrored directions
 * [Walter07 eq. 14], which cancels with the cosine in their density. */
static float microfacet_pdf_w(const struct material *m, vec3 wo, vec3 wi)
{
    if (wo.z < LOWEST_COS || wi.z < LOWEST_COS)
        return 0;
    vec3 h = normalize(add(wo, wi));
    return microfacet_d(m->microfacet, m->alpha, h) /
           (4 * (1 + microfacet_lambda(m->microfacet, m->alpha, wo)) * wo.z);
}

static struct bsdf_sample sample_microfacet(const struct material *m, vec3 wo, float u, float v)
{
    struct bsdf_sample s = {.eta2 = 1};
    if (wo.z < LOWEST_COS)
        return s;
    vec3 h = microfacet_sample(m->microfacet, m->alpha, wo, u, v);
    float cos_m = dot(wo, h);
    s.wi = sub(scale(h, 2 * cos_m), wo);
    if (cos_m <= 0 || s.wi.z < LOWEST_COS)
        return s;
    s.pdf_w = microfacet_pdf_w(m, wo, s.wi);
    /* D, the cosines and the Jacobian cancel. */
    float g = microfacet_g2(m->microfacet, m->alpha, m->separable, wo, s.wi);
    s.weight = rgb_scale(mirror_reflectance(m, cos_m),
                         g * (1 + microfacet_lambda(m->microfacet, m->alpha, wo)));
    return s;
}

rgb bsdf_eval(const struct material *m, vec3 wo, vec3 wi)
{
    switch (m->kind) {
    case MATERIAL_DIFFUSE:
        return wo.z > 0 && wi.z > 0 ? rgb_scale(m->reflectance, INV_PI_F) : grey(0);
    case MATERIAL_MICROFACET: return eval_microfacet(m, wo, wi);
    case MATERIAL_MIRROR:
    case MATERIAL_REFRACTION:
    case MATERIAL_GLASS: break;
    }
    return grey(0);
}

float bsdf_pdf_w(const struct material *m, vec3 wo, vec3 wi)
{
    switch (m->kind) {
    case MATERIAL_DIFFUSE: return wo.z > 0 ? warp_cosine_hemisphere_pdf_w(wi) : 0;
    case MATERIAL_MICROFACET: return microfacet_pdf_w(m, wo, wi);
    case MATERIAL_MIRROR:
    case MATERIAL_REFRACTION:
    case MATERIAL_GLASS: break;
    }
    return 0;
}

static struct bsdf_sample reflect(vec3 wo, rgb weight)
{
    return (struct bsdf_sample){
        .wi = {-wo.x, -wo.y, wo.z}, .weight = weight, .pdf_w = 1, .delta = true, .eta2 = 1};
}

/* eta: index behind over index here. Radiance is bundled by eta^2 behind the boundary, so what comes
 * out of there is divided by it [Veach97 5.2]. */
static struct bsdf_sample refract(vec3 wo, float cos_t, float eta, rgb weight)
{
    float eta2 = eta * eta;
    return (struct bsdf_sample){.wi = {-wo.x / eta, -wo.y / eta, -cos_t},
                                .weight = rgb_scale(weight, 1 / eta2),
                                .pdf_w = 1,
                                .delta = true,
                                .eta2 = eta2};
}

static struct bsdf_sample sample_dielectric(const struct material *m, bool front, vec3 wo,
                                            float lobe)
{
    float eta = front ? m->ior : 1 / m->ior, cos_t;
    float reflected =
        m->schlick ? fresnel_schlick(wo.z, eta, &cos_t) : fresnel_dielectric(wo.z, eta, &cos_t);
    if (m->kind == MATERIAL_REFRACTION)
        return cos_t > 0 ? refract(wo, cos_t, eta, m->transmittance) : (struct bsdf_sample){0};
    /* The lobe is picked with its own share, which then cancels. */
    return lobe < reflected ? reflect(wo, m->reflectance)
                            : refract(wo, cos_t, eta, m->transmittance);
}

struct bsdf_sample bsdf_sample_direction(const struct material *m, bool front, vec3 wo, float u,
                                         float v, float lobe)
{
    struct bsdf_sample s = {.eta2 = 1};
    if (wo.z <= 0)
        return s;
    switch (m->kind) {
    case MATERIAL_DIFFUSE:
        s.wi = warp_cosine_hemisphere(u, v);
        s.pdf_w = warp_cosine_hemisphere_pdf_w(s.wi);
        s.weight = m->reflectance; /* (albedo/pi) cos / (cos/pi) */
        break;
    case MATERIAL_MICROFACET: return sample_microfacet(m, wo, u, v);
    case MATERIAL_MIRROR: return reflect(wo, m->reflectance);
    case MATERIAL_REFRACTION:
    case MATERIAL_GLASS: return sample_dielectric(m, front, wo, lobe);
    }
    return s;
}

bool bsdf_is_delta(const struct material *m)
{
    switch (m->kind) {
    case MATERIAL_DIFFUSE:
    case MATERIAL_MICROFACET: return false;
    case MATERIAL_MIRROR:
    case MATERIAL_REFRACTION:
    case MATERIAL_GLASS: break;
    }
    return true;
}

bool bsdf_is_black(const struct material *m)
{
    switch (m->kind) {
    case MATERIAL_DIFFUSE:
    case MATERIAL_MIRROR: return rgb_is_zero(m->reflectance);
    case MATERIAL_REFRACTION: return rgb_is_zero(m->transmittance);
    case MATERIAL_GLASS: return rgb_is_zero(m->reflectance) && rgb_is_zero(m->transmittance);
    case MATERIAL_MICROFACET: return !m->conductor && rgb_is_zero(m->reflectance);
    }
    return true;
}
