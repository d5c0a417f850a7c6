/* Exponential and error function by short polynomials, so that a lane has the same bits at any vector width. Relative
 * errors below 3e-7 and 6e-7. */
#ifndef ASSAY_EXP_H
#define ASSAY_EXP_H

#include "simd.h"

/* e^x for x <= 0, as 2^n e^r with |r| <= ln(2)/2 (coefficients of [Moshier92]); 0 below -87, about where normal floats
 * end. */
INLINE vf exp_negative(vf x)
{
    const vf least = vf_set(-87);
    vf y = vf_max(x, least);
    vi n = vi_truncate(1.44269504088896341f * y - 0.5f);
    vf r = y - 0.693359375f * vf_of_int(n) + 2.12194440e-4f * vf_of_int(n), z = r * r;
    vf p = 1.9875691500e-4f * r + 1.3981999507e-3f;
    p = ((p * r + 8.3334519073e-3f) * r + 4.1665795894e-2f) * r;
    p = ((p + 1.6666665459e-1f) * r + 5.0000001201e-1f) * z + r + 1;
    return vf_select(vf_lt(x, least), vf_set(0), p * as_vf((n + 127) << 23));
}

/* e^(x^2) erfc(x) for x >= 0, the scaled complementary error function: a polynomial in s = 1/(1 + x/2),
 * fitted for the least relative error by Remez's algorithm. */
INLINE vf exp_erfcx(vf x)
{
    vf s = 1 / (1 + 0.5f * x);
    vf p = 0.0644610022f - 0.0255227865f * s;
    p = ((p * s + 0.0307543938f) * s - 0.198550241f) * s;
    p = ((p + 0.0794701138f) * s + 0.058261221f) * s;
    p = ((p + 0.180414976f) * s + 0.246512195f) * s;
    return ((p + 0.28210422f) * s + 0.282094747f) * s;
}

#endif
