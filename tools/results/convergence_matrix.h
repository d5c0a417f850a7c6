/* What `assay converge` found, at a glance. */
#ifndef ASSAY_CONVERGENCE_MATRIX_H
#define ASSAY_CONVERGENCE_MATRIX_H

#include "convergence_results.h"

/* A Markdown table, a row for each scene: the slope of every sampler and of Cycles; the most that the RMS
 * bias of ours at the top rung may be, in %; variance over that of Cycles at the first and the top rung, and
 * efficiency over that of Cycles at the top. Half widths of intervals behind +-. A verdict of ours only where
 * it is not EQUIVALENT. `convergence` as convergence_results_check() checks it; a cell is empty where an engine did
 * not take part. */
void convergence_matrix_print(FILE *f, const json_t *convergence);

#endif
