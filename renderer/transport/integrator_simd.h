/* The stages of the integrator on as many paths at a time as there are lanes, compiled once for each instruction set: one
 * for ISA_SCALAR, else eight. Every path gets the same bits. */
#ifndef ASSAY_INTEGRATOR_SIMD_H
#define ASSAY_INTEGRATOR_SIMD_H

#include "film.h"
#include "integrator.h"
#include "renderer/base/isa.h"

struct lanes_kernel {
    /* integrate() */
    void (*integrate)(const struct integrator *it, struct batch *b, int num_lanes);
    /* Adds the radiance of lane i of a batch to pixel[i]. first: these pixels have no sample yet. */
    void (*film_add)(struct film *f, const size_t *pixel, int num_lanes, const struct batch *b,
                     bool first);
};

extern const struct lanes_kernel lanes_kernel_scalar, lanes_kernel_sse42, lanes_kernel_avx2,
    lanes_kernel_avx512;

#endif
