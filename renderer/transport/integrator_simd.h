/* The integrator's stages, compiled once for each instruction set: one lane for ISA_SCALAR, eight for SSE4.2 and AVX2,
 * sixteen for AVX-512. Every path gets the same bits at every width. */
#ifndef ASSAY_INTEGRATOR_SIMD_H
#define ASSAY_INTEGRATOR_SIMD_H

#include "film.h"
#include "integrator.h"
#include "renderer/base/isa.h"

struct integrator_simd {
    /* integrator_run() */
    void (*integrate)(const struct integrator *it, struct batch *b, int num_lanes);
    /* Adds the radiance of lane i of a batch to pixel[i]. first: these pixels have no sample yet. */
    void (*film_add)(struct film *f, const size_t *pixel, int num_lanes, const struct batch *b,
                     bool first);
};

extern const struct integrator_simd integrator_simd_scalar, integrator_simd_sse42,
    integrator_simd_avx2, integrator_simd_avx512;

#endif
