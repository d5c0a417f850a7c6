#include "texture.h"

#include <stdint.h>

/* Coordinates are clamped to this: further out, float32 tells no texels apart. */
#define FAR_OUT 1e7f

/* Vectors hold u, v, u, v. No branches on the wrap modes, which differ unpredictably from look-up to look-up. */
typedef float f4 __attribute__((vector_size(16)));
typedef int32_t i4 __attribute__((vector_size(16)));

/* Coordinates are clamped to lo .. hi, then whole periods are subtracted (period 0: none), then what is above `fold` is
 * mirrored about 1; the result is in 0 .. 1 except for TEXTURE_BORDER. With the last texel's number `last`, a texel
 * before the first becomes (last & before) | none, one after the last (last & behind) | none; -1 is no texel. The
 * mirror image of the outermost texel is that texel. */
static const struct {
    float lo, hi, period, inverse, fold;
    int32_t before, behind, none;
} wraps[] = {[TEXTURE_WRAP] = {-FAR_OUT, FAR_OUT, 1, 1, 2, -1, 0, 0},
             [TEXTURE_MIRROR] = {-FAR_OUT, FAR_OUT, 2, 0.5f, 1, 0, -1, 0},
             [TEXTURE_CLAMP] = {0, 1, 0, 0, 2, 0, -1, 0},
             [TEXTURE_BORDER] = {-1, 2, 0, 0, 2, 0, 0, -1}};
#define OF_BOTH(m)                                                                                 \
    {                                                                                              \
        wraps[w[0]].m, wraps[w[1]].m, wraps[w[0]].m, wraps[w[1]].m                                 \
    }

static inline i4 select4(i4 mask, i4 yes, i4 no)
{
    return (yes & mask) | (no & ~mask);
}

static inline f4 floor4(f4 x)
{
    f4 whole = __builtin_convertvector(__builtin_convertvector(x, i4), f4);
    return whole + __builtin_convertvector(whole > x, f4);
}

static rgb texel(const struct texture *t, int i, int j)
{
    if (i < 0 || j < 0)
        return grey(0);
    const float *p = t->texel + 3 * ((size_t)j * (size_t)t->width + (size_t)i);
    return (rgb){p[0], p[1], p[2]};
}

/* Column to the left, row above, column to the right, row below a place; share[0] and share[1]: weights of the
 * latter two. */
struct between {
    i4 texel;
    f4 share;
};

static inline struct between place(const struct texture *t, struct uv uv)
{
    const enum texture_wrap *w = t->wrap;
    const int32_t right = t->width - 1, bottom = t->height - 1;
    const f4 lo = OF_BOTH(lo), hi = OF_BOTH(hi), period = OF_BOTH(period);
    const f4 inverse = OF_BOTH(inverse), fold = OF_BOTH(fold);
    const i4 before = OF_BOTH(before), behind = OF_BOTH(behind), none = OF_BOTH(none);
    const i4 last = {right, bottom, right, bottom}, second = {0, 0, 1, 1};
    f4 x = {uv.u, 1 - uv.v, uv.u, 1 - uv.v}; /* rows come from the top */
    x = (f4)select4(x > lo, (i4)x, (i4)lo);  /* NaN: lo */
    x = (f4)select4(x < hi, (i4)x, (i4)hi);
    x -= period * floor4(inverse * x);
    x = (f4)select4(x > fold, (i4)(2 - x), (i4)x);
    x = x * __builtin_convertvector(last + 1, f4) - (t->nearest ? 0 : 0.5f);
    f4 low = floor4(x);
    /* The far edge itself belongs to the last texel. */
    i4 i = __builtin_convertvector(low, i4);
    i = select4((i > last) & ~none, last, i) + second;
    i = select4(i > last, (last & behind) | none, select4(i < 0, (last & before) | none, i));
    return (struct between){i, x - low};
}

static rgb mix(rgb a, rgb b, float share)
{
    return rgb_add(rgb_scale(a, 1 - share), rgb_scale(b, share));
}

rgb texture_lookup(const struct texture *t, struct uv at)
{
    const struct between b = place(t, at);
    rgb first = texel(t, b.texel[0], b.texel[1]);
    if (t->nearest)
        return first;
    return mix(mix(first, texel(t, b.texel[2], b.texel[1]), b.share[0]),
               mix(texel(t, b.texel[0], b.texel[3]), texel(t, b.texel[2], b.texel[3]), b.share[0]),
               b.share[1]);
}

rgb texture_on_triangle(const struct texture *t, const struct uv c[3], float b1, float b2)
{
    struct uv at = {c[0].u + b1 * (c[1].u - c[0].u) + b2 * (c[2].u - c[0].u),
                    c[0].v + b1 * (c[1].v - c[0].v) + b2 * (c[2].v - c[0].v)};
    return texture_lookup(t, at);
}

/* Texels along the longer side of the box around a triangle. */
static float texels_across(const struct texture *t, const struct uv c[3])
{
    float u = maxf(c[0].u, maxf(c[1].u, c[2].u)) - minf(c[0].u, minf(c[1].u, c[2].u));
    float v = maxf(c[0].v, maxf(c[1].v, c[2].v)) - minf(c[0].v, minf(c[1].v, c[2].v));
    return maxf(u * (float)t->width, v * (float)t->height);
}

double texture_mean_luminance(const struct texture *t, const struct uv c[3], rgb factor)
{
    enum { MOST = 64 };
    const float across = texels_across(t, c);
    const int n = across < MOST ? 1 + (int)across : MOST;
    double sum = 0;
    /* Rows of upright triangles with inverted ones between them. */
    for (int i = 0; i < n; i++)
        for (int j = 0; i + j < n; j++) {
            const int parts = i + j + 1 < n ? 2 : 1;
            for (int part = 1; part <= parts; part++) {
                const float off = (float)part / 3;
                rgb c1 = texture_on_triangle(t, c, ((float)i + off) / (float)n,
                                             ((float)j + off) / (float)n);
                sum += (double)rgb_luminance(rgb_mul(factor, c1));
            }
        }
    return sum / (n * n);
}

static rgb extreme(const struct texture *t, float (*of)(float, float))
{
    rgb m = texel(t, 0, 0);
    for (size_t i = 0; i < (size_t)t->width * (size_t)t->height; i++) {
        const float *p = t->texel + 3 * i;
        m = (rgb){of(m.r, p[0]), of(m.g, p[1]), of(m.b, p[2])};
    }
    return m;
}

/* A running maximum or minimum that has met a NaN stays NaN. */
static float larger(float a, float b)
{
    return a > b || a != a ? a : b;
}

static float smaller(float a, float b)
{
    return a < b || a != a ? a : b;
}

rgb texture_max(const struct texture *t)
{
    return extreme(t, larger);
}

rgb texture_min(const struct texture *t)
{
    return extreme(t, smaller);
}
