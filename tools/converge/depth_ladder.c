#include "depth_ladder.h"

#include "reference/truth/truth.h"
#include "tools/images/luminance.h"

#include <math.h>

static double mean_of(const struct moments *m, double *se)
{
    size_t pixels = (size_t)m->width * (size_t)m->height;
    double sum = 0, variance = 0;
    for (size_t i = 0; i < pixels; i++) {
        double sd[3];
        for (int c = 0; c < 3; c++)
            sd[c] = sqrt(fmax(0, moments_var_of_mean(m, i, c)));
        sum += luminance(m->mean + 3 * i);
        variance += luminance(sd) * luminance(sd);
    }
    *se = sqrt(variance) / (double)pixels;
    return sum / (double)pixels;
}

static bool measure_one(const struct converge_job *job, const struct suite_reference *truth,
                        int spp, int depth, json_t *rungs, struct err *e)
{
    struct suite_scene scene = *job->scene;
    struct converge_job at = *job;
    struct moments m;
    struct err none = {""};
    double se, ignored;
    scene.depth = depth;
    at.scene = &scene;
    if (!converge_render_own(&at, spp, &m, e))
        return false;
    double mean = mean_of(&m, &se);
    moments_free(&m);
    json_t *rung = json_pack("{s:i, s:f, s:f}", "depth", depth, "mean", mean, "se", se);
    if (truth != NULL && truth_render(&scene, truth, &m, &none)) {
        json_object_set_new(rung, "truth", json_real(mean_of(&m, &ignored)));
        moments_free(&m);
    }
    if (err_is_of_memory(&none)) {
        json_decref(rung);
        return err_set(e, "%s", none.msg);
    }
    return json_array_append_new(rungs, rung) == 0;
}

bool depth_ladder_measure(const struct converge_job *job, const struct suite_reference *truth,
                          int spp, json_t **out, struct err *e)
{
    json_t *rungs = json_array();
    int last = job->scene->depth;
    bool ok = true;
    for (int depth = 0; ok && depth <= last;) {
        ok = measure_one(job, truth, spp, depth, rungs, e);
        int next = depth < 8 ? depth + 1 : depth + depth / 2;
        depth = next < last || depth == last ? next : last;
    }
    *out = ok ? json_pack("{s:i, s:O}", "samples", spp, "rungs", rungs) : NULL;
    json_decref(rungs);
    return ok;
}
