/* Adds samples to the sums of a film, as plain loops that the compiler turns into vectors. Part of
 * integrator_simd.c. */
#ifndef ASSAY_FILM_SIMD_H
#define ASSAY_FILM_SIMD_H

#include "film.h"

/* Most consecutive pixels that add_run() takes at once. */
enum { FILM_RUN = 16 };

/* Loads the radiance of a lane into x; returns its luminance. */
INLINE double load_sample(const struct rgbs *radiance, int lane, double x[3])
{
    x[0] = radiance->r[lane];
    x[1] = radiance->g[lane];
    x[2] = radiance->b[lane];
    return 0.2126 * x[0] + 0.7152 * x[1] + 0.0722 * x[2];
}

/* moments_add() and the sums of luminance for `count` consecutive pixels, all of which have the same number
 * of samples. */
static void add_run(double *restrict n, double *restrict mean, double *restrict m2,
                    double *restrict m3, double *restrict s1, double *restrict s2,
                    const struct rgbs *radiance, int lane, int count)
{
    double x[3 * FILM_RUN];
    const double samples = n[0] + 1;
    for (int i = 0; i < count; i++) {
        const double illuminance = load_sample(radiance, lane + i, x + 3 * i);
        n[i] = samples;
        s1[i] += illuminance;
        s2[i] += illuminance * illuminance;
    }
    for (int i = 0; i < 3 * count; i++) {
        double d = x[i] - mean[i], dn = d / samples, term = d * dn * (samples - 1);
        mean[i] += dn;
        m3[i] += term * dn * (samples - 2) - 3 * dn * m2[i];
        m2[i] += term;
    }
}

/* The same for the first sample of a pixel. Reads no sum, and leaves M2 and M3 alone: pages that are read before they
 * are written would be mapped twice, the second time with a TLB shootdown on all processors. */
INLINE void first_of(struct film *f, size_t pixel, const struct rgbs *radiance, int lane)
{
    double x[3], illuminance = load_sample(radiance, lane, x);
    f->m.n[pixel] = 1;
    for (size_t c = 0; c < 3; c++)
        f->m.mean[3 * pixel + c] = 0 + x[c]; /* not -0 */
    f->s1[pixel] = 0 + illuminance;
    f->s2[pixel] = illuminance * illuminance;
}

static void film_add_lanes(struct film *f, const size_t *pixel, int num_lanes,
                           const struct batch *b, bool first)
{
    if (first) {
        for (int i = 0; i < num_lanes; i++)
            first_of(f, pixel[i], &b->radiance, i);
        return;
    }
    for (int i = 0, end; i < num_lanes; i = end) {
        const size_t p = pixel[i];
        const double n = f->m.n[p];
        for (end = i + 1; end < num_lanes && end - i < FILM_RUN &&
                          pixel[end] == p + (size_t)(end - i) && f->m.n[pixel[end]] == n;)
            end++;
        add_run(f->m.n + p, f->m.mean + 3 * p, f->m.m2 + 3 * p, f->m.m3 + 3 * p, f->s1 + p,
                f->s2 + p, &b->radiance, i, end - i);
    }
}

#endif
