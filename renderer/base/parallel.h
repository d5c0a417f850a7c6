/* Work on several threads that are started for it and joined before the call returns. */
#ifndef ASSAY_PARALLEL_H
#define ASSAY_PARALLEL_H

#include "err.h"

#include <stdbool.h>
#include <stddef.h>

/* Calls work(ctx, first, last) for parts of 0 .. n-1 that together are all of it, one on each of up to
 * `threads` threads. */
void parallel_for(int threads, size_t n, void (*work)(void *ctx, size_t first, size_t last),
                  void *ctx);

enum { PARALLEL_TASK = 128 };

/* A task that may come apart: how large it is tells which is begun first, `what` belongs to the caller. */
struct parallel_task {
    size_t size;
    _Alignas(32) unsigned char what[PARALLEL_TASK];
};

/* Calls work(ctx, t, more) for the first task and for all that come of it, on up to `threads` threads. It
 * gives the number of tasks that it left in `more`, 0 to 2, or -1 if it failed; then false is returned when
 * all threads have come to an end. */
NODISCARD bool parallel_divide(int threads, const struct parallel_task *first,
                               int (*work)(void *ctx, const struct parallel_task *t,
                                           struct parallel_task more[2]),
                               void *ctx);

#endif
