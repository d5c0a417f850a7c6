#include "sampler.h"

#include <stddef.h>

const char *const sampler_kind_names[] = {"independent", "sobol", NULL};

void philox4x32(const uint32_t counter[4], const uint32_t key[2], int rounds, uint32_t out[4])
{
    uint32_t c0 = counter[0], c1 = counter[1], c2 = counter[2], c3 = counter[3];
    uint32_t k0 = key[0], k1 = key[1];
    for (int r = 0; r < rounds; r++) {
        uint64_t p0 = (uint64_t)0xD2511F53u * c0, p1 = (uint64_t)0xCD9E8D57u * c2;
        c0 = (uint32_t)(p1 >> 32) ^ c1 ^ k0;
        c1 = (uint32_t)p1;
        c2 = (uint32_t)(p0 >> 32) ^ c3 ^ k1;
        c3 = (uint32_t)p0;
        k0 += 0x9E3779B9u;
        k1 += 0xBB67AE85u;
    }
    out[0] = c0;
    out[1] = c1;
    out[2] = c2;
    out[3] = c3;
}

static struct sample4 to_unit(const uint32_t x[4])
{
    struct sample4 s;
    for (int i = 0; i < 4; i++)
        s.u[i] = (float)(x[i] >> 8) * 0x1p-24f;
    return s;
}

struct sample4 sampler_get(uint64_t seed, uint32_t pixel, uint32_t sample, uint32_t vertex,
                           uint32_t purpose)
{
    uint32_t counter[4] = {pixel, sample, vertex, purpose};
    uint32_t key[2] = {(uint32_t)seed, (uint32_t)(seed >> 32)}, x[4];
    philox4x32(counter, key, 10, x);
    return to_unit(x);
}

static uint32_t reverse_bits(uint32_t x)
{
    x = x << 16 | x >> 16;
    x = (x & 0x00FF00FFu) << 8 | (x >> 8 & 0x00FF00FFu);
    x = (x & 0x0F0F0F0Fu) << 4 | (x >> 4 & 0x0F0F0F0Fu);
    x = (x & 0x33333333u) << 2 | (x >> 2 & 0x33333333u);
    return (x & 0x55555555u) << 1 | (x >> 1 & 0x55555555u);
}

/* Bit places whose number has bit k set. */
static const uint32_t places[5] = {0xAAAAAAAAu, 0xCCCCCCCCu, 0xF0F0F0F0u, 0xFF00FF00u, 0xFFFF0000u};

/* P times a vector whose first element is the top bit. By Lucas' theorem P is a Kronecker product of
 * five matrices (1 1; 0 1), one for each bit of the place. */
static uint32_t pascal_2(uint32_t x)
{
    for (int k = 0; k < 5; k++)
        x ^= x << (1 << k) & places[k];
    return x;
}

/* U times a vector of 16 field elements of two bits. The like product of matrices (1 w^(2^k); 0 1),
 * where the exponents 1, 2, 4, 8 are 1, 2, 1, 2 modulo 3. */
static uint32_t pascal_4(uint32_t x)
{
    for (int k = 0; k < 4; k++) {
        uint32_t high = x >> 1 & 0x55555555u, low = x & 0x55555555u, sum = high ^ low;
        uint32_t times = k % 2 == 0 ? low << 1 | sum : sum << 1 | high;
        x ^= times << (2 << k) & places[k + 1];
    }
    return x;
}

void sobol_point(uint32_t index, uint32_t x[4])
{
    x[0] = reverse_bits(index);
    x[1] = pascal_2(x[0]);
    x[2] = pascal_4(x[0]);
    x[3] = pascal_2(x[2]);
}

/* Flips every bit by a hash of the seed and of the bits below it: a nested scrambling of reversed
 * numbers [Burley20], with the constants of [Vegdahl21]. */
static uint32_t scramble_upwards(uint32_t x, uint32_t seed)
{
    x ^= x * 0x3D20ADEAu;
    x += seed;
    x *= seed >> 16 | 1;
    x ^= x * 0x05526C56u;
    x ^= x * 0x53A22864u;
    return x;
}

struct sample4 sampler_draw(const struct sampler *s, uint32_t pixel, uint32_t sample,
                            uint32_t vertex, uint32_t purpose)
{
    if (s->kind == SAMPLER_INDEPENDENT)
        return sampler_get(s->seed, pixel, sample, vertex, purpose);
    const uint32_t key[2] = {(uint32_t)s->seed, (uint32_t)(s->seed >> 32)};
    uint32_t order[4], scramble[4], x[4];
    philox4x32((const uint32_t[4]){pixel, 0, vertex, purpose}, key, 10, order);
    philox4x32((const uint32_t[4]){pixel, 1, vertex, purpose}, key, 10, scramble);
    uint32_t index = reverse_bits(scramble_upwards(reverse_bits(sample), order[0]));
    sobol_point(index, x);
    for (int i = 0; i < 4; i++)
        x[i] = reverse_bits(scramble_upwards(reverse_bits(x[i]), scramble[i]));
    return to_unit(x);
}
