#include "warp.h"

#include "trig.h"

void warp_disk(float u, float v, float *x, float *y)
{
    float a = 2 * u - 1, b = 2 * v - 1, s, c;
    if (a == 0 && b == 0) {
        *x = *y = 0;
        return;
    }
    /* Within an eighth of a turn from the nearer axis. */
    bool near_x = fabsf(a) > fabsf(b);
    float r = near_x ? a : b;
    trig_small(0.25f * PI_F * (near_x ? b / a : a / b), &s, &c);
    *x = r * (near_x ? c : s);
    *y = r * (near_x ? s : c);
}

vec3 warp_cosine_hemisphere(float u, float v)
{
    float x, y;
    warp_disk(u, v, &x, &y);
    return v3(x, y, sqrtf(maxf(0, 1 - x * x - y * y)));
}

static vec3 from_height(float z, float v)
{
    float r = sqrtf(maxf(0, 1 - z * z)), sine, cosine;
    trig_turn(v, &sine, &cosine);
    return v3(r * cosine, r * sine, z);
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
    float r = sqrtf(maxf(0, h * (2 - h))), sine, cosine;
    trig_turn(v, &sine, &cosine);
    return v3(r * cosine, r * sine, 1 - h);
}

void warp_triangle(float u, float v, float *b1, float *b2)
{
    float s = sqrtf(u);
    *b1 = 1 - s;
    *b2 = v * s;
}
