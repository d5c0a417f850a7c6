/* What a user waits for: the course's own jobs by the program, its normal images against brute force, the way from a
 * file to the first ray, and a comparison. */
#include "bench.h"
#include "bench_scenes.h"
#include "bench_sets.h"
#include "bench_timing.h"

#include "reference/base/process.h"
#include "renderer/base/fs.h"
#include "renderer/transport/render.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* CPU seconds of the course staff's program for the same job, 2019; NAN: none. */
static const struct {
    const char *scene;
    double staff_s;
} paths_jobs[] = {{"CBbunny", 84.8}, {"CBspheres_lambertian", 53.7}, {"41_cornell", NAN}};
static const char *const normal_jobs[] = {"cow", "maxplanck", "CBbunny", "44_mesh"};
enum { NUM_PATHS = 3, NUM_NORMALS = 4, NORMALS_THREADS = 2, MAX_ARGS = 32 };

/* CPU seconds of `pathtracer OPTIONS... -f OUT SCENE`, the median over rounds. */
static bool run_program(const struct bench_options *o, const char *scene, bool is_course,
                        const char *const *options, double *median, struct err *e)
{
    double cpu[BENCH_MAX_ROUNDS];
    const struct path program = fs_path("%s/pathtracer", o->build);
    const struct path image = fs_path("%s/job.exr", o->out);
    const struct path log = fs_path("%s/job.log", o->out);
    const char *argv[MAX_ARGS] = {
        program.s, "--accel", "wide", "--isa",     isa_names[o->isa],
        "-f",      image.s,   "-q",   "--dialect", is_course ? "cgl" : "auto",
        scene};
    int argc = 11;
    for (; *options != NULL; options++)
        argv[argc++] = *options;
    for (int k = 0; k < o->rounds; k++) {
        const struct process p = {.argv = argv, .log = log.s};
        struct process_usage usage;
        if (!process_run(&p, &usage, e))
            return false;
        cpu[k] = usage.cpu_s;
    }
    *median = bench_median(cpu, o->rounds);
    return true;
}

static bool is_course(const struct bench_scene *s)
{
    return s->scene.dialect == DIALECT_CGL;
}

static bool paths_job(const struct bench_options *o, int i, json_t *jobs, struct err *e)
{
    static const char *const whole[] = {"-s", "64",  "-l",  "4",  "-m", "5",
                                        "-r", "480", "360", "-t", "1",  NULL};
    static const char *const tiny[] = {"-s", "1",  "-l", "4",  "-m", "5",
                                       "-r", "16", "12", "-t", "1",  NULL};
    struct bench_scene s;
    double cpu;
    if (!bench_wanted(o, paths_jobs[i].scene) || !bench_scene_load(paths_jobs[i].scene, &s))
        return true;
    bool ok = run_program(o, s.path, is_course(&s), o->smoke ? tiny : whole, &cpu, e);
    if (ok) {
        printf("%-21s -s 64 -l 4 -m 5 -r 480 360 %9.2f CPU s", s.name, cpu);
        if (isfinite(paths_jobs[i].staff_s))
            printf("   the course staff's %.1f (2019)", paths_jobs[i].staff_s);
        putchar('\n');
        json_array_append_new(jobs, json_pack("{s:s,s:f}", "scene", s.name, "cpu_s", cpu));
    }
    scene_free(&s.scene);
    return ok;
}

/* Ratio of the time per camera ray of brute force to that of the hierarchy, the latter over all rays of the set,
 * brute force over every 997th. */
static bool brute_force_factor(const struct bench_scene *s, const struct bvh *wide, double *factor,
                               struct err *e)
{
    enum { EVERY = 997 };
    struct bvh *brute = bvh_build(&s->scene, BVH_BRUTE_FORCE, e);
    if (brute == NULL)
        return false;
    struct ray_set set = ray_set_new();
    struct answer_key a = answers_new();
    struct bvh_stats stats = {0};
    vec3 lo, hi;
    bench_scene_bounds(&s->scene, &lo, &hi);
    ray_set_camera(s, scale(add(lo, hi), 0.5f), length(sub(hi, lo)) / 2, &set);
    uint16_t lane[BATCH_LANES];
    for (int i = 0; i < BATCH_LANES; i++)
        lane[i] = (uint16_t)i;
    double start = bench_cpu_seconds();
    for (size_t b = 0; b < ray_set_batches(&set); b++)
        bvh_closest(wide, &set.batch[b], lane, ray_set_size(&set, b), &a.hit[b], &stats);
    double each = (bench_cpu_seconds() - start) / (double)set.num_rays;
    size_t num = 0;
    start = bench_cpu_seconds();
    for (size_t k = 0; k < set.num_rays; k += EVERY, num++) {
        const uint16_t one = (uint16_t)(k % BATCH_LANES);
        bvh_closest(brute, &set.batch[k / BATCH_LANES], &one, 1, &a.hit[k / BATCH_LANES], &stats);
    }
    *factor = (bench_cpu_seconds() - start) / (double)num / each;
    free(set.batch);
    free(a.hit);
    free(a.occluded);
    bvh_free(brute);
    return true;
}

static bool normals_job(const struct bench_options *o, int i, json_t *jobs, struct err *e)
{
    struct bench_scene s;
    struct camera c;
    if (!bench_wanted(o, normal_jobs[i]) || !bench_scene_load(normal_jobs[i], &s))
        return true;
    int width = o->smoke ? 40 : 800, height = o->smoke ? 30 : 600;
    struct bvh *bvh = bvh_build_on(&s.scene, BVH_WIDE, o->isa, NORMALS_THREADS, e);
    bool ok = bvh != NULL && camera_init(&c, &s.scene, width, height, e);
    double wall[BENCH_MAX_ROUNDS], cpu[BENCH_MAX_ROUNDS], factor = NAN;
    for (int k = 0; ok && k < o->rounds; k++) {
        const struct render_options opt = {.integrator = {.kind = INTEGRATE_NORMALS, .isa = o->isa},
                                           .width = width,
                                           .height = height,
                                           .num_samples = 1,
                                           .threads = NORMALS_THREADS};
        struct progress quiet;
        struct moments m;
        struct render_stats stats;
        progress_start(&quiet, "", NULL, true);
        ok = render(&s.scene, &c, bvh, &opt, &quiet, &m, &stats, e);
        if (!ok)
            break;
        moments_free(&m);
        wall[k] = stats.wall_seconds;
        cpu[k] = stats.cpu_seconds;
    }
    ok = ok && brute_force_factor(&s, bvh, &factor, e);
    if (ok) {
        double w = bench_median(wall, o->rounds), u = bench_median(cpu, o->rounds);
        printf(
            "%-21s normals %d x %d, 1 sample, %d threads: %.4f s, %.4f CPU s; a ray by brute force "
            "costs %.0f times as much\n",
            s.name, width, height, NORMALS_THREADS, w, u, factor);
        json_array_append_new(jobs, json_pack("{s:s,s:f,s:f,s:f}", "scene", s.name, "wall_s", w,
                                              "cpu_s", u, "brute_force_factor", factor));
    }
    bvh_free(bvh);
    scene_free(&s.scene);
    return ok;
}

/* The whole program for one ray. */
static bool start_job(const struct bench_options *o, int i, json_t *jobs, struct err *e)
{
    static const char *const one_ray[] = {"-s",           "1",       "-r", "1", "1",
                                          "--integrator", "normals", "-t", "1", NULL};
    struct bench_scene s;
    double cpu;
    if (!bench_wanted(o, normal_jobs[i]) || !bench_scene_load(normal_jobs[i], &s))
        return true;
    bool ok = run_program(o, s.path, is_course(&s), one_ray, &cpu, e);
    if (ok) {
        printf("%-21s %6u triangles, from the file to one ray and its picture %.4f CPU s\n", s.name,
               s.scene.num_triangles, cpu);
        json_array_append_new(jobs, json_pack("{s:s,s:I,s:f}", "scene", s.name, "triangles",
                                              (json_int_t)s.scene.num_triangles, "cpu_s", cpu));
    }
    scene_free(&s.scene);
    return ok;
}

/* The harness: `assay compare` of two renders with seeds of their own. */
static bool compare_job(const struct bench_options *o, int width, int height, json_t *jobs,
                        struct err *e)
{
    char text[2][16], file[2][4096], log[4096], assay[4096], program[4096];
    double cpu[BENCH_MAX_ROUNDS];
    snprintf(text[0], sizeof text[0], "%d", o->smoke ? 64 : width);
    snprintf(text[1], sizeof text[1], "%d", o->smoke ? 36 : height);
    snprintf(log, sizeof log, "%s/job.log", o->out);
    snprintf(program, sizeof program, "%s/pathtracer", o->build);
    snprintf(assay, sizeof assay, "%s/assay", o->build);
    for (int k = 0; k < 2; k++) {
        snprintf(file[k], sizeof file[k], "%s/side%d.exr", o->out, k);
        const char *const render[] = {program,
                                      "-q",
                                      "-s",
                                      "16",
                                      "-m",
                                      "3",
                                      "-r",
                                      text[0],
                                      text[1],
                                      "--seed",
                                      k == 0 ? "1" : "2",
                                      "-f",
                                      file[k],
                                      "reference/scenes/41_cornell.dae",
                                      NULL};
        if (!process_run(&(struct process){.argv = render, .log = log}, NULL, e))
            return false;
    }
    const char *const compare[] = {assay,  "compare", "-q",    "--accept-mdb",
                                   "1000", file[0],   file[1], NULL};
    for (int k = 0; k < o->rounds; k++) {
        struct process_usage usage;
        if (!process_run(&(struct process){.argv = compare, .log = log}, &usage, e))
            return false;
        cpu[k] = usage.cpu_s;
    }
    const double median = bench_median(cpu, o->rounds);
    printf("assay compare         moments of %s x %s, 16 samples %9.2f CPU s\n", text[0], text[1],
           median);
    json_array_append_new(
        jobs, json_pack("{s:i,s:i,s:f}", "width", width, "height", height, "cpu_s", median));
    return unlink(file[0]) == 0 && unlink(file[1]) == 0;
}

json_t *bench_jobs(const struct bench_options *o, bool *wrong, struct err *e)
{
    (void)wrong;
    json_t *paths = json_array(), *normals = json_array(), *start = json_array(),
           *compares = json_array();
    bool ok = true;
    printf("The program's own time, start and files included; medians of %d rounds\n", o->rounds);
    for (int i = 0; ok && i < NUM_PATHS; i++)
        ok = paths_job(o, i, paths, e);
    for (int i = 0; ok && i < NUM_NORMALS; i++)
        ok = normals_job(o, i, normals, e);
    for (int i = 0; ok && i < NUM_NORMALS; i++)
        ok = start_job(o, i, start, e);
    if (ok && bench_wanted(o, "41_cornell"))
        ok = compare_job(o, 1920, 1080, compares, e) && compare_job(o, 3840, 2160, compares, e);
    json_t *all = json_pack("{s:o,s:o,s:o,s:o}", "paths", paths, "normals", normals, "start", start,
                            "compare", compares);
    if (ok)
        return all;
    json_decref(all);
    return NULL;
}
