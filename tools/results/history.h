/* Many runs of `assay validate` or `compare`, oldest first: what each claim measured in each of them, and
 * whether the last run moved.
 *
 * Moved: H0: the last difference has the mean of the earlier ones. z = (last - weighted mean of the earlier)
 * over the root of the sum of both variances; the standard error of a difference is half its interval over the
 * normal quantile of its alpha, which skewness only makes larger. The noise of a stored reference is in
 * all runs alike, so the test is cautious. |z| above the quantile of alpha/2 over all series (Bonferroni)
 * is "moved": family-wise alpha. Runs of the same code and seed have the same numbers, and z is 0. */
#ifndef ASSAY_HISTORY_H
#define ASSAY_HISTORY_H

#include "renderer/base/err.h"

#include <jansson.h>
#include <stddef.h>

struct history_run {
    char *path; /* of its results.json, below the directory */
    json_t *results;
};

/* One claim in one run. What is not known is NAN. */
struct history_point {
    size_t run;
    double alpha;                 /* of the claim */
    double difference, low, high; /* relative */
    double variance_ratio;        /* a path of A over one of B */
    double seconds;               /* of A */
    double efficiency; /* paths of B a second that say as much as A's: n/(ratio seconds) */
};

struct history_series {
    const char *scene, *a, *b, *quantity; /* of the runs */
    struct history_point *point;
    size_t num;
    double earlier,
        z; /* the mean before the last run; 0 where there are no two points or the last run lacks it */
};

struct history {
    struct history_run *run; /* by date, then path */
    size_t num_runs;
    struct history_series *series; /* the largest |z| first */
    size_t num_series;
    double alpha, critical; /* of |z| */
    size_t moved;
};

/* Reads every file named results.json below dir (8 levels, no links). Fails with a line on one that cannot
 * be read, if there is none, and on more than 400. The caller frees with history_free(). */
NODISCARD bool history_read(const char *dir, double alpha, struct history *out, struct err *e);
void history_free(struct history *h);

/* "d36ec014cebb" of "0.1 (commit d36ec014cebb)", else all of the version. */
void history_commit(const struct history_run *run, char *out, size_t size);

/* The page: a row for each series, with plots against the runs. By rename. */
NODISCARD bool report_history(const struct history *h, const char *path, struct err *e);

#endif
