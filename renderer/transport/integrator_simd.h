/* The stages of the integrator on eight paths at a time, compiled once for each instruction set. Every
 * path gets the bits that the scalar stages of integrator.c would give it. */
#ifndef ASSAY_INTEGRATOR_SIMD_H
#define ASSAY_INTEGRATOR_SIMD_H

#include "film.h"
#include "integrator.h"
#include "renderer/base/isa.h"

struct lanes_kernel {
    /* As integrate(), but for paths with DIRECT_HEMISPHERE. */
    void (*integrate)(const struct integrator *it, struct batch *b, int num_lanes);
    /* Adds lane i of a batch to pixel[i], as film_add() of a film without first hits. first: these pixels have no
     * sample yet. */
    void (*film_add)(struct film *f, const size_t *pixel, int num_lanes, const struct batch *b,
                     bool first);
};

extern const struct lanes_kernel lanes_kernel_sse42, lanes_kernel_avx2, lanes_kernel_avx512;

#endif
