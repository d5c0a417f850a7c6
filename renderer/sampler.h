/* Random numbers as a function: the value depends on (seed, pixel, sample, vertex, purpose) and on
 * nothing else, so threads, tiles and order of work cannot matter. The function is the
 * counter-based generator Philox4x32-10 [Salmon11]: the four indices are its counter, the seed its
 * key. */
#ifndef ASSAY_SAMPLER_H
#define ASSAY_SAMPLER_H

#include <stdint.h>

/* Four uniform numbers in [0, 1), multiples of 2^-24. */
struct sample4 {
    float u[4];
};

/* What the four numbers of one (pixel, sample, vertex) are for. Vertex 0 is the camera, vertex k+1
 * the k-th surface of the path. Direct-light sample i of a vertex uses PURPOSE_LIGHT + i. */
enum sampler_purpose {
    PURPOSE_CAMERA = 0, /* u[0..1] place in the pixel, u[2..3] place on the lens */
    PURPOSE_BSDF = 0,   /* u[0..1] direction, u[2] lobe, u[3] Russian roulette */
    PURPOSE_LIGHT = 1   /* u[0..1] place on the light or direction, u[2] which triangle */
};

/* The raw generator, `rounds` rounds (10 everywhere but in its test). */
void philox4x32(const uint32_t counter[4], const uint32_t key[2], int rounds, uint32_t out[4]);

struct sample4 sampler_get(uint64_t seed, uint32_t pixel, uint32_t sample, uint32_t vertex,
                           uint32_t purpose);

#endif
