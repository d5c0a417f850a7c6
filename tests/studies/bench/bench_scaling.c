/* What a render costs as it grows: by triangles (building, tracing; ours and Embree's), threads, pixels and
 * samples. */
#include "bench.h"
#include "bench_timing.h"
#include "bench_tracers.h"
#include "tests/support/mesh.h"

#include "renderer/transport/render.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

struct at_size {
    double triangles, build[2], mrays[2], bytes; /* 0: ours, 1: Embree's; seconds */
};

/* One mesh, with incoherent rays as after the first bounce: from a terrain's surface in all directions. */
static struct at_size measure_mesh(const struct bench_options *o, uint32_t triangles)
{
    struct bench_scene of = {.scene = mesh_terrain((uint32_t)sqrt(triangles / 2.0), 1)};
    const struct scene *s = &of.scene;
    struct at_size out = {.triangles = s->num_triangles};
    double build[2][BENCH_MAX_ROUNDS], rate[2][BENCH_MAX_ROUNDS];
    int builds = triangles > 2000000 ? 1 : o->rounds;
    struct tracer t[2] = {0};
    for (int k = 0; k < builds; k++) {
        if (k > 0) {
            tracer_free(&t[0]);
            tracer_free(&t[1]);
        }
        t[0] = tracer_ours(s, o->isa);
        t[1] = tracer_embree("embree", s, RTC_SCENE_FLAG_NONE);
        for (int j = 0; j < 2; j++)
            build[j][k] = t[j].build_seconds;
    }
    out.bytes = (double)t[0].bytes / s->num_triangles;
    struct ray_set primary = ray_set_new(), bounce = ray_set_new(), shadow = ray_set_new();
    struct answer_key a = answers_new();
    struct bvh_stats stats = {0};
    vec3 lo, hi;
    bench_scene_bounds(s, &lo, &hi);
    float size = length(sub(hi, lo)) / 2;
    ray_set_camera(&of, scale(add(lo, hi), 0.5f), size, &primary);
    tracer_run(&t[0], &primary, false, &a, &stats);
    ray_set_go_on(s, &primary, &a, size, v3(1, 4, 1), 73, &bounce, &shadow);
    for (int k = 0; k < o->rounds; k++)
        for (int j = 0; j < 2; j++)
            rate[j][k] =
                (double)bounce.num_rays / tracer_run(&t[j], &bounce, false, &a, &stats) * 1e-6;
    for (int j = 0; j < 2; j++) {
        out.build[j] = bench_median(build[j], builds);
        out.mrays[j] = bench_median(rate[j], o->rounds);
        tracer_free(&t[j]);
    }
    free(primary.batch);
    free(bounce.batch);
    free(shadow.batch);
    free(a.hit);
    free(a.occluded);
    scene_free(&of.scene);
    return out;
}

static void by_triangles(const struct bench_options *o, json_t *all)
{
    json_t *rows = json_array();
    printf("%-10s %11s %11s %8s %10s %10s %8s %7s\n", "triangles", "build s", "Embree's", "ratio",
           "Mrays/s", "Embree's", "ratio", "B/tri");
    for (double n = 1e3; n < (o->smoke ? 2e3 : 2e7); n *= 10) {
        struct at_size r = measure_mesh(o, (uint32_t)n);
        printf("%-10.0f %11.5f %11.5f %8.2f %10.2f %10.2f %8.2f %7.1f\n", r.triangles, r.build[0],
               r.build[1], r.build[1] / r.build[0], r.mrays[0], r.mrays[1], r.mrays[0] / r.mrays[1],
               r.bytes);
        json_array_append_new(rows, json_pack("{s:f,s:[f,f],s:[f,f],s:f}", "triangles", r.triangles,
                                              "build_cpu_s", r.build[0], r.build[1],
                                              "mrays_per_cpu_second", r.mrays[0], r.mrays[1],
                                              "bytes_per_triangle", r.bytes));
    }
    json_object_set_new(all, "triangles", rows);
}

/* A render of 44_mesh, or its first pass. */
static bool measure_render(const struct bench_options *o, const struct bench_scene *s, int side,
                           int spp, int threads, double *wall, double *cpu, struct err *e)
{
    struct camera c;
    double w[BENCH_MAX_ROUNDS], u[BENCH_MAX_ROUNDS];
    struct bvh *bvh = bvh_build_on(&s->scene, BVH_WIDE, o->isa, threads, e);
    bool ok = bvh != NULL && camera_init(&c, &s->scene, side, side, e);
    for (int k = 0; ok && k < o->rounds; k++) {
        const struct render_options opt = {
            .integrator = {.direct = DIRECT_MIS,
                           .max_bounces = 5,
                           .light_samples = 1,
                           .roulette = ROULETTE_THROUGHPUT,
                           .sampler = {SAMPLER_INDEPENDENT, (uint64_t)k},
                           .isa = o->isa},
            .width = side,
            .height = side,
            .num_samples = (uint32_t)spp,
            .threads = threads};
        struct progress quiet;
        struct moments m;
        struct render_stats stats;
        progress_start(&quiet, "", NULL, true);
        ok = render(&s->scene, &c, bvh, &opt, &quiet, &m, &stats, e);
        if (!ok)
            break;
        moments_free(&m);
        w[k] = stats.wall_seconds;
        u[k] = stats.cpu_seconds;
    }
    bvh_free(bvh);
    if (!ok)
        return false;
    *wall = bench_median(w, o->rounds);
    *cpu = bench_median(u, o->rounds);
    return true;
}

enum kind { BY_THREADS, BY_PIXELS, BY_SAMPLES };

/* One table; `first` and twice, or four times as much each, up to `last`. */
static bool by(const struct bench_options *o, const struct bench_scene *s, enum kind kind,
               int first, int last, json_t *all, struct err *e)
{
    static const char *const words[] = {"threads", "pixels", "samples"};
    json_t *rows = json_array();
    bool ok = true;
    const int side = o->smoke ? 16 : 128, spp = o->smoke ? 1 : 16;
    printf("%-10s %11s %11s %14s\n", words[kind], "wall s", "CPU s", "CPU us a path");
    for (int n = first; ok && n <= last; n *= kind == BY_SAMPLES ? 4 : 2) {
        double wall, cpu;
        int width = kind == BY_PIXELS ? n : side, samples = kind == BY_SAMPLES ? n : spp;
        ok = measure_render(o, s, width, samples, kind == BY_THREADS ? n : 1, &wall, &cpu, e);
        if (!ok)
            break;
        double x = kind == BY_PIXELS ? (double)n * n : n;
        printf("%-10.0f %11.4f %11.4f %14.3f\n", x, wall, cpu,
               cpu / ((double)width * width * samples) * 1e6);
        json_array_append_new(
            rows, json_pack("{s:f,s:f,s:f}", words[kind], x, "wall_s", wall, "cpu_s", cpu));
    }
    json_object_set_new(all, words[kind], rows);
    return ok;
}

json_t *bench_scaling(const struct bench_options *o, bool *wrong, struct err *e)
{
    (void)wrong;
    json_t *all = json_object();
    struct bench_scene s;
    int threads = (int)sysconf(_SC_NPROCESSORS_ONLN);
    printf(
        "Medians of %d rounds. Building and rays: one thread. Wall times hold on an idle machine only.\n",
        o->rounds);
    bool ok = true;
    by_triangles(o, all);
    if (bench_scene_load("44_mesh", &s)) {
        ok = by(o, &s, BY_THREADS, 1, o->smoke ? 2 : threads, all, e) &&
             by(o, &s, BY_PIXELS, o->smoke ? 8 : 32, o->smoke ? 16 : 512, all, e) &&
             by(o, &s, BY_SAMPLES, 1, o->smoke ? 4 : 256, all, e);
        scene_free(&s.scene);
    }
    if (ok)
        return all;
    json_decref(all);
    return NULL;
}
