/* Many runs of `assay validate` or `compare`, oldest first: what each run measured of every claim, and whether
 * the last run has moved away from the earlier ones.
 *
 * H0: the last difference has the expectation of the earlier ones. z = (last - inverse-variance weighted mean of
 * the earlier) / sqrt(sum of both variances). The standard error of a difference is half its interval over the
 * normal quantile at its alpha; intervals are widened for skewness, so it is never too small. The noise of a
 * stored reference is the same in all runs and cancels, so the test is conservative. A series has moved if |z|
 * exceeds the critical value at alpha/2 over the number of series (Bonferroni: family-wise error rate alpha).
 * Runs of the same code and seed have the same numbers, and z is 0. */
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
    double variance_ratio;        /* of one path, A over B */
    double seconds;               /* of A */
    double efficiency; /* paths of B per second that are worth A's: n/(ratio x seconds) */
};

struct history_series {
    const char *scene, *a, *b, *quantity; /* borrowed from the runs */
    struct history_point *point;
    size_t num;
    double earlier,
        z; /* weighted mean of the earlier runs, and z; 0 with fewer than two points, or none in the last run */
};

struct history {
    struct history_run *run; /* by date, then path */
    size_t num_runs;
    struct history_series *series; /* the largest |z| first */
    size_t num_series;
    double alpha, critical; /* of |z| */
    size_t moved;
};

/* Reads every file named results.json below dir (8 levels, no links). Fails with a line if one cannot be read or
 * has a claim twice, if there is none, or if there are more than 400. The caller frees with history_free(). */
NODISCARD bool history_read(const char *dir, double alpha, struct history *out, struct err *e);
void history_free(struct history *h);

/* What was tested in a run: the version of the engine, where one is stated, else ours: "d36ec014cebb" of
 * "0.1 (commit d36ec014cebb)", or all of it. */
void history_version(const struct history_run *run, char *out, size_t size);

/* Writes the page (report/report_history.c): a row of plots against the runs for each series. Appears by rename. */
NODISCARD bool report_history(const struct history *h, const char *path, struct err *e);

#endif
