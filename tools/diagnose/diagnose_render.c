#include "diagnose_render.h"
#include "renderer/base/fs.h"

#include "reference/replicates/engine_driver.h"
#include "tools/validate/run_pathtracer.h"

#include <stdlib.h>

enum { FEWEST_CONSISTENT = 4 };

/* How far R may be from 1: our samples are independent, so that only alpha matters. */
static const double consistency_margin = 0.02;

static bool render_one(const struct diagnose_job *job, int k, struct moments *out, struct err *e)
{
    struct suite_scene scene = *job->scene;
    scene.width = job->width;
    scene.height = job->height;
    const struct path files = fs_path("%s/diagnose", job->work_dir);
    const struct pathtracer_job ours = {.program = job->program,
                                        .scene = &scene,
                                        .spp = job->spp,
                                        .seed = replicate_seed((uint32_t)job->seed, k),
                                        .options = job->options != NULL   ? job->options
                                                   : job->variant != NULL ? job->variant->options
                                                                          : NULL,
                                        .threads = job->threads,
                                        .timeout_s = job->timeout_s,
                                        .files = files.s};
    double cpu_s;
    return run_pathtracer(&ours, out, &cpu_s, NULL, e) || err_prefix(e, "%s", job->scene->name);
}

/* A black image has no noise to judge; that it is black is for others to find. */
static bool has_noise(const struct signature *s)
{
    double sum = 0;
    for (int i = 0; i < s->columns * s->rows; i++)
        sum += s->spread[i];
    return sum > 0;
}

static bool judge(const struct moments *m, const struct diagnose_job *job, double alpha,
                  struct signature *s, bool *consistent, struct err *e)
{
    struct stated_error c;
    if (!stated_error_judge(m, job->renders, consistency_margin, alpha, &c, e))
        return false;
    signature_set_stated_error(s, c.pixels, c.pixels_lo, c.pixels_hi, c.image, job->renders, alpha);
    *consistent = c.verdict != VERDICT_DIFFERENT;
    return true;
}

bool diagnose_render(const struct diagnose_job *job, double alpha, struct signature *out,
                     bool *consistent, struct err *e)
{
    size_t num = (size_t)job->renders;
    struct moments *m = calloc(num, sizeof *m);
    struct signature *s = calloc(num, sizeof *s);
    bool ok = (m != NULL && s != NULL) || err_set(e, "out of memory"), judged = true;
    int done = 0;
    for (; ok && done < job->renders; done += ok)
        ok = render_one(job, done, &m[done], e) &&
             signature_of(&m[done], job->columns, job->spp, &s[done], e);
    if (ok)
        *out = signature_average(s, job->renders);
    if (ok && job->renders >= FEWEST_CONSISTENT && has_noise(out))
        ok = judge(m, job, alpha, out, &judged, e);
    if (consistent != NULL)
        *consistent = judged;
    for (int k = 0; k < done; k++)
        moments_free(&m[k]);
    free(m);
    free(s);
    return ok;
}
