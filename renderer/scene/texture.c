#include "texture.h"

/* Beyond this many images from the first, float32 tells no texels apart. */
#define FAR_OUT 1e7f

/* Coordinate x of n texels, folded into the image: 0 .. n, but for TEXTURE_BORDER, which may leave it. */
static float folded(float x, int n, enum texture_wrap wrap)
{
    x = minf(maxf(x, -FAR_OUT), FAR_OUT); /* of NaN, too */
    switch (wrap) {
    case TEXTURE_WRAP: x -= floorf(x); break;
    case TEXTURE_MIRROR:
        x -= 2 * floorf(0.5f * x);
        x = x > 1 ? 2 - x : x;
        break;
    case TEXTURE_CLAMP: x = minf(1, maxf(0, x)); break;
    case TEXTURE_BORDER: x = minf(2, maxf(-1, x)); break;
    }
    return x * (float)n;
}

/* The texel of number i, which may be one off the edge (border: n off); -1: none. A mirrored neighbour of the outermost texel is
 * that texel. */
static int neighbour(int i, int n, enum texture_wrap wrap)
{
    if (i >= 0 && i < n)
        return i;
    if (wrap == TEXTURE_BORDER)
        return -1;
    if (wrap == TEXTURE_WRAP)
        return i < 0 ? n - 1 : 0;
    return i < 0 ? 0 : n - 1;
}

static rgb texel(const struct texture *t, int i, int j)
{
    if (i < 0 || j < 0)
        return grey(0);
    const float *p = t->texel + 3 * ((size_t)j * (size_t)t->width + (size_t)i);
    return (rgb){p[0], p[1], p[2]};
}

/* Texels to both sides of a coordinate, and the share of the second. */
struct between {
    int texel[2];
    float share;
};

static struct between place(float x, int n, enum texture_wrap wrap, bool nearest)
{
    float at = folded(x, n, wrap) - (nearest ? 0 : 0.5f), low = floorf(at);
    /* The far edge itself belongs to the last texel. */
    if (nearest && wrap != TEXTURE_BORDER)
        low = minf(low, (float)(n - 1));
    int i = (int)low, next = i + 1;
    return (struct between){{neighbour(i, n, wrap), neighbour(next, n, wrap)}, at - low};
}

static rgb mix(rgb a, rgb b, float share)
{
    return rgb_add(rgb_scale(a, 1 - share), rgb_scale(b, share));
}

rgb texture_lookup(const struct texture *t, struct uv at)
{
    const struct between x = place(at.u, t->width, t->wrap[0], t->nearest);
    /* Rows come from the top. */
    const struct between y = place(1 - at.v, t->height, t->wrap[1], t->nearest);
    rgb first = texel(t, x.texel[0], y.texel[0]);
    if (t->nearest)
        return first;
    return mix(mix(first, texel(t, x.texel[1], y.texel[0]), x.share),
               mix(texel(t, x.texel[0], y.texel[1]), texel(t, x.texel[1], y.texel[1]), x.share),
               y.share);
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
    /* Rows of triangles that stand, and between them of triangles that hang. */
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

/* NaN, once met, stays. */
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
