/* Drives POV-Ray: the pictures of povray_picture.h, rendered side by side and folded. Picture t of a reference is window t
 * for t < POVRAY_WINDOWS, and for the rest what a replicate adds: all passes of a window, or those of a replicate's pair. */
#include "job.h"

#include "independence.h"
#include "povray_picture.h"
#include "process.h"

#include "../renderer/sha256.h"
#include "../renderer/fs.h"

#include <assert.h>
#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

/* What the workers share. */
struct crew {
    const struct reference_job *job;
    const struct povray_plan *plan;
    const char *program;
    int first, last; /* of the pictures that are wanted */
    size_t size;     /* floats in a picture */
    pthread_mutex_t lock;
    int next;
    bool failed;
    struct err why; /* of the first failure */
};

static struct povray_picture window(const struct crew *w, int j, int pass)
{
    return povray_window(w->plan, w->job->suite->width, w->job->suite->height, j, pass);
}

static struct povray_picture replicate(const struct crew *w, int i, int pass, bool indirect)
{
    i += w->job->opt->first_replicate;
    return povray_replicate(w->plan, w->job->suite->width, w->job->suite->height,
                            w->job->ref->subgrid, i, replicate_seed(w->job->opt->seed, i), pass,
                            indirect);
}

/* A picture with radiosity must say in its log that no sample was kept; a cache would be a bias that
 * nobody sees. */
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

/* out += sign x the box-averaged picture / scale. */
static bool add_picture(const struct crew *w, const struct povray_picture *p, const char *path,
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

enum {
    NUM_ARGS = 16,  /* of the engine's command line, NULL included */
    MAX_STARTS = 10 /* of one picture */
};

/* The command line, in text that belongs to the caller. */
static void command_line(const struct crew *w, const struct povray_picture *p, char text[4][32],
                         const char *argv[NUM_ARGS])
{
    snprintf(text[0], sizeof text[0], "+W%d", p->grid * w->job->suite->width);
    snprintf(text[1], sizeof text[1], "+H%d", p->grid * w->job->suite->height);
    snprintf(text[2], sizeof text[2], "+BS%d", p->block);
    const char *const args[] = {
        w->program, "+Iscene.pov", "+Oscene.exr", "+FE", text[0], text[1], text[2],          "+WT1",
        "-A",       "-C",          "-D",          "-P",  "-V",    "+Q9",   "File_Gamma=1.0", NULL};
    static_assert(sizeof args / sizeof *args == NUM_ARGS, "one slot per argument");
    memcpy(argv, args, sizeof args);
}

/* On a busy machine POV-Ray gives up before it has begun, when its own threads start too slowly. That
 * says nothing about the picture, so it is asked again. */
static bool run_engine(const struct process *run, struct err *e)
{
    for (int attempt = 1;; attempt++) {
        if (process_run(run, NULL, e))
            return true;
        if (attempt == MAX_STARTS ||
            strstr(e->msg, "Timed out waiting for worker thread startup") == NULL)
            return false;
    }
}

static bool render_one(struct crew *w, const struct povray_picture *p, float sign, float *out,
                       struct err *e)
{
    char dir[4096], pov[4224], exr[4224], log[4224], text[4][32];
    const char *argv[NUM_ARGS];
    if (snprintf(dir, sizeof dir, "%s/%s", w->job->dir, p->name) >= (int)sizeof dir)
        return err_set(e, "%.64s...: path too long", w->job->dir);
    snprintf(pov, sizeof pov, "%s/scene.pov", dir);
    snprintf(exr, sizeof exr, "%s/scene.exr", dir);
    snprintf(log, sizeof log, "%s/povray.log", dir);
    if (!make_dirs(dir, e))
        return false;
    FILE *f = fopen(pov, "w");
    if (f == NULL)
        return err_set(e, "%s: cannot write: %s", pov, strerror(errno));
    bool ok = export_povray(w->job->scene, w->job->camera, w->job->suite->depth, &p->variant, f, e);
    if (fclose(f) != 0 && ok)
        ok = err_set(e, "%s: cannot write: %s", pov, strerror(errno));
    if (!ok)
        return false;
    command_line(w, p, text, argv);
    struct process run = {
        .argv = argv, .cwd = dir, .log = log, .timeout_s = w->job->opt->timeout_s};
    bool radiosity = p->variant.indirect && w->plan->pass[p->variant.pass].recursion > 0;
    return run_engine(&run, e) && (!radiosity || check_log(log, e)) &&
           add_picture(w, p, exr, sign, out, e) && remove_tree(dir, e);
}

/* Adds its passes up, box-averaged to the job's size, into a file. */
static bool run_task(struct crew *w, int t, struct err *e)
{
    char path[PICTURE_PATH];
    float *out = calloc(w->size, sizeof *out);
    bool ok = out != NULL || err_set(e, "a picture: out of memory");
    for (int pass = 0; ok && pass < w->plan->num_passes; pass++) {
        if (t < POVRAY_WINDOWS) {
            struct povray_picture fine = window(w, t, pass);
            ok = render_one(w, &fine, 1, out, e);
        } else if (w->plan->pass[pass].recursion > 0) {
            struct povray_picture indirect = replicate(w, t - POVRAY_WINDOWS, pass, true);
            struct povray_picture direct = replicate(w, t - POVRAY_WINDOWS, pass, false);
            ok = render_one(w, &indirect, 1, out, e) && render_one(w, &direct, -1, out, e);
        }
    }
    if (ok) {
        pictures_path(w->job->dir, povray_driver.prefix, t - w->first, path);
        ok = pictures_write(path, w->job->suite->width, w->job->suite->height, out, e);
    }
    free(out);
    return ok;
}

static void *work(void *arg)
{
    struct crew *w = arg;
    for (;;) {
        pthread_mutex_lock(&w->lock);
        int t = w->failed || w->next == w->last ? -1 : w->next++;
        pthread_mutex_unlock(&w->lock);
        if (t < 0)
            return NULL;
        struct err e = {0};
        if (run_task(w, t, &e))
            continue;
        pthread_mutex_lock(&w->lock);
        if (!w->failed)
            w->why = e;
        w->failed = true;
        pthread_mutex_unlock(&w->lock);
    }
}

/* All tasks, on up to opt->threads threads, this one included. */
static bool run_crew(struct crew *w, struct err *e)
{
    pthread_t thread[64];
    int n = w->job->opt->threads - 1, started = 0;
    pthread_mutex_init(&w->lock, NULL);
    for (int i = 0; i < n && i < 64; i++) {
        if (pthread_create(&thread[started], NULL, work, w) != 0)
            break; /* fewer then */
        started++;
    }
    work(w);
    for (int i = 0; i < started; i++)
        pthread_join(thread[i], NULL);
    pthread_mutex_destroy(&w->lock);
    if (!w->failed)
        return true;
    *e = w->why;
    return err_prefix(e, "POV-Ray");
}

/* "POV-Ray 3.7.0.10.unofficial": the first line that begins so. */
static bool engine_version(const struct crew *w, char line[128], struct err *e)
{
    char log[4224];
    const char *argv[] = {w->program, "--version", NULL};
    snprintf(log, sizeof log, "%s/version.log", w->job->dir);
    if (!process_run(
            &(struct process){
                .argv = argv, .cwd = w->job->dir, .log = log, .timeout_s = w->job->opt->timeout_s},
            NULL, e))
        return false;
    FILE *f = fopen(log, "r");
    if (f == NULL)
        return err_set(e, "%s: cannot read: %s", log, strerror(errno));
    bool found = false;
    while (!found && fgets(line, 128, f) != NULL)
        found = strncmp(line, "POV-Ray ", 8) == 0;
    fclose(f);
    if (!found)
        return err_set(e, "%s: no version in what it prints", w->program);
    line[strcspn(line, "\r\n")] = '\0';
    return true;
}

/* How many replicates there are: none where the picture has no noise. */
static int replicates_of(const struct crew *w)
{
    return povray_plan_is_noisy(w->plan) ? w->job->ref->replicates : 0;
}

static bool describe(const struct crew *w, const json_t *said, json_t *manifest, struct err *e)
{
    char text[4][32], command[512] = "povray";
    const char *argv[NUM_ARGS];
    int replicates = replicates_of(w);
    struct povray_picture first = replicates > 0 ? replicate(w, 0, 0, true) : window(w, 0, 0);
    command_line(w, &first, text, argv);
    for (int i = 1; argv[i] != NULL; i++)
        snprintf(command + strlen(command), sizeof command - strlen(command), " %s", argv[i]);
    json_t *seeds = json_array(), *blocks = json_array();
    for (int i = 0; i < replicates; i++) {
        json_array_append_new(seeds, json_integer(replicate_seed(
                                         w->job->opt->seed, w->job->opt->first_replicate + i)));
        json_array_append_new(blocks, json_integer(replicate(w, i, 0, true).block));
    }
    double top = POVRAY_TOP_VALUE / w->plan->radiance;
    json_t *passes = json_array();
    for (int i = 0; i < w->plan->num_passes; i++) {
        const struct povray_pass *pass = &w->plan->pass[i];
        json_array_append_new(
            passes, json_pack("{s:b, s:b, s:i, s:i, s:i}", "light_sources", pass->sources, "glow",
                              pass->glow, "recursion_limit", pass->recursion, "max_trace_level",
                              pass->levels, "max_trace_level_indirect", pass->levels_indirect));
    }
    struct povray_picture fine = window(w, 0, 0);
    json_t *settings =
        json_pack("{s:o, s:[f,f], s:{s:i, s:i, s:i, s:s}}", "passes", passes, "scale", top, 2 * top,
                  "fine", "windows", (int)POVRAY_WINDOWS, "subgrid", (int)POVRAY_WINDOW_GRID,
                  "lamp_cells", fine.variant.lamp_cells, "rule",
                  fine.variant.rule == POVRAY_GAUSS ? "gauss2" : "shifted grid");
    json_t *scheme = replicates > 0
                         ? json_pack("{s:i, s:i, s:f, s:O}", "subgrid", w->job->ref->subgrid,
                                     "jittered_lamp_cells", first.variant.lamp_cells, "roulette",
                                     POVRAY_ROULETTE, "block_sizes", blocks)
                         : json_string("none: the picture has no noise");
    bool ok =
        json_object_set(settings, "replicate", scheme) == 0 &&
        json_object_set(manifest, "version", json_object_get(said, "version")) == 0 &&
        json_object_set(manifest, "binary_sha256", json_object_get(said, "binary_sha256")) == 0 &&
        json_object_set_new(manifest, "command", json_string(command)) == 0 &&
        json_object_set(manifest, "settings", settings) == 0 &&
        json_object_set(manifest, "seeds", seeds) == 0;
    json_decref(settings);
    json_decref(scheme);
    json_decref(seeds);
    json_decref(blocks);
    return ok || err_set(e, "POV-Ray manifest: out of memory");
}

/* The mean of the windows. */
static bool mean_window(const struct crew *w, const struct pictures *pictures, double *fine,
                        struct err *e)
{
    for (int t = 0; t < POVRAY_WINDOWS; t++) {
        char path[PICTURE_PATH];
        pictures->path_of(pictures->ctx, t, path);
        float *px = pictures_read(path, w->job->suite->width, w->job->suite->height, true, e);
        if (px == NULL)
            return false;
        for (size_t i = 0; i < w->size; i++)
            fine[i] += (double)px[i] / POVRAY_WINDOWS;
        free(px);
    }
    return true;
}

/* fine + the difference of replicate k, into the moments. */
static bool add_replicate(const struct crew *w, const struct pictures *pictures, int k,
                          const double *fine, struct repeats *repeats, struct replicates *all,
                          struct moments *m, struct err *e)
{
    char path[PICTURE_PATH];
    pictures->path_of(pictures->ctx, POVRAY_WINDOWS + k, path);
    float *px = pictures_read(path, m->width, m->height, true, e);
    if (px == NULL)
        return false;
    int first = repeats_add(repeats, px, w->size);
    if (first < k) {
        free(px);
        return err_set(e, "POV-Ray: replicates %d and %d are the same", first, k);
    }
    for (size_t i = 0; i < w->size; i++)
        px[i] = (float)(fine[i] + (double)px[i]);
    moments_add_image(m, px);
    if (w->job->opt->on_replicate != NULL)
        w->job->opt->on_replicate(w->job->opt->on_replicate_ctx, k, px);
    replicates_add(all, px);
    free(px);
    return true;
}

/* fine + each replicate's difference; fine alone if there are none. */
static bool fold_pictures(const struct crew *w, const struct pictures *pictures,
                          struct moments *out, json_t *manifest, struct err *e)
{
    const struct suite_scene *suite = w->job->suite;
    int replicates = replicates_of(w);
    struct moments m = {0};
    struct replicates all = {0};
    struct repeats repeats = {0};
    double *fine = calloc(w->size, sizeof *fine);
    bool ok = fine != NULL || err_set(e, "POV-Ray pictures: out of memory");
    ok = ok && moments_alloc(&m, suite->width, suite->height, e) &&
         (replicates == 0 || (replicates_alloc(&all, m.width, m.height, replicates, e) &&
                              repeats_alloc(&repeats, replicates, e))) &&
         mean_window(w, pictures, fine, e);
    strcpy(m.unit, replicates == 0 ? "exact" : "replicate");
    m.spp = replicates == 0 ? 0 : w->job->ref->subgrid * w->job->ref->subgrid;
    for (int k = 0; ok && k < replicates; k++)
        ok = add_replicate(w, pictures, k, fine, &repeats, &all, &m, e);
    ok = ok &&
         (replicates == 0 || independence_check(&all, manifest, e) || err_prefix(e, "POV-Ray"));
    for (size_t i = 0; ok && replicates == 0 && i < w->size; i++) {
        m.mean[i] = fine[i];
        m.n[i / 3] = 1;
    }
    free(fine);
    replicates_free(&all);
    repeats_free(&repeats);
    if (ok)
        *out = m;
    else
        moments_free(&m);
    return ok;
}

static bool crew_of(const struct reference_job *job, struct povray_plan *plan, struct crew *w,
                    struct err *e)
{
    if (!povray_plan(job->scene, job->camera, job->suite->depth, plan, e))
        return false;
    *w = (struct crew){.job = job,
                       .plan = plan,
                       .program = "povray",
                       .size = (size_t)job->suite->width * (size_t)job->suite->height * 3};
    assert(replicates_of(w) == 0 || (job->ref->replicates > 1 && job->ref->subgrid > 0));
    return true;
}

static bool count(const struct reference_job *job, int *num, struct err *e)
{
    struct povray_plan plan;
    struct crew w;
    if (!crew_of(job, &plan, &w, e))
        return false;
    *num = POVRAY_WINDOWS + replicates_of(&w);
    return true;
}

static bool render(const struct reference_job *job, int first, int last, json_t *said,
                   struct err *e)
{
    char program[4096], version[128], sha256[65];
    struct povray_plan plan;
    struct crew w;
    if (!process_find("povray", program, sizeof program))
        return err_set(e, "povray: no such program in PATH (POV-Ray 3.7)");
    if (strlen(job->dir) >= 4096)
        return err_set(e, "%.64s...: path too long", job->dir);
    if (!crew_of(job, &plan, &w, e))
        return false;
    w.program = program;
    w.first = w.next = first;
    w.last = last;
    return run_crew(&w, e) && engine_version(&w, version, e) && sha256_file(program, sha256, e) &&
           ((json_object_set_new(said, "version", json_string(version)) == 0 &&
             json_object_set_new(said, "binary_sha256", json_string(sha256)) == 0) ||
            err_set(e, "out of memory"));
}

static bool fold(const struct reference_job *job, const struct pictures *pictures,
                 const json_t *said, struct moments *out, json_t *manifest, struct err *e)
{
    struct povray_plan plan;
    struct crew w;
    return crew_of(job, &plan, &w, e) && describe(&w, said, manifest, e) &&
           fold_pictures(&w, pictures, out, manifest, e);
}

const struct driver povray_driver = {.engine = "povray",
                                     .prefix = "picture",
                                     .below_zero = true,
                                     .count = count,
                                     .render = render,
                                     .fold = fold};

bool povray_render(const struct reference_job *job, struct moments *out, json_t *manifest,
                   struct err *e)
{
    return driver_render(&povray_driver, job, out, manifest, e);
}
