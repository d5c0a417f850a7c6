/* The verdicts of one run, and what `assay converge` found, at a glance. */
#ifndef ASSAY_RESULTS_MATRIX_H
#define ASSAY_RESULTS_MATRIX_H

#include "results.h"

#include <stdio.h>

/* Prints Markdown tables of the claims and of the convergence in `results` (checked by results_read()).
 *
 * Of claims: a row for each scene, columns for pathtracer against the closed form and the
 * engines with goldens. A cell has the difference of the image mean, the half width of its interval, and the MDB,
 * all in per cent; the verdict only where it is not EQUIVALENT, in bold where it was not expected.
 *
 * Of convergence: a row for each scene: the slopes of both samplers and of Cycles; the upper end of the
 * interval of our RMS bias at the top rung, in %; variance over that of Cycles at the first and the top rung,
 * efficiency over that of Cycles at the top. +- stands before half widths of intervals. A verdict of ours is
 * shown only if it is not EQUIVALENT. A cell is empty if the engine did not take part. */
void results_matrix_print(FILE *f, const json_t *results);

#endif
