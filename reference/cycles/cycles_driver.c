/* The Cycles driver: writes the scene dump, runs one Blender process for all replicates requested, folds their
 * images. */
#include "blender.h"
#include "export_cycles.h"
#include "reference/replicates/engine_driver.h"
#include "reference/replicates/independence.h"
#include "reference/base/process.h"

#include "renderer/base/fs.h"
#include "renderer/base/sha256.h"
#include "reference/base/json_file.h"

#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The seeds of replicates first .. last-1. */
static json_t *seeds_of(const struct reference_job *job, int first, int last)
{
    json_t *seeds = json_array();
    for (int k = first; k < last; k++)
        json_array_append_new(
            seeds, json_integer(replicate_seed(job->opt->seed, job->opt->first_replicate + k)));
    return seeds;
}

static bool write_seeds(const struct reference_job *job, int first, int last, struct err *e)
{
    const struct path path = fs_path("%s/seeds.json", job->dir);
    json_t *seeds = seeds_of(job, first, last);
    bool ok = json_write(path.s, seeds, e);
    json_decref(seeds);
    return ok;
}

/* Parses the line that cycles.py prints at the very end: "ASSAY OK {...}". The caller releases *report. */
static bool read_report(const char *log, json_t **report, struct err *e)
{
    static const char mark[] = "ASSAY OK ";
    FILE *f = fopen(log, "r");
    if (f == NULL)
        return err_set(e, "%s: cannot read: %s", log, strerror(errno));
    char *line = NULL;
    size_t size = 0;
    *report = NULL;
    while (*report == NULL && getline(&line, &size, f) > 0)
        if (strncmp(line, mark, sizeof mark - 1) == 0)
            *report = json_loads(line + sizeof mark - 1, 0, NULL);
    free(line);
    fclose(f);
    const char *version = json_string_value(json_object_get(*report, "version"));
    if (version != NULL && json_is_object(json_object_get(*report, "settings")))
        return true;
    json_decref(*report);
    *report = NULL;
    return err_set(e, "blender: ended without the OK line of cycles.py");
}

/* Folds all replicates into *out. */
static bool fold_replicates(const struct reference_job *job, const struct replicate_images *images,
                            struct moments *out, json_t *manifest, struct err *e)
{
    int width = job->suite->width, height = job->suite->height;
    int count = job->ref->replicates;
    size_t pixels = (size_t)width * (size_t)height;
    struct moments m = {0};
    struct replicates all = {0};
    struct replicate_repeats repeats = {0};
    bool ok = replicate_repeats_alloc(&repeats, count, e) && moments_alloc(&m, width, height, e) &&
              replicates_alloc(&all, width, height, count, e);
    strcpy(m.unit, "replicate");
    m.spp = job->ref->spp;
    for (int k = 0; ok && k < count; k++) {
        char path[REPLICATE_IMAGE_PATH];
        images->path_of(images->ctx, k, path);
        float *px = replicate_images_read(path, width, height, false, e);
        ok = px != NULL;
        if (!ok)
            break;
        replicate_repeats_add(&repeats, px, pixels);
        moments_add_image(&m, px);
        if (job->opt->on_replicate != NULL)
            job->opt->on_replicate(job->opt->on_replicate_ctx, k, px);
        replicates_add(&all, px);
        free(px);
    }
    if (ok && repeats.without_noise) {
        moments_make_exact(&m);
    } else if (ok && repeats.same >= 0) {
        ok = err_set(
            e, "Cycles: replicate %d is the same image as an earlier one: the seed has no effect",
            repeats.same);
    } else if (ok) {
        ok = independence_check(&all, manifest, e) || err_prefix(e, "Cycles");
    }
    replicates_free(&all);
    replicate_repeats_free(&repeats);
    if (ok)
        *out = m;
    else
        moments_free(&m);
    return ok;
}

static bool fold(const struct reference_job *job, const struct replicate_images *images,
                 const json_t *said, struct moments *out, json_t *manifest, struct err *e)
{
    static const char *const told[] = {"version", "settings", "binary_sha256", "command"};
    if (!fold_replicates(job, images, out, manifest, e))
        return false;
    for (size_t i = 0; i < sizeof told / sizeof *told; i++)
        json_object_set(manifest, told[i], json_object_get(said, told[i]));
    json_object_set_new(manifest, "seeds", seeds_of(job, 0, job->ref->replicates));
    return true;
}

static bool count(const struct reference_job *job, int *num, struct err *e)
{
    (void)e;
    *num = job->ref->replicates;
    return true;
}

static bool write_key(const struct reference_job *job, const char *path, struct err *e)
{
    return export_cycles(job->scene, job->camera, job->suite->depth, path, e);
}

static const char *const scripts[] = {"cycles/cycles.py",
                                      "cycles/cycles_blender.py",
                                      "cycles/cycles_geometry.py",
                                      "cycles/cycles_light.py",
                                      "cycles/cycles_material.py",
                                      "cycles/cycles_texture.py",
                                      NULL};

/* Image first + i is replicate_<i>.exr, as cycles.py names it. */
static bool render(const struct reference_job *job, int first, int last, json_t *said,
                   struct err *e)
{
    char blender[4096], sha256[65], command[512];
    json_t *report = NULL;
    assert(last > first && job->ref->spp > 0 && job->opt->threads > 0);
    if (!process_find("blender", blender, sizeof blender))
        return err_set(e, "blender: no such program in PATH (Blender 3.4 with Cycles)");
    snprintf(command, sizeof command,
             BLENDER_RUN "cycles.py -- --scene scene.json --spp %d --threads %d --seeds seeds.json",
             job->ref->spp, job->opt->threads);
    if (!sha256_file(blender, sha256, e) ||
        !write_key(job, fs_path("%s/scene.json", job->dir).s, e) ||
        !write_seeds(job, first, last, e) ||
        !blender_run(command, job->opt->share_dir, scripts[0], job->dir, job->opt->timeout_s, e) ||
        !read_report(fs_path("%s/blender.log", job->dir).s, &report, e))
        return false;
    json_object_update_new(said,
                           json_pack("{sO,sO,ss,ss}", "version", json_object_get(report, "version"),
                                     "settings", json_object_get(report, "settings"),
                                     "binary_sha256", sha256, "command", command));
    json_decref(report);
    return true;
}

const struct engine_driver cycles_driver = {.scripts = scripts,
                                            .prefix = "replicate",
                                            .count = count,
                                            .render = render,
                                            .fold = fold,
                                            .write_key = write_key};
