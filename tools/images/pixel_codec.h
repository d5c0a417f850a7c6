/* An image's numbers, packed for the page: mean and standard error of every pixel and channel, as exact
 * as their noise warrants and no more. page_layer.js unpacks them.
 *
 * Precision. A value is stored as q 2^e, q whole, |q| <= 2^20, with e such that it is off by at most 1/16
 * of its own standard error or 2^-20 of itself, whichever is more. A standard error is stored in
 * twelfths of an octave, off by at most 3 %.
 *
 * Format: a zlib stream (RFC 1950) of byte planes, each a byte a pixel, row 0 at the top. Channels are in
 * the order R, G, B; neighbours are W (left), N (above), NW, NE; zz(i) is 2 i for i >= 0, else -2 i - 1.
 *   1 byte     predictor of values: 0 mean, 1 slope
 *   2 planes each of R, G, B   low and high byte of zz(S - P). S is 0 where there is no noise, else
 *              round(12 log2(standard error)) + 4096, 1 .. 8191. P of R: (W + N) >> 1, W in row 0, N in
 *              column 0, 0 in the first pixel; of G and B: S of the channel before, plus what W had more
 *              than W of the channel before (0 in column 0).
 *   1 plane each  D less its W (0 in column 0), mod 256. e = D - 128 where S = 0, else
 *              floor((S - 4096)/12) - 3 + D.
 *   3 planes each  bytes of zz(q - Q), lowest first; Q = floor(P/2^e + 1/2) within +-(2^20 - 1). P in R is
 *              the spatial prediction s from decoded values q 2^e, in this order of operations: mean:
 *              ((W + NW) + (N + NE))/4 (last column: ((W + NW) + N)/3), slope: (W + N) - NW; in row 0 it is
 *              W, in column 0 N, in the first pixel 0. In G and B, c and the channel before b:
 *              P = s_c + (value_b - s_b) r; r = 2^(k/12), k = S_c - S_b, as (table[k mod 12]/4096) 2^floor(k/12)
 *              with table[i] = round(4096 2^(i/12)), if both have noise; else s_c/s_b, 0 if s_b is 0.
 *   4 planes   n of the pixel, less its W (0 in the first pixel of all), mod 2^32, lowest byte first; only
 *              if n differs between pixels. */
#ifndef ASSAY_PIXEL_CODEC_H
#define ASSAY_PIXEL_CODEC_H

#include "renderer/image/moments.h"

#include <stdbool.h>

/* Packs m with an error of up to 2^coarser/16 of the standard errors. The caller frees *bytes. *uniform_n: all pixels
 * have the same n. Fails only out of memory. */
NODISCARD bool pixel_codec_encode(const struct moments *m, int coarser, uint8_t **bytes,
                                  size_t *size, bool *uniform_n, struct err *e);

/* Packs a map of numbers in [0, 1], NaN being 0, as round(128 sqrt(v)): steps of 0.0005 at 0.001, of 0.016 at 1. A zlib
 * stream of a byte a pixel, row 0 at the top, each less its left neighbour (0 in column 0), mod 256. *bytes belongs to the
 * caller (free()). Fails only out of memory. */
NODISCARD bool pixel_codec_encode_map(const float *map, int width, int height, uint8_t **bytes,
                                      size_t *size, struct err *e);

#endif
