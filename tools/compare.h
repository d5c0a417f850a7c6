/* Two moments images -> a verdict with its error rates and what it could have missed.
 * Procedure and sources: tools/README.md. */
#ifndef ASSAY_COMPARE_H
#define ASSAY_COMPARE_H

#include "../reference/suite.h"
#include "../renderer/moments.h"

struct compare_options {
    double alpha;         /* bounds the chance of a wrong DIFFERENT and of a wrong EQUIVALENT, each,
                             over all regions and channels of this one claim */
    double margin_global; /* relative; 0: any difference counts (a regression test) */
    double margin_tile;
    int tile; /* side of a reporting tile, pixels; divides width and height */
};

/* A square region (or the image) in one channel (0..2 RGB, 3 luminance .2126 .7152 .0722). Relative
 * quantities are in units of max(|B|, floor), see floor_fraction. */
struct region {
    int x, y, width, height;
    int channel;
    double mean_a, mean_b; /* mean radiance of the region */
    double difference;     /* (A-B) relative */
    double std_error;      /* of `difference` */
    double dof;            /* Welch-Satterthwaite */
    double t;              /* difference / std_error; 0 if both are 0 */
    double log10_p;        /* two-sided p of "no difference beyond the margin" */
    double ci_lo, ci_hi;   /* 1 - 2 alpha interval of `difference` */
    double mdb;            /* the smallest true |difference| that comes out DIFFERENT with 95 % */
    double margin;
};

struct comparison {
    enum verdict verdict;
    char reason[256];         /* one sentence: what decided */
    int num_tests;            /* over which alpha is divided (Bonferroni) */
    struct region global[4];  /* per channel and luminance */
    struct region worst;      /* smallest p of the whole pyramid */
    struct region worst_tile; /* reporting tile whose interval reaches furthest out */
    double mdb_global;        /* of luminance */
    double mdb_tile;          /* largest over the reporting tiles, luminance */
    double rms_bias;     /* debiased relative RMS error over pixels, luminance: sqrt(max(0, ..)) */
    double extra_factor; /* INCONCLUSIVE: about how many times the samples would decide; else 1 */
    bool skew_limited;   /* some small regions were too skewed for their t and were merged upward */
    int tiles_x, tiles_y; /* of reporting tiles */
    double *tile_log10_p; /* luminance, no margin (H0: equal), tiles_x*tiles_y; for the histogram */
    double *tile_t;
    struct image z;        /* per pixel luminance z (difference / standard error), 1 channel "z" */
    struct image relative; /* per pixel signed relative difference of luminance, 1 channel "rel" */
};

/* Hygiene first (sizes, NaN, infinity, negative radiance, n < 2 where not exact, replicates without
 * any variance), each a line in e and false: could not judge. The caller frees with
 * comparison_free(). */
bool compare_moments(const struct moments *a, const struct moments *b,
                     const struct compare_options *opt, struct comparison *out, struct err *e)
    __attribute__((warn_unused_result));
void comparison_free(struct comparison *c);

#endif
