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

/* Each (engine, rung, replicate) gets a seed of its own. */
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

/* The images of a rung as they arrive. */
struct sink {
    float *images;
    size_t size; /* of one */
    int num;
    const struct converge_progress *progress; /* NULL: none */
};

static void add_one(struct sink *s)
{
    const struct converge_progress *p = s->progress;
    s->num++;
    if (p != NULL)
        progress_update(p->progress, p->before + s->num * p->each, p->total);
}

static void take_replicate(void *ctx, int k, const float *pixels_rgb)
{
    struct sink *s = ctx;
    memcpy(s->images + (size_t)k * s->size, pixels_rgb, s->size * sizeof *pixels_rgb);
    add_one(s);
}

static void take_moments(struct sink *s, int k, const struct moments *m)
{
    float *image = s->images + (size_t)k * s->size;
    for (size_t i = 0; i < s->size; i++)
        image[i] = (float)m->mean[i];
    add_one(s);
}

static bool render_ours(const struct converge_job *job, enum converge_engine engine, int rung,
                        int spp, struct sink *sink, double *cpu_s, struct err *e)
{
    const char *sampler = engine == CONVERGE_SOBOL ? "sobol" : "independent";
    for (int k = 0; k < job->replicates; k++) {
        struct moments m;
        double seconds;
        if (!render_by_pathtracer(job, sampler, spp, seed_of(job, engine, rung, k), &m, &seconds,
                                  e))
            return false;
        take_moments(sink, k, &m);
        moments_free(&m);
        *cpu_s += seconds / job->replicates;
    }
    return true;
}

/* What an engine says of its images. Frees *m and the manifest. */
static bool finish(const struct converge_job *job, const char *engine, struct moments *m,
                   json_t *manifest, double *cpu_s, char **version, struct err *e)
{
    const bool noisy = strcmp(m->unit, "exact") != 0;
    *cpu_s += json_number_value(json_object_get(manifest, "cpu_s")) / job->replicates;
    const char *text = json_string_value(json_object_get(manifest, "version"));
    free(*version);
    *version = noisy && text != NULL ? strdup(text) : NULL;
    moments_free(m);
    json_decref(manifest);
    return noisy ||
           err_set(e, "%s, %s: " CONVERGE_NO_NOISE ": there is nothing that could converge",
                   job->scene->name, engine);
}

static bool render_reference(const struct converge_job *job, enum converge_engine engine, int rung,
                             int spp, struct sink *sink, double *cpu_s, char **version,
                             struct err *e)
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
    const struct reference_options opt = {.seed = seed_of(job, engine, rung, 0),
                                          .threads = job->threads,
                                          .timeout_s = job->timeout_s,
                                          .work_dir = job->dir,
                                          .share_dir = job->share_dir,
                                          .on_replicate = take_replicate,
                                          .on_replicate_ctx = sink};
    struct moments m;
    json_t *manifest;
    return reference_render(job->scene, &ref, &opt, &m, &manifest, e) &&
           finish(job, ref.engine, &m, manifest, cpu_s, version, e);
}

/* "mean" renders all replicates in one call; of "moments" each call gives one. */
static bool render_described(const struct converge_job *job, enum converge_engine engine, int rung,
                             int spp, struct sink *sink, double *cpu_s, char **version,
                             struct err *e)
{
    const struct engine *en = &job->described[engine - CONVERGE_DESCRIBED];
    const bool one_by_one = en->output == OUTPUT_MOMENTS;
    assert(one_by_one || en->output == OUTPUT_MEAN);
    while (sink->num < job->replicates) {
        const struct engine_options opt = {.spp = spp,
                                           .replicates = job->replicates,
                                           .seed = seed_of(job, engine, rung, sink->num),
                                           .threads = job->threads,
                                           .timeout_s = job->timeout_s,
                                           .work_dir = job->dir,
                                           .on_replicate = one_by_one ? NULL : take_replicate,
                                           .on_replicate_ctx = sink};
        struct moments m;
        json_t *manifest;
        if (!engine_render(en, job->scene, &opt, &m, &manifest, e))
            return false;
        if (one_by_one)
            take_moments(sink, sink->num, &m);
        if (!finish(job, en->name, &m, manifest, cpu_s, version, e))
            return false;
    }
    return true;
}

bool converge_render(const struct converge_job *job, enum converge_engine engine, int rung, int spp,
                     float *images, double *cpu_s, char **version,
                     const struct converge_progress *progress, struct err *e)
{
    struct sink sink = {images, 3 * (size_t)job->scene->width * (size_t)job->scene->height, 0,
                        progress};
    assert(engine != CONVERGE_OWN);
    *version = NULL;
    *cpu_s = 0;
    if (engine >= CONVERGE_DESCRIBED)
        return render_described(job, engine, rung, spp, &sink, cpu_s, version, e);
    if (engine >= CONVERGE_REFERENCES)
        return render_reference(job, engine, rung, spp, &sink, cpu_s, version, e);
    return render_ours(job, engine, rung, spp, &sink, cpu_s, e);
}

bool converge_render_own(const struct converge_job *job, int spp, struct moments *out,
                         struct err *e)
{
    double cpu_s;
    return render_by_pathtracer(job, "independent", spp, seed_of(job, CONVERGE_OWN, 0, 0), out,
                                &cpu_s, e);
}
