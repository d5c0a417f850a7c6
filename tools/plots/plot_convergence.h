/* The plots of `assay converge`: error against samples and against time, and the depth ladder. */
#ifndef ASSAY_PLOT_CONVERGENCE_H
#define ASSAY_PLOT_CONVERGENCE_H

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

/* <figure> of one element of "convergence" (convergence_results.h), both axes logarithmic; nothing without two different x. */
void plot_convergence(FILE *f, const json_t *scene, bool against_time);

/* <figure> of "depths" of that element, or its error; nothing without any (NULL). */
void plot_depths(FILE *f, const json_t *depths);

#endif
