#include "warp.h"

void warp_disk(float u, float v, float *x, float *y)
{
    float a = 2 * u - 1, b = 2 * v - 1, r, phi;
    if (a == 0 && b == 0) {
        *x = *y = 0;
        return;
    }
    if (fabsf(a) > fabsf(b)) {
        r = a;
        phi = 0.25f * PI_F * (b / a);
    } else {
        r = b;
        phi = 0.5f * PI_F - 0.25f * PI_F * (a / b);
    }
    *x = r * cosf(phi);
    *y = r * sinf(phi);
}

vec3 warp_cosine_hemisphere(float u, float v)
{
    float x, y;
    warp_disk(u, v, &x, &y);
    return v3(x, y, sqrtf(maxf(0, 1 - x * x - y * y)));
}

static vec3 from_height(float z, float v)
{
    float r = sqrtf(maxf(0, 1 - z * z)), phi = 2 * PI_F * v;
    return v3(r * cosf(phi), r * sinf(phi), z);
}

vec3 warp_uniform_hemisphere(float u, float v)
{
    return from_height(1 - u, v);
}

vec3 warp_uniform_sphere(float u, float v)
{
    return from_height(1 - 2 * u, v);
}

vec3 warp_uniform_cone(float u, float v, float one_minus_cos)
{
    /* 1 - z is formed first: a narrow cone would lose all its digits in z. */
    float h = u * one_minus_cos;
    float r = sqrtf(maxf(0, h * (2 - h))), phi = 2 * PI_F * v;
    return v3(r * cosf(phi), r * sinf(phi), 1 - h);
}

void warp_triangle(float u, float v, float *b1, float *b2)
{
    float s = sqrtf(u);
    *b1 = 1 - s;
    *b2 = v * s;
}
