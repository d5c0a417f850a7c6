/* The plots of `assay converge`: error against samples and against time, and the depth ladder. */
#ifndef ASSAY_PLOT_CONVERGENCE_H
#define ASSAY_PLOT_CONVERGENCE_H

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

/* Writes a <figure> of one element of "convergence" (convergence_results.h), both axes logarithmic; nothing if no
 * rung has a positive x and error. */
void plot_convergence(FILE *f, const json_t *scene, bool against_time);

/* Writes a <figure> of the element's "depths", or its error; nothing if depths is NULL. */
void plot_depths(FILE *f, const json_t *depths);

#endif
