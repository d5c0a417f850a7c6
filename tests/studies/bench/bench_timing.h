/* What every measurement needs. */
#ifndef ASSAY_BENCH_TIMING_H
#define ASSAY_BENCH_TIMING_H

#include <stddef.h>

/* CPU time of this thread. */
double bench_cpu_seconds(void);
/* Sorts x. */
double bench_median(double *x, int n);
/* Zeroed; aborts when out of memory. */
void *bench_allocate(size_t size);

#endif
