/* What every measurement needs. */
#ifndef ASSAY_BENCH_TIMING_H
#define ASSAY_BENCH_TIMING_H

#include <stddef.h>

/* CPU seconds of this thread so far. */
double bench_cpu_seconds(void);
/* The median of n numbers; sorts x. */
double bench_median(double *x, int n);
/* Zeroed; aborts when out of memory. */
void *bench_allocate(size_t size);

#endif
