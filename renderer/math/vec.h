/* Value types of the renderer and their inline arithmetic: points and directions (vec3), linear
 * Rec. 709 radiometric triples (rgb), rays and orthonormal frames. All float32, right-handed, Y up.
 */
#ifndef ASSAY_VEC_H
#define ASSAY_VEC_H

#include <math.h>
#include <stdbool.h>

#define PI_F     3.14159265358979323846f
#define INV_PI_F 0.31830988618379067154f

typedef struct {
    float x, y, z;
} vec3;

typedef struct {
    float r, g, b;
} rgb;

/* Parametric ray o + t d with d of unit length; only t in (tmin, tmax) counts as a hit. */
typedef struct {
    vec3 o, d;
    float tmin, tmax;
} ray;

/* One instruction each, unlike fminf and fmaxf; if either is NaN the second wins. */
static inline float minf(float a, float b)
{
    return a < b ? a : b;
}
static inline float maxf(float a, float b)
{
    return a > b ? a : b;
}

/* Right-handed orthonormal frame around a unit normal: s x t = n. */
typedef struct {
    vec3 s, t, n;
} frame;

static inline vec3 v3(float x, float y, float z)
{
    return (vec3){x, y, z};
}

#define HOW        static inline
#define NUMBER     float
#define VEC3       vec3
#define RGB        rgb
#define FRAME      frame
#define OF(name)   name
#define ROOT(x)    sqrtf(x)
#define SIGN_OF(x) copysignf(1.0f, x)
#include "vec_ops.h"

static inline float length(vec3 a)
{
    return sqrtf(dot(a, a));
}
static inline vec3 vmin(vec3 a, vec3 b)
{
    return (vec3){minf(a.x, b.x), minf(a.y, b.y), minf(a.z, b.z)};
}
static inline vec3 vmax(vec3 a, vec3 b)
{
    return (vec3){maxf(a.x, b.x), maxf(a.y, b.y), maxf(a.z, b.z)};
}

static inline rgb grey(float v)
{
    return (rgb){v, v, v};
}
static inline float rgb_max(rgb a)
{
    return maxf(a.r, maxf(a.g, a.b));
}
/* Rec. 709; in double, so that it is 0 for black only. */
static inline double rgb_luminance(rgb a)
{
    return 0.2126 * (double)a.r + 0.7152 * (double)a.g + 0.0722 * (double)a.b;
}
static inline bool rgb_is_zero(rgb a)
{
    return a.r == 0 && a.g == 0 && a.b == 0;
}

#endif
