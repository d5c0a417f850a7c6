/* POV-Ray as one of bench_engines.h. */
#ifndef ASSAY_BENCH_POVRAY_H
#define ASSAY_BENCH_POVRAY_H

#include "bench_engines.h"

/* Image i of grid x grid points a pixel. */
NODISCARD bool bench_povray(const struct bench_view *v, int grid, int i, uint32_t seed,
                            const char *work_dir, float *image, struct err *e);

#endif
