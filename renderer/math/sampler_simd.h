/* The functions of sampler.h on lanes, each lane with its own pixel and sample. */
#ifndef ASSAY_SAMPLER_SIMD_H
#define ASSAY_SAMPLER_SIMD_H

#include "sampler.h"
#include "simd.h"

enum { PHILOX_ROUNDS = 10 };

/* The round keys, made once for many numbers. */
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

/* Mask of the bits of a word whose index (0: lowest) has bit k clear. */
#define PLACES(k)                                                                                  \
    ((k) == 0   ? 0x55555555u                                                                      \
     : (k) == 1 ? 0x33333333u                                                                      \
     : (k) == 2 ? 0x0F0F0F0Fu                                                                      \
     : (k) == 3 ? 0x00FF00FFu                                                                      \
                : 0x0000FFFFu)

/* P (see sobolv()) times a vector of 32 bits, the lowest bit first. By Lucas' theorem P is the Kronecker
 * product of five matrices (1 1; 0 1), one for each bit of the index. */
INLINE vu pascal_2v(vu x)
{
    for (int k = 0; k < 5; k++)
        x ^= x >> (1 << k) & PLACES(k);
    return x;
}

/* U (see sobolv()) times a vector of 16 field elements of two bits, a + b w with a in the lower bit. U is
 * the Kronecker product of matrices (1 w^(2^k); 0 1); the exponents 1, 2, 4, 8 are 1, 2, 1, 2 modulo 3. */
INLINE vu pascal_4v(vu x)
{
    for (int k = 0; k < 4; k++) {
        vu a = x & PLACES(0), b = x >> 1 & PLACES(0), sum = a ^ b;
        vu times = k % 2 == 0 ? b | sum << 1 : sum | a << 1;
        x ^= times >> (2 << k) & PLACES(k + 1);
    }
    return x;
}

/* The unscrambled point `index` of the sequence, as binary fractions in reversed bit order (the lowest is worth 1/2).
 * The generator matrices are I, P, U and PU. P is Pascal's triangle mod 2, so that the first two
 * are Sobol's; U is the analogous triangle over the field of four elements 0, 1, w, w^2, with entries
 * binomial(j, i) w^(j-i), the field's elements written as matrices of 2 x 2 bits. All four together
 * are the sequence of [Faure82] in base 4, generalised to prime powers by [Niederreiter87]; (U, PU) is
 * (I, P) with its points in another order, since U is triangular. */
INLINE void sobolv(vu index, vu x[4])
{
    x[0] = index;
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

/* A permutation of the 32-bit numbers in which each input bit changes about half of the output bits [Wellons18]. */
INLINE vu hash_bitsv(vu x)
{
    x ^= x >> 16;
    x *= 0x7FEB352Du;
    x ^= x >> 15;
    x *= 0x846CA68Bu;
    return x ^ x >> 16;
}

/* The keys of a (vertex, purpose) under the Sobol sampler, the same for all pixels. */
struct sobol_keys {
    uint32_t order, scramble[4];
};

static inline struct sobol_keys sobol_keys(uint64_t seed, uint32_t vertex, uint32_t purpose)
{
    const uint32_t key[2] = {(uint32_t)seed, (uint32_t)(seed >> 32)};
    uint32_t order[4];
    struct sobol_keys k;
    sampler_philox4x32((const uint32_t[]){0, 0, vertex, purpose}, key, PHILOX_ROUNDS, order);
    sampler_philox4x32((const uint32_t[]){0, 1, vertex, purpose}, key, PHILOX_ROUNDS, k.scramble);
    k.order = order[0];
    return k;
}

/* The first `used` numbers of sampler_draw(); the others are undefined. block: keys of the vertex and purpose, which
 * the independent sampler does not use. */
INLINE void drawv(enum sampler_kind kind, const struct philox_keys *keys,
                  const struct sobol_keys *block, vu pixel, vu sample, uint32_t vertex,
                  uint32_t purpose, int used, vf u[4])
{
    vu x[4];
    if (kind == SAMPLER_INDEPENDENT) {
        philoxv(pixel, sample, vertex, purpose, keys, PHILOX_ROUNDS, x);
    } else {
        vu order = hash_bitsv(pixel ^ block->order);
        sobolv(vu_reverse_bits(scramble_upwardsv(vu_reverse_bits(sample), order)), x);
        for (int i = 0; i < used; i++)
            x[i] = vu_reverse_bits(scramble_upwardsv(x[i], hash_bitsv(pixel ^ block->scramble[i])));
    }
    for (int i = 0; i < used; i++)
        u[i] = vf_of_int((vi)(x[i] >> 8)) * 0x1p-24f;
}

#endif
