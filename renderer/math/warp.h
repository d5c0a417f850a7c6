/* Sampling of simple densities: maps of [0,1)^2 onto directions and surfaces, each beside its
 * density: pdf_w per steradian, pdf_a per unit area. Local frames have the normal on +Z. */
#ifndef ASSAY_WARP_H
#define ASSAY_WARP_H

#include "trig.h"
#include "vec_simd.h"

/* Point of the unit disk, density 1/pi; concentric map [Shirley97]. */
INLINE void warp_disk(vf u, vf v, vf *x, vf *y)
{
    vf a = 2 * u - 1, b = 2 * v - 1, s, c;
    /* The angle is taken from the nearer axis, so it is at most an eighth of a turn. */
    vm near_x = vf_lt(vf_abs(b), vf_abs(a));
    vf r = vf_select(near_x, a, b), other = vf_select(near_x, b, a);
    /* r is 0 only where both are: then the angle does not matter. */
    trig_small(0.25f * PI_F * (other / vf_select(vf_eq(r, vf_set(0)), vf_set(1), r)), &s, &c);
    *x = r * vf_select(near_x, c, s);
    *y = r * vf_select(near_x, s, c);
}

/* Direction of the upper hemisphere, density cos(theta)/pi [Malley88]. */
INLINE vec3v warp_cosine_hemisphere(vf u, vf v)
{
    vf x, y;
    warp_disk(u, v, &x, &y);
    return v3v(x, y, vf_sqrt(vf_max(vf_set(0), 1 - x * x - y * y)));
}
/* pdf of a direction above the surface, given its cosine to the normal. */
INLINE vf warp_cosine_hemisphere_pdf_w(vf cosine)
{
    return cosine * INV_PI_F;
}

/* Unit direction of height z, -1 to 1, at an azimuth of v turns. */
INLINE vec3v warp_from_height(vf z, vf v)
{
    vf r = vf_sqrt(vf_max(vf_set(0), 1 - z * z)), sine, cosine;
    trig_turn(v, &sine, &cosine);
    return v3v(r * cosine, r * sine, z);
}

/* Direction of the upper hemisphere, density 1/(2 pi). */
INLINE vec3v warp_uniform_hemisphere(vf u, vf v)
{
    return warp_from_height(1 - u, v);
}
INLINE vf warp_uniform_hemisphere_pdf_w(vec3v w)
{
    return vf_select(vf_lt(vf_set(0), w.z), vf_set(0.5f * INV_PI_F), vf_set(0));
}

/* Direction of the sphere, density 1/(4 pi). */
INLINE vec3v warp_uniform_sphere(vf u, vf v)
{
    return warp_from_height(1 - 2 * u, v);
}

/* Direction within a cone around +Z whose half angle has 1 - cos = one_minus_cos; density
 * 1/(2 pi one_minus_cos). */
INLINE vec3v warp_uniform_cone(vf u, vf v, vf one_minus_cos)
{
    /* 1 - z is formed first: a narrow cone would lose all its digits in z. */
    vf h = u * one_minus_cos;
    vf r = vf_sqrt(vf_max(vf_set(0), h * (2 - h))), sine, cosine;
    trig_turn(v, &sine, &cosine);
    return v3v(r * cosine, r * sine, 1 - h);
}
INLINE vf warp_uniform_cone_pdf_w(vf one_minus_cos)
{
    return 0.5f * INV_PI_F / one_minus_cos;
}

/* Barycentric coordinates (b1, b2) of a uniform point of a triangle, density 1/area [Turk90]. */
INLINE void warp_triangle(vf u, vf v, vf *b1, vf *b2)
{
    vf s = vf_sqrt(u);
    *b1 = 1 - s;
    *b2 = v * s;
}

#endif
