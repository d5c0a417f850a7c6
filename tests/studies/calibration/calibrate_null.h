/* False alarms: pairs of images of equal means go through the tester at three levels of alpha; its
 * p-values are kept, counted and compared with the uniform law. */
#ifndef ASSAY_CALIBRATE_NULL_H
#define ASSAY_CALIBRATE_NULL_H

#include "calibrate_check.h"
#include "calibrate_tester.h"

#include <stddef.h>

enum {
    NUM_LEVELS = 3,
    LEVEL_SHAPE = 1,  /* whose p-values are held against the uniform law */
    CURVE_POINTS = 33 /* at p = 10^(-i/8) */
};
extern const double null_level[NUM_LEVELS]; /* 1e-2, 1e-3, 1e-4 */

/* The p-values of many pairs. null_pair() may be called from several threads for different pairs. */
struct null_run {
    enum weakness weakness;
    /* The first pairs[l] pairs are run at level l. 0: the level is read off the run at LEVEL_SHAPE, whose
     * guard against skewness is less strict than at a smaller alpha. */
    size_t pairs[NUM_LEVELS];
    float *log10_p[NUM_LEVELS]; /* NUM_COLUMNS a pair */
    float *mean_t;              /* of the image's luminance, at LEVEL_SHAPE */
};
/* Fails only out of memory. Release with null_free(). */
NODISCARD bool null_init(struct null_run *r, enum weakness weakness, const size_t pairs[NUM_LEVELS],
                         struct err *e);
void null_free(struct null_run *r);
/* Runs pair i at every level that wants it; margins 0, that of the variance 0.1 %. */
NODISCARD bool null_pair(struct null_run *r, size_t i, const struct moments *a,
                         const struct moments *b, int tile, struct err *e);

struct null_result {
    char name[64];
    double pairs[NUM_LEVELS];                 /* that were looked at */
    double tested[NUM_COLUMNS][NUM_LEVELS];   /* pairs in which the column was tested */
    double rejected[NUM_COLUMNS][NUM_LEVELS]; /* p <= level */
    double curve[NUM_COLUMNS][CURVE_POINTS];  /* share of all pairs with p <= 10^(-i/8) */
    double above[NUM_COLUMNS]; /* largest excess of that share over p, at any p; -1: unknown */
    /* The one-sided p of the image's luminance in every other pair, from the first on (grey ones). */
    bool is_exact; /* is expected to be uniform exactly */
    size_t num_one_sided;
    double ks, ks_p, ad, ad_p;
};

/* Counts; false only out of memory. */
NODISCARD bool null_summary(const struct null_run *r, const char *name, bool is_exact,
                            struct null_result *out, struct err *e);
/* Sums the counts and averages the curves; leaves out what needs every p. */
void null_pool(const struct null_result *part, int num, const char *name, struct null_result *out);

/* The acceptance lines of one result: the rates of each statistic, of the gate and of the image's own
 * test are consistent with at most alpha; no rate exceeds its p by more than 1 %, at any p, beyond
 * what chance does; the p of an exact test is uniform. */
void null_check(const struct null_result *r, struct checks *c);

#endif
