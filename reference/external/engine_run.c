/* Runs an engine as its description says: the scene file, the processes, the images. */
#define _GNU_SOURCE
#include "engine_internal.h"

#include "reference/replicates/block_means.h"
#include "reference/replicates/engine_driver.h"
#include "reference/replicates/independence.h"
#include "reference/replicates/replicate_images.h"
#include "reference/base/process.h"

#include "renderer/base/fs.h"
#include "renderer/base/progress.h"
#include "renderer/image/image_oiio.h"

#include <assert.h>
#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { NUMBER = 32 };

/* The arguments of one process; the caller frees *argv. */
static bool command_line(struct engine_job *j, uint32_t seed, const char *out, char ***argv,
                         struct err *e)
{
    char number[8][NUMBER];
    snprintf(number[0], NUMBER, "%d", j->spp);
    snprintf(number[1], NUMBER, "%u", seed);
    snprintf(number[2], NUMBER, "%d", j->suite->depth + j->en->depth_offset);
    snprintf(number[3], NUMBER, "%d", j->suite->width);
    snprintf(number[4], NUMBER, "%d", j->suite->height);
    snprintf(number[5], NUMBER, "%d", j->opt->threads);
    snprintf(number[6], NUMBER, "%.9g", j->suite->lens_radius);
    snprintf(number[7], NUMBER, "%.9g", j->suite->focal_distance);
    char environment[4096] = "";
    if (j->suite->environment[0] != '\0' && realpath(j->suite->environment, environment) == NULL)
        return err_set(e, "%s: %s", j->suite->environment, strerror(errno));
    const struct engine_value values[] = {{"spp", number[0]},
                                          {"seed", number[1]},
                                          {"depth", number[2]},
                                          {"name", j->suite->name},
                                          {"width", number[3]},
                                          {"height", number[4]},
                                          {"threads", number[5]},
                                          {"scene", j->scene[j->channel]},
                                          {"out", out},
                                          {"here", j->en->here},
                                          {"lens_radius", number[6]},
                                          {"focal_distance", number[7]},
                                          {"environment", environment},
                                          {0}};
    const char *const keys[] = {"command", j->suite->lens_radius > 0 ? "lens_args" : "",
                                environment[0] != '\0' ? "environment_args" : "", NULL};
    if (!engine_argv(j->en, keys, values, argv, e))
        return false;
    (*argv)[0] = j->program;
    return true;
}

static bool run_process(struct engine_job *j, uint32_t seed, const char *out, struct err *e)
{
    char **argv = NULL;
    struct process_usage usage = {0};
    const struct path log = fs_path("%s/engine.log", j->dir);
    bool ok = command_line(j, seed, out, &argv, e) &&
              process_run(&(struct process){.argv = (const char *const *)argv,
                                            .cwd = j->dir,
                                            .log = log.s,
                                            .timeout_s = j->opt->timeout_s},
                          &usage, e);
    j->cpu_s += usage.cpu_s;
    free(argv);
    return ok;
}

/* Is there an image of floats, as radiance has to be? Bytes and 16-bit integers are clamped and mostly have a tone
 * curve. */
static bool check_image(const struct engine_job *j, const char *path, struct err *e)
{
    struct image_info info;
    if (access(path, F_OK) != 0)
        return err_set(e, "%s: ended without an error, but wrote no image, %s is not there",
                       j->program, path);
    if (!image_inspect(path, &info, e))
        return false;
    return info.type == IMAGE_HALF || info.type == IMAGE_FLOAT ||
           err_set(e, "%s: an image of %d-bit integers, not of floats: write linear radiance as %s",
                   path, 8 * info.bytes, j->en->image);
}

static struct path image_path(const struct engine_job *j, int k)
{
    return fs_path("%s/replicate_%04d.%s", j->dir, k, j->en->image);
}

/* Image k (the caller frees it): one run, or one per channel, each with its own seed and used for that channel only. The
 * file of the last run is left. */
static float *render_image(struct engine_job *j, int k, struct err *e)
{
    const struct path path = image_path(j, k);
    const int runs = j->en->separate ? 3 : 1;
    const size_t pixels = (size_t)j->suite->width * (size_t)j->suite->height;
    float *out = NULL;
    for (j->channel = 0; j->channel < runs; j->channel++) {
        const size_t c = (size_t)j->channel;
        unlink(path.s);
        float *px =
            run_process(j, replicate_seed(j->opt->seed, runs * k + j->channel), path.s, e) &&
                    check_image(j, path.s, e)
                ? replicate_images_read_any(path.s, j->suite->width, j->suite->height, j->en->scale,
                                            &j->half, e)
                : NULL;
        if (px == NULL) {
            free(out);
            return NULL;
        }
        if (out == NULL) {
            out = px;
            continue;
        }
        for (size_t i = 0; i < pixels; i++)
            out[3 * i + c] = px[3 * i + c];
        free(px);
    }
    return out;
}

/* n: 1 for an exact image; 3 for a noisy one, by the convention of noise_estimate.h, where n is not a count. */
static void make_single(struct moments *m, const char *unit, double n)
{
    strcpy(m->unit, unit);
    m->spp = 0;
    for (size_t p = 0; p < (size_t)m->width * (size_t)m->height; p++)
        m->n[p] = n;
}

/* Fails if it is another image than it has to be. */
static bool add_hash(struct engine_job *j, const char *sha256, struct err *e)
{
    const json_t *same = j->opt->same_as;
    const size_t k = json_array_size(j->images);
    const char *has = json_string_value(json_array_get(same, k));
    json_array_append_new(j->images, json_string(sha256));
    if (same == NULL || (has != NULL && strcmp(has, sha256) == 0))
        return true;
    *j->opt->differs = true;
    return j->opt->goes_on || err_set(e, "image %zu is another one", k);
}

/* Replicate k is the same image as an earlier one: what may be wrong. */
static bool set_repeats(const struct engine_job *j, const float *px, size_t pixels, int k,
                        struct err *e)
{
    bool is_black = true;
    for (size_t i = 0; i < 3 * pixels && is_black; i++)
        is_black = px[i] == 0;
    if (is_black)
        return err_set(e, "replicate %d is black, as an earlier one is: no light was found", k);
    return err_set(e, "replicate %d is the same image as an earlier one: %s%s", k,
                   k > 1 ? "the program has few different images, as if {seed} did not "
                           "decide all that is random in it"
                         : "the seed has no effect",
                   strcmp(j->en->image, "hdr") == 0
                       ? ", or less than RGBE's 8 bits show: write EXR or PFM"
                       : "");
}

/* Runs, reads and folds. */
static bool fold_runs(struct engine_job *j, struct moments *m, struct err *e)
{
    size_t pixels = (size_t)m->width * (size_t)m->height;
    struct replicate_repeats repeats;
    struct replicates seen = {0};
    struct block_means blocks = {0};
    const bool has_blocks = j->en->output == OUTPUT_MEAN && !j->en->shares_samples;
    bool ok = replicate_repeats_alloc(&repeats, j->replicates, e) &&
              replicates_alloc(&seen, m->width, m->height, j->replicates, e) &&
              (!has_blocks ||
               block_means_alloc(&blocks, m->width, m->height, j->suite->tile, j->replicates, e));
    if (j->en->shares_samples)
        seen.sharing = pixel_filter_sharing(&j->en->filter, 2);
    for (int k = 0; ok && k < j->replicates; k++) {
        float *px = render_image(j, k, e);
        ok = px != NULL;
        if (!ok)
            break;
        replicate_repeats_add(&repeats, px, pixels);
        if (j->en->output == OUTPUT_MEAN)
            ok = add_hash(j, repeats.sha256[k], e);
        if (ok && j->en->output == OUTPUT_MEAN && repeats.same >= 0 && !repeats.without_noise)
            ok = set_repeats(j, px, pixels, k, e);
        moments_add_image(m, px);
        replicates_add(&seen, px);
        ok = ok && (!has_blocks || block_means_add(&blocks, px, e));
        if (j->opt->on_replicate != NULL)
            j->opt->on_replicate(j->opt->on_replicate_ctx, k, px);
        free(px);
        if (ok)
            unlink(image_path(j, k).s);
    }
    if (ok && j->en->output == OUTPUT_NOISY)
        make_single(m, "picture", 3);
    else if (ok && (j->en->output == OUTPUT_EXACT || repeats.without_noise))
        make_single(m, "exact", 1);
    else if (ok)
        ok = independence_check(&seen, j->independence, e) &&
             (!has_blocks || (j->blocks = block_means_to_json(&blocks)) != NULL ||
              err_set(e, "out of memory"));
    block_means_free(&blocks);
    replicates_free(&seen);
    replicate_repeats_free(&repeats);
    return ok;
}

/* Multiplies means, variances and third cumulants by these factors. */
static void multiply(struct moments *m, double first, double second, double third)
{
    for (size_t i = 0; i < 3 * (size_t)m->width * (size_t)m->height; i++) {
        m->mean[i] *= first;
        m->m2[i] *= second;
        m->m3[i] *= third;
    }
}

static bool run_all(struct engine_job *j, struct moments *out, struct err *e)
{
    char path[PATH_SIZE];
    struct moments m = {0};
    bool ok;
    if (j->en->output == OUTPUT_MOMENTS) {
        snprintf(path, sizeof path, "%s/moments.exr", j->dir);
        ok = run_process(j, replicate_seed(j->opt->seed, 0), path, e) &&
             moments_read(path, &m, NULL, e);
        if (ok && (m.width != j->suite->width || m.height != j->suite->height))
            ok = err_set(e, "%s: %d x %d pixels, not %d x %d", path, m.width, m.height,
                         j->suite->width, j->suite->height);
        if (m.mean != NULL)
            multiply(&m, j->en->scale, j->en->scale * j->en->scale,
                     j->en->scale * j->en->scale * j->en->scale);
    } else {
        ok = moments_alloc(&m, j->suite->width, j->suite->height, e);
        strcpy(m.unit, "replicate");
        m.spp = j->spp;
        ok = ok && fold_runs(j, &m, e);
        /* The variance of a sum over pixels that share samples exceeds the sum of their variances, which is inflated to
         * match. */
        if (ok && j->en->shares_samples && strcmp(m.unit, "replicate") == 0) {
            m.sharing = pixel_filter_sharing(&j->en->filter, 2);
            multiply(&m, 1, m.sharing, pixel_filter_sharing(&j->en->filter, 3));
        }
    }
    if (ok)
        *out = m;
    else
        moments_free(&m);
    return ok;
}

bool engine_render(const struct engine *en, const struct suite_scene *scene,
                   const struct engine_options *opt, struct moments *out, json_t **manifest,
                   struct err *e)
{
    char work[PATH_MAX];
    struct engine_job j = {.en = en, .suite = scene, .opt = opt};
    double start = progress_seconds();
    assert(opt->threads > 0);
    j.spp = opt->spp > 0 ? opt->spp : en->spp;
    j.replicates = en->output != OUTPUT_MEAN ? 1
                   : opt->replicates > 0     ? opt->replicates
                                             : en->replicates;
    if (realpath(opt->work_dir, work) == NULL)
        return err_set(e, "%s: %s", opt->work_dir, strerror(errno));
    struct path dir = fs_path("%s/%s-%s-XXXXXX", work, scene->name, en->name);
    j.dir = dir.s;
    if (mkdtemp(dir.s) == NULL)
        return err_set(e, "%s: cannot make a directory in it: %s", work, strerror(errno));
    *manifest = NULL;
    j.independence = json_object();
    j.images = json_array();
    bool rendered = engine_program(en, "command", j.program, sizeof j.program, e) &&
                    engine_write_scene(en, scene, dir.s, j.scene, e) && run_all(&j, out, e);
    bool ok = rendered && engine_describe(&j, out, progress_seconds() - start, manifest, e) &&
              fs_remove_tree(dir.s, e);
    json_decref(j.independence);
    json_decref(j.images);
    json_decref(j.blocks);
    if (ok)
        return true;
    if (opt->same_as != NULL && *opt->differs && !opt->goes_on && fs_remove_tree(dir.s, e))
        return false;
    if (rendered)
        moments_free(out);
    json_decref(*manifest);
    *manifest = NULL;
    struct err what = *e;
    bool kept = rmdir(dir.s) != 0;
    return err_set(e, "%s, %s: %.800s%s%s%s", scene->name, en->name, what.msg, kept ? " (see " : "",
                   kept ? dir.s : "", kept ? ")" : "");
}
