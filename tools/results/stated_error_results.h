/* "consistency" in results.json: claims about the error that our renders state (stated_error.h).
 *
 *   [ {"scene": "41_cornell", "engine": "pathtracer", "renders": 8, "spp": 32, "alpha": 1e-5,
 *      "margin": .1, "verdict": "EQUIVALENT", "passed": true, "reason": "one sentence",
 *      "pixels": 1.003, "pixels_ci": [.95, 1.06], "image": 1.2, "image_range": [.1, 4.1],
 *      "seconds": 3.1,
 *      "noise": 1.002, "noise_ci": [.99, 1.01],       (where the scene asks for it: sample_efficiency.h)
 *      "too_early": 0, "too_late": 0}                 (the same: adaptive_stop.h)
 *   | {"scene": , "engine": , "passed": false, "error": "one line", "verdict": "INCONCLUSIVE" where
 *      only the time was missing} ]
 *
 * pixels and image are 0 where two renders are the same. */
#ifndef ASSAY_STATED_ERROR_RESULTS_H
#define ASSAY_STATED_ERROR_RESULTS_H

#include "results.h"

#include <stdio.h>

/* Checks all that the functions below rely on; a failure is a line with file, scene and member. */
bool stated_error_check(const json_t *consistency, const char *path, struct err *e)
    __attribute__((warn_unused_result));

enum outcome stated_error_outcome(const json_t *claim);

/* A line for each, for a terminal or as a Markdown table; nothing where there is none. */
void stated_error_print(FILE *f, const json_t *consistency, bool markdown);

#endif
