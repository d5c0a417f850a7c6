/* The POV-Ray driver: renders the images of a povray_replicates in parallel; run_task() sums the passes of each. */
#include "povray_replicates.h"
#include "reference/base/process.h"

#include "renderer/base/parallel.h"
#include "renderer/base/sha256.h"
#include "renderer/base/fs.h"

#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

/* What the workers share. */
struct crew {
    const struct povray_replicates *set;
    const struct reference_job *job; /* of the set */
    const char *program;
    int first; /* number of the first image wanted */
    pthread_mutex_t lock;
    bool failed;
    struct err why; /* of the first failure */
};

/* With radiosity, POV-Ray's log must say that no sample was kept: reusing samples would be an unnoticed
 * bias. */
static bool check_log(const char *path, struct err *e)
{
    FILE *f = fopen(path, "r");
    if (f == NULL)
        return err_set(e, "%s: cannot read: %s", path, strerror(errno));
    char line[512];
    long kept = -1;
    while (kept < 0 && fgets(line, sizeof line, f) != NULL)
        if (sscanf(line, " retained for re-use: %18ld", &kept) != 1)
            kept = -1;
    fclose(f);
    if (kept < 0)
        return err_set(e, "%s: POV-Ray does not say that it traced indirect light", path);
    return kept == 0 || err_set(e, "%s: POV-Ray kept %ld radiosity samples for re-use", path, kept);
}

/* out += sign x the box-averaged image / scale. */
static bool add_image(const struct crew *w, const struct povray_image *p, const char *path,
                      float sign, float *out, struct err *e)
{
    int width = w->job->suite->width, height = w->job->suite->height, k = p->grid;
    struct image im = {0};
    if (!image_read_exr(path, &im, NULL, e))
        return false;
    const int at[3] = {image_channel(&im, "R"), image_channel(&im, "G"), image_channel(&im, "B")};
    bool ok =
        im.width == k * width && im.height == k * height && at[0] >= 0 && at[1] >= 0 && at[2] >= 0;
    if (!ok)
        err_set(e, "%s: POV-Ray wrote %d x %d x %d values, not %d x %d of R, G and B", path,
                im.width, im.height, im.channels, k * width, k * height);
    for (int y = 0; ok && y < height; y++)
        for (int x = 0; ok && x < width; x++)
            for (int c = 0; c < 3; c++) {
                double sum = 0;
                for (int j = 0; j < k; j++)
                    for (int i = 0; i < k; i++)
                        sum += (double)im.data[((size_t)(y * k + j) * (size_t)im.width +
                                                (size_t)(x * k + i)) *
                                                   (size_t)im.channels +
                                               (size_t)at[c]];
                if (!isfinite(sum))
                    ok =
                        err_set(e, "%s: pixel %d,%d is brighter than half floats hold", path, x, y);
                size_t o = ((size_t)y * (size_t)width + (size_t)x) * 3 + (size_t)c;
                out[o] += sign * (float)(sum / (k * k) / p->variant.scale);
            }
    image_free(&im);
    return ok;
}

enum { MAX_STARTS = 10 /* of one image */ };

/* On a busy machine POV-Ray may give up before rendering because its threads start too slowly, or crash
 * while it parses (one of 1500 small runs with four processes for each processor). That says nothing about
 * the image, so it is started again. */
static bool run_engine(const struct process *run, struct err *e)
{
    for (int attempt = 1;; attempt++) {
        if (process_run(run, NULL, e))
            return true;
        bool gave_up = strstr(e->msg, "Timed out waiting for worker thread startup") != NULL,
             crashed = strstr(e->msg, "killed by signal 11") != NULL &&
                       strstr(e->msg, "[Parsing...]") != NULL &&
                       strstr(e->msg, "[Rendering...]") == NULL;
        if (attempt == MAX_STARTS || !(gave_up || crashed))
            return false;
    }
}

static bool render_one(struct crew *w, const struct povray_image *p, float sign, float *out,
                       struct err *e)
{
    char text[4][32];
    const char *argv[POVRAY_ARGS];
    const struct path dir = fs_path("%s/%s", w->job->dir, p->name);
    const struct path pov = fs_path("%s/scene.pov", dir.s);
    const struct path exr = fs_path("%s/scene.exr", dir.s);
    const struct path log = fs_path("%s/povray.log", dir.s);
    if (!fs_make_dirs(dir.s, e))
        return false;
    FILE *f = fopen(pov.s, "w");
    if (f == NULL)
        return err_set(e, "%s: cannot write: %s", pov.s, strerror(errno));
    bool ok = export_povray(w->job->scene, w->job->camera, w->job->suite->depth, &p->variant, f, e);
    if (fclose(f) != 0 && ok)
        ok = err_set(e, "%s: cannot write: %s", pov.s, strerror(errno));
    if (!ok)
        return false;
    povray_command_line(w->set, w->program, p, text, argv);
    struct process run = {
        .argv = argv, .cwd = dir.s, .log = log.s, .timeout_s = w->job->opt->timeout_s};
    bool radiosity = p->variant.indirect && w->set->plan.pass[p->variant.pass].recursion > 0;
    return run_engine(&run, e) && (!radiosity || check_log(log.s, e)) &&
           add_image(w, p, exr.s, sign, out, e) && fs_remove_tree(dir.s, e);
}

/* Writes image t: the sum of its passes, box-averaged to the job's size. */
static bool run_task(struct crew *w, int t, struct err *e)
{
    char path[REPLICATE_IMAGE_PATH];
    float *out = calloc(w->set->size, sizeof *out);
    bool ok = out != NULL || err_set(e, "an image: out of memory");
    for (int pass = 0; ok && pass < w->set->plan.num_passes; pass++) {
        if (t < POVRAY_WINDOWS) {
            struct povray_image fine = povray_replicates_window(w->set, t, pass);
            ok = render_one(w, &fine, 1, out, e);
        } else if (w->set->plan.pass[pass].recursion > 0) {
            struct povray_image indirect =
                povray_replicates_replicate(w->set, t - POVRAY_WINDOWS, pass, true);
            struct povray_image direct =
                povray_replicates_replicate(w->set, t - POVRAY_WINDOWS, pass, false);
            ok = render_one(w, &indirect, 1, out, e) && render_one(w, &direct, -1, out, e);
        }
    }
    if (ok) {
        replicate_images_path(w->job->dir, povray_driver.prefix, t - w->first, path);
        ok = replicate_images_write(path, w->job->suite->width, w->job->suite->height, out, e);
    }
    free(out);
    return ok;
}

static void work(void *ctx, size_t first, size_t last)
{
    struct crew *w = ctx;
    for (size_t t = first; t < last; t++) {
        struct err e = {0};
        pthread_mutex_lock(&w->lock);
        bool failed = w->failed;
        pthread_mutex_unlock(&w->lock);
        if (failed || run_task(w, w->first + (int)t, &e))
            continue;
        pthread_mutex_lock(&w->lock);
        if (!w->failed)
            w->why = e;
        w->failed = true;
        pthread_mutex_unlock(&w->lock);
    }
}

/* The first line that begins with "POV-Ray ", such as "POV-Ray 3.7.0.10.unofficial". */
static bool engine_version(const struct crew *w, char line[128], struct err *e)
{
    const char *argv[] = {w->program, "--version", NULL};
    const struct path log = fs_path("%s/version.log", w->job->dir);
    if (!process_run(&(struct process){.argv = argv,
                                       .cwd = w->job->dir,
                                       .log = log.s,
                                       .timeout_s = w->job->opt->timeout_s},
                     NULL, e))
        return false;
    FILE *f = fopen(log.s, "r");
    if (f == NULL)
        return err_set(e, "%s: cannot read: %s", log.s, strerror(errno));
    bool found = false;
    while (!found && fgets(line, 128, f) != NULL)
        found = strncmp(line, "POV-Ray ", 8) == 0;
    fclose(f);
    if (!found)
        return err_set(e, "%s: no version in what it prints", w->program);
    line[strcspn(line, "\r\n")] = '\0';
    return true;
}

static bool render(const struct reference_job *job, int first, int last, json_t *said,
                   struct err *e)
{
    char program[4096], version[128], sha256[65];
    struct povray_replicates set;
    struct crew w = {.set = &set,
                     .job = job,
                     .program = program,
                     .first = first,
                     .lock = PTHREAD_MUTEX_INITIALIZER};
    if (!process_find("povray", program, sizeof program))
        return err_set(e, "povray: no such program in PATH (POV-Ray 3.7)");
    if (!povray_replicates(job, &set, e))
        return false;
    parallel_for(job->opt->threads, (size_t)(last - first), work, &w);
    if (w.failed) {
        *e = w.why;
        return err_prefix(e, "POV-Ray");
    }
    if (!engine_version(&w, version, e) || !sha256_file(program, sha256, e))
        return false;
    json_object_set_new(said, "version", json_string(version));
    json_object_set_new(said, "binary_sha256", json_string(sha256));
    return true;
}

static bool count(const struct reference_job *job, int *num, struct err *e)
{
    struct povray_replicates set;
    if (!povray_replicates(job, &set, e))
        return false;
    *num = POVRAY_WINDOWS + set.replicates;
    return true;
}

/* One image of each of the three kinds in each pass; the others differ from these only by the seed. */
static bool write_key(const struct reference_job *job, const char *path, struct err *e)
{
    const struct suite_scene *s = job->suite;
    struct povray_passes plan;
    if (!povray_passes(job->scene, job->camera, s->depth, &plan, e))
        return false;
    uint32_t seed = replicate_seed(job->opt->seed, 0);
    FILE *f = fopen(path, "w");
    if (f == NULL)
        return err_set(e, "%s: cannot write: %s", path, strerror(errno));
    bool ok = true;
    for (int i = 0; ok && i < 3 * plan.num_passes; i++) {
        struct povray_image p =
            i % 3 == 0 ? povray_window(&plan, s->width, s->height, 0, i / 3)
                       : povray_replicate(&plan, s->width, s->height, job->ref->subgrid, 0, seed,
                                          i / 3, i % 3 == 1);
        fprintf(f, "// grid %d, block %d\n", p.grid, p.block);
        ok = export_povray(job->scene, job->camera, s->depth, &p.variant, f, e);
    }
    fprintf(f, "// %d windows\n", POVRAY_WINDOWS);
    if (fclose(f) != 0 && ok)
        ok = err_set(e, "%s: cannot write: %s", path, strerror(errno));
    return ok;
}

const struct engine_driver povray_driver = {.prefix = "picture",
                                            .below_zero = true,
                                            .count = count,
                                            .render = render,
                                            .fold = povray_fold,
                                            .write_key = write_key};
