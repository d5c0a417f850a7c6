/* The member "consistency" of results.json (tools/docs/formats/results.md): does the error that our
 * renders state agree with the error between them (stated_error.h)? The ratios "pixels" and "image"
 * are 0 where two renders are the same. */
#ifndef ASSAY_STATED_ERROR_RESULTS_H
#define ASSAY_STATED_ERROR_RESULTS_H

#include "results.h"

#include <stdio.h>

/* Checks all that the functions below rely on; a failure is a line with file, scene and member. */
NODISCARD bool stated_error_check(const json_t *consistency, const char *path, struct err *e);

/* A line for each, for a terminal or as a Markdown table; nothing where there is none. */
void stated_error_print(FILE *f, const json_t *consistency, bool markdown);

#endif
