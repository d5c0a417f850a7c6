/* Shared by the stages of integrator_simd.c. */
#ifndef ASSAY_PATHS_SIMD_H
#define ASSAY_PATHS_SIMD_H

#include "integrator.h"
#include "renderer/math/sampler_simd.h"
#include "renderer/shading/bsdf_simd.h"
#include "renderer/shading/light_simd.h"

static inline bool counts(const struct integrator *it, int bounces)
{
    return bounces >= it->opt.first_bounce && bounces <= it->opt.max_bounces;
}

INLINE void pick_v3(struct vec3s *a, int i, vec3v v, vi order)
{
    v3_store(a, i, v3v(pick(v.x, order), pick(v.y, order), pick(v.z, order)));
}

INLINE void pick_rgb(struct rgbs *a, int i, rgbv c, vi order)
{
    rgb_store(a, i, (rgbv){pick(c.r, order), pick(c.g, order), pick(c.b, order)});
}

/* Which numbers to draw: the first `used` ones of `num` consecutive purposes of a vertex. */
struct draws {
    int vertex;
    uint32_t purpose;
    int num;  /* purposes, one after the other */
    int used; /* numbers, at least 2 */
};

INLINE void draw_rows(struct batch *b, enum sampler_kind kind, uint64_t seed, int first, int end,
                      const struct draws *what, int used)
{
    const struct philox_keys keys = philox_keys(seed);
    for (int i = 0; i < what->num; i++) {
        const uint32_t vertex = (uint32_t)what->vertex, purpose = what->purpose + (uint32_t)i;
        struct sobol_keys block = {0};
        if (kind == SAMPLER_SOBOL)
            block = sobol_keys(seed, vertex, purpose);
        for (int k = first, row = i; k < end; k += LANES, row += what->num) {
            vu pixel = (vu)vi_load_any(b->slot_pixel + k);
            vu sample = (vu)vi_load_any(b->slot_sample + k);
            vf u[4];
            drawv(kind, &keys, &block, pixel, sample, vertex, purpose, used, u);
            for (int d = 0; d < used; d++)
                vf_store_any(b->numbers[d] + LANES * row, u[d]);
        }
    }
}

/* Draws numbers for the lanes first .. end-1, LANES at a time, into rows of b->numbers. A separate loop, short enough
 * for the processor to overlap iterations. Every unused number of a Sobol point would cost time. */
static __attribute__((noinline)) void draw_numbers(const struct integrator *it, struct batch *b,
                                                   int first, int end, struct draws what)
{
    const uint64_t seed = it->opt.sampler.seed;
    if (it->opt.sampler.kind == SAMPLER_INDEPENDENT)
        draw_rows(b, SAMPLER_INDEPENDENT, seed, first, end, &what, 4);
    else if (what.used == 2)
        draw_rows(b, SAMPLER_SOBOL, seed, first, end, &what, 2);
    else if (what.used == 3)
        draw_rows(b, SAMPLER_SOBOL, seed, first, end, &what, 3);
    else
        draw_rows(b, SAMPLER_SOBOL, seed, first, end, &what, 4);
}

INLINE void load_numbers(const struct batch *b, int row, vf u[4])
{
    for (int d = 0; d < 4; d++)
        u[d] = vf_load_any(b->numbers[d] + LANES * row);
}

/* Adds light to what the paths k .. of the mask have gathered. */
INLINE void gather_light(struct batch *b, int k, vm mask, rgbv light)
{
    rgb_store(&b->gathered, k, rgb_addv(rgb_load(&b->gathered, k), rgb_where(mask, light)));
}

#endif
