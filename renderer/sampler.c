#include "sampler.h"

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

struct sample4 sampler_get(uint64_t seed, uint32_t pixel, uint32_t sample, uint32_t vertex,
                           uint32_t purpose)
{
    uint32_t counter[4] = {pixel, sample, vertex, purpose};
    uint32_t key[2] = {(uint32_t)seed, (uint32_t)(seed >> 32)}, x[4];
    philox4x32(counter, key, 10, x);
    struct sample4 s;
    for (int i = 0; i < 4; i++)
        s.u[i] = (float)(x[i] >> 8) * 0x1p-24f;
    return s;
}
