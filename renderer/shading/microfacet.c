#include "microfacet.h"

/* Integral of (1 - s t) exp(-s^2) over s < x: the slopes towards a viewer at tan(theta) = t. */
static float slope_integral(float x, float t)
{
    return 0.5f * MICROFACET_SQRT_PI * erfcf(-x) + 0.5f * t * expf(-x * x);
}

/* Newton's method inside a shrinking bracket. */
float microfacet_slope(float t, float u)
{
    float lo = -6, hi = t > 1.0f / 6 ? 1 / t : 6, all = slope_integral(hi, t), x = 0;
    x = x < hi ? x : 0.5f * (lo + hi);
    for (int i = 0; i < 30 && hi - lo > 1e-6f; i++) {
        float f = slope_integral(x, t) - u * all;
        if (f > 0)
            hi = x;
        else
            lo = x;
        float next = x - f / ((1 - x * t) * expf(-x * x));
        if (!(next > lo && next < hi))
            next = 0.5f * (lo + hi);
        if (fabsf(next - x) < 1e-6f)
            return next;
        x = next;
    }
    return x;
}
