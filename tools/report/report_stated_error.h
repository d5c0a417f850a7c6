/* The report's part about stated errors (stated_error_results.h). */
#ifndef ASSAY_REPORT_STATED_ERROR_H
#define ASSAY_REPORT_STATED_ERROR_H

#include <jansson.h>
#include <stdio.h>

/* `consistency` as stated_error_check() leaves it; nothing is written where it is NULL or empty. */

/* How many renderers err as they state, in one line. */
void report_stated_error_headline(FILE *f, const json_t *consistency);
/* The table. */
void report_stated_error(FILE *f, const json_t *consistency);

#endif
