/* BSDFs: sampling, evaluation and density, by lanes, which may be of different materials.
 * Directions are unit, point away from the surface, and stand in the local frame of the shading
 * normal, which is turned to the side of wo: wo.z > 0. wi.z < 0 is light that comes through the
 * surface. f is in sr^-1, without the cosine, and 0 for delta lobes, as is their density. A new
 * material has a header of its own, lines in eval_lobes() and sample_lobes(), and its bit in the
 * sets of kinds that it belongs to (scene.h); all files: renderer/README.md, "What to touch". */
#ifndef ASSAY_BSDF_SIMD_H
#define ASSAY_BSDF_SIMD_H

#include "fresnel.h"
#include "microfacet.h"
#include "scene_simd.h"

/* Closer to the surface than this, squares of cosines leave the range of float32. */
#define LOWEST_COS 1e-15f

/* The material of each lane. Of plastic, ior, transmittance and k are what scene_simd.h says. */
struct materialv {
    vi bits, facets;
    rgbv reflectance, transmittance, eta, k; /* plastic: reflectance is that of its facets */
    vf ior, alpha;
};

INLINE vm has_bits(vi a, int which)
{
    return ~vi_eq(a & which, vi_set(0));
}

/* Fetches the materials of these numbers from their records. */
INLINE void materials_gather(const float *record, const int32_t number[LANES], struct materialv *m)
{
    vf w[2][COLUMNS];
    gather_columns(record, MATERIAL_WORDS, number, w[0]);
    gather_columns(record + COLUMNS, MATERIAL_WORDS, number, w[1]);
    m->reflectance = (rgbv){w[0][0], w[0][1], w[0][2]};
    m->ior = w[0][MATERIAL_IOR];
    m->transmittance = (rgbv){w[0][4], w[0][5], w[0][6]};
    m->bits = as_vi(w[0][MATERIAL_BITS]);
    m->alpha = w[1][MATERIAL_ALPHA - COLUMNS];
    m->eta = (rgbv){w[1][1], w[1][2], w[1][3]};
    m->k = (rgbv){w[1][4], w[1][5], w[1][6]};
    m->facets = as_vi(w[1][MATERIAL_FACETS - COLUMNS]);
    m->reflectance = rgb_select(has_bits(m->bits, 1 << MATERIAL_PLASTIC), m->eta, m->reflectance);
}

/* Sampled directions. weight = f |cos(theta_i)| / pdf_w: the caller only multiplies by it.
 * pdf_w 0: nothing scatters (the path ends). */
struct bsdf_samplev {
    vec3v wi;
    rgbv weight;
    vf pdf_w; /* per steradian; 1 if delta */
    vf eta2; /* factor by which weight divides radiance from behind a refracting boundary, (n_behind / n_here)^2; else
                 1. The product along a path is 1 again where it leaves the glass. */
    vm delta; /* sampled from a delta lobe, which light sampling cannot find */
};

INLINE rgbv mirror_reflectance(const struct materialv *m, vf cos_m)
{
    vm conductor = has_bits(m->bits, MATERIAL_IS_CONDUCTOR);
    if (!bits(conductor))
        return m->reflectance;
    rgbv f = {fresnel_conductor(cos_m, m->eta.r, m->k.r),
              fresnel_conductor(cos_m, m->eta.g, m->k.g),
              fresnel_conductor(cos_m, m->eta.b, m->k.b)};
    return rgb_select(conductor, f, m->reflectance);
}

/* Density of wi when visible normals h are sampled: mirroring at h magnifies solid angle by 4 wo.h
 * [Walter07 eq. 14], which cancels the cosine in the density of h. *d: D(h). */
INLINE vf pdf_microfacet(vi kind, vf alpha, vec3v wo, vec3v wi, vec3v h, vf *d)
{
    vm low = vf_lt(wo.z, vf_set(LOWEST_COS)) | vf_lt(wi.z, vf_set(LOWEST_COS));
    *d = microfacet_d(kind, alpha, h);
    return vf_select(low, vf_set(0), *d / (4 * (1 + microfacet_lambda(kind, alpha, wo)) * wo.z));
}

INLINE vf shadowing(const struct materialv *m, vi kind, vec3v wo, vec3v wi)
{
    return microfacet_g2(kind, m->alpha, has_bits(m->bits, MATERIAL_IS_SEPARABLE), wo, wi);
}

/* F D G / (4 cos_o cos_i) [Walter07 eq. 20]. */
INLINE rgbv eval_microfacet(const struct materialv *m, vm lanes, vec3v wo, vec3v wi, vf *pdf_w)
{
    vm low = vf_lt(wo.z, vf_set(LOWEST_COS)) | vf_lt(wi.z, vf_set(LOWEST_COS));
    vi kind = vi_where(lanes & ~low, m->facets);
    vec3v h = normalizev(addv(wo, wi));
    vf d, g = shadowing(m, kind, wo, wi);
    *pdf_w = pdf_microfacet(kind, m->alpha, wo, wi, h, &d);
    /* Between two grazing directions the rounding of h can be more than its cosine. */
    rgbv f = mirror_reflectance(m, vf_max(vf_set(LOWEST_COS), dotv(wo, h)));
    return rgb_where(~low, rgb_scalev(f, d * g / (4 * wo.z * wi.z)));
}

INLINE void sample_microfacet(const struct materialv *m, vm lanes, vec3v wo, vf u, vf v,
                              struct bsdf_samplev *s)
{
    vi kind = vi_where(lanes, m->facets);
    vec3v h = microfacet_sample(kind, m->alpha, wo, u, v);
    vf cos_m = dotv(wo, h), d;
    vec3v wi = subv(scalev(h, 2 * cos_m), wo);
    lanes &= ~vf_lt(wo.z, vf_set(LOWEST_COS)) & vf_lt(vf_set(0), cos_m) &
             ~vf_lt(wi.z, vf_set(LOWEST_COS));
    kind = vi_where(lanes, kind);
    vf pdf_w = pdf_microfacet(kind, m->alpha, wo, wi, normalizev(addv(wo, wi)), &d);
    /* D, the cosines and the Jacobian cancel. */
    vf weight = shadowing(m, kind, wo, wi) * (1 + microfacet_lambda(kind, m->alpha, wo));
    s->wi = v3_select(lanes, wi, s->wi);
    s->weight = rgb_select(lanes, rgb_scalev(mirror_reflectance(m, cos_m), weight), s->weight);
    s->pdf_w = vf_select(lanes, pdf_w, s->pdf_w);
}

INLINE void sample_delta(vm lanes, vec3v wi, rgbv weight, vf eta2, struct bsdf_samplev *s)
{
    s->wi = v3_select(lanes, wi, s->wi);
    s->weight = rgb_select(lanes, weight, s->weight);
    s->pdf_w = vf_select(lanes, vf_set(1), s->pdf_w);
    s->eta2 = vf_select(lanes, eta2, s->eta2);
    s->delta |= lanes;
}

INLINE void sample_mirror(vm lanes, vec3v wo, rgbv weight, struct bsdf_samplev *s)
{
    sample_delta(lanes, v3v(-wo.x, -wo.y, wo.z), weight, vf_set(1), s);
}

/* Glass, and refraction without reflection. eta: index behind over index on the side of wo. Radiance is
 * larger by eta^2 behind the boundary, so radiance that comes from there is divided by it [Veach97 5.2]. */
INLINE void sample_dielectric(const struct materialv *m, vm lanes, vm front, vec3v wo, vf lobe,
                              struct bsdf_samplev *s)
{
    vf eta = vf_select(front, m->ior, 1 / m->ior), eta2 = eta * eta, cos_t;
    vm schlick = has_bits(m->bits, MATERIAL_IS_SCHLICK);
    vf reflected = fresnel_dielectric(wo.z, eta, &cos_t);
    reflected = vf_select(schlick, fresnel_schlick(wo.z, eta, &cos_t), reflected);
    vm only_through = has_bits(m->bits, 1 << MATERIAL_REFRACTION);
    /* The lobe is picked with its own share, which then cancels. */
    vm back = lanes & ~only_through & vf_lt(lobe, reflected);
    vm through = lanes & ~back & (~only_through | vf_lt(vf_set(0), cos_t));
    sample_mirror(back, wo, m->reflectance, s);
    sample_delta(through, v3v(-wo.x / eta, -wo.y / eta, -cos_t),
                 rgb_scalev(m->transmittance, 1 / eta2), eta2, s);
}

/* f of a diffuse surface, wo and wi above it; the density of wi is warp_cosine_hemisphere_pdf_w(). */
INLINE rgbv eval_diffuse(rgbv reflectance)
{
    return rgb_scalev(reflectance, vf_set(INV_PI_F));
}

/* f, and the density of wi, for lanes whose material is not purely diffuse. diffuse: f of the diffuse part. */
INLINE rgbv eval_lobes(const struct materialv *m, vm lanes, rgbv diffuse, vec3v wo, vec3v wi,
                       vf *pdf_w)
{
    const vf zero = vf_set(0);
    rgbv f = eval_microfacet(m, lanes, wo, wi, pdf_w);
    vm plastic = lanes & has_bits(m->bits, 1 << MATERIAL_PLASTIC);
    if (!bits(plastic))
        return f;
    const vf mirror = m->ior, highlight = m->transmittance.r; /* shares */
    plastic &= vf_lt(zero, wo.z) & vf_lt(zero, wi.z);
    vf both = highlight * *pdf_w + (1 - mirror - highlight) * warp_cosine_hemisphere_pdf_w(wi.z);
    *pdf_w = vf_select(plastic, both, *pdf_w);
    return rgb_select(plastic, rgb_addv(f, diffuse), f);
}

/* Picks one lobe with the probability of its share. Outside the mirror, weight and density are those of the diffuse and
 * the rough lobe together. On entry s holds a direction of the diffuse lobe. */
INLINE void sample_plastic(const struct materialv *m, vm lanes, rgbv reflectance, vec3v wo,
                           const vf u[4], struct bsdf_samplev *s)
{
    const vf zero = vf_set(0), mirror = m->ior, highlight = m->transmittance.r;
    vm mirrored = lanes & vf_lt(u[2], mirror);
    vm facet = lanes & ~mirrored & vf_lt(u[2], mirror + highlight);
    if (bits(facet))
        sample_microfacet(m, facet, wo, u[0], u[1], s);
    lanes &= ~mirrored & (~facet | vf_lt(zero, s->pdf_w));
    vf pdf_w;
    rgbv f = eval_lobes(m, lanes, eval_diffuse(reflectance), wo, s->wi, &pdf_w);
    lanes &= vf_lt(zero, pdf_w);
    s->weight = rgb_select(lanes, rgb_scalev(f, s->wi.z / pdf_w), s->weight);
    s->pdf_w = vf_select(lanes, pdf_w, s->pdf_w);
    sample_mirror(mirrored, wo, rgb_scalev(m->k, 1 / mirror), s);
}

/* Samples directions for the lanes of the mask; other lanes are undefined. number, kinds (bits) and reflectance: of the
 * lanes' materials; front: true where wo is on the side of the scene's geometric normal (outside glass). u[0] and
 * u[1] choose the direction, u[2] the lobe. */
INLINE void sample_lobes(const float *record, const int32_t number[LANES], vi kinds,
                         rgbv reflectance, const bool *front, unsigned mask, vec3v wo,
                         const vf u[4], struct bsdf_samplev *s)
{
    const vf zero = vf_set(0);
    vm above = vf_lt(zero, wo.z), diffuse = has_bits(kinds, 1 << MATERIAL_DIFFUSE);
    *s = (struct bsdf_samplev){.eta2 = vf_set(1), .delta = vm_set(false)};
    s->wi = warp_cosine_hemisphere(u[0], u[1]);
    s->pdf_w = vf_select(diffuse & above, warp_cosine_hemisphere_pdf_w(s->wi.z), zero);
    s->weight = reflectance; /* (albedo/pi) cos / (cos/pi) */
    unsigned other = mask & ~bits(diffuse) & bits(above);
    if (!other)
        return;
    struct materialv m;
    materials_gather(record, number, &m);
    vm lanes = lanes_of(other);
    vm mirror = lanes & has_bits(kinds, 1 << MATERIAL_MIRROR);
    if (bits(mirror))
        sample_mirror(mirror, wo, m.reflectance, s);
    vm dielectric = lanes & has_bits(kinds, 1 << MATERIAL_GLASS | 1 << MATERIAL_REFRACTION);
    if (bits(dielectric))
        sample_dielectric(&m, dielectric, lanes_of(spread_flags(front, ALL_LANES)), wo, u[2], s);
    vm rough = lanes & has_bits(kinds, 1 << MATERIAL_MICROFACET);
    if (bits(rough))
        sample_microfacet(&m, rough, wo, u[0], u[1], s);
    vm plastic = lanes & has_bits(kinds, 1 << MATERIAL_PLASTIC);
    if (bits(plastic))
        sample_plastic(&m, plastic, reflectance, wo, u, s);
}

#endif
