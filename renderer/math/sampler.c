#include "sampler.h"

#include "sampler_simd.h"

#include <assert.h>

const char *const sampler_kind_names[] = {"independent", "sobol", NULL};

void sampler_philox4x32(const uint32_t counter[4], const uint32_t key[2], int rounds,
                        uint32_t out[4])
{
    assert(rounds <= PHILOX_ROUNDS);
    const struct philox_keys keys = philox_keys(key[0] | (uint64_t)key[1] << 32);
    philoxv(counter[0], counter[1], counter[2], counter[3], &keys, rounds, out);
}

struct sample4 sampler_draw(const struct sampler *s, uint32_t pixel, uint32_t sample,
                            uint32_t vertex, uint32_t purpose)
{
    const struct philox_keys keys = philox_keys(s->seed);
    struct sobol_keys block = {0};
    struct sample4 out;
    if (s->kind == SAMPLER_SOBOL)
        block = sobol_keys(s->seed, vertex, purpose);
    drawv(s->kind, &keys, &block, pixel, sample, vertex, purpose, 4, out.u);
    return out;
}

struct sample4 sampler_get(uint64_t seed, uint32_t pixel, uint32_t sample, uint32_t vertex,
                           uint32_t purpose)
{
    return sampler_draw(&(struct sampler){SAMPLER_INDEPENDENT, seed}, pixel, sample, vertex,
                        purpose);
}
