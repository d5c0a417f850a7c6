#include "converge_engine.h"
#include "renderer/base/fs.h"

#include "reference/replicates/engine_driver.h"
#include "tools/validate/run_pathtracer.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *const converge_engine_names[] = {
    "pathtracer",
    "pathtracer-sobol",
    ENGINES_WITH_GOLDENS(ENGINE_WORD) NULL,
};

/* Each (engine, rung, replicate) gets a seed of its own; OWN counts as one more engine. */
enum { OWN = CONVERGE_NUM_ENGINES };

static uint32_t seed_of(const struct converge_job *job, int engine, int rung, int k)
{
    assert(rung < CONVERGE_MAX_RUNGS && k < CONVERGE_MAX_REPLICATES);
    return replicate_seed(job->seed,
                          (engine * CONVERGE_MAX_RUNGS + rung) * CONVERGE_MAX_REPLICATES + k);
}

/* Runs our program once and reads what it wrote. */
static bool render_by_pathtracer(const struct converge_job *job, const char *sampler, int spp,
                                 uint32_t seed, struct moments *out, double *cpu_s, struct err *e)
{
    const char *const options[] = {"--sampler", sampler, NULL};
    const struct path files = fs_path("%s/pathtracer", job->dir);
    const struct pathtracer_job ours = {.program = job->pathtracer,
                                        .scene = job->scene,
                                        .spp = spp,
                                        .seed = seed,
                                        .options = options,
                                        .threads = job->threads,
                                        .timeout_s = job->timeout_s,
                                        .files = files.s};
    return run_pathtracer(&ours, out, cpu_s, NULL, e);
}

static bool render_ours(const struct converge_job *job, enum converge_engine engine, int rung,
                        int spp, float *images, double *cpu_s,
                        const struct converge_progress *progress, struct err *e)
{
    const char *sampler = engine == CONVERGE_SOBOL ? "sobol" : "independent";
    size_t size = 3 * (size_t)job->scene->width * (size_t)job->scene->height;
    *cpu_s = 0;
    for (int k = 0; k < job->replicates; k++) {
        struct moments m;
        double seconds;
        if (!render_by_pathtracer(job, sampler, spp, seed_of(job, engine, rung, k), &m, &seconds,
                                  e))
            return false;
        for (size_t i = 0; i < size; i++)
            images[(size_t)k * size + i] = (float)m.mean[i];
        moments_free(&m);
        *cpu_s += seconds / job->replicates;
        progress_update(progress->progress, progress->before + (k + 1) * progress->each,
                        progress->total);
    }
    return true;
}

struct sink {
    float *images;
    size_t size;
    int num;
};

static void take_replicate(void *ctx, int k, const float *pixels_rgb)
{
    struct sink *s = ctx;
    memcpy(s->images + (size_t)k * s->size, pixels_rgb, s->size * sizeof *pixels_rgb);
    s->num++;
}

static bool render_reference(const struct converge_job *job, enum converge_engine engine, int rung,
                             int spp, float *images, double *cpu_s, char **version, struct err *e)
{
    struct suite_reference ref = {.fidelity = "exact", .replicates = job->replicates, .spp = spp};
    snprintf(ref.engine, sizeof ref.engine, "%s", converge_engine_names[engine]);
    if (engine_with_goldens(ref.engine)->subgrid) {
        ref.spp = 0;
        ref.subgrid = (int)lround(sqrt(spp));
        if (ref.subgrid * ref.subgrid != spp || ref.subgrid > 64)
            return err_set(e, "%s: renders k x k points a pixel, k up to 64, not %d", ref.engine,
                           spp);
    }
    struct sink sink = {images, 3 * (size_t)job->scene->width * (size_t)job->scene->height, 0};
    const struct reference_options opt = {.seed = seed_of(job, engine, rung, 0),
                                          .threads = job->threads,
                                          .timeout_s = job->timeout_s,
                                          .work_dir = job->dir,
                                          .share_dir = job->share_dir,
                                          .on_replicate = take_replicate,
                                          .on_replicate_ctx = &sink};
    struct moments m;
    json_t *manifest;
    if (!reference_render(job->scene, &ref, &opt, &m, &manifest, e))
        return false;
    bool noisy = strcmp(m.unit, "replicate") == 0 && sink.num == job->replicates;
    *cpu_s = json_number_value(json_object_get(manifest, "cpu_s")) / job->replicates;
    const char *text = json_string_value(json_object_get(manifest, "version"));
    *version = text != NULL ? strdup(text) : NULL;
    moments_free(&m);
    json_decref(manifest);
    if (noisy)
        return true;
    free(*version);
    *version = NULL;
    return err_set(e, "%s, %s: " CONVERGE_NO_NOISE ": there is nothing that could converge",
                   job->scene->name, ref.engine);
}

bool converge_render(const struct converge_job *job, enum converge_engine engine, int rung, int spp,
                     float *images, double *cpu_s, char **version,
                     const struct converge_progress *progress, struct err *e)
{
    *version = NULL;
    if (engine < CONVERGE_REFERENCES)
        return render_ours(job, engine, rung, spp, images, cpu_s, progress, e);
    return render_reference(job, engine, rung, spp, images, cpu_s, version, e);
}

bool converge_render_own(const struct converge_job *job, int spp, struct moments *out,
                         struct err *e)
{
    double cpu_s;
    return render_by_pathtracer(job, "independent", spp, seed_of(job, OWN, 0, 0), out, &cpu_s, e);
}
