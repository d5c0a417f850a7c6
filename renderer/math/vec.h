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

static inline vec3 v3(float x, float y, float z)
{
    return (vec3){x, y, z};
}
static inline vec3 add(vec3 a, vec3 b)
{
    return (vec3){a.x + b.x, a.y + b.y, a.z + b.z};
}
static inline vec3 sub(vec3 a, vec3 b)
{
    return (vec3){a.x - b.x, a.y - b.y, a.z - b.z};
}
static inline vec3 scale(vec3 a, float s)
{
    return (vec3){a.x * s, a.y * s, a.z * s};
}
static inline vec3 neg(vec3 a)
{
    return (vec3){-a.x, -a.y, -a.z};
}
/* a + s b */
static inline vec3 mad(vec3 a, float s, vec3 b)
{
    return (vec3){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}
static inline float dot(vec3 a, vec3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
static inline vec3 cross(vec3 a, vec3 b)
{
    return (vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline float length(vec3 a)
{
    return sqrtf(dot(a, a));
}
/* a must not be zero. */
static inline vec3 normalize(vec3 a)
{
    return scale(a, 1.0f / length(a));
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
static inline rgb rgb_add(rgb a, rgb b)
{
    return (rgb){a.r + b.r, a.g + b.g, a.b + b.b};
}
static inline rgb rgb_mul(rgb a, rgb b)
{
    return (rgb){a.r * b.r, a.g * b.g, a.b * b.b};
}
static inline rgb rgb_scale(rgb a, float s)
{
    return (rgb){a.r * s, a.g * s, a.b * s};
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

/* Right-handed orthonormal frame around a unit normal: s x t = n. */
typedef struct {
    vec3 s, t, n;
} frame;

/* n must be of unit length. Branch-free but for the sign of n.z [Duff17]. */
static inline frame frame_from_normal(vec3 n)
{
    float sign = copysignf(1.0f, n.z);
    float a = -1.0f / (sign + n.z);
    float b = n.x * n.y * a;
    return (frame){.s = {1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x},
                   .t = {b, sign + n.y * n.y * a, -n.y},
                   .n = n};
}
static inline vec3 frame_to_world(const frame *f, vec3 v)
{
    return mad(mad(scale(f->s, v.x), v.y, f->t), v.z, f->n);
}

#endif
