/* Choosing one of n things in proportion to their weights, with one number of the sampler.
 *
 * Those numbers are multiples of 2^-24. Comparing them with a running sum in floating point would
 * give a thing of small weight noticeably more or fewer of them than its share, while the estimator
 * divides by that share: a bias. So every thing owns a whole number of the 2^24 steps, at least one
 * unless its weight is zero, and its probability is that number over 2^24: exact, if not quite
 * proportional to its weight. */
#ifndef ASSAY_DISCRETE_H
#define ASSAY_DISCRETE_H

#include <assert.h>
#include <stdint.h>

enum { DISCRETE_STEPS = 1 << 24, DISCRETE_MOST = 1 << 23 };

/* Fills the cumulative table end[0 .. n-1]: end[i] is the number of steps of things 0 .. i together.
 * 1 <= n <= DISCRETE_MOST; weights are finite and not negative. Returns their sum; if that is 0, all
 * of end[] is 0 and nothing may be picked. */
double discrete_build(const double *weight, uint32_t n, uint32_t *end);

/* Index of the thing that u in [0, 1) picks, never one of weight 0. */
static inline uint32_t discrete_pick(const uint32_t *end, uint32_t n, float u)
{
    assert(end[n - 1] == DISCRETE_STEPS);
    const uint32_t step = (uint32_t)(u * DISCRETE_STEPS), *at = end;
    /* Binary search without branches on the comparisons, which no processor can predict. */
    while (n > 1) {
        const uint32_t half = n / 2;
        at += half & -(uint32_t)(at[half - 1] <= step);
        n -= half;
    }
    return (uint32_t)(at - end);
}

/* The position of u within the steps of thing i, which u picks, from 0 to 1: a uniform number again. */
static inline float discrete_part(const uint32_t *end, uint32_t i, float u)
{
    const uint32_t first = i > 0 ? end[i - 1] : 0;
    return (u * DISCRETE_STEPS - (float)first + 0.5f) / (float)(end[i] - first);
}

static inline float discrete_probability(const uint32_t *end, uint32_t i)
{
    return (float)(end[i] - (i > 0 ? end[i - 1] : 0)) * (1.0f / DISCRETE_STEPS);
}

#endif
