/* What a validation spent its rendering on, from its results. */
#ifndef ASSAY_RENDER_COST_H
#define ASSAY_RENDER_COST_H

#include "results.h"

#include <stdio.h>

enum { MAX_COSTS = 512 };

/* Of one scene: its claims and its claim of consistency. */
struct scene_cost {
    const char *scene;
    double ours_s, references_s; /* CPU seconds rendered in this run; of --engine: ours_s */
    double largest_n;            /* observations of the tested side, at most */
    int claims, looks, undecided;
};

/* Largest first; at most MAX_COSTS scenes, the number of them is returned. */
int render_cost_gather(const json_t *results, struct scene_cost out[MAX_COSTS]);

/* "cost: 41_cornell 38 s of 120 s, ...": the costliest scenes on one line; nothing where nothing was
 * rendered. */
void render_cost_print(FILE *f, const json_t *results);

#endif
