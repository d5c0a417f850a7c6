/* Many small differences together: the sum of squares over disjoint regions (tools/docs/background/verdict.md, "Dense").
 * Used by compare.c and channel_sweep.c only. */
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

/* A region as the union of smaller ones, each testable. */
struct part {
    double sum; /* of their squares */
    int num;
    bool whole; /* they cover all of it */
};

/* The finest partition of a band, as parts of its tiles. `part`: workspace for twice the band's pixels. */
void chi_square_gather(const struct judge *j, const struct pyramid *band, int channel,
                       struct part *part, struct part *tiles);

/* Two tests in this channel: over the finest partition of the image into testable regions, of which `tiles` has what was
 * gathered and room for as many, and over one whose regions are reporting tiles or larger. Counts them in j->num_tests. */
void chi_square_test(struct judge *j, const struct pyramid *above, int channel, struct part *tiles,
                     struct chi_square *d);

#endif
