/* An exact test of "A and B come from the same law" from replicates: if they do, which images are
 * called A is arbitrary, and every other way to call them is as likely [Pitman37]. Nothing is assumed
 * about the noise, its tails, or correlations of pixels and channels: a relabelling moves whole images.
 *
 * Statistic: the largest |t| (two samples, pooled variance) over the squares of sides min_side, 2
 * min_side, .. up to the image, in R, G, B and luminance [Westfall93]. A region's total sum of
 * squares is the same for every labelling, so t grows with |sum over A of z|, z being the region's
 * means, centred and over the root of that sum; the largest of that is what is compared.
 *
 * All labellings where there are at most 200 000, else that many random ones (fixed seed) besides the
 * one observed: p = (1 + #)/(1 + N). Exact: P(p <= alpha) <= alpha. */
#ifndef ASSAY_PERMUTATION_H
#define ASSAY_PERMUTATION_H

#include "tools/compare/pyramid.h"
#include "tools/images/replicate_dir.h"

#include "reference/suite/suite.h"

struct permutation_options {
    double alpha;
    int min_side; /* pixels; 0: the smallest power of 2 that leaves at most 1024 regions a channel */
    int tile;     /* side of a reporting tile, pixels: for mdb_tile */
};

struct permutation {
    enum verdict verdict; /* DIFFERENT: p <= alpha. INCONCLUSIVE: smallest_p > alpha. Else NO
                             DIFFERENCE FOUND */
    char reason[256];
    double p, smallest_p; /* smallest_p: the lowest that so many replicates can reach */
    int num_labellings;   /* compared, including the observed one */
    bool is_exhaustive;
    int num_regions; /* over all channels; those that never vary are left out */
    /* Where |t| is largest: */
    struct rect rect;
    int channel; /* 0..2 RGB, 3 luminance */
    double t;
    double difference; /* of the means there, over that of B */
    double mdb;        /* relative, luminance of the image: found with about 95 % */
    double mdb_tile; /* the same of a tile, the largest over the image (unit as of struct region) */
};

/* Fails with a line if sizes differ, an image is in both, none varies, or B is black. */
NODISCARD bool permutation_test(const struct replicate_dir *a, const struct replicate_dir *b,
                                const struct permutation_options *opt, struct permutation *out,
                                struct err *e);

/* A second stage on fresh replicates: the region of `first` alone, in its direction, at opt->alpha.
 * Everything in out is of that one test; mdb and mdb_tile are 0. */
NODISCARD bool permutation_confirm(const struct permutation *first, const struct replicate_dir *a2,
                                   const struct replicate_dir *b2,
                                   const struct permutation_options *opt, struct permutation *out,
                                   struct err *e);

/* How many replicates a side can reach a p, one- or two-sided (sides: 1 or 2), of at most alpha; 0 if even
 * random labellings cannot. */
int permutation_needed(double alpha, int sides);

#endif
