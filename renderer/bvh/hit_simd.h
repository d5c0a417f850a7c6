/* Ray-triangle and ray-sphere tests, a pair in each lane, by the tests of shape.c, operation by
 * operation, so that a hit has the same bits. Whether the lanes are rays or primitives is the
 * caller's matter. Part of traverse.c and small_scene_trace.c. */
#ifndef ASSAY_HIT_SIMD_H
#define ASSAY_HIT_SIMD_H

#include "renderer/math/simd.h"

/* Recomputes, in lanes where both products rounded to the same, e in double, where products are exact (shape.c). */
static __attribute__((noinline, cold)) void edge_exact(const vf *ax, const vf *ay, const vf *bx,
                                                       const vf *by, vf *e)
{
    for (int i = 0; i < LANES; i++)
        if ((*e)[i] == 0)
            (*e)[i] =
                (float)((double)(*ax)[i] * (double)(*by)[i] - (double)(*ay)[i] * (double)(*bx)[i]);
}

/* Lanes whose three edge functions have one sign, or are 0. NaNs, of which a leaf's empty lanes consist, do not pass:
 * most leaves have some. */
INLINE vm edges_agree(vf e0, vf e1, vf e2)
{
    const vf zero = vf_set(0);
    return vf_le(zero, vf_min(vf_min(e0, e1), e2)) | vf_le(vf_max(vf_max(e0, e1), e2), zero);
}

/* triangle_intersect() without the comparison of t; returns the lanes that pass. x, y, z: the corners
 * in the sheared frame, whose origin is that of the ray; sz: as in struct shear. */
INLINE vm sheared_hit(const vf x[3], const vf y[3], const vf z[3], vf sz, vf *t, vf *u, vf *v)
{
    vf e0 = x[1] * y[2] - y[1] * x[2];
    vf e1 = x[2] * y[0] - y[2] * x[0];
    vf e2 = x[0] * y[1] - y[0] * x[1];
    const vf zero = vf_set(0);
    vm pass = edges_agree(e0, e1, e2);
    if (!bits(pass))
        return pass;
    if (__builtin_expect(bits(pass & (vf_eq(e0, zero) | vf_eq(e1, zero) | vf_eq(e2, zero))) != 0,
                         0)) {
        edge_exact(&x[1], &y[1], &x[2], &y[2], &e0);
        edge_exact(&x[2], &y[2], &x[0], &y[0], &e1);
        edge_exact(&x[0], &y[0], &x[1], &y[1], &e2);
        pass = edges_agree(e0, e1, e2);
    }
    /* Without area the inverse is infinite and t is NaN, which fails every comparison. */
    vf inv = 1 / (e0 + e1 + e2);
    *u = e1 * inv;
    *v = e2 * inv;
    *t = sz * (e0 * inv * z[0] + *u * z[1] + *v * z[2]);
    return pass;
}

/* sphere_intersect() within (tmin, limit]. f: from the centre to the ray's origin. */
INLINE vm sphere_hit(vf fx, vf fy, vf fz, vf dx, vf dy, vf dz, vf radius, vf tmin, vf limit, vf *t)
{
    vf b = -(fx * dx + fy * dy + fz * dz);
    vf cx = fx + b * dx, cy = fy + b * dy, cz = fz + b * dz;
    vf disc = radius * radius - (cx * cx + cy * cy + cz * cz);
    const vf zero = vf_set(0);
    vm pass = vf_le(zero, disc);
    if (!bits(pass))
        return pass;
    vf c = fx * fx + fy * fy + fz * fz - radius * radius;
    vf root = vf_sqrt(disc);
    vf q = b + (vf)((vi)root | ((vi)b & vi_set(INT32_MIN)));
    vf t0 = vf_select(vf_eq(q, zero), zero, c / q), t1 = q;
    vf near = vf_min(t0, t1), far = vf_max(t0, t1);
    vm first = vf_lt(tmin, near) & vf_le(near, limit);
    vm second = vf_lt(tmin, far) & vf_le(far, limit);
    *t = vf_select(first, near, far);
    return pass & (first | second);
}

#endif
