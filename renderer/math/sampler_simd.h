/* The numbers of sampler.h, lane by lane of their own pixel and sample. */
#ifndef ASSAY_SAMPLER_SIMD_H
#define ASSAY_SAMPLER_SIMD_H

#include "sampler.h"
#include "simd.h"

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

INLINE void philoxv(vu pixel, vu sample, uint32_t vertex, uint32_t purpose,
                    const struct philox_keys *keys, int rounds, vu out[4])
{
    vw c0 = vw_of(pixel), c1 = vw_of(sample), c2 = vw_of(vu_set(vertex));
    vw c3 = vw_of(vu_set(purpose));
    for (int r = 0; r < rounds; r++) {
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

/* P times a vector whose first element is the top bit. By Lucas' theorem P is a Kronecker product of
 * five matrices (1 1; 0 1), one for each bit of the place. */
INLINE vu pascal_2v(vu x)
{
    for (int k = 0; k < 5; k++)
        x ^= x << (1 << k) & PLACES(k);
    return x;
}

/* U times a vector of 16 field elements of two bits. The like product of matrices (1 w^(2^k); 0 1),
 * where the exponents 1, 2, 4, 8 are 1, 2, 1, 2 modulo 3. */
INLINE vu pascal_4v(vu x)
{
    for (int k = 0; k < 4; k++) {
        vu high = x >> 1 & 0x55555555u, low = x & 0x55555555u, sum = high ^ low;
        vu times = k % 2 == 0 ? low << 1 | sum : sum << 1 | high;
        x ^= times << (2 << k) & PLACES(k + 1);
    }
    return x;
}

/* sobol_point() of the number with these bits from the lowest to the highest. */
INLINE void sobolv(vu reversed, vu x[4])
{
    x[0] = reversed;
    x[1] = pascal_2v(x[0]);
    x[2] = pascal_4v(x[0]);
    x[3] = pascal_2v(x[2]);
}

/* Flips every bit by a hash of the seed and of the bits below it: a nested scrambling of reversed
 * numbers [Burley20], with the constants of [Vegdahl21]. */
INLINE vu scramble_upwardsv(vu x, vu seed)
{
    x ^= x * 0x3D20ADEAu;
    x += seed;
    x *= seed >> 16 | 1;
    x ^= x * 0x05526C56u;
    x ^= x * 0x53A22864u;
    return x;
}

/* sampler_draw() */
INLINE void drawv(enum sampler_kind kind, const struct philox_keys *keys, vu pixel, vu sample,
                  uint32_t vertex, uint32_t purpose, vf u[4])
{
    vu x[4];
    if (kind == SAMPLER_INDEPENDENT) {
        philoxv(pixel, sample, vertex, purpose, keys, PHILOX_ROUNDS, x);
    } else {
        vu order[4], scramble[4];
        philoxv(pixel, vu_set(0), vertex, purpose, keys, PHILOX_ROUNDS, order);
        philoxv(pixel, vu_set(1), vertex, purpose, keys, PHILOX_ROUNDS, scramble);
        sobolv(scramble_upwardsv(reverse_bitsv(sample), order[0]), x);
        for (int i = 0; i < 4; i++)
            x[i] = reverse_bitsv(scramble_upwardsv(reverse_bitsv(x[i]), scramble[i]));
    }
    for (int i = 0; i < 4; i++)
        u[i] = vf_of_int((vi)(x[i] >> 8)) * 0x1p-24f;
}

#endif
