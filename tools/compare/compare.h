/* Two moments images -> a verdict with its error rates and what it could have missed.
 * Procedure, formulas, sources and limits: tools/docs/background/verdict.md. */
#ifndef ASSAY_COMPARE_H
#define ASSAY_COMPARE_H

#include "reference/suite/suite.h"
#include "renderer/image/moments.h"

struct compare_options {
    double alpha;           /* in (0, 0.5): bounds the chance of a wrong DIFFERENT and of a wrong
                             EQUIVALENT, each, over all regions and channels of this one claim */
    double margin_global;   /* relative, in [0, 1); 0: none, so that nothing can be EQUIVALENT */
    double margin_tile;     /* at least margin_global; both are 0 or none is */
    int tile;               /* side of a reporting tile, pixels (pyramid.h) */
    double margin_variance; /* relative, of the variance per observation; 0: reported, never tested,
                               as different estimators differ rightly; else its interval must lie
                               inside for EQUIVALENT and NO DIFFERENCE FOUND */
    int threads;            /* upper limit; at most 5 are used; the results do not depend on it */
    bool
        is_paired; /* A is B, which is exact, plus differences of pairs (block_means.h): both are of equally many
                       paths, so that B does not show what A has missed */
};

/* The claim's tests in groups, each with its own part of alpha. */
enum {
    STATISTIC_IMAGE,          /* the image's mean: R, G, B, luminance */
    STATISTIC_PYRAMID,        /* every smaller region */
    STATISTIC_CHI_SQUARE,     /* many small differences together */
    STATISTIC_MATCHED_FILTER, /* known kinds of error */
    STATISTIC_VARIANCE,       /* the variance of one observation */
    NUM_STATISTICS
};

/* DIFFERENT if any log10_p <= log10(alpha * share). */
struct statistic {
    double share;   /* of alpha; 0 where it does not apply. Its share then goes to the others, by
                       options and kind of input only, never by the data */
    int num_tests;  /* 0: nothing could be tested */
    double log10_p; /* of its smallest p, times num_tests (Bonferroni), at most 0 */
    char what[96];  /* which test that was: "shift by x", "16 x 16 pixels at 32,48 (red)" */
};
/* A change that, made to B, removes at least nine tenths of the difference (hint.h). */
struct hint {
    const char *name; /* "shift by x", static; NULL: no change that is known does */
    double removed;   /* removed share of the squared difference, corrected for noise; about 1 */
    double amount;    /* 0 where unit is "" */
    const char *unit; /* "%", "% of the mean", "in the exponent", "px", "" */
};

/* VA/VB: the variance of one path (or, where the number of paths is unknown, of one observation), RGB
 * together, and its 1 - 2 alpha interval. lo may be 0. */
struct variance_ratio {
    double ratio, lo, hi;
    bool valid;     /* both sides have noise of a kind that compares, and enough of it to know */
    bool of_paths;  /* false: of observations, "render" for short */
    bool is_shared; /* pixels share noise: the ratio is that of single pixels and not tested */
};
extern const char *const statistic_name[NUM_STATISTICS]; /* "image", "pyramid", .. */

/* A square region (or the image) in one channel (0..2 RGB, 3 luminance .2126 .7152 .0722). Relative
 * quantities are in units of the larger of mean_b and 5 % of the mean luminance of the image B, in which no pixel counts
 * as more than ten times that mean.
 * Every number is finite: t is within +-1e9, log10_p at least -1e6, mdb at most 1e6. */
struct region {
    int x, y, width, height;
    int channel;
    double mean_a, mean_b; /* mean radiance of the region */
    double difference;     /* (A-B) relative */
    double std_error;      /* of `difference` */
    double dof;            /* Welch-Satterthwaite; 0 if there is no noise */
    double t;              /* difference / std_error; 0 if both are 0 */
    double log10_p;        /* two-sided p of "no difference beyond the margin" */
    double
        log10_p_equal; /* of the image and of reporting tiles: of "no difference"; 0 where no test can tell */
    double ci_lo, ci_hi;   /* 1 - 2 alpha interval of `difference`, widened for skew */
    bool ci_valid;         /* false: too skewed for an interval; ci_lo, ci_hi only a hint */
    double ci_scale; /* how many times as wide it is as an expansion in skewness reaches, or 1 */
    /* About how many times the samples would make skewness, which falls as 1/sqrt n, no hindrance to an interval and to
     * a test; 1: it is none. */
    double unskew_interval, unskew_test;
    double mdb;            /* the smallest true |difference| that comes out DIFFERENT with 95 % */
    double margin;
};

struct comparison {
    enum verdict verdict;
    char reason[256]; /* one sentence: what decided */
    int num_tests;    /* of all statistics together */
    struct statistic statistic[NUM_STATISTICS];
    struct hint hint; /* not set by compare_moments() */
    struct variance_ratio variance;
    struct region global[4];  /* per channel and luminance */
    struct region worst;      /* the region with the smallest p relative to its level */
    struct region worst_tile; /* reporting tile whose interval reaches furthest out, luminance */
    /* With a margin, of the image's channels and the tiles: those whose difference is not noise (log10_p_equal, over all
     * of them at once) and, noise taken off, more than a tenth of its margin; of these the one that reaches furthest.
     * width 0: there is none. Decides nothing. */
    struct region significant;
    double mdb_global;        /* of luminance */
    double mdb_tile;          /* largest over the reporting tiles, luminance */
    double rms_bias;          /* debiased RMS error over pixels and RGB (weighted as luminance) in
                                 units of the mean luminance of B: sqrt(max(0, ..)) */
    double extra_factor;      /* if undecided: about how many times the samples would decide, at most
                            verdict_largest_factor, which means "or more"; else 1 */
    bool skew_limited; /* some regions of a tile's size or larger were too skewed for their t and
                            were judged only as part of larger ones */
    int finest_side;   /* smallest side of which at least half the luminance regions were tested */
    int tiles_x, tiles_y; /* of reporting tiles */
    double *tile_log10_p; /* luminance, no margin (H0: equal), tiles_x*tiles_y; for the histogram */
    double *tile_t;
    struct image z;        /* per pixel luminance z (difference / standard error), 1 channel "z",
                              within +-1e4 */
    struct image relative; /* per pixel signed relative difference of luminance, 1 channel "rel" */
};

/* Checks the input first. Each failure is a line in e and false (could not judge): sizes differ, NaN, infinity,
 * negative M2, n < 3 where not exact (skewness is unknown then), an unknown unit, noise in an exact side, replicates
 * without any variance (the seed was ignored), the same observations on both sides, a black reference, options out of
 * range. Means below 0 are judged like others. A is the tested side, B the reference. The caller frees with
 * comparison_free(). */
NODISCARD bool compare_moments(const struct moments *a, const struct moments *b,
                               const struct compare_options *opt, struct comparison *out,
                               struct err *e);
void comparison_free(struct comparison *c);

#endif
