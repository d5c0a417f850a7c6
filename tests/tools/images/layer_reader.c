#include "layer_reader.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <zlib.h>

#include <cmocka.h>

/* Letters as in tools/images/pixel_codec.h. */

/* Undoes zz() of the pixel's bytes, which are a plane apart. */
static long unzigzag(const uint8_t *low, size_t pixels, size_t i, int bytes)
{
    long u = low[i] + 256L * low[pixels + i] + (bytes == 3 ? 65536L * low[2 * pixels + i] : 0);
    return u % 2 == 0 ? u / 2 : -(u + 1) / 2;
}

static double twelfths(long k)
{
    long octaves = (long)floor((double)k / 12);
    return round(4096 * pow(2, (double)(k - 12 * octaves) / 12)) / 4096 * pow(2, (double)octaves);
}

/* s of the format, from the interleaved values decoded so far. */
static double spatial(const double *value, size_t i, size_t w, size_t channel, int slope)
{
#define AT(j) value[3 * (j) + channel]
    size_t x = i % w;
    if (i == 0)
        return 0;
    if (i < w)
        return AT(i - 1);
    if (x == 0)
        return AT(i - w);
    if (slope)
        return (AT(i - 1) + AT(i - w)) - AT(i - w - 1);
    if (x == w - 1)
        return ((AT(i - 1) + AT(i - w - 1)) + AT(i - w)) / 3;
    return ((AT(i - 1) + AT(i - w - 1)) + (AT(i - w) + AT(i - w + 1))) / 4;
#undef AT
}

struct layer_numbers layer_read(const uint8_t *bytes, size_t size, int width, int height)
{
    size_t w = (size_t)width, pixels = w * (size_t)height;
    uLongf length = (uLongf)(1 + 23 * pixels);
    uint8_t *raw = malloc(length);
    assert_non_null(raw);
    assert_int_equal(uncompress(raw, &length, bytes, (uLong)size), Z_OK);
    assert_true(length == 1 + 18 * pixels || length == 1 + 22 * pixels);
    assert_true(raw[0] <= 1);
    struct layer_numbers l = {calloc(3 * pixels, sizeof(double)),
                              calloc(3 * pixels, sizeof(double)), NULL};
    long *s = calloc(3 * pixels, sizeof *s);
    assert_true(l.value != NULL && l.error != NULL && s != NULL);
    const uint8_t *at = raw + 1;
    for (size_t c = 0; c < 3; c++, at += 2 * pixels)
        for (size_t i = 0; i < pixels; i++) {
            size_t x = i % w;
            long p = 0;
            if (c > 0)
                p = s[3 * i + c - 1] + (x > 0 ? s[3 * i - 3 + c] - s[3 * i - 3 + c - 1] : 0);
            else if (x > 0 && i >= w)
                p = (long)floor((double)(s[3 * i - 3] + s[3 * (i - w)]) / 2);
            else if (i > 0)
                p = x > 0 ? s[3 * i - 3] : s[3 * (i - w)];
            long now = s[3 * i + c] = p + unzigzag(at, pixels, i, 2);
            assert_true(now >= 0 && now < 8192);
            l.error[3 * i + c] = now == 0 ? 0 : pow(2, (double)(now - 4096) / 12);
        }
    const uint8_t *d_plane = at;
    at += 3 * pixels;
    for (size_t c = 0; c < 3; c++, at += 3 * pixels) {
        int d = 0;
        for (size_t i = 0; i < pixels; i++) {
            long now = s[3 * i + c];
            d = ((i % w > 0 ? d : 0) + d_plane[c * pixels + i]) % 256;
            int e = now == 0 ? d - 128 : (int)floor((double)(now - 4096) / 12) - 3 + d;
            double p = spatial(l.value, i, w, c, raw[0]);
            if (c > 0) {
                double before = spatial(l.value, i, w, c - 1, raw[0]);
                long other = s[3 * i + c - 1];
                double r = now != 0 && other != 0 ? twelfths(now - other)
                           : before != 0          ? p / before
                                                  : 0;
                p += (l.value[3 * i + c - 1] - before) * r;
            }
            double q = fmin(fmax(floor(p / pow(2, e) + 0.5), -1048575), 1048575);
            q += (double)unzigzag(at, pixels, i, 3);
            assert_true(fabs(q) <= 1048576);
            l.value[3 * i + c] = q * pow(2, e);
        }
    }
    if (at < raw + length) {
        l.n = calloc(pixels, sizeof(double));
        assert_non_null(l.n);
        uint32_t n = 0;
        for (size_t i = 0; i < pixels; i++) {
            for (uint32_t b = 0; b < 4; b++)
                n += (uint32_t)at[b * pixels + i] << (8 * b);
            l.n[i] = n;
        }
    }
    free(raw);
    free(s);
    return l;
}

void layer_numbers_free(struct layer_numbers *l)
{
    free(l->value);
    free(l->error);
    free(l->n);
}
