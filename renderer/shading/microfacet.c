#include "microfacet.h"

#include "renderer/math/warp.h"

#define SQRT_PI_F 1.77245385090551602730f

float microfacet_d(enum microfacet_kind kind, float alpha, vec3 m)
{
    if (m.z <= 0)
        return 0;
    float a2 = alpha * alpha, cos2 = m.z * m.z, sin2 = m.x * m.x + m.y * m.y;
    if (kind == MICROFACET_GGX) {
        /* cos^2 (a^2 - 1) + 1 in a form that keeps its digits for small alpha. */
        float e = sin2 + a2 * cos2;
        return a2 * INV_PI_F / (e * e);
    }
    float e = sin2 / (cos2 * a2);
    /* expf() is 0 there, and cos2 may be. */
    if (!(e < 100))
        return 0;
    return expf(-e) * INV_PI_F / (a2 * cos2 * cos2);
}

float microfacet_lambda(enum microfacet_kind kind, float alpha, vec3 w)
{
    float tan2 = (w.x * w.x + w.y * w.y) / (w.z * w.z);
    if (tan2 == 0)
        return 0;
    if (kind == MICROFACET_GGX)
        return 0.5f * (sqrtf(1 + alpha * alpha * tan2) - 1);
    float a = 1 / (alpha * sqrtf(tan2));
    return 0.5f * (expf(-a * a) / (a * SQRT_PI_F) - erfcf(a));
}

static float smith_g2(enum microfacet_kind kind, float alpha, bool separable, vec3 wo, vec3 wi)
{
    float lo = microfacet_lambda(kind, alpha, wo), li = microfacet_lambda(kind, alpha, wi);
    return separable ? 1 / ((1 + lo) * (1 + li)) : 1 / (1 + lo + li);
}

static float starter_lambda(float alpha, vec3 w)
{
    float tan2 = (w.x * w.x + w.y * w.y) / (w.z * w.z), a = 1 / (alpha * sqrtf(tan2));
    return tan2 > 0 ? 0.5f * (expf(-a * a) / (a * PI_F) - erfcf(a)) : 0;
}

float microfacet_g2(enum microfacet_kind kind, float alpha, bool separable, vec3 wo, vec3 wi)
{
    return kind == MICROFACET_BECKMANN_STARTER
               ? 1 / (1 + starter_lambda(alpha, wo) + starter_lambda(alpha, wi))
               : smith_g2(kind, alpha, separable, wo, wi);
}

/* Visible normals of a hemisphere seen from wo, stretched back [Heitz18, section 3]. */
static vec3 sample_ggx(float alpha, vec3 wo, float u, float v)
{
    vec3 w = normalize(v3(alpha * wo.x, alpha * wo.y, wo.z));
    float x, y;
    warp_disk(u, v, &x, &y);
    /* The half of the disk that the hemisphere's rim cuts off is squeezed onto the visible part. */
    float s = 0.5f * (1 + w.z);
    y = (1 - s) * sqrtf(maxf(0, 1 - x * x)) + s * y;
    float z = sqrtf(maxf(0, 1 - x * x - y * y));
    float l2 = w.x * w.x + w.y * w.y;
    vec3 t1 = l2 > 0 ? scale(v3(-w.y, w.x, 0), 1 / sqrtf(l2)) : v3(1, 0, 0);
    vec3 t2 = cross(w, t1);
    vec3 n = mad(mad(scale(t1, x), y, t2), z, w);
    return normalize(v3(alpha * n.x, alpha * n.y, maxf(1e-7f, n.z)));
}

/* Integral of (1 - s t) exp(-s^2) over s < x: the slopes towards a viewer at tan(theta) = t. */
static float slope_integral(float x, float t)
{
    return 0.5f * SQRT_PI_F * erfcf(-x) + 0.5f * t * expf(-x * x);
}

/* The slope at which that integral is the fraction u of all visible slopes; Newton's method inside a
 * shrinking bracket. t = 0 gives a normal variate of variance 1/2. */
static float sample_slope(float t, float u)
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

static vec3 sample_beckmann(float alpha, vec3 wo, float u, float v)
{
    vec3 w = v3(alpha * wo.x, alpha * wo.y, wo.z);
    float sin_w = sqrtf(w.x * w.x + w.y * w.y), t = sin_w / w.z;
    float c = sin_w > 0 ? w.x / sin_w : 1, s = sin_w > 0 ? w.y / sin_w : 0;
    float along = sample_slope(t, u), across = sample_slope(0, v);
    return normalize(v3(-alpha * (c * along - s * across), -alpha * (s * along + c * across), 1));
}

vec3 microfacet_sample(enum microfacet_kind kind, float alpha, vec3 wo, float u, float v)
{
    return kind == MICROFACET_GGX ? sample_ggx(alpha, wo, u, v) : sample_beckmann(alpha, wo, u, v);
}
