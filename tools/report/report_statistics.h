/* The report's table of one claim: which statistics looked, with what part of alpha, and what each found;
 * below it what the difference looks like and how the noise of both sides compares. */
#ifndef ASSAY_REPORT_STATISTICS_H
#define ASSAY_REPORT_STATISTICS_H

#include <jansson.h>
#include <stdio.h>

/* A judged claim of results.json. */
void report_statistics(FILE *f, const json_t *claim);

#endif
