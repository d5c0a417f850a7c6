/* The verdicts of one run at a glance. */
#ifndef ASSAY_RESULTS_MATRIX_H
#define ASSAY_RESULTS_MATRIX_H

#include "results.h"

#include <stdio.h>

/* A Markdown table: a row for each scene, columns for pathtracer against the closed form and the
 * engines with goldens. A cell has the difference of the image mean, the half width of its interval, and the MDB,
 * all in per cent; the verdict only where it is not EQUIVALENT, in bold where it was not expected.
 * `results` as results_read() checks them. */
void results_matrix_print(FILE *f, const json_t *results);

#endif
