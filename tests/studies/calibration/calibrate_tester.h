/* The tester under measurement: compare_moments() as it is, or weakened on purpose. A calibration is only
 * worth something if it rejects each weakened tester. */
#ifndef ASSAY_CALIBRATE_TESTER_H
#define ASSAY_CALIBRATE_TESTER_H

#include "tools/compare/compare.h"

enum weakness {
    WEAK_NOT,
    WEAK_LENIENT,   /* rejects and accepts at ten times the alpha it was asked for */
    WEAK_STRICT,    /* rejects at a tenth of it, and prints the MDB of the alpha asked for */
    WEAK_COPIED,    /* takes each observation twice: n doubles, the variance halves */
    WEAK_ONE_SIDED, /* leaves the variance of B out */
    WEAK_NO_SKEW,   /* sees no third moment, so neither guard nor interval know of skewness */
    NUM_WEAKNESSES
};
extern const char *const weakness_name[NUM_WEAKNESSES];

/* The p-values of one comparison: of the statistics, times their number of tests, and then: */
enum {
    COLUMN_GATE = NUM_STATISTICS, /* the smallest alpha at which the verdict is DIFFERENT */
    COLUMN_MEAN,                  /* the luminance of the image alone */
    COLUMN_TILE,                  /* the luminance of the first reporting tile alone, H0: equal */
    NUM_COLUMNS
};
extern const char *const column_name[NUM_COLUMNS];

struct outcome {
    enum verdict verdict;
    double log10_p[NUM_COLUMNS]; /* 1 where nothing was tested */
    struct region mean;          /* the image's luminance */
    struct region worst_tile;
    double mdb_global, mdb_tile;
};

/* Fails as compare_moments() does. */
NODISCARD bool tester_run(enum weakness weakness, const struct moments *a, const struct moments *b,
                          const struct compare_options *opt, struct outcome *out, struct err *e);

#endif
