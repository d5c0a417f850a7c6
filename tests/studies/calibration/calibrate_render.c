#include "calibrate_render.h"

#include "reference/suite/suite.h"
#include "renderer/transport/render.h"

#include <stdio.h>
#include <stdlib.h>

enum { EACH = 10, TILE = 8 };

struct render_job {
    const struct render_cell *cell;
    struct null_run run;
    struct scene scene;
    struct camera camera;
    struct bvh *bvh;
    int depth;
};

static bool image(const struct render_job *job, uint64_t seed, struct moments *m, struct err *e)
{
    struct progress quiet;
    struct render_stats stats;
    struct render_options o = {
        .integrator = {.kind = INTEGRATE_PATHS,
                       .direct = DIRECT_MIS,
                       .max_bounces = job->depth,
                       .light_samples = 1,
                       .roulette = ROULETTE_THROUGHPUT,
                       .sampler = {SAMPLER_INDEPENDENT, seed}},
        .width = job->cell->side,
        .height = job->cell->side,
        .num_samples = (uint32_t)job->cell->spp,
        .threads = 1,
    };
    progress_start(&quiet, "", NULL, true);
    return render(&job->scene, &job->camera, job->bvh, &o, &quiet, m, &stats, e);
}

static bool replicates(const struct render_job *job, uint64_t seed, struct moments *m,
                       struct err *e)
{
    int side = job->cell->side;
    size_t values = 3 * (size_t)side * (size_t)side;
    float *mean = malloc(values * sizeof *mean);
    if (mean == NULL)
        return err_set(e, "out of memory for a replicate");
    bool ok = moments_alloc(m, side, side, e);
    for (int k = 0; ok && k < job->cell->replicates; k++) {
        struct moments one;
        ok = image(job, seed + (uint64_t)k, &one, e);
        if (!ok)
            break;
        for (size_t i = 0; i < values; i++)
            mean[i] = (float)one.mean[i];
        moments_add_image(m, mean);
        moments_free(&one);
    }
    snprintf(m->unit, sizeof m->unit, "replicate");
    m->spp = job->cell->spp;
    free(mean);
    if (!ok)
        moments_free(m);
    return ok;
}

static bool render_part(void *arg, int part, size_t first, size_t end, double count[PAIR_COUNTS],
                        struct err *e)
{
    (void)part;
    (void)count;
    struct render_job *job = arg;
    const struct render_cell *cell = job->cell;
    uint64_t per_pair = 1 + (cell->replicates > 0 ? (uint64_t)cell->replicates : 1);
    bool ok = true;
    for (size_t i = first; ok && i < end; i++) {
        uint64_t seed = (cell->seed << 32) + i * per_pair;
        struct moments a = {0}, b = {0};
        if (!image(job, seed, &a, e))
            return false;
        ok = (cell->replicates > 0 ? replicates : image)(job, seed + 1, &b, e);
        if (ok) {
            ok = null_pair(&job->run, i, &a, &b, TILE, e);
            moments_free(&b);
        }
        moments_free(&a);
    }
    return ok;
}

double render_cost(const struct render_cell *cell, size_t pairs)
{
    double pixels = (double)cell->side * cell->side;
    double images = cell->replicates > 0 ? 1 + cell->replicates : 2;
    return (double)pairs * pixels * (images * cell->spp * 1e-3 + 5e-3);
}

static bool open_scene(struct render_job *job, const char *scenes, struct err *e)
{
    struct suite suite;
    if (!suite_load(scenes, &suite, e))
        return false;
    const struct suite_scene *s = suite_find(&suite, job->cell->scene);
    bool ok = s != NULL ? suite_open(s, &job->scene, &job->camera, e)
                        : err_set(e, "%s has no scene %s", scenes, job->cell->scene);
    if (ok) {
        job->depth = s->depth;
        ok = camera_init(&job->camera, &job->scene, job->cell->side, job->cell->side, e) &&
             (job->bvh = bvh_build(&job->scene, BVH_SAH, e)) != NULL;
        if (!ok)
            scene_free(&job->scene);
    }
    suite_free(&suite);
    return ok;
}

bool render_run(struct work *w, const char *scenes, const struct render_cell *cell,
                enum weakness weakness, size_t pairs, struct null_result *out, struct err *e)
{
    struct render_job job = {.cell = cell};
    double count[PAIR_COUNTS];
    char name[64];
    const size_t all[NUM_LEVELS] = {pairs, pairs, pairs};
    if (cell->replicates > 0)
        snprintf(name, sizeof name, "%s, %dx%d, %d and %d x %d", cell->scene, cell->side,
                 cell->side, cell->spp, cell->replicates, cell->spp);
    else
        snprintf(name, sizeof name, "%s, %dx%d, %d and %d", cell->scene, cell->side, cell->side,
                 cell->spp, cell->spp);
    if (!open_scene(&job, scenes, e))
        return false;
    bool ok = null_init(&job.run, weakness, all, e) &&
              pairs_run(w, pairs, EACH, render_cost(cell, pairs), render_part, &job, count, e) &&
              null_summary(&job.run, name, false, out, e);
    null_free(&job.run);
    bvh_free(job.bvh);
    scene_free(&job.scene);
    return ok || err_prefix(e, "%s", name);
}
