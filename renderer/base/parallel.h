/* Work on several threads that are started for it and joined before the call returns. */
#ifndef ASSAY_PARALLEL_H
#define ASSAY_PARALLEL_H

#include "err.h"

#include <stdbool.h>
#include <stddef.h>

/* Cuts 0 .. n-1 into parts and calls work(ctx, first, last) for each, elements first .. last-1, on
 * up to `threads` threads. Returns when all are done. */
void parallel_for(int threads, size_t n, void (*work)(void *ctx, size_t first, size_t last),
                  void *ctx);

enum { PARALLEL_TASK = 128 };

/* A task that may split. The largest one that waits is begun first; `what` belongs to the caller. */
struct parallel_task {
    size_t size;
    _Alignas(32) unsigned char what[PARALLEL_TASK];
};

/* Calls work(ctx, t, more) for the first task and all that it splits into, on up to `threads` threads.
 * work() returns how many tasks it put into `more`, 0 to 2, or -1 on failure. Returns when all threads
 * have ended; false if a task failed or memory ran out. */
NODISCARD bool parallel_divide(int threads, const struct parallel_task *first,
                               int (*work)(void *ctx, const struct parallel_task *t,
                                           struct parallel_task more[2]),
                               void *ctx);

#endif
