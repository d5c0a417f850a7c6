/* Where a validation spent its rendering time, computed from its results. */
#ifndef ASSAY_RENDER_COST_H
#define ASSAY_RENDER_COST_H

#include "results.h"

#include <stdio.h>

enum { MAX_COSTS = 512 };

/* The cost of one scene: of its claims and of its check of stated errors. */
struct scene_cost {
    const char *scene;
    double ours_s, references_s; /* CPU seconds of renders in this run; --engine counts as ours */
    double largest_n;            /* most observations per pixel of the tested side at any look */
    int claims, looks, undecided;
};

/* Fills out, the costliest scene first, and returns their number; scenes beyond MAX_COSTS are left out. */
int render_cost_gather(const json_t *results, struct scene_cost out[MAX_COSTS]);

/* "cost: 41_cornell 38 s of 120 s, ...": the costliest scenes on one line; nothing where nothing was
 * rendered. */
void render_cost_print(FILE *f, const json_t *results);

#endif
