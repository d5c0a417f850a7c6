/* How much a smooth boundary reflects. */
#ifndef ASSAY_FRESNEL_H
#define ASSAY_FRESNEL_H

#include "vec.h"

/* Unpolarised reflectance of a dielectric boundary [Born99 1.5.2]. cos_i > 0: of the angle of
 * incidence; eta: index behind over index in front. *cos_t is the cosine behind, 0 under total
 * reflection (result 1). */
static inline float fresnel_dielectric(float cos_i, float eta, float *cos_t)
{
    float sin2_t = (1 - cos_i * cos_i) / (eta * eta);
    if (sin2_t >= 1) {
        *cos_t = 0;
        return 1;
    }
    float c = sqrtf(1 - sin2_t);
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

/* Unpolarised reflectance of a conductor with index eta + i k against air [Born99 14.2]. */
static inline float fresnel_conductor(float cos_i, float eta, float k)
{
    float cos2 = cos_i * cos_i, sin2 = 1 - cos2, t0 = eta * eta - k * k - sin2;
    float a2b2 = sqrtf(t0 * t0 + 4 * eta * eta * k * k);
    float a = sqrtf(maxf(0, 0.5f * (a2b2 + t0)));
    float perpendicular = (a2b2 + cos2 - 2 * a * cos_i) / (a2b2 + cos2 + 2 * a * cos_i);
    float parallel = perpendicular * (cos2 * a2b2 + sin2 * sin2 - 2 * a * cos_i * sin2) /
                     (cos2 * a2b2 + sin2 * sin2 + 2 * a * cos_i * sin2);
    return 0.5f * (parallel + perpendicular);
}

#endif
