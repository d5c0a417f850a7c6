/* bsdf.c on eight lanes, which may be of different materials; Beckmann's distribution is left to the
 * caller. Directions in the local frame. Part of integrator_simd.c. */
#ifndef ASSAY_BSDF_SIMD_H
#define ASSAY_BSDF_SIMD_H

#include "renderer/math/vec_simd.h"
#include "scene_simd.h"

#define LOWEST_COS 1e-15f

/* Materials of eight lanes; only `kinds` is always there. */
struct materialv {
    vi bits;
    rgbv reflectance, transmittance, eta, k;
    vf ior, alpha;
};

INLINE vi has_bits(vi a, int which)
{
    return ~vi_eq(a & which, vi_set(0));
}

INLINE void materials_gather(const struct lanes_scene *ls, const int32_t number[LANES],
                             struct materialv *m)
{
    vf w[2][LANES];
    gather_columns(ls->material, MATERIAL_WORDS, number, w[0]);
    gather_columns(ls->material + LANES, MATERIAL_WORDS, number, w[1]);
    m->reflectance = (rgbv){w[0][0], w[0][1], w[0][2]};
    m->ior = w[0][MATERIAL_IOR];
    m->transmittance = (rgbv){w[0][4], w[0][5], w[0][6]};
    m->bits = (vi)w[0][MATERIAL_BITS];
    m->alpha = w[1][MATERIAL_ALPHA - LANES];
    m->eta = (rgbv){w[1][1], w[1][2], w[1][3]};
    m->k = (rgbv){w[1][4], w[1][5], w[1][6]};
}

/* struct bsdf_sample. */
struct bsdf_samplev {
    vec3v wi;
    rgbv weight;
    vf pdf_w, eta2;
    vi delta;
};

INLINE void reflectv(vi lanes, vec3v wo, rgbv weight, struct bsdf_samplev *s)
{
    s->wi = v3_select(lanes, v3v(-wo.x, -wo.y, wo.z), s->wi);
    s->weight = rgb_select(lanes, weight, s->weight);
    s->pdf_w = vf_select(lanes, vf_set(1), s->pdf_w);
    s->eta2 = vf_select(lanes, vf_set(1), s->eta2);
    s->delta |= lanes;
}

/* sample_dielectric(), for refraction too. */
INLINE void sample_dielectricv(const struct materialv *m, vi lanes, vi front, vec3v wo, vf lobe,
                               struct bsdf_samplev *s)
{
    const vf zero = vf_set(0);
    vf eta = vf_select(front, m->ior, 1 / m->ior), cos_i = wo.z;
    vf d = (eta - 1) * (eta + 1) + cos_i * cos_i;
    vi total = vf_le(d, zero);
    vf c = vf_sqrt(d) / eta;
    vf parallel = (eta * cos_i - c) / (eta * cos_i + c);
    vf perpendicular = (cos_i - eta * c) / (cos_i + eta * c);
    vf cos_t = vf_select(total, zero, c);
    vf reflected =
        vf_select(total, vf_set(1), 0.5f * (parallel * parallel + perpendicular * perpendicular));
    vf r0 = (1 - eta) / (1 + eta), away = 1 - cos_i;
    r0 *= r0;
    vf schlick = r0 + (1 - r0) * away * away * away * away * away;
    vi uses_schlick = has_bits(m->bits, MATERIAL_IS_SCHLICK) & ~vf_eq(reflected, vf_set(1));
    reflected = vf_select(uses_schlick, schlick, reflected);
    vi only_through = has_bits(m->bits, 1 << MATERIAL_REFRACTION);
    vi back = lanes & ~only_through & vf_lt(lobe, reflected);
    vi through = lanes & ~back & (~only_through | vf_lt(zero, cos_t));
    reflectv(back, wo, m->reflectance, s);
    vf eta2 = eta * eta;
    s->wi = v3_select(through, v3v(-wo.x / eta, -wo.y / eta, -cos_t), s->wi);
    s->weight = rgb_select(through, rgb_scalev(m->transmittance, 1 / eta2), s->weight);
    s->pdf_w = vf_select(through, vf_set(1), s->pdf_w);
    s->eta2 = vf_select(through, eta2, s->eta2);
    s->delta |= through;
}

/* microfacet_d(), microfacet_lambda() and microfacet_g2() of GGX. */
INLINE vf ggx_d(vf alpha, vec3v m)
{
    vf a2 = alpha * alpha, cos2 = m.z * m.z, sin2 = m.x * m.x + m.y * m.y;
    vf e = sin2 + a2 * cos2;
    return vf_select(vf_le(m.z, vf_set(0)), vf_set(0), a2 * INV_PI_F / (e * e));
}
INLINE vf ggx_lambda(vf alpha, vec3v w)
{
    vf tan2 = (w.x * w.x + w.y * w.y) / (w.z * w.z);
    vf l = 0.5f * (vf_sqrt(1 + alpha * alpha * tan2) - 1);
    return vf_select(vf_eq(tan2, vf_set(0)), vf_set(0), l);
}
INLINE vf ggx_g2(const struct materialv *m, vec3v wo, vec3v wi)
{
    vf lo = ggx_lambda(m->alpha, wo), li = ggx_lambda(m->alpha, wi);
    return vf_select(has_bits(m->bits, MATERIAL_IS_SEPARABLE), 1 / ((1 + lo) * (1 + li)),
                     1 / (1 + lo + li));
}

/* fresnel_conductor() */
INLINE vf fresnel_conductorv(vf cos_i, vf eta, vf k)
{
    vf cos2 = cos_i * cos_i, sin2 = 1 - cos2;
    vf t0 = (eta - 1) * (eta + 1) - k * k + cos2;
    vf ek = eta * k;
    vf a2b2 = vf_hypot(t0, 2 * eta * k);
    vf large = vf_sqrt(0.5f * (a2b2 + vf_abs(t0)));
    vf a = vf_select(vf_le(vf_set(0), t0), large, ek / large);
    vf perpendicular = (a2b2 + cos2 - 2 * a * cos_i) / (a2b2 + cos2 + 2 * a * cos_i);
    vf parallel = perpendicular * (cos2 * a2b2 + sin2 * sin2 - 2 * a * cos_i * sin2) /
                  (cos2 * a2b2 + sin2 * sin2 + 2 * a * cos_i * sin2);
    vi none = vf_eq(eta, vf_set(0)) & vf_eq(k, vf_set(0));
    return vf_select(none, vf_set(1), 0.5f * (parallel + perpendicular));
}

INLINE rgbv mirror_reflectancev(const struct materialv *m, vf cos_m)
{
    vi conductor = has_bits(m->bits, MATERIAL_IS_CONDUCTOR);
    if (!bits(conductor))
        return m->reflectance;
    rgbv f = {fresnel_conductorv(cos_m, m->eta.r, m->k.r),
              fresnel_conductorv(cos_m, m->eta.g, m->k.g),
              fresnel_conductorv(cos_m, m->eta.b, m->k.b)};
    return rgb_select(conductor, f, m->reflectance);
}

/* eval_microfacet() and microfacet_pdf_w() together. */
INLINE rgbv eval_ggx(const struct materialv *m, vec3v wo, vec3v wi, vf *pdf_w)
{
    vi low = vf_lt(wo.z, vf_set(LOWEST_COS)) | vf_lt(wi.z, vf_set(LOWEST_COS));
    vec3v h = normalizev(addv(wo, wi));
    vf d = ggx_d(m->alpha, h), g = ggx_g2(m, wo, wi);
    rgbv f = rgb_scalev(mirror_reflectancev(m, vf_max(vf_set(LOWEST_COS), dotv(wo, h))),
                        d * g / (4 * wo.z * wi.z));
    *pdf_w = vf_select(low, vf_set(0), d / (4 * (1 + ggx_lambda(m->alpha, wo)) * wo.z));
    const rgbv black = {vf_set(0), vf_set(0), vf_set(0)};
    return rgb_select(low, black, f);
}

/* sample_ggx() */
INLINE vec3v sample_ggx_normal(vf alpha, vec3v wo, vf u, vf v)
{
    const vf zero = vf_set(0);
    vec3v w = normalizev(v3v(alpha * wo.x, alpha * wo.y, wo.z));
    vf x, y;
    warp_diskv(u, v, &x, &y);
    vf s = 0.5f * (1 + w.z);
    y = (1 - s) * vf_sqrt(vf_max(zero, 1 - x * x)) + s * y;
    vf z = vf_sqrt(vf_max(zero, 1 - x * x - y * y));
    vf l2 = w.x * w.x + w.y * w.y;
    vec3v t1 = v3_select(vf_lt(zero, l2), scalev(v3v(-w.y, w.x, zero), 1 / vf_sqrt(l2)),
                         v3v(vf_set(1), zero, zero));
    vec3v t2 = crossv(w, t1);
    vec3v n = madv(madv(scalev(t1, x), y, t2), z, w);
    return normalizev(v3v(alpha * n.x, alpha * n.y, vf_max(vf_set(1e-7f), n.z)));
}

INLINE void sample_ggxv(const struct materialv *m, vi lanes, vec3v wo, vf u, vf v,
                        struct bsdf_samplev *s)
{
    vec3v h = sample_ggx_normal(m->alpha, wo, u, v);
    vf cos_m = dotv(wo, h), pdf_w;
    vec3v wi = subv(scalev(h, 2 * cos_m), wo);
    vi ok = lanes & ~vf_lt(wo.z, vf_set(LOWEST_COS)) & vf_lt(vf_set(0), cos_m) &
            ~vf_lt(wi.z, vf_set(LOWEST_COS));
    eval_ggx(m, wo, wi, &pdf_w);
    vf g = ggx_g2(m, wo, wi);
    rgbv weight = rgb_scalev(mirror_reflectancev(m, cos_m), g * (1 + ggx_lambda(m->alpha, wo)));
    s->wi = v3_select(ok, wi, s->wi);
    s->weight = rgb_select(ok, weight, s->weight);
    s->pdf_w = vf_select(ok, pdf_w, s->pdf_w);
}

#endif
