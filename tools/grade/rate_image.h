/* The assignment's image of sampling rates: blue (none) through green (half) to red (all samples), 8 bits. */
#ifndef ASSAY_RATE_IMAGE_H
#define ASSAY_RATE_IMAGE_H

#include "renderer/image/moments.h"
#include "tools/submission/rubric.h"

struct rate_image {
    double pixels,
        odd; /* odd: of a colour that no multiple of the batch has, to one sample and 2 codes */
    double early;    /* that did not take all samples */
    double mean;     /* samples a pixel */
    double more, sd; /* mean over that of `expected`, less 1, and its standard deviation */
};

/* Of an image of the rubric. ours: n is the samples of each pixel in a render of ours (they hardly depend on each other: the
 * difference of two such counts varies from pixel to pixel by noise alone). Fails on what is no image of that size, and where batches
 * are too small against all samples to tell apart. */
NODISCARD bool rate_image_read(const char *path, const struct rubric_image *p, int batch,
                               const struct moments *ours, struct rate_image *out, struct err *e);

/* Samples of each pixel by its colour alone, 1 at least. */
NODISCARD bool rate_image_counts(const char *path, const struct rubric_image *p, double *count,
                                 struct err *e);

#endif
