/* Jobs distributed among threads, with a progress line. */
#ifndef ASSAY_TESTS_WORK_H
#define ASSAY_TESTS_WORK_H

#include "renderer/base/progress.h"
#include "renderer/base/err.h"

struct work {
    int threads;
    double done, total; /* of all that is to come, about CPU milliseconds */
    struct progress progress;
};

/* A job's result goes where nothing else writes, so the results do not depend on the threads. */
typedef bool work_job(void *arg, int job, struct err *e);

/* Runs jobs 0 .. num-1, each about `cost` CPU milliseconds; false with the first error. */
NODISCARD bool work_run(struct work *w, int num, double cost, work_job *job, void *arg,
                        struct err *e);
/* The same on all processors; `what` is said with how far it is, NULL: nothing. */
NODISCARD bool work_run_all(const char *what, int num, work_job *job, void *arg, struct err *e);

#endif
