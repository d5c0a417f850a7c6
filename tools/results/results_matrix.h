/* The verdicts of one run, and what `assay converge` found, at a glance. */
#ifndef ASSAY_RESULTS_MATRIX_H
#define ASSAY_RESULTS_MATRIX_H

#include "results.h"

#include <stdio.h>

/* Markdown tables of what there is, `results` as results_read() checks them.
 *
 * Of claims: a row for each scene, columns for pathtracer against the closed form and the
 * engines with goldens. A cell has the difference of the image mean, the half width of its interval, and the MDB,
 * all in per cent; the verdict only where it is not EQUIVALENT, in bold where it was not expected.
 *
 * Of convergence: a row for each scene: the slope of every sampler and of Cycles; the most that the RMS
 * bias of ours at the top rung may be, in %; variance over that of Cycles at the first and the top rung, and
 * efficiency over that of Cycles at the top. Half widths of intervals behind +-. A verdict of ours only where
 * it is not EQUIVALENT. A cell is empty where an engine did not take part. */
void results_matrix_print(FILE *f, const json_t *results);

#endif
