/* A diagnosis for a person and as JSON. */
#ifndef ASSAY_DIAGNOSE_PRINT_H
#define ASSAY_DIAGNOSE_PRINT_H

#include "diagnose.h"

#include <jansson.h>
#include <stdio.h>

/* skipped: as of diagnose_gather_results(). */
void diagnose_print(FILE *f, const struct catalogue *c, const struct observation *clue,
                    int num_clues, const struct diagnosis *d, const json_t *skipped);

/* { "finding": "correct" | "bug" | "unknown", "gate": "one line", "log10_p": -40.1,
 *   "known_bugs": 100, "probability": 0.999 (bug only),
 *   "named": ["NAME"],                    bugs that cannot be told apart, first the likeliest
 *   "candidates": [{"name": , "bug": , "where": , "amplitude": 1, "log10_likelihood": (over "correct"),
 *                   "explained": .99 | null}],
 *   "views": [{"view": , "t": , "log10_lead": , "explained": .99 | null,
 *              "region": {"x": , "y": , "width": , "height": , "change": } | null}],  of the likeliest
 *   "skipped": [{"view": , "reason": }] }
 * A new reference; NULL out of memory. */
json_t *diagnose_print_json(const struct catalogue *c, const struct observation *clue,
                            int num_clues, const struct diagnosis *d, const json_t *skipped);

#endif
