/* The report's part about convergence: for every scene the plots of RMSE against samples and against
 * CPU time, what was judged, and the rungs behind it. */
#ifndef ASSAY_REPORT_CONVERGENCE_H
#define ASSAY_REPORT_CONVERGENCE_H

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

/* `convergence` as in convergence_results.h, checked; NULL: nothing is written. */

/* The verdict in one line: the page's headline if it is about nothing else. */
void report_convergence_headline(FILE *f, const json_t *convergence, bool alone);

void report_convergence(FILE *f, const json_t *convergence);

#endif
