/* The microfacet model: distribution D of the facet normals m (GGX, Beckmann), Smith's shadowing
 * and masking, and sampling of the normals that are visible from wo [Heitz14]. Directions are in
 * the local frame, normal +Z, and more than 1e-15 above the surface; alpha is at least
 * MICROFACET_MIN_ALPHA; kind is an enum microfacet_kind per lane.
 * tests/renderer/shading/test_bsdf.c checks it against the textbook formulas in double precision. */
#ifndef ASSAY_MICROFACET_H
#define ASSAY_MICROFACET_H

#include "renderer/math/exp.h"
#include "renderer/math/warp.h"
#include "renderer/scene/scene.h"

#define MICROFACET_SQRT_PI 1.77245385090551602730f

/* Mask, as of bits(), of the lanes with a Beckmann distribution. */
INLINE unsigned microfacet_beckmanns(vi kind)
{
    return bits(~vi_eq(kind, vi_set(MICROFACET_GGX)));
}

/* Density of normals per steradian of m and unit of macroscopic area [Walter07 eq. 25, 33]. */
INLINE vf microfacet_d(vi kind, vf alpha, vec3v m)
{
    vf a2 = alpha * alpha, cos2 = m.z * m.z, sin2 = m.x * m.x + m.y * m.y;
    /* cos^2 (a^2 - 1) + 1 in a form that keeps its digits for small alpha. */
    vf e = sin2 + a2 * cos2;
    vf d = a2 * INV_PI_F / (e * e);
    unsigned beckmann = microfacet_beckmanns(kind);
    if (beckmann) {
        e = sin2 / (cos2 * a2);
        /* Beyond 87 the exponential is 0, and cos2 may be 0. */
        vm near = vf_lt(e, vf_set(87));
        vf b = exp_negative(-e) * INV_PI_F / (a2 * cos2 * cos2);
        d = vf_select(lanes_of(beckmann), vf_select(near, b, vf_set(0)), d);
    }
    return vf_select(vf_le(m.z, vf_set(0)), vf_set(0), d);
}

/* Smith's auxiliary function; the fraction of facets visible from w is 1/(1 + lambda)
 * [Heitz14 eq. 72; Walter07 eq. 34 for GGX; the exact error function for Beckmann]. */
INLINE vf microfacet_lambda(vi kind, vf alpha, vec3v w)
{
    vf tan2 = (w.x * w.x + w.y * w.y) / (w.z * w.z);
    vf l = 0.5f * (vf_sqrt(1 + alpha * alpha * tan2) - 1);
    vm upright = vf_eq(tan2, vf_set(0));
    unsigned beckmann = microfacet_beckmanns(kind);
    if (beckmann) {
        vf a = 1 / (alpha * vf_sqrt(tan2));
        vf b = exp_negative(-a * a) * (1 / (a * MICROFACET_SQRT_PI) - exp_erfcx(a));
        l = vf_select(lanes_of(beckmann), 0.5f * b, l);
    }
    return vf_select(upright, vf_set(0), l);
}

/* Lambda of MICROFACET_BECKMANN_STARTER. */
INLINE vf microfacet_starter_lambda(vf alpha, vec3v w)
{
    vf tan2 = (w.x * w.x + w.y * w.y) / (w.z * w.z), a = 1 / (alpha * vf_sqrt(tan2));
    vf l = 0.5f * exp_negative(-a * a) * (1 / (a * PI_F) - exp_erfcx(a));
    return vf_select(vf_lt(vf_set(0), tan2), l, vf_set(0));
}

/* Smith's G2, the fraction of facets visible from both wo and wi. Height-correlated: 1/(1 + lambda_o + lambda_i).
 * separable (a mask): the product of the two G1. MICROFACET_BECKMANN_STARTER: height-correlated with the starter code's
 * lambda, which has pi where sqrt(pi) belongs; that is more than 1 where both directions are near the normal. */
INLINE vf microfacet_g2(vi kind, vf alpha, vm separable, vec3v wo, vec3v wi)
{
    vf lo = microfacet_lambda(kind, alpha, wo), li = microfacet_lambda(kind, alpha, wi);
    vf g = vf_select(separable, 1 / ((1 + lo) * (1 + li)), 1 / (1 + lo + li));
    unsigned starter = bits(vi_eq(kind, vi_set(MICROFACET_BECKMANN_STARTER)));
    if (starter)
        g = vf_select(
            lanes_of(starter),
            1 / (1 + microfacet_starter_lambda(alpha, wo) + microfacet_starter_lambda(alpha, wi)),
            g);
    return g;
}

/* Samples the normals of a hemisphere that are visible from wo, in stretched space, and stretches them back [Heitz18,
 * section 3]. */
INLINE vec3v microfacet_sample_ggx(vf alpha, vec3v wo, vf u, vf v)
{
    const vf zero = vf_set(0);
    vec3v w = normalizev(v3v(alpha * wo.x, alpha * wo.y, wo.z));
    vf x, y;
    warp_disk(u, v, &x, &y);
    /* The half of the disk that the hemisphere's rim cuts off is squeezed onto the visible part. */
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

/* Integral of (1 - s t) exp(-s^2) over s < x: up to a factor, the share of slopes below x that a viewer at
 * tan(theta) = t sees. e: exp(-x^2). */
INLINE vf microfacet_slope_integral(vf x, vf t, vf e)
{
    vf tail = e * exp_erfcx(vf_abs(x));
    tail = vf_select(vf_lt(x, vf_set(0)), tail, 2 - tail);
    return 0.5f * MICROFACET_SQRT_PI * tail + 0.5f * t * e;
}

/* The slope s at which the integral of (1 - s t) exp(-s^2) is the fraction u of what a viewer at
 * tan(theta) = t sees of all slopes; t = 0 gives a normal variate of variance 1/2. Newton's method
 * inside a shrinking bracket, for the lanes of the mask `lanes`. A step below 2e-4 is the last: the
 * remaining error is of the order of its square, below rounding. u is reproduced to 4e-7. */
INLINE vf microfacet_slope(unsigned lanes, vf t, vf u)
{
    const vf zero = vf_set(0), top = vf_set(6);
    vf lo = -top, hi = vf_select(vf_lt(1 / top, t), 1 / t, top), y = 2 * u - 1;
    /* First guess: the series of the inverse error function, reduced for a slanting view. */
    vf x = 0.8862f * y * (1 + 0.26f * y * y) - (1 - 1 / (t + 1)) * (0.7f + 0.45f * u);
    x = vf_min(x, 0.9f * hi);
    vf all = microfacet_slope_integral(hi, t, exp_negative(-hi * hi));
    for (int i = 0; i < 30 && lanes; i++) {
        const vm live = lanes_of(lanes);
        vf e = exp_negative(-x * x), f = microfacet_slope_integral(x, t, e) - u * all;
        vm above = vf_lt(zero, f);
        hi = vf_select(above & live, x, hi);
        lo = vf_select(~above & live, x, lo);
        vf next = x - f / ((1 - x * t) * e);
        vm last = vf_lt(vf_abs(next - x), vf_set(2e-4f));
        next = vf_select(last | (vf_lt(lo, next) & vf_lt(next, hi)), next, 0.5f * (lo + hi));
        lanes &= ~bits(last | vf_lt(hi - lo, vf_set(1e-6f)));
        x = vf_select(live, next, x);
    }
    return x;
}

/* Samples the slopes along wo and across it. */
INLINE vec3v microfacet_sample_beckmann(unsigned lanes, vf alpha, vec3v wo, vf u, vf v)
{
    const vf zero = vf_set(0);
    vec3v w = v3v(alpha * wo.x, alpha * wo.y, wo.z);
    vf sin_w = vf_sqrt(w.x * w.x + w.y * w.y), t = sin_w / w.z;
    vm slant = vf_lt(zero, sin_w);
    vf c = vf_select(slant, w.x / sin_w, vf_set(1)), s = vf_select(slant, w.y / sin_w, zero);
    vf along = microfacet_slope(lanes, t, u), across = microfacet_slope(lanes, zero, v);
    return normalizev(
        v3v(-alpha * (c * along - s * across), -alpha * (s * along + c * across), vf_set(1)));
}

/* A normal with density D(m) max(0, wo.m) / ((1 + lambda(wo)) wo.z), per steradian: GGX [Heitz18];
 * Beckmann by inverting the distribution of visible slopes numerically. wo.z > 0. */
INLINE vec3v microfacet_sample(vi kind, vf alpha, vec3v wo, vf u, vf v)
{
    vec3v m = microfacet_sample_ggx(alpha, wo, u, v);
    unsigned beckmann = microfacet_beckmanns(kind);
    if (beckmann)
        m = v3_select(lanes_of(beckmann), microfacet_sample_beckmann(beckmann, alpha, wo, u, v), m);
    return m;
}

#endif
