/* Progress of a validation on stderr, and the time that is left. */
#include "validate_internal.h"

#include "renderer/base/progress.h"
#include "tools/results/results.h"

#include <math.h>
#include <stdio.h>

double validate_time_left(const struct validation *v)
{
    return v->deadline - progress_seconds();
}

void validate_log(struct validation *v, const char *scene, const char *what)
{
    if (v->opt->quiet)
        return;
    pthread_mutex_lock(&v->lock);
    fprintf(stderr, "[%2d/%d", v->done, v->num_tasks);
    if (isfinite(v->deadline))
        fprintf(stderr, ", %.0f s of %.0f s left", fmax(0, validate_time_left(v)),
                v->opt->budget_s);
    fprintf(stderr, "] %s: %s\n", scene, what);
    pthread_mutex_unlock(&v->lock);
}

json_t *validate_bare_row(const char *scene, const char *error, bool late)
{
    return json_pack("{ss,ss,sb,ss*,ss}", "scene", scene, "engine", "pathtracer", "passed", 0,
                     "verdict", late ? verdict_name(VERDICT_INCONCLUSIVE) : NULL, "error",
                     late ? BUDGET_SPENT " before its renders were done" : error);
}
