/* What the ladders of a scene say: judgements, ratios and numbers, as results (convergence_results.h). */
#ifndef ASSAY_CONVERGE_JUDGE_H
#define ASSAY_CONVERGE_JUDGE_H

#include "converge_run.h"
#include "tools/stats/convergence_rate.h"

#include <jansson.h>

/* One engine's ladder on one scene. */
struct converge_ladder {
    struct rung rung[CONVERGE_MAX_RUNGS];
    struct cost cost;
    char *version; /* owned; NULL: not known */
    bool present;
    struct err e; /* why it is not */
};

const char *converge_judge_name(const struct converge_options *o, enum converge_engine engine);

/* How many judgements there are of each scene; at least 1. */
int converge_judge_count(const struct converge_options *o);

/* The members "engines" and "ratios" of the scene, new references. ladder: of o->engine[], in that order; alpha: of one
 * judgement. With o->margin_variance the first engine is DIFFERENT if its variance at the last rung is more than 1 +
 * margin_variance times that of any other (convergence_rate_log_ratio()), and INCONCLUSIVE if it may be. */
void converge_judge(const struct converge_options *o, double alpha,
                    const struct converge_ladder *ladder, const struct converge_reference *ref,
                    json_t **engines, json_t **ratios);

#endif
