/* "convergence" in results.json: what `assay converge` found, one element for each scene (tools/docs/formats/results.md).
 * rmse, variance, bias and reference_noise are relative, pixel by pixel (convergence_rate.h). All intervals have the
 * level 1 - alpha, floor_ci 1 - 2 alpha; alpha is that of one judgement. Numbers that a run cannot tell are null
 * (efficiency of what is too short to be timed, its interval with two rungs). An engine that is not judged is
 * "MEASURED" and passes. */
#ifndef ASSAY_CONVERGENCE_RESULTS_H
#define ASSAY_CONVERGENCE_RESULTS_H

#include "results.h"

#include <stdio.h>

/* Checks all that the functions below and the report rely on; a failure is a line with file, scene,
 * engine and member. */
NODISCARD bool convergence_results_check(const json_t *convergence, const char *path,
                                         struct err *e);

/* Checks "depths" of a scene, or {"error": "one line"} of a ladder that could not be rendered; the line begins with `where`. */
NODISCARD bool convergence_results_check_depths(const json_t *depths, const char *where,
                                                struct err *e);

/* One line "scene x engine x quantity" of one element of "convergence". Texts are valid until the callback
 * returns. */
struct convergence_row {
    const char *scene, *engine, *quantity, *value, *verdict;
    enum outcome outcome;
};
void convergence_results_rows(const json_t *scene,
                              void (*row)(void *ctx, const struct convergence_row *r), void *ctx);

/* Rungs, then rows, of every scene, for a terminal. */
void convergence_results_print(FILE *f, const json_t *convergence);
/* The rows as a Markdown table. */
void convergence_results_print_markdown(FILE *f, const json_t *convergence);

#endif
