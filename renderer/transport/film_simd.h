/* Samples into the sums of a film, as plain loops that the compiler turns into vectors. Part of
 * integrator_simd.c. */
#ifndef ASSAY_FILM_SIMD_H
#define ASSAY_FILM_SIMD_H

#include "film.h"

/* Pixels of the film that follow each other, from the first one of the pointers on. */
enum { FILM_RUN = 16 };

/* moments_add() and the sums of luminance for `count` pixels, all of which have had the same number of
 * samples. */
static void add_run(double *restrict n, double *restrict mean, double *restrict m2,
                    double *restrict m3, double *restrict s1, double *restrict s2,
                    const struct rgbs *radiance, int lane, int count)
{
    double x[3 * FILM_RUN];
    const double samples = n[0] + 1;
    for (int i = 0; i < count; i++) {
        double r = radiance->r[lane + i], g = radiance->g[lane + i], b = radiance->b[lane + i];
        double illuminance = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        x[3 * i] = r;
        x[3 * i + 1] = g;
        x[3 * i + 2] = b;
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

/* The same for the first sample of a pixel. It reads no sum, and leaves M2 and M3 alone: memory that has not been
 * written yet would be mapped twice, the second time with a call to all processors. */
INLINE void first_of(struct film *f, size_t pixel, const struct rgbs *radiance, int lane)
{
    double r = radiance->r[lane], g = radiance->g[lane], b = radiance->b[lane];
    double illuminance = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    double *mean = f->m.mean + 3 * pixel;
    f->m.n[pixel] = 1;
    mean[0] = 0 + r; /* not -0 */
    mean[1] = 0 + g;
    mean[2] = 0 + b;
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
