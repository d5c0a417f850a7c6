#include "discrete.h"

#include <assert.h>

double discrete_build(const double *weight, uint32_t n, uint32_t *end)
{
    assert(n >= 1 && n <= DISCRETE_MOST);
    double total = 0, sum = 0;
    uint32_t positive = 0, seen = 0;
    for (uint32_t i = 0; i < n; i++) {
        assert(weight[i] >= 0);
        total += weight[i];
        positive += weight[i] > 0;
    }
    /* One step each, the rest by weight. The last sum is the total to the bit. */
    for (uint32_t i = 0; i < n; i++) {
        sum += weight[i];
        seen += weight[i] > 0;
        end[i] = total > 0 ? seen + (uint32_t)(sum / total * (DISCRETE_STEPS - positive)) : 0;
    }
    return total;
}

uint32_t discrete_pick(const uint32_t *end, uint32_t n, float u)
{
    assert(end[n - 1] == DISCRETE_STEPS);
    const uint32_t step = (uint32_t)(u * DISCRETE_STEPS), *at = end;
    /* Without branches on what is found, which no machine can foresee. */
    while (n > 1) {
        const uint32_t half = n / 2;
        at += half & -(uint32_t)(at[half - 1] <= step);
        n -= half;
    }
    return (uint32_t)(at - end);
}

uint32_t discrete_pick_part(const uint32_t *end, uint32_t n, float u, float *part)
{
    const uint32_t i = discrete_pick(end, n, u), first = i > 0 ? end[i - 1] : 0;
    *part = (u * DISCRETE_STEPS - (float)first + 0.5f) / (float)(end[i] - first);
    return i;
}
