/* sampler_draw() for eight lanes: the same numbers. Part of integrator_simd.c. */
#ifndef ASSAY_SAMPLER_SIMD_H
#define ASSAY_SAMPLER_SIMD_H

#include "sampler.h"
#include "simd.h"

INLINE vu vu_set(uint32_t x)
{
    return (vu)vi_set((int32_t)x);
}

enum { PHILOX_ROUNDS = 10 };

/* What the rounds mix in, made once for many numbers. */
struct philox_keys {
    uint32_t k[PHILOX_ROUNDS][2];
};

static inline struct philox_keys philox_keys(uint64_t seed)
{
    struct philox_keys keys;
    uint32_t k0 = (uint32_t)seed, k1 = (uint32_t)(seed >> 32);
    for (int r = 0; r < PHILOX_ROUNDS; r++) {
        keys.k[r][0] = k0;
        keys.k[r][1] = k1;
        k0 += 0x9E3779B9u;
        k1 += 0xBB67AE85u;
    }
    return keys;
}

/* philox4x32() */
INLINE void philoxv(vu pixel, vu sample, uint32_t vertex, uint32_t purpose,
                    const struct philox_keys *keys, vu out[4])
{
    vw c0 = vw_of(pixel), c1 = vw_of(sample), c2 = vw_of(vu_set(vertex));
    vw c3 = vw_of(vu_set(purpose));
    for (int r = 0; r < PHILOX_ROUNDS; r++) {
        vw p0 = vw_mul(c0, 0xD2511F53u), p1 = vw_mul(c2, 0xCD9E8D57u);
        c0 = vw_xor(vw_high(p1), c1, keys->k[r][0]);
        c1 = p1;
        c2 = vw_xor(vw_high(p0), c3, keys->k[r][1]);
        c3 = p0;
    }
    out[0] = vu_of(c0);
    out[1] = vu_of(c1);
    out[2] = vu_of(c2);
    out[3] = vu_of(c3);
}

INLINE vu reverse_bitsv(vu x)
{
    x = x << 16 | x >> 16;
    x = (x & 0x00FF00FFu) << 8 | (x >> 8 & 0x00FF00FFu);
    x = (x & 0x0F0F0F0Fu) << 4 | (x >> 4 & 0x0F0F0F0Fu);
    x = (x & 0x33333333u) << 2 | (x >> 2 & 0x33333333u);
    return (x & 0x55555555u) << 1 | (x >> 1 & 0x55555555u);
}

/* Bit places whose number has bit k set. */
#define PLACES(k)                                                                                  \
    ((k) == 0   ? 0xAAAAAAAAu                                                                      \
     : (k) == 1 ? 0xCCCCCCCCu                                                                      \
     : (k) == 2 ? 0xF0F0F0F0u                                                                      \
     : (k) == 3 ? 0xFF00FF00u                                                                      \
                : 0xFFFF0000u)

INLINE vu pascal_2v(vu x)
{
    for (int k = 0; k < 5; k++)
        x ^= x << (1 << k) & PLACES(k);
    return x;
}

INLINE vu pascal_4v(vu x)
{
    for (int k = 0; k < 4; k++) {
        vu high = x >> 1 & 0x55555555u, low = x & 0x55555555u, sum = high ^ low;
        vu times = k % 2 == 0 ? low << 1 | sum : sum << 1 | high;
        x ^= times << (2 << k) & PLACES(k + 1);
    }
    return x;
}

INLINE vu scramble_upwardsv(vu x, vu seed)
{
    x ^= x * 0x3D20ADEAu;
    x += seed;
    x *= seed >> 16 | 1;
    x ^= x * 0x05526C56u;
    x ^= x * 0x53A22864u;
    return x;
}

INLINE void drawv(enum sampler_kind kind, const struct philox_keys *keys, vu pixel, vu sample,
                  uint32_t vertex, uint32_t purpose, vf u[4])
{
    vu x[4];
    if (kind == SAMPLER_INDEPENDENT) {
        philoxv(pixel, sample, vertex, purpose, keys, x);
    } else {
        vu order[4], scramble[4];
        philoxv(pixel, vu_set(0), vertex, purpose, keys, order);
        philoxv(pixel, vu_set(1), vertex, purpose, keys, scramble);
        x[0] = scramble_upwardsv(reverse_bitsv(sample), order[0]);
        x[1] = pascal_2v(x[0]);
        x[2] = pascal_4v(x[0]);
        x[3] = pascal_2v(x[2]);
        for (int i = 0; i < 4; i++)
            x[i] = reverse_bitsv(scramble_upwardsv(reverse_bitsv(x[i]), scramble[i]));
    }
    for (int i = 0; i < 4; i++)
        u[i] = vf_of_int((vi)(x[i] >> 8)) * 0x1p-24f;
}

#endif
