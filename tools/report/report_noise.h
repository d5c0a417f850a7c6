/* The report's part about noise (noise_results.h): variance of a sample, its fall, efficiency. */
#ifndef ASSAY_REPORT_NOISE_H
#define ASSAY_REPORT_NOISE_H

#include <jansson.h>
#include <stdio.h>

/* `noise` as noise_results_check() leaves it; nothing is written where it is NULL or empty. */

/* One line for the head of the page. */
void report_noise_headline(FILE *f, const json_t *noise);
/* A section with a row for each scene and engine. */
void report_noise(FILE *f, const json_t *noise);

#endif
