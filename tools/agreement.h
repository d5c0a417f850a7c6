/* By how much two pictures differ, as intervals: what points are a function of. */
#ifndef ASSAY_AGREEMENT_H
#define ASSAY_AGREEMENT_H

#include "region.h"
#include "student.h"

/* A quantity that should be 0 and the interval that holds its true value with 1 - alpha. */
struct interval {
    double value, lo, hi, sd;
};

/* How far the interval is from 0 (0 if it holds 0); half its width. */
double interval_distance(const struct interval *i);
double interval_half(const struct interval *i);

struct agreement {
    struct interval
        image[NUM_CHANNELS]; /* relative difference of the means of R, G, B, luminance */
    struct interval tile;    /* of the tile furthest from agreeing, luminance */
    int tile_x, tile_y;      /* pixels */
    int tiles;               /* that could be judged */
    double compared;         /* share of the pixels */
    double *relative;        /* per tile, difference in luminance; NAN where not judged */
};

/* A against B over the pixels with use[p] != 0. In a tile too skewed for an interval (region.h), or with less
 * than a quarter of its pixels in use, nothing is judged. alpha is that of all intervals together. Noise is that of
 * the difference (spatial.h), which needs 32 x 32 pixels; `exact`: there is none, as in two pictures that are the
 * same. Means of a and b where use[p] is 0 are set to 0. Fails where nothing can be compared: a line fit for the
 * student. The caller frees with agreement_free(). */
bool agreement_measure(const struct student *a, const struct student *b, const unsigned char *use,
                       double alpha, struct agreement *out, struct err *e)
    __attribute__((warn_unused_result));
void agreement_free(struct agreement *a);

/* ln of the variance of P over that of Q in a pixel, from second differences of each less its reference (means,
 * 3 per pixel), over pixels with use[p] != 0, RGB together; rounding is taken off. Var(sum r^2) is at most
 * 4 sum r^4 (spatial.h). Fails where there is no noise in one of them. */
bool agreement_noise(const struct student *p, const double *reference_p, const struct student *q,
                     const double *reference_q, const unsigned char *use, double alpha,
                     struct interval *out, struct err *e) __attribute__((warn_unused_result));

#endif
