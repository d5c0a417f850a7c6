/* Drives Blender: the dump, one Blender process for all replicates, then the fold. */
#define _GNU_SOURCE
#include "job.h"

#include "export_cycles.h"
#include "independence.h"
#include "process.h"

#include "../renderer/sha256.h"
#include "../renderer/fs.h"
#include "json_file.h"

#include <assert.h>
#include <errno.h>
#include <math.h>
#include <nettle/sha2.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PATH_SIZE = 4096 + 64 };

static bool write_seeds(const struct reference_job *job, json_t **seeds, struct err *e)
{
    char path[PATH_SIZE];
    snprintf(path, sizeof path, "%s/seeds.json", job->dir);
    *seeds = json_array();
    for (int k = 0; k < job->ref->replicates; k++)
        if (json_array_append_new(*seeds, json_integer(replicate_seed(
                                              job->opt->seed, job->opt->first_replicate + k))) != 0)
            return err_set(e, "out of memory");
    return json_write(path, *seeds, e);
}

/* What cycles.py says at the very end: "ASSAY OK {...}". */
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

/* RGB of a replicate, packed; the caller frees. */
static float *read_replicate(const struct reference_job *job, const char *path, struct err *e)
{
    struct image im = {0};
    bool half;
    if (!image_read_exr(path, &im, &half, e))
        return NULL;
    size_t pixels = (size_t)im.width * (size_t)im.height;
    int at[3] = {image_channel(&im, "R"), image_channel(&im, "G"), image_channel(&im, "B")};
    float *rgb_out = NULL;
    if (im.width != job->suite->width || im.height != job->suite->height) {
        err_set(e, "%s: %d x %d pixels, not %d x %d", path, im.width, im.height, job->suite->width,
                job->suite->height);
        goto out;
    }
    if (half || at[0] < 0 || at[1] < 0 || at[2] < 0) {
        err_set(e, "%s: not the 32-bit R, G, B that Blender was asked for", path);
        goto out;
    }
    rgb_out = malloc(3 * pixels * sizeof *rgb_out);
    if (rgb_out == NULL) {
        err_set(e, "%s: out of memory", path);
        goto out;
    }
    for (size_t i = 0; i < 3 * pixels; i++) {
        float v = im.data[i / 3 * (size_t)im.channels + (size_t)at[i % 3]];
        if (!isfinite(v) || v < 0) {
            err_set(e, "%s: pixel %d,%d is negative or not finite", path,
                    (int)(i / 3 % (size_t)im.width), (int)(i / 3 / (size_t)im.width));
            free(rgb_out);
            rgb_out = NULL;
            goto out;
        }
        rgb_out[i] = v;
    }
out:
    image_free(&im);
    return rgb_out;
}

static bool is_constant(const float *pixels_rgb, size_t pixels)
{
    for (size_t i = 3; i < 3 * pixels; i++)
        if (pixels_rgb[i] != pixels_rgb[i - 3])
            return false;
    return true;
}

/* All replicates into *out. Two that are the same betray a seed that was ignored. The exception is
 * light without noise: every pixel has random numbers of its own, so if all pixels of all
 * replicates agree to the bit, no random number matters, and the answer is exact. */
static bool fold(const struct reference_job *job, struct moments *out, json_t *manifest,
                 struct err *e)
{
    int count = job->ref->replicates, num_constant = 0, num_first = 0;
    uint8_t(*digest)[SHA256_DIGEST_SIZE] = malloc((size_t)count * sizeof *digest);
    if (digest == NULL)
        return err_set(e, "out of memory");
    if (!moments_alloc(out, job->suite->width, job->suite->height, e)) {
        free(digest);
        return false;
    }
    size_t pixels = (size_t)out->width * (size_t)out->height;
    struct replicates all = {0};
    if (!replicates_alloc(&all, out->width, out->height, count, e))
        goto fail;
    strcpy(out->unit, "replicate");
    out->spp = job->ref->spp;
    int same = -1;
    for (int k = 0; k < count; k++) {
        char path[PATH_SIZE];
        snprintf(path, sizeof path, "%s/replicate_%04d.exr", job->dir, k);
        float *px = read_replicate(job, path, e);
        if (px == NULL)
            goto fail;
        struct sha256_ctx ctx;
        sha256_init(&ctx);
        sha256_update(&ctx, 3 * pixels * sizeof *px, (const uint8_t *)px);
        sha256_digest(&ctx, SHA256_DIGEST_SIZE, digest[k]);
        for (int j = 0; j < k; j++)
            if (memcmp(digest[j], digest[k], SHA256_DIGEST_SIZE) == 0)
                same = k;
        num_first += memcmp(digest[0], digest[k], SHA256_DIGEST_SIZE) == 0;
        num_constant += is_constant(px, pixels);
        moments_add_image(out, px);
        if (job->opt->on_replicate != NULL)
            job->opt->on_replicate(job->opt->on_replicate_ctx, k, px);
        replicates_add(&all, px);
        free(px);
    }
    if (num_constant == count && num_first == count) {
        strcpy(out->unit, "exact");
        for (size_t p = 0; p < pixels; p++)
            out->n[p] = 1;
    } else if (same >= 0) {
        err_set(e,
                "Cycles: replicate %d is the same image as an earlier one: the seed has no effect",
                same);
        goto fail;
    } else if (!independence_check(&all, manifest, e)) {
        err_prefix(e, "Cycles");
        goto fail;
    }
    replicates_free(&all);
    free(digest);
    return true;
fail:
    moments_free(out);
    replicates_free(&all);
    free(digest);
    return false;
}

bool cycles_render(const struct reference_job *job, struct moments *out, json_t *manifest,
                   struct err *e)
{
    char blender[4096], sha256[65], dump[PATH_SIZE], log[PATH_SIZE], relative[PATH_SIZE];
    char spp[16], threads[16], command[512] = "";
    json_t *seeds = NULL, *report = NULL;
    char *script = NULL;
    bool ok = false;
    assert(job->ref->replicates > 0 && job->ref->spp > 0 && job->opt->threads > 0);
    if (strlen(job->dir) >= 4096 || strlen(job->opt->share_dir) >= 4096)
        return err_set(e, "%.64s...: path too long", job->dir);
    if (!process_find("blender", blender, sizeof blender))
        return err_set(e, "blender: no such program in PATH (Blender 3.4 with Cycles)");
    snprintf(relative, sizeof relative, "%s/cycles.py", job->opt->share_dir);
    script = realpath(relative, NULL);
    if (script == NULL)
        return err_set(e, "%s: %s", relative, strerror(errno));
    snprintf(dump, sizeof dump, "%s/scene.json", job->dir);
    snprintf(log, sizeof log, "%s/blender.log", job->dir);
    if (!sha256_file(blender, sha256, e) ||
        !export_cycles(job->scene, job->camera, job->suite->depth, dump, e) ||
        !write_seeds(job, &seeds, e))
        goto out;

    snprintf(spp, sizeof spp, "%d", job->ref->spp);
    snprintf(threads, sizeof threads, "%d", job->opt->threads);
    const char *const argv[] = {"blender",
                                "-b",
                                "--factory-startup",
                                "-noaudio",
                                "--python-exit-code",
                                "3",
                                "-P",
                                script,
                                "--",
                                "--scene",
                                "scene.json",
                                "--spp",
                                spp,
                                "--threads",
                                threads,
                                "--seeds",
                                "seeds.json",
                                NULL};
    if (!process_run(
            &(struct process){
                .argv = argv, .cwd = job->dir, .log = log, .timeout_s = job->opt->timeout_s},
            NULL, e) ||
        !read_report(log, &report, e) || !fold(job, out, manifest, e))
        goto out;

    for (int i = 0; argv[i] != NULL; i++)
        snprintf(command + strlen(command), sizeof command - strlen(command), "%s%s",
                 i > 0 ? " " : "", argv[i] == script ? "cycles.py" : argv[i]);
    ok = json_object_set(manifest, "version", json_object_get(report, "version")) == 0 &&
         json_object_set(manifest, "settings", json_object_get(report, "settings")) == 0 &&
         json_object_set_new(manifest, "binary_sha256", json_string(sha256)) == 0 &&
         json_object_set_new(manifest, "command", json_string(command)) == 0 &&
         json_object_set(manifest, "seeds", seeds) == 0;
    if (!ok) {
        err_set(e, "out of memory");
        moments_free(out);
    }
out:
    json_decref(seeds);
    json_decref(report);
    free(script);
    return ok;
}
