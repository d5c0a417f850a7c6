/* "convergence" in results.json: what `assay converge` found, one element for each scene.
 *
 *   { "scene": "41_cornell", "title": "...", "width": 64, "height": 64, "depth": 5,
 *     "replicates": 16, "reference": "golden of cycles", "reference_noise": .0012, "alpha": 3.3e-4,
 *     "margin": .01, "slope_margin": .1,
 *     "engines": [ {
 *         "engine": "pathtracer", "version": "0.1 (commit)", "independent": true, "judged": true,
 *         "slope": -.5003, "slope_ci": [-.507, -.494], "slope_verdict": "EQUIVALENT",
 *         "floor_ci": [0, .0021], "floor_verdict": "EQUIVALENT",
 *         "start_s": .012, "cpu_s_per_spp": .003,
 *         "verdict": "EQUIVALENT", "passed": true, "reason": "one sentence",
 *         "rungs": [ {"spp": 1, "rmse": .92, "rmse_ci": [.90, .94], "variance": .85,
 *                     "variance_ci": [..], "bias": .001, "cpu_s": .02, "efficiency": 310,
 *                     "efficiency_ci": [..]}, ... ]
 *     } | {"engine": "povray", "independent": false, "judged": false, "passed": false,
 *          "error": "one line"} ],
 *     "ratios": [ {"a": "pathtracer", "b": "cycles",
 *                  "rungs": [ {"spp": 1, "variance": 1.01, "variance_ci": [.99, 1.03],
 *                              "efficiency": 2.1, "efficiency_ci": [..]}, ... ]} ],
 *     "depths": {...} (depth_ladder.h; absent without such a ladder) }
 *
 * rmse, variance, bias and reference_noise are relative, pixel by pixel (convergence_rate.h); bias is the signed root of B^2 (convergence_rate.h), efficiency 1/(variance x CPU seconds of a replicate, start
 * left out). All intervals have the level 1 - alpha, floor_ci 1 - 2 alpha; alpha is that of one
 * judgement. Numbers that a run cannot tell are null (efficiency of what is too short to be timed, its
 * interval with two rungs). An engine that is not judged is "MEASURED" and passes. */
#ifndef ASSAY_CONVERGENCE_RESULTS_H
#define ASSAY_CONVERGENCE_RESULTS_H

#include "results.h"

#include <stdio.h>

/* Checks all that the functions below and the report rely on; a failure is a line with file, scene,
 * engine and member. */
bool convergence_results_check(const json_t *convergence, const char *path, struct err *e)
    __attribute__((warn_unused_result));

/* Checks "depths" of a scene, or {"error": "one line"} of a ladder that could not be rendered; the line begins with `where`. */
bool convergence_results_check_depths(const json_t *depths, const char *where, struct err *e)
    __attribute__((warn_unused_result));

/* How an engine came out; MEASURED is as expected. */
enum outcome convergence_results_outcome(const json_t *engine);

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
