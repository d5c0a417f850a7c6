#include "bench_engines.h"
#include "bench_povray.h"

#include "reference/replicates/engine_driver.h"
#include "renderer/base/fs.h"
#include "renderer/transport/render.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>

const char *const bench_engine_names[BENCH_NUM_ENGINES] = {
    [BENCH_LIGHT] = "ours, light",   [BENCH_MIS] = "ours, mis",    [BENCH_SOBOL] = "ours, sobol",
    [BENCH_GUIDED] = "ours, guided", [BENCH_EMBREE] = "on Embree", [BENCH_CYCLES] = "Cycles",
    [BENCH_POVRAY] = "POV-Ray"};

/* User and system time of this process and of the children that it has waited for. */
static double all_cpu_seconds(void)
{
    double sum = 0;
    const int who[] = {RUSAGE_SELF, RUSAGE_CHILDREN};
    for (int i = 0; i < 2; i++) {
        struct rusage u;
        getrusage(who[i], &u);
        sum += (double)(u.ru_utime.tv_sec + u.ru_stime.tv_sec) +
               1e-6 * (double)(u.ru_utime.tv_usec + u.ru_stime.tv_usec);
    }
    return sum;
}

static bool render_ours(enum bench_engine engine, const struct bench_view *v, int spp,
                        uint32_t seed, float *image, struct err *e)
{
    const struct render_options opt = {
        .integrator = {.direct = engine == BENCH_LIGHT ? DIRECT_LIGHT : DIRECT_MIS,
                       .max_bounces = v->depth,
                       .light_samples = 1,
                       .roulette = ROULETTE_THROUGHPUT,
                       .isa = v->isa,
                       .guiding = engine == BENCH_GUIDED,
                       .sampler = {engine == BENCH_SOBOL || engine == BENCH_GUIDED
                                       ? SAMPLER_SOBOL
                                       : SAMPLER_INDEPENDENT,
                                   seed}},
        .width = v->camera.width,
        .height = v->camera.height,
        .num_samples = (uint32_t)spp,
        .threads = 1};
    struct progress quiet;
    struct moments m;
    struct render_stats stats;
    progress_start(&quiet, "", NULL, true);
    if (!render(&v->scene, &v->camera, v->bvh, &opt, &quiet, &m, &stats, e))
        return false;
    for (size_t i = 0; i < 3 * (size_t)m.width * (size_t)m.height; i++)
        image[i] = (float)m.mean[i];
    moments_free(&m);
    return true;
}

struct sink {
    float *images;
    size_t size;
};

static void take_replicate(void *ctx, int k, const float *pixels_rgb)
{
    struct sink *s = ctx;
    memcpy(s->images + (size_t)k * s->size, pixels_rgb, s->size * sizeof *pixels_rgb);
}

static bool render_cycles(const struct bench_view *v, int spp, int count, uint32_t seed,
                          const char *work_dir, float *images, struct err *e)
{
    struct suite_scene suite = {
        .width = v->camera.width, .height = v->camera.height, .depth = v->depth};
    struct suite_reference ref = {.replicates = count, .spp = spp};
    struct sink sink = {images, 3 * (size_t)suite.width * (size_t)suite.height};
    const struct reference_options opt = {.seed = seed,
                                          .threads = 1,
                                          .timeout_s = 3600,
                                          .work_dir = work_dir,
                                          .share_dir = "reference",
                                          .on_replicate = take_replicate,
                                          .on_replicate_ctx = &sink};
    snprintf(suite.name, sizeof suite.name, "%s", v->name);
    const struct path dir = fs_path("%s/engine", work_dir);
    const struct reference_job job = {&suite, &ref, &opt, &v->scene, &v->camera, dir.s};
    struct moments m;
    json_t *manifest = json_object();
    bool ok = fs_remove_tree(dir.s, e) && fs_make_dirs(dir.s, e) &&
              engine_driver_render(&cycles_driver, &job, &m, manifest, e);
    json_decref(manifest);
    if (!ok)
        return false;
    moments_free(&m);
    return fs_remove_tree(dir.s, e);
}

bool bench_engine_render(enum bench_engine engine, const struct bench_view *v, int spp, int count,
                         uint32_t seed, const char *work_dir, float *images, double *cpu_s,
                         struct err *e)
{
    size_t size = 3 * (size_t)v->camera.width * (size_t)v->camera.height;
    double start = all_cpu_seconds();
    bool ok = true;
    switch (engine) {
    case BENCH_LIGHT:
    case BENCH_MIS:
    case BENCH_SOBOL:
    case BENCH_GUIDED:
        for (int k = 0; ok && k < count; k++)
            ok = render_ours(engine, v, spp, replicate_seed(seed, k), images + (size_t)k * size, e);
        break;
    case BENCH_EMBREE:
        for (int k = 0; k < count; k++)
            embree_tracer_render(v->embree, &v->camera, v->depth, spp, replicate_seed(seed, k),
                                 images + (size_t)k * size);
        break;
    case BENCH_CYCLES: ok = render_cycles(v, spp, count, seed, work_dir, images, e); break;
    case BENCH_POVRAY:
        for (int k = 0; ok && k < count; k++)
            ok = bench_povray(v, (int)lround(sqrt(spp)), k, replicate_seed(seed, k), work_dir,
                              images + (size_t)k * size, e);
        break;
    case BENCH_NUM_ENGINES: break;
    }
    *cpu_s = all_cpu_seconds() - start;
    return ok;
}
