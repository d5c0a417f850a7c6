/* The member "noise" of results.json (tools/docs/formats/results.md): for each scene and engine the
 * variance of one sample and how that of an image falls with their number; for our renderer also the
 * verdicts on both (tools/validate/noise_claims.c). An engine that is not judged has the verdict
 * "MEASURED", one without stored noise has "not_stored"; both pass. */
#ifndef ASSAY_NOISE_RESULTS_H
#define ASSAY_NOISE_RESULTS_H

#include "results.h"

#include "tools/base/text_table.h"

#include <stdio.h>

/* Checks all that the functions below rely on; the error line names file, row and member. */
NODISCARD bool noise_results_check(const json_t *noise, const char *path, struct err *e);

/* The judged rows in the form of claims, for code that lists claims: scene, "a" (the engine), "b" (what
 * it is compared with), "quantity" ("variance"), expected, passed, verdict or error, reason; if the ratio
 * has an interval also "difference" (ratio - 1), "ci" and "alpha". A new reference; NULL if out of memory. */
json_t *noise_results_claims(const json_t *noise);

/* A cell of the table, for terminal, Markdown and page; empty where there is nothing to say. */
enum { NOISE_COLUMNS = 8 };
void noise_results_cell(const json_t *row, size_t column, char text[TEXT_TABLE_CELL]);
/* Prints the table, and the reasons of what did not pass; nothing if there are no rows. */
void noise_results_print(FILE *f, const json_t *noise, bool markdown);

#endif
