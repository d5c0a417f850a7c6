#include "block_means.h"

#include <nettle/base64.h>
#include <stdlib.h>
#include <string.h>

static size_t values_of(const struct block_means *b)
{
    return 3 * (size_t)b->nx * (size_t)b->ny;
}

static int blocks_along(int pixels, int side)
{
    const int n = (pixels + side / 2) / side;
    return n > 0 ? n : 1;
}

static bool allocate(struct block_means *b, int width, int height, int side, int capacity,
                     struct err *e)
{
    *b = (struct block_means){.width = width,
                              .height = height,
                              .side = side,
                              .nx = blocks_along(width, side),
                              .ny = blocks_along(height, side),
                              .capacity = capacity};
    b->value = malloc(values_of(b) * (size_t)capacity * sizeof *b->value);
    return b->value != NULL || err_set(e, "out of memory for block means of %d images", capacity);
}

bool block_means_alloc(struct block_means *b, int width, int height, int tile, int capacity,
                       struct err *e)
{
    int side = 1;
    while (side * side < capacity && tile % (2 * side) == 0)
        side *= 2;
    return allocate(b, width, height, side, capacity, e);
}

void block_means_free(struct block_means *b)
{
    free(b->value);
    *b = (struct block_means){0};
}

static size_t block_at(int pixel, int side, int blocks)
{
    return (size_t)(pixel / side < blocks ? pixel / side : blocks - 1);
}

bool block_means_add(struct block_means *b, const float *pixels_rgb, struct err *e)
{
    const size_t values = values_of(b);
    double *sum = calloc(values, sizeof *sum);
    if (sum == NULL)
        return err_set(e, "out of memory for %zu block means", values);
    for (int y = 0; y < b->height; y++)
        for (int x = 0; x < b->width; x++, pixels_rgb += 3) {
            double *s = sum + 3 * (block_at(y, b->side, b->ny) * (size_t)b->nx +
                                   block_at(x, b->side, b->nx));
            for (int c = 0; c < 3; c++)
                s[c] += pixels_rgb[c];
        }
    float *out = b->value + values * (size_t)b->num++;
    for (size_t i = 0; i < values; i++)
        out[i] = (float)(sum[i] / (b->side * b->side));
    free(sum);
    return true;
}

json_t *block_means_to_json(const struct block_means *b)
{
    const size_t num = values_of(b) * (size_t)b->num, size = 4 * num;
    uint8_t *bytes = malloc(size);
    char *text = malloc(BASE64_ENCODE_RAW_LENGTH(size));
    json_t *json = NULL;
    if (bytes != NULL && text != NULL) {
        for (size_t i = 0; i < num; i++) {
            uint32_t bits;
            memcpy(&bits, &b->value[i], 4);
            for (size_t k = 0; k < 4; k++)
                bytes[4 * i + k] = (uint8_t)(bits >> 8 * k);
        }
        base64_encode_raw(text, size, bytes);
        json = json_pack("{s:i, s:o}", "side", b->side, "values",
                         json_stringn(text, BASE64_ENCODE_RAW_LENGTH(size)));
    }
    free(bytes);
    free(text);
    return json;
}

/* The bytes that base64 stands for, to free(); NULL: it is none, or out of memory. */
static uint8_t *decode(const char *text, size_t length, size_t *size)
{
    struct base64_decode_ctx ctx;
    uint8_t *bytes = malloc(BASE64_DECODE_LENGTH(length) + 1);
    *size = BASE64_DECODE_LENGTH(length);
    base64_decode_init(&ctx);
    if (bytes != NULL && base64_decode_update(&ctx, size, bytes, length, text) &&
        base64_decode_final(&ctx))
        return bytes;
    free(bytes);
    return NULL;
}

bool block_means_from_json(const json_t *json, int width, int height, struct block_means *b,
                           struct err *e)
{
    const json_t *side = json_object_get(json, "side"), *values = json_object_get(json, "values");
    const json_int_t pixels = json_integer_value(side);
    size_t size = 0;
    *b = (struct block_means){0};
    uint8_t *bytes = json_is_string(values) && pixels > 0 && pixels <= 1 << 16
                         ? decode(json_string_value(values), json_string_length(values), &size)
                         : NULL;
    const size_t one = 12 * (size_t)blocks_along(width, pixels > 0 ? (int)pixels : 1) *
                       (size_t)blocks_along(height, pixels > 0 ? (int)pixels : 1);
    if (bytes == NULL || size == 0 || size % one != 0 || size / one > 1 << 20) {
        free(bytes);
        return err_set(e, "its block means are none of images of %d x %d pixels", width, height);
    }
    const bool ok = allocate(b, width, height, (int)pixels, (int)(size / one), e);
    for (size_t i = 0; ok && i < size / 4; i++) {
        uint32_t bits = 0;
        for (size_t k = 0; k < 4; k++)
            bits |= (uint32_t)bytes[4 * i + k] << 8 * k;
        memcpy(&b->value[i], &bits, 4);
    }
    b->num = b->capacity;
    free(bytes);
    return ok;
}

bool block_means_pair(const struct block_means *a, const struct block_means *b,
                      struct moments *pairs, struct moments *mean, struct err *e)
{
    *pairs = *mean = (struct moments){0};
    if (a->width != b->width || a->height != b->height || a->side != b->side)
        return err_set(e,
                       "block means of %d x %d pixels in images of %d x %d, and of %d x %d in "
                       "images of %d x %d: these make no pairs",
                       a->side, a->side, a->width, a->height, b->side, b->side, b->width,
                       b->height);
    if (!moments_alloc(mean, b->nx, b->ny, e) || !moments_alloc(pairs, b->nx, b->ny, e)) {
        moments_free(mean);
        return false;
    }
    const size_t values = values_of(b);
    const int num = a->num < b->num ? a->num : b->num;
    for (int k = 0; k < b->num; k++)
        for (size_t i = 0; i < values; i++)
            mean->mean[i] += b->value[values * (size_t)k + i] / b->num;
    for (int k = 0; k < num; k++)
        for (size_t i = 0; i < values; i += 3) {
            double x[3];
            for (size_t c = 0; c < 3; c++) {
                const size_t at = values * (size_t)k + i + c;
                x[c] = mean->mean[i + c] + ((double)a->value[at] - (double)b->value[at]);
            }
            moments_add(pairs, i / 3, x);
        }
    moments_make_exact(mean);
    strcpy(pairs->unit, "replicate");
    bool varies = false;
    for (size_t i = 0; i < values; i++)
        varies |= pairs->m2[i] > 0;
    if (!varies)
        moments_make_exact(pairs);
    return true;
}
