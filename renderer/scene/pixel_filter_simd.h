/* Importance sampling of the pixel filter, by lanes. */
#ifndef ASSAY_PIXEL_FILTER_SIMD_H
#define ASSAY_PIXEL_FILTER_SIMD_H

#include "pixel_filter.h"
#include "renderer/math/simd.h"

/* Quantile function of f, from the table: the x, in pixels from the centre, below which the share u in [0,1) lies. x is
 * distributed as f, so that all samples have the same weight. Not for the box of one pixel. */
INLINE vf filter_places(const struct pixel_filter *f, vf u)
{
    enum { MANTISSA = 23 - PIXEL_FILTER_BITS };
    const vm left = vf_lt(u, vf_set(0.5f));
    const vi word = as_vi(vf_max(vf_select(left, u, 1 - u), vf_set(PIXEL_FILTER_LEAST)));
    const vi bin = (word >> MANTISSA) - PIXEL_FILTER_FIRST;
    const vf w = vf_of_int(word & ((1 << MANTISSA) - 1)) * (1.0f / (1 << MANTISSA));
    int32_t row[LANES];
    vf c[COLUMNS];
    vi_store_any(row, bin);
    gather_columns(f->cubic[0], PIXEL_FILTER_CUBIC, row, c);
    const vf x = ((c[3] * w + c[2]) * w + c[1]) * w + c[0];
    return vf_select(left, -x, x);
}

#endif
