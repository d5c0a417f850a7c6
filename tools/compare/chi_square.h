/* Many small differences together: the sum of squares over disjoint regions (tools/docs/background/verdict.md, "Dense").
 * Used by compare.c only. */
#ifndef ASSAY_CHI_SQUARE_H
#define ASSAY_CHI_SQUARE_H

#include "region.h"

/* The smallest p of the tests so far; begin with log10_p = 0. */
struct chi_square {
    double log10_p;
    int channel;
    int side;    /* of the smallest regions allowed */
    int regions; /* squares summed */
};

/* Two tests in this channel: over the finest partition of the image into testable regions, and over
 * one whose regions are reporting tiles or larger. Counts them in j->num_tests. Fails only out of
 * memory. */
bool chi_square_scan(struct judge *j, const struct pyramid *p, int channel, struct chi_square *d,
                     struct err *e) __attribute__((warn_unused_result));

#endif
