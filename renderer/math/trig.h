/* Sine and cosine by short polynomials, so that one lane and eight give the same bits; the macros are
 * written for float and for vectors of float. Coefficients: [Moshier92], of single precision. Off by
 * less than 1.5e-7. */
#ifndef ASSAY_TRIG_H
#define ASSAY_TRIG_H

/* For |x| <= pi/4; xx is x squared. */
#define TRIG_SIN(x, xx)                                                                            \
    ((x) + (x) * (xx) * (-1.6666654611e-1f + (xx) * (8.3321608736e-3f + (xx) * -1.9515295891e-4f)))
#define TRIG_COS(xx)                                                                               \
    (1 - 0.5f * (xx) +                                                                             \
     (xx) * (xx) *                                                                                 \
         (4.166664568298827e-2f + (xx) * (-1.388731625493765e-3f + (xx)*2.443315711809948e-5f)))

/* Of x radians, |x| <= pi/4. */
static inline void trig_small(float x, float *sine, float *cosine)
{
    float xx = x * x;
    *sine = TRIG_SIN(x, xx);
    *cosine = TRIG_COS(xx);
}

/* Of v turns, 0 <= v < 1: the nearest quarter, and what is left. */
static inline void trig_turn(float v, float *sine, float *cosine)
{
    const float two_pi = 6.28318530717958647693f;
    int quarter = (int)(4 * v + 0.5f);
    float s, c;
    trig_small(two_pi * (v - 0.25f * (float)quarter), &s, &c);
    float along = quarter & 1 ? s : c, across = quarter & 1 ? c : s;
    *cosine = (quarter + 1) & 2 ? -along : along;
    *sine = quarter & 2 ? -across : across;
}

#endif
