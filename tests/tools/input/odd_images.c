#include "odd_images.h"

#include <libdeflate.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static FILE *open_file(const char *path)
{
    FILE *f = fopen(path, "wb");
    if (f == NULL)
        abort();
    return f;
}

static void close_file(FILE *f)
{
    if (fclose(f) != 0)
        abort();
}

static void put_le(FILE *f, uint64_t v, int bytes)
{
    for (int i = 0; i < bytes; i++)
        fputc((int)(v >> 8 * i & 255), f);
}

static void put_be(uint8_t *out, uint32_t v)
{
    for (int i = 0; i < 4; i++)
        out[i] = (uint8_t)(v >> (24 - 8 * i));
}

static void put_text(FILE *f, const char *text)
{
    fwrite(text, 1, strlen(text) + 1, f);
}

static void put_attribute(FILE *f, const char *name, const char *type, uint64_t size)
{
    put_text(f, name);
    put_text(f, type);
    put_le(f, size, 4);
}

static void put_box(FILE *f, const char *name, struct odd_window w)
{
    put_attribute(f, name, "box2i", 16);
    put_le(f, (uint32_t)w.x, 4);
    put_le(f, (uint32_t)w.y, 4);
    put_le(f, (uint32_t)(w.x + w.width - 1), 4);
    put_le(f, (uint32_t)(w.y + w.height - 1), 4);
}

static uint32_t float_bits(float v)
{
    uint32_t bits;
    memcpy(&bits, &v, sizeof bits);
    return bits;
}

/* Normal numbers and 0 only. */
static uint32_t half_bits(float v)
{
    int exponent;
    double m = frexp(fabs((double)v), &exponent); /* m in [1/2, 1): 1.f x 2^(e-1) */
    if (v == 0)
        return 0;
    return (uint32_t)((v < 0) << 15 | (exponent + 14) << 10 | (int)ldexp(m - 0.5, 11));
}

void odd_exr(const char *path, int width, int height, const char *names, bool half, const float *v)
{
    struct odd_window whole = {0, 0, width, height};
    odd_exr_cropped(path, whole, whole, names, half, v);
}

void odd_exr_cropped(const char *path, struct odd_window data, struct odd_window shown,
                     const char *names, bool half, const float *v)
{
    FILE *f = open_file(path);
    int width = data.width, height = data.height;
    int channels = (int)strlen(names), bytes = half ? 2 : 4;
    put_le(f, 20000630, 4);
    put_le(f, 2, 4);
    put_attribute(f, "channels", "chlist", (uint64_t)(18 * channels + 1));
    for (int c = 0; c < channels; c++) {
        put_text(f, (char[2]){names[c], 0});
        put_le(f, half ? 1 : 2, 4); /* type */
        put_le(f, 0, 4);            /* pLinear and three bytes reserved */
        put_le(f, 1, 4);            /* sampling */
        put_le(f, 1, 4);
    }
    fputc(0, f);
    put_attribute(f, "compression", "compression", 1);
    fputc(0, f);
    put_box(f, "dataWindow", data);
    put_box(f, "displayWindow", shown);
    put_attribute(f, "lineOrder", "lineOrder", 1);
    fputc(0, f);
    put_attribute(f, "pixelAspectRatio", "float", 4);
    put_le(f, float_bits(1), 4);
    put_attribute(f, "screenWindowCenter", "v2f", 8);
    put_le(f, 0, 8);
    put_attribute(f, "screenWindowWidth", "float", 4);
    put_le(f, float_bits(1), 4);
    fputc(0, f);
    uint64_t line = (uint64_t)(width * channels * bytes),
             first = (uint64_t)ftell(f) + 8u * (unsigned)height;
    for (int y = 0; y < height; y++)
        put_le(f, first + (uint64_t)y * (8 + line), 8);
    for (int y = 0; y < height; y++) {
        put_le(f, (uint32_t)(data.y + y), 4);
        put_le(f, line, 4);
        for (int c = 0; c < channels; c++)
            for (int x = 0; x < width; x++) {
                float p = v[(y * width + x) * channels + c];
                put_le(f, half ? half_bits(p) : float_bits(p), bytes);
            }
    }
    close_file(f);
}

static void put_chunk(FILE *f, const char *type, const uint8_t *data, size_t n)
{
    uint8_t *chunk = malloc(n + 12);
    if (chunk == NULL)
        abort();
    put_be(chunk, (uint32_t)n);
    memcpy(chunk + 4, type, 4);
    if (n > 0)
        memcpy(chunk + 8, data, n);
    put_be(chunk + 8 + n, libdeflate_crc32(0, chunk + 4, n + 4));
    fwrite(chunk, 1, n + 12, f);
    free(chunk);
}

void odd_png(const char *path, int width, int height, int channels, int bits, const uint16_t *code)
{
    FILE *f = open_file(path);
    fwrite("\x89PNG\r\n\x1a\n", 1, 8, f);
    uint8_t head[13] = {0};
    put_be(head, (uint32_t)width);
    put_be(head + 4, (uint32_t)height);
    head[8] = (uint8_t)bits;
    head[9] = channels == 1 ? 0 : channels == 3 ? 2 : 6;
    put_chunk(f, "IHDR", head, sizeof head);
    size_t bytes = (size_t)bits / 8, line = 1 + (size_t)(width * channels) * bytes;
    size_t n = line * (size_t)height;
    uint8_t *raw = calloc(n, 1), *data = malloc(libdeflate_zlib_compress_bound(NULL, n));
    struct libdeflate_compressor *zlib = libdeflate_alloc_compressor(1);
    if (raw == NULL || data == NULL || zlib == NULL)
        abort();
    for (int y = 0; y < height; y++)
        for (int i = 0; i < width * channels; i++) {
            uint16_t v = code[y * width * channels + i];
            uint8_t *at = raw + (size_t)y * line + 1 + (size_t)i * bytes;
            if (bits == 16)
                *at++ = (uint8_t)(v >> 8);
            *at = (uint8_t)v;
        }
    size_t packed =
        libdeflate_zlib_compress(zlib, raw, n, data, libdeflate_zlib_compress_bound(zlib, n));
    libdeflate_free_compressor(zlib);
    if (packed == 0)
        abort();
    put_chunk(f, "IDAT", data, packed);
    put_chunk(f, "IEND", NULL, 0);
    free(raw);
    free(data);
    close_file(f);
}

void odd_hdr(const char *path, int width, int height, const uint8_t (*rgbe)[4])
{
    FILE *f = open_file(path);
    fprintf(f, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n", height, width);
    fwrite(rgbe, 4, (size_t)(width * height), f);
    close_file(f);
}

void odd_pfm(const char *path, int width, int height, const float *v)
{
    FILE *f = open_file(path);
    fprintf(f, "PF\n%d %d\n-1.0\n", width, height);
    for (int y = height - 1; y >= 0; y--)
        for (int i = 0; i < 3 * width; i++)
            put_le(f, float_bits(v[3 * width * y + i]), 4);
    close_file(f);
}

void odd_file(const char *path, const char *text)
{
    FILE *f = open_file(path);
    fwrite(text, 1, strlen(text), f);
    close_file(f);
}
