/* The assignment's image of sampling rates, 8 bits: blue (no samples) through green (half) to red
 * (all). */
#ifndef ASSAY_RATE_IMAGE_H
#define ASSAY_RATE_IMAGE_H

#include "renderer/image/moments.h"
#include "rubric.h"

struct rate_image {
    double pixels,
        odd; /* pixels whose colour is no multiple of the batch, to within one sample and 2 codes */
    double early;    /* pixels that did not take all samples */
    double mean;     /* samples a pixel */
    double more, sd; /* mean over that of `ours`, less 1, and its standard deviation */
};

/* Reads the rate image of an image of the rubric. ours: its n is the number of samples of each pixel in
 * a render of ours. (Counts of two renders are nearly independent: their difference varies from pixel
 * to pixel by noise alone.) Fails if the file is no image of that size, and if a batch is too small a
 * part of all samples for colours to tell counts apart. */
NODISCARD bool rate_image_read(const char *path, const struct rubric_image *p, int batch,
                               const struct moments *ours, struct rate_image *out, struct err *e);

/* Fills count[], one per pixel by rows, with its samples by its colour alone, at least 1. */
NODISCARD bool rate_image_counts(const char *path, const struct rubric_image *p, double *count,
                                 struct err *e);

#endif
