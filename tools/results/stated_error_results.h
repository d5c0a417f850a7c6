/* The member "consistency" of results.json (tools/docs/formats/results.md): does the error that our
 * renders state agree with the error between them (stated_error.h)? The ratios "pixels" and "image"
 * are 0 where two renders are the same. */
#ifndef ASSAY_STATED_ERROR_RESULTS_H
#define ASSAY_STATED_ERROR_RESULTS_H

#include "results.h"

#include <stdio.h>

/* Checks all that stated_error_print() and the report rely on; the error line names file, row and member. */
NODISCARD bool stated_error_check(const json_t *consistency, const char *path, struct err *e);

/* Prints a line for each row, for a terminal or as a Markdown table; nothing if there are no rows. */
void stated_error_print(FILE *f, const json_t *consistency, bool markdown);

#endif
