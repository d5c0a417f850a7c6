/* Synthetic renders for the tests of tools/compare/compare.c: moments of n observations per pixel from a
 * law of known mean 1, made without renderer/image/moments.c. */
#ifndef ASSAY_TESTS_SIMULATE_H
#define ASSAY_TESTS_SIMULATE_H

#include "renderer/image/moments.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

/* splitmix64 */
static inline double uniform(uint64_t *state)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return ((double)((z ^ z >> 31) >> 11) + 0.5) * 0x1p-53;
}

enum law {
    LAW_NORMAL,      /* sd 0.3 */
    LAW_EXPONENTIAL, /* skewness 2 */
    LAW_BLACK,       /* 90 % are 0, the rest exponential of mean 10: skewness 6.5 */
    LAW_RARE,        /* 0.2, and 0.8/0.02 = 40 more in 2 % */
    LAW_FIREFLY,     /* 0.5, and 500 more in 0.1 % */
    LAW_LOGNORMAL,   /* sigma 1: skewness 6.2 */
    LAW_PARETO,      /* exponential of mean 0.5, and in 0.1 % a Pareto firefly of mean 500 and index
                        2.5 more: no third moment */
};

static inline double draw_normal(double u, uint64_t *state)
{
    return sqrt(-2 * log(u)) * cos(6.283185307179586 * uniform(state));
}

static inline double draw(enum law law, uint64_t *state)
{
    double u = uniform(state);
    switch (law) {
    case LAW_NORMAL: return 1 + 0.3 * draw_normal(u, state);
    case LAW_EXPONENTIAL: return -log(u);
    case LAW_BLACK: return u < 0.9 ? 0 : -10 * log((u - 0.9) / 0.1 + 1e-17);
    case LAW_RARE: return 0.2 + (u < 0.02 ? 40 : 0);
    case LAW_FIREFLY: return 0.5 + (u < 0.001 ? 500 : 0);
    case LAW_LOGNORMAL: return exp(draw_normal(u, state) - 0.5);
    case LAW_PARETO:
        return -0.5 * log(uniform(state)) + (u < 0.001 ? 300 * pow(uniform(state), -0.4) : 0);
    }
    abort();
}

/* Mean and central sums of n draws times `scale`, by shifted power sums. */
static inline void draw_pixel(enum law law, double scale, int n, uint64_t *state, double *mean,
                              double *m2, double *m3)
{
    double s1 = 0, s2 = 0, s3 = 0;
    double first = draw(law, state); /* shifting by a draw: equal draws give exactly no variance */
    for (int i = 1; i < n; i++) {
        double x = draw(law, state) - first;
        s1 += x;
        s2 += x * x;
        s3 += x * x * x;
    }
    *mean = scale * (first + s1 / n);
    *m2 = scale * scale * fmax(0, s2 - s1 * s1 / n);
    *m3 = scale * scale * scale * (s3 - 3 * s1 * s2 / n + 2 * s1 * s1 * s1 / ((double)n * n));
}

static inline struct moments new_moments(int width, int height, const char *unit)
{
    struct moments m;
    struct err e;
    if (!moments_alloc(&m, width, height, &e))
        abort();
    snprintf(m.unit, sizeof m.unit, "%s", unit);
    return m;
}

/* Fills all pixels, with mean `scale`. is_grey: the three channels are equal; else independent. */
static inline void simulate(struct moments *m, enum law law, double scale, int n, bool is_grey,
                            uint64_t *state)
{
    size_t pixels = (size_t)m->width * (size_t)m->height;
    for (size_t p = 0; p < pixels; p++) {
        m->n[p] = n;
        for (size_t i = 3 * p; i < 3 * p + 3; i++)
            if (i == 3 * p || !is_grey) {
                draw_pixel(law, scale, n, state, &m->mean[i], &m->m2[i], &m->m3[i]);
            } else {
                m->mean[i] = m->mean[i - 1];
                m->m2[i] = m->m2[i - 1];
                m->m3[i] = m->m3[i - 1];
            }
    }
}

/* Every pixel and channel exactly `value` in n observations. */
static inline void constant(struct moments *m, double value, double n)
{
    size_t pixels = (size_t)m->width * (size_t)m->height;
    for (size_t p = 0; p < pixels; p++) {
        m->n[p] = n;
        for (size_t i = 3 * p; i < 3 * p + 3; i++) {
            m->mean[i] = value;
            m->m2[i] = m->m3[i] = 0;
        }
    }
}

#endif
