/* Maps of [0,1)^2 onto directions and surfaces, each beside its density: pdf_w per steradian, pdf_a
 * per unit area. Local frames have the normal on +Z. */
#ifndef ASSAY_WARP_H
#define ASSAY_WARP_H

#include "vec.h"

/* Point of the unit disk, density 1/pi; concentric map [Shirley97]. */
void warp_disk(float u, float v, float *x, float *y);

/* Direction of the upper hemisphere, density cos(theta)/pi [Malley88]. */
vec3 warp_cosine_hemisphere(float u, float v);
static inline float warp_cosine_hemisphere_pdf_w(vec3 w)
{
    return w.z > 0 ? w.z * INV_PI_F : 0;
}

/* Direction of the upper hemisphere, density 1/(2 pi). */
vec3 warp_uniform_hemisphere(float u, float v);
static inline float warp_uniform_hemisphere_pdf_w(vec3 w)
{
    return w.z > 0 ? 0.5f * INV_PI_F : 0;
}

/* Direction of the sphere, density 1/(4 pi). */
vec3 warp_uniform_sphere(float u, float v);

/* Direction within a cone around +Z whose half angle has 1 - cos = one_minus_cos; density
 * 1/(2 pi one_minus_cos). */
vec3 warp_uniform_cone(float u, float v, float one_minus_cos);
static inline float warp_uniform_cone_pdf_w(float one_minus_cos)
{
    return 0.5f * INV_PI_F / one_minus_cos;
}

/* Barycentric coordinates (b1, b2) of a uniform point of a triangle, density 1/area [Turk90]. */
void warp_triangle(float u, float v, float *b1, float *b2);

#endif
