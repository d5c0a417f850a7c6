/* The means of the regions of all images of both sides, standardised, which permutation.c adds up. */
#ifndef ASSAY_PERMUTATION_TABLE_H
#define ASSAY_PERMUTATION_TABLE_H

#include "tools/compare/pyramid.h"
#include "tools/images/replicate_dir.h"

/* Means of all regions in all images. */
struct permutation_table {
    int num_a, num_b;
    size_t num;      /* regions of all channels */
    double sign;     /* 0: two-sided, by |sum|; else one-sided, by sum times sign */
    double *z;       /* num_a + num_b rows of num: centred, sum of squares 1, or all 0 */
    double *mean[2]; /* of A's and B's rows, before they are standardised */
    double *spread;  /* root of the total sum of squares, likewise. mean and spread lie in the memory of z */
    struct rect *rect;
    int *channel;
};

/* All squares of sides min_side, 2 min_side, .. up to the image, in R, G, B and luminance; the last
 * is the luminance of the image. min_side 0: the smallest power of 2 that leaves at most 1024 squares
 * a channel. Release with permutation_table_free(), also after a failure. */
NODISCARD bool permutation_table_make(const struct replicate_dir *a, const struct replicate_dir *b,
                                      int min_side, struct permutation_table *t, struct err *e);
/* One region alone. */
NODISCARD bool permutation_table_make_one(const struct replicate_dir *a,
                                          const struct replicate_dir *b, struct rect rect,
                                          int channel, struct permutation_table *t, struct err *e);
void permutation_table_free(struct permutation_table *t);

#endif
