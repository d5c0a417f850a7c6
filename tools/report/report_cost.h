/* The report's table of what the time went to (render_cost.h). */
#ifndef ASSAY_REPORT_COST_H
#define ASSAY_REPORT_COST_H

#include <jansson.h>
#include <stdio.h>

/* <section> with a row for each scene, the costliest first; nothing where nothing was rendered. */
void report_cost(FILE *f, const json_t *results);

#endif
