/* How much a smooth boundary reflects. */
#ifndef ASSAY_FRESNEL_H
#define ASSAY_FRESNEL_H

#include "renderer/math/vec.h"

/* Unpolarised reflectance of a dielectric boundary [Born99 1.5.2]. cos_i > 0: of the angle of
 * incidence; eta: index behind over index in front. *cos_t is the cosine behind, 0 under total
 * reflection (result 1). */
static inline float fresnel_dielectric(float cos_i, float eta, float *cos_t)
{
    /* eta^2 - sin^2, in a form that keeps its digits for eta near 1 and at grazing angles. */
    float d = (eta - 1) * (eta + 1) + cos_i * cos_i;
    if (d <= 0) {
        *cos_t = 0;
        return 1;
    }
    float c = sqrtf(d) / eta;
    float parallel = (eta * cos_i - c) / (eta * cos_i + c);
    float perpendicular = (cos_i - eta * c) / (cos_i + eta * c);
    *cos_t = c;
    return 0.5f * (parallel * parallel + perpendicular * perpendicular);
}

/* Schlick's approximation of it, in the cosine on the side of incidence, whichever that is, as the
 * assignment uses it [Schlick94]. Total reflection is still total. */
static inline float fresnel_schlick(float cos_i, float eta, float *cos_t)
{
    if (fresnel_dielectric(cos_i, eta, cos_t) == 1)
        return 1;
    float r0 = (1 - eta) / (1 + eta), m = 1 - cos_i;
    r0 *= r0;
    return r0 + (1 - r0) * m * m * m * m * m;
}

/* Unpolarised reflectance of a conductor with index eta + i k against air [Born99 14.2]; 1 if both
 * are 0. cos_i > 0. */
static inline float fresnel_conductor(float cos_i, float eta, float k)
{
    if (eta == 0 && k == 0)
        return 1;
    float cos2 = cos_i * cos_i, sin2 = 1 - cos2;
    /* eta^2 - k^2 - sin^2, in a form that keeps its digits for eta near 1 and at grazing angles. */
    float t0 = (eta - 1) * (eta + 1) - k * k + cos2;
    double ek2 = 2 * eta * k;
    float a2b2 = (float)sqrt((double)t0 * (double)t0 + ek2 * ek2);
    /* a + i b = sqrt(t0 + 2 i eta k): the larger by its root, the other by a b = eta k. */
    float large = sqrtf(0.5f * (a2b2 + fabsf(t0)));
    float a = t0 >= 0 ? large : eta * k / large;
    float perpendicular = (a2b2 + cos2 - 2 * a * cos_i) / (a2b2 + cos2 + 2 * a * cos_i);
    float parallel = perpendicular * (cos2 * a2b2 + sin2 * sin2 - 2 * a * cos_i * sin2) /
                     (cos2 * a2b2 + sin2 * sin2 + 2 * a * cos_i * sin2);
    return 0.5f * (parallel + perpendicular);
}

#endif
