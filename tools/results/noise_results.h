/* The member "noise" of results.json (tools/docs/formats/results.md): per scene and engine the
 * variance of one sample and how it falls with the number of samples; for our renderer also what
 * both were judged by (tools/validate/noise_claims.c). An engine that is not judged has the verdict
 * "MEASURED", one without stored noise has "not_stored"; both pass. */
#ifndef ASSAY_NOISE_RESULTS_H
#define ASSAY_NOISE_RESULTS_H

#include "results.h"

#include "tools/base/text_table.h"

#include <stdio.h>

/* Checks all that the functions below rely on; a failure is a line with file, scene, engine and member. */
NODISCARD bool noise_results_check(const json_t *noise, const char *path, struct err *e);

/* The rows of ours, for whoever lists claims: scene, "a" (the engine), "b" (what it is held
 * against), "quantity" ("variance"), expected, passed, verdict or error, reason; where the ratio
 * has an interval, "difference" (ratio - 1), "ci" and "alpha". A new reference, NULL out of memory. */
json_t *noise_results_claims(const json_t *noise);

/* A cell of the table, for terminal, Markdown and page; empty where there is nothing to say. */
enum { NOISE_COLUMNS = 8 };
void noise_results_cell(const json_t *row, size_t column, char text[TEXT_TABLE_CELL]);
/* Nothing where there is none. */
void noise_results_print(FILE *f, const json_t *noise, bool markdown);

#endif
