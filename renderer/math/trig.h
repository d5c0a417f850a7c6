/* Sine, cosine and arctangent by short polynomials, so that a lane has the same bits at any vector width.
 * Single-precision coefficients of [Moshier92]. Absolute error of sine and cosine below 1.5e-7. */
#ifndef ASSAY_TRIG_H
#define ASSAY_TRIG_H

#include "simd.h"

/* Sine and cosine of x radians, |x| <= pi/4. */
INLINE void trig_small(vf x, vf *sine, vf *cosine)
{
    vf xx = x * x;
    *sine = x + x * xx * (-1.6666654611e-1f + xx * (8.3321608736e-3f + xx * -1.9515295891e-4f));
    *cosine =
        1 - 0.5f * xx +
        xx * xx *
            (4.166664568298827e-2f + xx * (-1.388731625493765e-3f + xx * 2.443315711809948e-5f));
}

/* Sine and cosine of v turns, 0 <= v < 1: reduced by the nearest quarter turn. */
INLINE void trig_turn(vf v, vf *sine, vf *cosine)
{
    const float two_pi = 6.28318530717958647693f;
    vi quarter = vi_truncate(4 * v + 0.5f);
    vf s, c;
    trig_small(two_pi * (v - 0.25f * vf_of_int(quarter)), &s, &c);
    vm is_odd = vi_eq(quarter & 1, vi_set(1));
    vf along = vf_select(is_odd, s, c), across = vf_select(is_odd, c, s);
    *cosine = as_vf(as_vi(along) ^ (vi)(((vu)(quarter + 1) & 2) << 30));
    *sine = as_vf(as_vi(across) ^ (vi)(((vu)quarter & 2) << 30));
}

/* The angle of (x, y), -pi to pi, with a relative error below 3e-7. */
INLINE vf trig_atan2(vf y, vf x)
{
    const vf zero = vf_set(0), ax = vf_abs(x), ay = vf_abs(y);
    const vm steep = vf_lt(ax, ay);
    const vf most = vf_select(steep, ay, ax), least = vf_select(steep, ax, ay);
    vf t = least / vf_max(most, vf_set(1e-37f));
    /* Above tan(pi/8) the angle is reduced by an eighth of a turn. */
    const vm beyond = vf_lt(vf_set(0.4142135623730950f), t);
    t = vf_select(beyond, (t - 1) / (t + 1), t);
    vf z = t * t;
    vf a = t + t * z *
                   (-3.33329491539e-1f +
                    z * (1.99777106478e-1f + z * (-1.38776856032e-1f + z * 8.05374449538e-2f)));
    a = vf_select(beyond, a + 0.78539816339744830962f, a);
    a = vf_select(steep, 1.57079632679489661923f - a, a);
    a = vf_select(vf_lt(x, zero), 3.14159265358979323846f - a, a);
    return vf_select(vf_lt(y, zero), -a, a);
}

#endif
