#include "run_pathtracer.h"

#include "reference/base/process.h"
#include "renderer/base/fs.h"
#include "renderer/pathtracer/options.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { MAX_ARGUMENTS = 64 };

/* As renderer/pathtracer/output.c writes it. */
static struct pathtracer_rays read_rays(const struct image *im)
{
    struct pathtracer_rays r;
    const char *text = image_get_attr(im, "assay:rays");
    if (text != NULL && sscanf(text, "%lf rays, %lf box tests, %lf primitive tests", &r.rays,
                               &r.box_tests, &r.primitive_tests) == 3)
        return r;
    return (struct pathtracer_rays){0};
}

/* Runs the program; seed: one seed or several, separated by commas. */
static bool run(const struct pathtracer_job *job, const char *seed, double timeout_s, double *cpu_s,
                struct err *e)
{
    const struct path image = fs_path("%s.exr", job->files), log = fs_path("%s.log", job->files);
    const struct suite_scene *s = job->scene;
    char width[16], height[16], spp[16], depth[16], threads[16], lens[32], focus[32];
    char range[32], filter[PIXEL_FILTER_TEXT];
    snprintf(width, sizeof width, "%d", s->width);
    snprintf(height, sizeof height, "%d", s->height);
    snprintf(spp, sizeof spp, "%d", job->spp);
    snprintf(depth, sizeof depth, "%d", s->depth);
    snprintf(threads, sizeof threads, "%d", job->threads);
    snprintf(lens, sizeof lens, "%.17g", s->lens_radius);
    snprintf(focus, sizeof focus, "%.17g", s->focal_distance);
    snprintf(range, sizeof range, "%d:%d", job->first, job->spp);
    const char *argv[MAX_ARGUMENTS] = {job->program, "-r", width, height,  "-s",
                                       spp,          "-m", depth, "-t",    threads,
                                       "--seed",     seed, "-f",  image.s, s->dae};
    int argc = 15;
    if (s->environment[0] != '\0') {
        argv[argc++] = "-e";
        argv[argc++] = s->environment;
    }
    if (s->lens_radius > 0) {
        argv[argc++] = "-b";
        argv[argc++] = lens;
        argv[argc++] = "-d";
        argv[argc++] = focus;
    }
    if (s->filter.radius > 0) {
        pixel_filter_print(&s->filter, filter);
        argv[argc++] = "--filter";
        argv[argc++] = filter;
    }
    if (job->first > 0) {
        argv[argc++] = "--samples";
        argv[argc++] = range;
    }
    for (const char *const *o = job->options; o != NULL && *o != NULL; o++) {
        if (argc == MAX_ARGUMENTS - 1)
            return err_set(e, "%s: too many options", s->name);
        argv[argc++] = *o;
    }
    const struct process p = {.argv = argv, .log = log.s, .timeout_s = timeout_s};
    struct process_usage usage;
    if (!process_run(&p, &usage, e))
        return false;
    *cpu_s = usage.cpu_s;
    if (!job->keep)
        unlink(log.s);
    return true;
}

static bool read_image(const struct suite_scene *s, const char *path, bool keep,
                       struct moments *out, struct pathtracer_rays *rays, struct err *e)
{
    struct image im;
    bool ok = moments_read(path, out, &im, e);
    if (!keep)
        unlink(path);
    if (!ok)
        return false;
    if (rays != NULL)
        *rays = read_rays(&im);
    image_free(&im);
    if (out->width == s->width && out->height == s->height)
        return true;
    err_set(e, "%s: pathtracer wrote %d x %d pixels instead of %d x %d", s->name, out->width,
            out->height, s->width, s->height);
    moments_free(out);
    return false;
}

bool run_pathtracer(const struct pathtracer_job *job, struct moments *out, double *cpu_s,
                    struct pathtracer_rays *rays, struct err *e)
{
    char seed[32];
    snprintf(seed, sizeof seed, "%llu", (unsigned long long)job->seed);
    return run(job, seed, job->timeout_s, cpu_s, e) &&
           read_image(job->scene, fs_path("%s.exr", job->files).s, job->keep, out, rays, e);
}

bool run_pathtracer_seeds(const struct pathtracer_job *job, const uint64_t *seed, int num,
                          struct moments *out, double *cpu_s, struct err *e)
{
    char text[24 * MAX_SEEDS];
    size_t at = 0;
    int done = 0;
    assert(num > 0 && num <= MAX_SEEDS);
    for (int k = 0; k < num; k++)
        at += (size_t)snprintf(text + at, sizeof text - at, "%s%llu", k > 0 ? "," : "",
                               (unsigned long long)seed[k]);
    bool ok = run(job, text, num * job->timeout_s, cpu_s, e);
    while (ok && done < num) {
        const struct path image =
            num == 1 ? fs_path("%s.exr", job->files)
                     : fs_path("%s_%llu.exr", job->files, (unsigned long long)seed[done]);
        ok = read_image(job->scene, image.s, false, &out[done], NULL, e);
        done += ok;
    }
    while (!ok && done > 0)
        moments_free(&out[--done]);
    return ok;
}
