/* What the stages of integrator_simd.c share. */
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

/* Bits of the lanes of the paths from k that a batch of n has. */
INLINE unsigned lanes_there(int k, int n)
{
    return n - k >= LANES ? (unsigned)ALL_LANES : (1u << (n - k)) - 1;
}

INLINE void pick_v3(struct vec3s *a, int i, vec3v v, vi order)
{
    v3_store(a, i, v3v(pick(v.x, order), pick(v.y, order), pick(v.z, order)));
}

INLINE void pick_rgb(struct rgbs *a, int i, rgbv c, vi order)
{
    rgb_store(a, i, (rgbv){pick(c.r, order), pick(c.g, order), pick(c.b, order)});
}

INLINE void draw_rows(struct batch *b, enum sampler_kind kind, const struct philox_keys *keys,
                      int first, int end, int vertex, uint32_t purpose, int num)
{
    for (int k = first, j = 0; k < end; k += LANES) {
        vu pixel = (vu)vi_load_any(b->slot_pixel + k), sample = (vu)vi_load_any(b->slot_sample + k);
        for (int i = 0; i < num; i++, j += LANES) {
            vf u[4];
            drawv(kind, keys, pixel, sample, (uint32_t)vertex, purpose + (uint32_t)i, u);
            for (int d = 0; d < 4; d++)
                vf_store_any(b->numbers[d] + j, u[d]);
        }
    }
}

/* The numbers of `num` purposes for the lanes first .. end, LANES after LANES, into rows of
 * b->numbers. A loop of its own, short enough that the machine works on several rounds of it at once. */
static __attribute__((noinline)) void draw_numbers(const struct integrator *it, struct batch *b,
                                                   int first, int end, int vertex, uint32_t purpose,
                                                   int num)
{
    const struct philox_keys keys = philox_keys(it->opt.sampler.seed);
    switch (it->opt.sampler.kind) {
    case SAMPLER_INDEPENDENT:
        draw_rows(b, SAMPLER_INDEPENDENT, &keys, first, end, vertex, purpose, num);
        break;
    case SAMPLER_SOBOL: draw_rows(b, SAMPLER_SOBOL, &keys, first, end, vertex, purpose, num); break;
    }
}

INLINE void load_numbers(const struct batch *b, int row, vf u[4])
{
    for (int d = 0; d < 4; d++)
        u[d] = vf_load_any(b->numbers[d] + LANES * row);
}

/* Light comes to lanes k .. of the mask. */
INLINE void gather_light(struct batch *b, int k, vi mask, rgbv light)
{
    rgb_store(&b->gathered, k, rgb_addv(rgb_load(&b->gathered, k), rgb_where(mask, light)));
}

#endif
