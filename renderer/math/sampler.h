/* Random numbers (samplers) as a function: the value depends on (seed, pixel, sample, vertex,
 * purpose) and on nothing else, so threads, tiles and order of work cannot matter. Two functions of
 * that kind:
 *
 * Independent: the counter-based generator Philox4x32-10 [Salmon11]; the four indices are its
 * counter, the seed its key.
 *
 * Sobol: for each block (pixel, vertex, purpose) the samples 0, 1, 2, ... are points of one digital
 * sequence in 4 dimensions, under a nested uniform scrambling [Owen95] by a hash [Burley20].
 * Scrambles and order of the points come from hashes of the pixel under keys that Philox makes of
 * (seed, vertex, purpose), so the blocks of a path are padded and pixels are decorrelated. Each
 * number is uniform, but the samples of one pixel depend on each other: their variance is no measure
 * of the error of their mean. Guaranteed for samples k 2^m .. (k+1) 2^m - 1 of a block, for every
 * k:
 * - u[0..1] and u[2..3] are (0,m,2)-nets in base 2: one point in each box of area 2^-m;
 * - u[0..3] is a (0,m/2,4)-net in base 4 if m is even: one point in each box of volume 2^-m whose
 *   sides are powers of 1/4. */
#ifndef ASSAY_SAMPLER_H
#define ASSAY_SAMPLER_H

#include <stdint.h>

enum sampler_kind { SAMPLER_INDEPENDENT, SAMPLER_SOBOL };

struct sampler {
    enum sampler_kind kind;
    uint64_t seed;
};

/* Four uniform numbers in [0, 1), multiples of 2^-24. */
struct sample4 {
    float u[4];
};

/* What the four numbers of one (pixel, sample, vertex) are for. Vertex 0 is the camera, vertex k+1
 * the k-th surface of the path. Direct-light sample i of a vertex uses PURPOSE_LIGHT + i. */
enum sampler_purpose {
    PURPOSE_CAMERA = 0, /* u[0..1] place in the pixel, u[2..3] place on the lens */
    PURPOSE_BSDF = 0,   /* u[0..1] direction, u[2] lobe, u[3] Russian roulette */
    PURPOSE_LIGHT = 1   /* u[0..1] place, u[2] triangle, u[2..3] sky region, u[3] light */
};

/* The raw generator, `rounds` rounds (10 everywhere but in its test). */
void sampler_philox4x32(const uint32_t counter[4], const uint32_t key[2], int rounds,
                        uint32_t out[4]);

/* Independent numbers, where there is no choice of sampler. */
struct sample4 sampler_get(uint64_t seed, uint32_t pixel, uint32_t sample, uint32_t vertex,
                           uint32_t purpose);

struct sample4 sampler_draw(const struct sampler *s, uint32_t pixel, uint32_t sample,
                            uint32_t vertex, uint32_t purpose);

extern const char *const sampler_kind_names[]; /* by enum sampler_kind; ends with NULL */

#endif
