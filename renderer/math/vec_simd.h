/* The arithmetic of vec.h and warp.h on eight lanes, operation by operation, so that every lane gets the
 * bits that the scalar code would give it. Part of integrator_simd.c. */
#ifndef ASSAY_VEC_SIMD_H
#define ASSAY_VEC_SIMD_H

#include "ray_batch.h"
#include "simd.h"
#include "trig.h"

typedef struct {
    vf x, y, z;
} vec3v;

typedef struct {
    vf r, g, b;
} rgbv;

typedef struct {
    vec3v s, t, n;
} framev;

INLINE vec3v v3v(vf x, vf y, vf z)
{
    return (vec3v){x, y, z};
}
/* The same in every lane. */
INLINE vec3v v3_all(vec3 a)
{
    return v3v(vf_set(a.x), vf_set(a.y), vf_set(a.z));
}
INLINE rgbv rgb_all(rgb a)
{
    return (rgbv){vf_set(a.r), vf_set(a.g), vf_set(a.b)};
}
INLINE vec3v addv(vec3v a, vec3v b)
{
    return v3v(a.x + b.x, a.y + b.y, a.z + b.z);
}
INLINE vec3v subv(vec3v a, vec3v b)
{
    return v3v(a.x - b.x, a.y - b.y, a.z - b.z);
}
INLINE vec3v scalev(vec3v a, vf s)
{
    return v3v(a.x * s, a.y * s, a.z * s);
}
INLINE vec3v negv(vec3v a)
{
    return v3v(-a.x, -a.y, -a.z);
}
INLINE vec3v madv(vec3v a, vf s, vec3v b)
{
    return v3v(a.x + s * b.x, a.y + s * b.y, a.z + s * b.z);
}
INLINE vf dotv(vec3v a, vec3v b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
INLINE vec3v crossv(vec3v a, vec3v b)
{
    return v3v(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
INLINE vec3v normalizev(vec3v a)
{
    return scalev(a, 1.0f / vf_sqrt(dotv(a, a)));
}
INLINE vec3v v3_select(vi mask, vec3v yes, vec3v no)
{
    return v3v(vf_select(mask, yes.x, no.x), vf_select(mask, yes.y, no.y),
               vf_select(mask, yes.z, no.z));
}
/* -a where the mask is set. */
INLINE vec3v v3_negate_if(vi mask, vec3v a)
{
    vi sign = mask & vi_set(INT32_MIN);
    return v3v((vf)((vi)a.x ^ sign), (vf)((vi)a.y ^ sign), (vf)((vi)a.z ^ sign));
}
INLINE vf copysignv(float magnitude, vf sign)
{
    return (vf)((vi)vf_set(magnitude) | ((vi)sign & vi_set(INT32_MIN)));
}
INLINE rgbv rgb_mulv(rgbv a, rgbv b)
{
    return (rgbv){a.r * b.r, a.g * b.g, a.b * b.b};
}
INLINE rgbv rgb_scalev(rgbv a, vf s)
{
    return (rgbv){a.r * s, a.g * s, a.b * s};
}
INLINE rgbv rgb_select(vi mask, rgbv yes, rgbv no)
{
    return (rgbv){vf_select(mask, yes.r, no.r), vf_select(mask, yes.g, no.g),
                  vf_select(mask, yes.b, no.b)};
}
INLINE vf rgb_maxv(rgbv a)
{
    return vf_max(a.r, vf_max(a.g, a.b));
}
INLINE vi rgb_is_zerov(rgbv a)
{
    const vf zero = vf_set(0);
    return vf_eq(a.r, zero) & vf_eq(a.g, zero) & vf_eq(a.b, zero);
}

INLINE framev frame_from_normalv(vec3v n)
{
    vf sign = copysignv(1.0f, n.z);
    vf a = -1.0f / (sign + n.z);
    vf b = n.x * n.y * a;
    return (framev){.s = v3v(1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x),
                    .t = v3v(b, sign + n.y * n.y * a, -n.y),
                    .n = n};
}
INLINE vec3v frame_to_worldv(const framev *f, vec3v v)
{
    return madv(madv(scalev(f->s, v.x), v.y, f->t), v.z, f->n);
}
INLINE vec3v frame_to_localv(const framev *f, vec3v w)
{
    return v3v(dotv(w, f->s), dotv(w, f->t), dotv(w, f->n));
}

INLINE void warp_diskv(vf u, vf v, vf *x, vf *y)
{
    vf a = 2 * u - 1, b = 2 * v - 1;
    vi near_x = vf_lt(vf_abs(b), vf_abs(a));
    vf r = vf_select(near_x, a, b), other = vf_select(near_x, b, a);
    /* Only both can be 0: then so is r, whatever the angle. */
    vf angle = 0.25f * PI_F * (other / vf_select(vf_eq(r, vf_set(0)), vf_set(1), r));
    vf aa = angle * angle, s = TRIG_SIN(angle, aa), c = TRIG_COS(aa);
    *x = r * vf_select(near_x, c, s);
    *y = r * vf_select(near_x, s, c);
}
INLINE vec3v warp_cosine_hemispherev(vf u, vf v)
{
    vf x, y;
    warp_diskv(u, v, &x, &y);
    return v3v(x, y, vf_sqrt(vf_max(vf_set(0), 1 - x * x - y * y)));
}
INLINE void trig_turnv(vf v, vf *sine, vf *cosine)
{
    const float two_pi = 6.28318530717958647693f;
    vi quarter = vi_truncate(4 * v + 0.5f);
    vf x = two_pi * (v - 0.25f * vf_of_int(quarter)), xx = x * x;
    vf s = TRIG_SIN(x, xx), c = TRIG_COS(xx);
    vi is_odd = vi_eq(quarter & 1, vi_set(1));
    vf along = vf_select(is_odd, s, c), across = vf_select(is_odd, c, s);
    *cosine = (vf)((vi)along ^ (((quarter + 1) & 2) << 30));
    *sine = (vf)((vi)across ^ ((quarter & 2) << 30));
}

INLINE vec3v v3_load(const struct vec3s *a, int i)
{
    return v3v(vf_load_any(a->x + i), vf_load_any(a->y + i), vf_load_any(a->z + i));
}
INLINE void v3_store(struct vec3s *a, int i, vec3v v)
{
    vf_store_any(a->x + i, v.x);
    vf_store_any(a->y + i, v.y);
    vf_store_any(a->z + i, v.z);
}
INLINE rgbv rgb_load(const struct rgbs *a, int i)
{
    return (rgbv){vf_load_any(a->r + i), vf_load_any(a->g + i), vf_load_any(a->b + i)};
}
INLINE void rgb_store(struct rgbs *a, int i, rgbv v)
{
    vf_store_any(a->r + i, v.r);
    vf_store_any(a->g + i, v.g);
    vf_store_any(a->b + i, v.b);
}

#endif
