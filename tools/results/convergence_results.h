/* "convergence" in results.json: what `assay converge` found, one element for each scene (tools/docs/formats/results.md).
 * rmse, variance, bias and reference_noise are relative to the reference's pixels (convergence_rate.h). Intervals
 * have the level 1 - alpha, floor_ci 1 - 2 alpha, alpha being the share of one judgement. What a run cannot
 * estimate is null: the efficiency where times are too short to measure, its interval on two rungs. An engine that
 * is only measured has the verdict "MEASURED" and passes. */
#ifndef ASSAY_CONVERGENCE_RESULTS_H
#define ASSAY_CONVERGENCE_RESULTS_H

#include "results.h"

#include <stdio.h>

/* Checks all that the functions below and the report rely on; the error line names file, scene, engine
 * and member. */
NODISCARD bool convergence_results_check(const json_t *convergence, const char *path,
                                         struct err *e);

/* Checks a scene's "depths", or the {"error": ..} of a ladder that could not be rendered. Error lines begin with
 * `where`. */
NODISCARD bool convergence_results_check_depths(const json_t *depths, const char *where,
                                                struct err *e);

/* A row of the table: one quantity of one engine on a scene. Its texts are valid until the callback returns. */
struct convergence_row {
    const char *scene, *engine, *quantity, *value, *verdict;
    enum outcome outcome;
};
void convergence_results_rows(const json_t *scene,
                              void (*row)(void *ctx, const struct convergence_row *r), void *ctx);

/* Why an element of "engines" that has verdicts did not pass; NULL if it passed or could not be judged. */
const char *convergence_results_reason(const json_t *engine);

/* Rungs, then rows, of every scene, for a terminal. */
void convergence_results_print(FILE *f, const json_t *convergence);
/* The rows as a Markdown table. */
void convergence_results_print_markdown(FILE *f, const json_t *convergence);

#endif
