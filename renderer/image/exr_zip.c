#include "exr_zip.h"

#include <libdeflate.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__,
               "floats are written as they lie in memory");

/* Compression level. Noise compresses equally badly at every level; level 4 is fast on all other data, too. */
enum { LEVEL = 4 };

struct exr_zip {
    size_t width, channels;
    struct libdeflate_compressor *compressor;
    struct libdeflate_decompressor *decompressor;
    int *from;
    uint8_t *raw, *mixed, *packed;
    size_t room; /* of packed */
};

struct exr_zip *exr_zip_new(int width, int channels, const int *from, int rows)
{
    const size_t most = (size_t)rows * (size_t)width * (size_t)channels * sizeof(float);
    struct exr_zip *z = calloc(1, sizeof *z);
    if (z == NULL)
        return NULL;
    z->width = (size_t)width;
    z->channels = (size_t)channels;
    z->raw = malloc(most);
    z->mixed = malloc(most);
    bool ok = z->raw != NULL && z->mixed != NULL;
    if (from == NULL) {
        z->decompressor = libdeflate_alloc_decompressor();
        ok = ok && z->decompressor != NULL;
    } else { /* a megabyte, which a reader of many small files would spend its time on */
        z->compressor = libdeflate_alloc_compressor(LEVEL);
        z->room = libdeflate_zlib_compress_bound(z->compressor, most);
        z->packed = malloc(z->room);
        z->from = malloc(z->channels * sizeof *z->from);
        ok = ok && z->compressor != NULL && z->packed != NULL && z->from != NULL;
    }
    if (!ok) {
        exr_zip_free(z);
        return NULL;
    }
    if (from != NULL)
        memcpy(z->from, from, z->channels * sizeof *from);
    return z;
}

void exr_zip_free(struct exr_zip *z)
{
    if (z == NULL)
        return;
    libdeflate_free_compressor(z->compressor);
    libdeflate_free_decompressor(z->decompressor);
    free(z->from);
    free(z->raw);
    free(z->mixed);
    free(z->packed);
    free(z);
}

const void *exr_zip_rows(struct exr_zip *z, const float *rows, int num, size_t *size)
{
    const size_t width = z->width, channels = z->channels;
    const size_t length = (size_t)num * width * channels * sizeof(float);
    uint8_t *raw = z->raw, *even = z->mixed, *odd = z->mixed + length / 2;
    for (size_t row = 0; row < (size_t)num; row++)
        for (size_t c = 0; c < channels; c++) {
            const float *p = rows + row * width * channels + z->from[c];
            for (size_t x = 0; x < width; x++, raw += sizeof(float))
                memcpy(raw, p + x * channels, sizeof(float));
        }
    for (size_t i = 0; i < length / 2; i++) {
        even[i] = z->raw[2 * i];
        odd[i] = z->raw[2 * i + 1];
    }
    for (size_t i = length - 1; i > 0; i--)
        z->mixed[i] = (uint8_t)(z->mixed[i] - z->mixed[i - 1] + 128);
    *size = libdeflate_zlib_compress(z->compressor, z->mixed, length, z->packed, z->room);
    if (*size > 0 && *size < length)
        return z->packed;
    *size = length;
    return z->raw;
}

const float *exr_zip_unpack(struct exr_zip *z, const void *bytes, size_t size, int num)
{
    const size_t length = (size_t)num * z->width * z->channels * sizeof(float);
    const uint8_t *even = z->mixed, *odd = z->mixed + length / 2;
    uint8_t *raw = z->raw, last[2] = {128, 128};
    if (size == length)
        return memcpy(z->raw, bytes, size);
    if (libdeflate_zlib_decompress(z->decompressor, bytes, size, z->mixed, length, NULL) !=
        LIBDEFLATE_SUCCESS)
        return NULL;
    /* Differences run on from the last even byte to the first odd one. There is an even number of even bytes, so their
     * offsets of 128 add up to 0 modulo 256. */
    for (size_t i = 0; i < length / 2; i++)
        last[1] = (uint8_t)(last[1] + even[i]);
    for (size_t i = 0; i < length / 2; i++) {
        raw[2 * i] = last[0] = (uint8_t)(last[0] + even[i] - 128);
        raw[2 * i + 1] = last[1] = (uint8_t)(last[1] + odd[i] - 128);
    }
    return (const float *)(const void *)z->raw;
}
