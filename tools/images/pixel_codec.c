#include "pixel_codec.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <libdeflate.h>

enum { LEVEL = 6, OFFSET = 4096, STEPS = 12, LARGEST = 1 << 20 };

static const double octave[STEPS] = {4096, 4340, 4598, 4871, 5161, 5468,
                                     5793, 6137, 6502, 6889, 7298, 7732};

struct coder {
    const struct moments *m;
    size_t pixels;
    double *value[3]; /* as the decoder will reconstruct them */
    int *noise[3];    /* S */
    uint8_t *plane;   /* where the next plane goes */
    bool slope;
    int coarser; /* octaves, on top of 1/16 of the standard error */
};

static unsigned zigzag(int i)
{
    return i >= 0 ? 2 * (unsigned)i : 2 * (unsigned)-(i + 1) + 1;
}

/* Stores the lowest `bytes` bytes of v at element i of as many planes. */
static void put(struct coder *c, size_t i, uint32_t v, size_t bytes)
{
    for (size_t b = 0; b < bytes; b++)
        c->plane[b * c->pixels + i] = (uint8_t)(v >> 8 * b);
}

static int floor_div(int a, int b)
{
    return a >= 0 ? a / b : -((b - 1 - a) / b);
}

static int noise_code(const struct moments *m, size_t pixel, int channel)
{
    double variance = moments_var_of_mean(m, pixel, channel);
    if (!(variance > 0))
        return 0;
    double s = rint(STEPS / 2.0 * log2(variance)) + OFFSET;
    return (int)fmin(fmax(s, 1), 2 * OFFSET - 1);
}

static void encode_noise(struct coder *c)
{
    size_t w = (size_t)c->m->width;
    for (int k = 0; k < 3; k++, c->plane += 2 * c->pixels) {
        int *s = c->noise[k];
        const int *before = k > 0 ? c->noise[k - 1] : NULL;
        for (size_t i = 0; i < c->pixels; i++) {
            int p = 0;
            s[i] = noise_code(c->m, i, k);
            if (before != NULL)
                p = before[i] + (i % w > 0 ? s[i - 1] - before[i - 1] : 0);
            else if (i % w > 0)
                p = i >= w ? (s[i - 1] + s[i - w]) >> 1 : s[i - 1];
            else if (i >= w)
                p = s[i - w];
            put(c, i, zigzag(s[i] - p), 2);
        }
    }
}

/* e of one value: the largest that is exact enough. */
static int exponent(double value, int noise, int coarser)
{
    int by_value = value != 0 ? ilogb(value) - 19 : -128;
    int by_noise = noise != 0 ? floor_div(noise - OFFSET, STEPS) - 3 + coarser : -128;
    int e = by_value > by_noise ? by_value : by_noise;
    return e < -128 ? -128 : e > 127 ? 127 : e;
}

static double spatial(const struct coder *c, int channel, size_t i)
{
    const double *v = c->value[channel];
    size_t w = (size_t)c->m->width, x = i % w;
    if (i == 0)
        return 0;
    if (i < w)
        return v[i - 1];
    if (x == 0)
        return v[i - w];
    if (c->slope)
        return (v[i - 1] + v[i - w]) - v[i - w - 1];
    if (x + 1 == w)
        return ((v[i - 1] + v[i - w - 1]) + v[i - w]) / 3;
    return ((v[i - 1] + v[i - w - 1]) + (v[i - w] + v[i - w + 1])) / 4;
}

/* r: the factor by which the previous channel's deviation from its prediction is carried over to
 * this one. */
static double carry(int noise, int noise_before, double s, double s_before)
{
    if (noise != 0 && noise_before != 0) {
        int k = noise - noise_before, octaves = floor_div(k, STEPS);
        return ldexp(octave[k - STEPS * octaves] / 4096, octaves);
    }
    return s_before != 0 ? s / s_before : 0;
}

/* The D planes, then the q planes, of all channels; needs encode_noise(). */
static void encode_values(struct coder *c)
{
    size_t w = (size_t)c->m->width;
    uint8_t *d_plane = c->plane;
    c->plane += 3 * c->pixels;
    for (int k = 0; k < 3; k++, d_plane += c->pixels, c->plane += 3 * c->pixels) {
        uint8_t left = 0;
        for (size_t i = 0; i < c->pixels; i++) {
            double v = c->m->mean[3 * i + (size_t)k];
            int noise = c->noise[k][i];
            int base = noise != 0 ? floor_div(noise - OFFSET, STEPS) - 3 : -128;
            int e = exponent(v, noise, c->coarser);
            uint8_t d = (uint8_t)(e - base);
            if (i % w == 0)
                left = 0;
            if (v == 0 && noise == 0 && i % w > 0) /* any e will do */
                d = left, e = d - 128;
            d_plane[i] = (uint8_t)(d - left);
            left = d;

            double p = spatial(c, k, i);
            if (k > 0) {
                double before = spatial(c, k - 1, i);
                double r = carry(noise, c->noise[k - 1][i], p, before);
                p = p + (c->value[k - 1][i] - before) * r;
            }
            double q = rint(ldexp(v, -e)), limit = LARGEST - 1;
            q = fmin(fmax(q, -LARGEST), LARGEST);
            p = fmin(fmax(floor(ldexp(p, -e) + 0.5), -limit), limit);
            put(c, i, zigzag((int)q - (int)p), 3);
            c->value[k][i] = ldexp(q, e);
        }
    }
}

static void encode_counts(struct coder *c)
{
    uint32_t left = 0;
    for (size_t i = 0; i < c->pixels; i++) {
        uint32_t n = (uint32_t)fmin(c->m->n[i], 4294967295.0);
        put(c, i, n - left, 4);
        left = n;
    }
    c->plane += 4 * c->pixels;
}

static bool pack(const uint8_t *raw, size_t length, uint8_t **bytes, size_t *size, struct err *e)
{
    struct libdeflate_compressor *c = libdeflate_alloc_compressor(LEVEL);
    const size_t room = c != NULL ? libdeflate_zlib_compress_bound(c, length) : 0;
    *bytes = c != NULL ? malloc(room) : NULL;
    if (*bytes != NULL)
        *size = libdeflate_zlib_compress(c, raw, length, *bytes, room);
    libdeflate_free_compressor(c);
    return *bytes != NULL || err_set(e, "out of memory for the report");
}

/* The planes of c with one predictor, compressed. */
static bool encode(struct coder *c, uint8_t *raw, bool slope, bool uniform_n, uint8_t **bytes,
                   size_t *size, struct err *e)
{
    c->slope = slope;
    raw[0] = slope;
    c->plane = raw + 1;
    encode_noise(c);
    encode_values(c);
    if (!uniform_n)
        encode_counts(c);
    return pack(raw, (size_t)(c->plane - raw), bytes, size, e);
}

bool pixel_codec_encode(const struct moments *m, int coarser, uint8_t **bytes, size_t *size,
                        bool *uniform_n, struct err *e)
{
    struct coder c = {.m = m, .pixels = (size_t)m->width * (size_t)m->height, .coarser = coarser};
    uint8_t *raw = malloc(1 + 22 * c.pixels), *other = NULL;
    double *value = malloc(3 * c.pixels * sizeof *value);
    int *noise = malloc(3 * c.pixels * sizeof *noise);
    bool ok = raw != NULL && value != NULL && noise != NULL;
    *uniform_n = true;
    for (size_t i = 1; i < c.pixels; i++)
        *uniform_n &= m->n[i] == m->n[0];
    for (size_t k = 0; ok && k < 3; k++) {
        c.value[k] = value + k * c.pixels;
        c.noise[k] = noise + k * c.pixels;
    }
    size_t other_size = 0;
    ok = ok ? encode(&c, raw, false, *uniform_n, bytes, size, e)
            : err_set(e, "out of memory for the report");
    if (ok && encode(&c, raw, true, *uniform_n, &other, &other_size, e)) {
        bool better = other_size < *size;
        free(better ? *bytes : other);
        *bytes = better ? other : *bytes;
        *size = better ? other_size : *size;
    } else if (ok) {
        free(*bytes);
        ok = false;
    }
    free(raw);
    free(value);
    free(noise);
    return ok;
}

bool pixel_codec_encode_map(const float *map, int width, int height, uint8_t **bytes, size_t *size,
                            struct err *e)
{
    size_t w = (size_t)width, pixels = w * (size_t)height;
    uint8_t *raw = malloc(pixels), left = 0;
    if (raw == NULL)
        return err_set(e, "out of memory for the report");
    for (size_t i = 0; i < pixels; i++) {
        uint8_t q = (uint8_t)lrintf(128 * sqrtf(fminf(fmaxf(map[i], 0), 1)));
        raw[i] = (uint8_t)(q - (i % w > 0 ? left : 0));
        left = q;
    }
    bool ok = pack(raw, pixels, bytes, size, e);
    free(raw);
    return ok;
}
