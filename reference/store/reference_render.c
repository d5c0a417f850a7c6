#include "reference_render.h"

#include "reference/replicates/engine_driver.h"
#include "reference/truth/truth.h"

#include "renderer/base/fs.h"

#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

/* One round on 31 bits; each step can be undone, so different x stay different. */
static uint32_t mix31(uint32_t x, uint32_t key)
{
    const uint32_t mask = 0x7fffffff;
    x = (x + key) & mask;
    x ^= x >> 15;
    x = (x * 0x2c1b3c6d) & mask;
    x ^= x >> 12;
    x = (x * 0x297a2d39) & mask;
    return x ^ x >> 15;
}

/* A permutation of the 31-bit numbers, another one for each seed. */
static uint32_t permute31(uint32_t x, uint32_t seed)
{
    x = mix31(x, (seed & 0xffff) + 0x3c6ef372);
    x = mix31(x, (seed >> 16) + 0x1b873593);
    return mix31(x, (seed * 0x9e3779b1) >> 8);
}

uint32_t replicate_seed(uint32_t seed, int k)
{
    assert(k >= 0 && k < INT32_MAX);
    uint32_t x = permute31((uint32_t)k, seed);
    return x != 0 ? x : permute31(INT32_MAX, seed); /* which no k has taken */
}

static double clock_s(clockid_t id)
{
    struct timespec t;
    clock_gettime(id, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Of this process and of all children that were waited for. */
static double cpu_s(void)
{
    struct rusage r;
    getrusage(RUSAGE_CHILDREN, &r);
    return clock_s(CLOCK_PROCESS_CPUTIME_ID) + (double)(r.ru_utime.tv_sec + r.ru_stime.tv_sec) +
           1e-6 * (double)(r.ru_utime.tv_usec + r.ru_stime.tv_usec);
}

struct timing timing_start(void)
{
    struct timing t = {.wall_s = clock_s(CLOCK_MONOTONIC), .cpu_s = cpu_s()};
    time_t now = time(NULL);
    struct tm tm;
    strftime(t.date, sizeof t.date, "%Y-%m-%dT%H:%M:%SZ", gmtime_r(&now, &tm));
    return t;
}

void timing_stop(struct timing *t)
{
    t->wall_s = clock_s(CLOCK_MONOTONIC) - t->wall_s;
    t->cpu_s = cpu_s() - t->cpu_s;
}

const struct engine_driver *engine_driver_of(const char *engine)
{
    return strcmp(engine, cycles_driver.engine) == 0   ? &cycles_driver
           : strcmp(engine, povray_driver.engine) == 0 ? &povray_driver
                                                       : NULL;
}

struct here {
    const struct engine_driver *driver;
    const char *dir;
};

static void path_here(const void *ctx, int k, char path[REPLICATE_IMAGE_PATH])
{
    const struct here *h = ctx;
    replicate_images_path(h->dir, h->driver->prefix, k, path);
}

bool engine_driver_render(const struct engine_driver *driver, const struct reference_job *job,
                          struct moments *out, json_t *manifest, struct err *e)
{
    const struct here here = {driver, job->dir};
    const struct replicate_images pictures = {path_here, &here};
    int num;
    json_t *said = json_object();
    bool ok = driver->count(job, &num, e) && driver->render(job, 0, num, said, e) &&
              driver->fold(job, &pictures, said, out, manifest, e);
    json_decref(said);
    return ok;
}

bool reference_in_directory(const struct suite_scene *scene, const struct suite_reference *ref,
                            const struct reference_options *opt,
                            bool (*act)(const struct reference_job *job, void *ctx, struct err *e),
                            void *ctx, struct err *e)
{
    char dir[4096];
    int n = snprintf(dir, sizeof dir, "%s/%s-%s-XXXXXX", opt->work_dir, scene->name, ref->engine);
    if (n < 0 || (size_t)n >= sizeof dir)
        return err_set(e, "%.64s...: path too long", opt->work_dir);
    if (mkdtemp(dir) == NULL)
        return err_set(e, "%s: cannot make a directory in it: %s", opt->work_dir, strerror(errno));
    struct scene s = {0};
    struct camera camera;
    struct reference_job job = {
        .suite = scene, .ref = ref, .opt = opt, .scene = &s, .camera = &camera, .dir = dir};
    bool ok = suite_open(scene, &s, &camera, e);
    if (ok) {
        ok = act(&job, ctx, e);
        scene_free(&s);
    }
    if (ok)
        return fs_remove_tree(dir, e);
    if (rmdir(dir) != 0) {
        struct err what = *e;
        err_set(e, "%.900s (see %s)", what.msg, dir);
    }
    return false;
}

struct whole {
    struct moments *out;
    json_t *manifest;
    bool rendered;
};

static bool render_whole(const struct reference_job *job, void *ctx, struct err *e)
{
    struct whole *w = ctx;
    return w->rendered = engine_driver_render(engine_driver_of(job->ref->engine), job, w->out,
                                              w->manifest, e);
}

static bool engine_render(const struct suite_scene *scene, const struct suite_reference *ref,
                          const struct reference_options *opt, struct moments *out,
                          json_t *manifest, struct err *e)
{
    struct whole w = {.out = out, .manifest = manifest};
    if (reference_in_directory(scene, ref, opt, render_whole, &w, e))
        return true;
    if (w.rendered)
        moments_free(out);
    return false;
}

bool reference_describe(const struct suite_scene *scene, const struct suite_reference *ref,
                        const struct reference_options *opt, const struct timing *t,
                        const struct moments *m, json_t *manifest)
{
    json_t *common = json_pack(
        "{ss,ss,ss,ss,ss,sf,si,si,si,si,si,si,sI,sf,sf}", "scene", scene->name, "scene_sha256",
        scene->sha256, "engine", ref->engine, "date", t->date, "unit", m->unit, "spp_of_unit",
        m->spp, "width", scene->width, "height", scene->height, "depth", scene->depth, "replicates",
        ref->replicates, "spp", ref->spp, "subgrid", ref->subgrid, "seed", (json_int_t)opt->seed,
        "cpu_s", t->cpu_s, "wall_s", t->wall_s);
    bool ok = common != NULL && json_object_update(manifest, common) == 0;
    json_decref(common);
    return ok;
}

bool reference_render(const struct suite_scene *scene, const struct suite_reference *ref,
                      const struct reference_options *opt, struct moments *out, json_t **manifest,
                      struct err *e)
{
    bool is_truth = strcmp(ref->engine, "truth") == 0;
    if (!is_truth && engine_driver_of(ref->engine) == NULL)
        return err_set(e, "%s: unknown reference engine '%s'", scene->name, ref->engine);
    struct timing t = timing_start();
    json_t *m = json_object();
    if (is_truth ? !truth_render(scene, ref, out, e) : !engine_render(scene, ref, opt, out, m, e)) {
        json_decref(m);
        return err_prefix(e, "%s, %s", scene->name, ref->engine);
    }
    timing_stop(&t);
    bool ok = reference_describe(scene, ref, opt, &t, out, m);
    if (ok && is_truth)
        ok = json_object_set_new(m, "kind", json_string(ref->kind)) == 0 &&
             json_object_set(m, "values", ref->values) == 0;
    if (!ok) {
        json_decref(m);
        moments_free(out);
        return err_set(e, "%s, %s: out of memory", scene->name, ref->engine);
    }
    *manifest = m;
    return true;
}
