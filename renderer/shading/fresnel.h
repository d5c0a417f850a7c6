/* Fresnel reflectance of smooth boundaries, by lanes. */
#ifndef ASSAY_FRESNEL_H
#define ASSAY_FRESNEL_H

#include "renderer/math/vec_simd.h"

/* Unpolarised reflectance of a dielectric boundary [Born99 1.5.2]. cos_i > 0: of the angle of
 * incidence; eta: index behind over index in front. *cos_t is the cosine behind, 0 under total
 * reflection (result 1). */
INLINE vf fresnel_dielectric(vf cos_i, vf eta, vf *cos_t)
{
    const vf zero = vf_set(0);
    /* eta^2 - sin^2, in a form that keeps its digits for eta near 1 and at grazing angles. */
    vf d = (eta - 1) * (eta + 1) + cos_i * cos_i;
    vm total = vf_le(d, zero);
    vf c = vf_sqrt(d) / eta;
    vf parallel = (eta * cos_i - c) / (eta * cos_i + c);
    vf perpendicular = (cos_i - eta * c) / (cos_i + eta * c);
    *cos_t = vf_select(total, zero, c);
    return vf_select(total, vf_set(1),
                     0.5f * (parallel * parallel + perpendicular * perpendicular));
}

/* Schlick's approximation of it [Schlick94], always in the cosine on the side of incidence, as in the
 * assignment, even if that is the denser side. Total reflection stays total. */
INLINE vf fresnel_schlick(vf cos_i, vf eta, vf *cos_t)
{
    vm total = vf_eq(fresnel_dielectric(cos_i, eta, cos_t), vf_set(1));
    vf r0 = (1 - eta) / (1 + eta), m = 1 - cos_i;
    r0 *= r0;
    return vf_select(total, vf_set(1), r0 + (1 - r0) * m * m * m * m * m);
}

/* Unpolarised reflectance of a conductor with index eta + i k against air [Born99 14.2]; 1 if both
 * are 0. cos_i > 0. */
INLINE vf fresnel_conductor(vf cos_i, vf eta, vf k)
{
    vf cos2 = cos_i * cos_i, sin2 = 1 - cos2;
    /* eta^2 - k^2 - sin^2, in a form that keeps its digits for eta near 1 and at grazing angles. */
    vf t0 = (eta - 1) * (eta + 1) - k * k + cos2;
    vf a2b2 = vf_hypot(t0, 2 * eta * k);
    /* a + i b = sqrt(t0 + 2 i eta k): the larger by its root, the other by a b = eta k. */
    vf large = vf_sqrt(0.5f * (a2b2 + vf_abs(t0)));
    vf a = vf_select(vf_le(vf_set(0), t0), large, eta * k / large);
    vf perpendicular = (a2b2 + cos2 - 2 * a * cos_i) / (a2b2 + cos2 + 2 * a * cos_i);
    vf parallel = perpendicular * (cos2 * a2b2 + sin2 * sin2 - 2 * a * cos_i * sin2) /
                  (cos2 * a2b2 + sin2 * sin2 + 2 * a * cos_i * sin2);
    vm none = vf_eq(eta, vf_set(0)) & vf_eq(k, vf_set(0));
    return vf_select(none, vf_set(1), 0.5f * (parallel + perpendicular));
}

#endif
