/* The luminance of an engine's replicates, kept while their noise is looked at; moments hold sums alone. */
#ifndef ASSAY_REPLICATES_H
#define ASSAY_REPLICATES_H

#include "renderer/base/err.h"

#include <stddef.h>

/* The luminance of the first MOST_REPLICATES replicates. */
enum { MOST_REPLICATES = 1024 };
struct replicates {
    int width, height, num, capacity;
    float *luminance; /* num images of width*height */
    double
        sharing; /* variance of a sum of pixels over the sum of their variances, by a known filter; 0: 1 */
};

NODISCARD bool replicates_alloc(struct replicates *r, int width, int height, int count,
                                struct err *e);
void replicates_add(struct replicates *r, const float *pixels_rgb);
void replicates_free(struct replicates *r);
/* e[k], k < num, of one pixel: its values less their mean, over their standard deviation; false if it has no noise. */
bool replicates_residuals(const struct replicates *r, size_t pixel, double *e);

#endif
