/* Drives POV-Ray. A replicate is
 *
 *     total_i = fine + (indirect_i - direct_i)
 *
 * fine: the direct light, one deterministic picture for all replicates, from many shifted windows
 * and a fine quadrature of the lamps. indirect_i and direct_i: two pictures that differ only in
 * whether radiosity is on, turned by a random rotation, with a block size, lamp points and a
 * sub-pixel shift of their own, since POV-Ray has no seed. Their difference is the indirect light:
 * a glowing lamp in view has the same value in both and drops out.
 *
 * Pictures are half-float EXR. Each is rendered at a scale of its own within one octave, so that
 * rounding (at most 2^-11 of a value) is a different one in each and averages out. */
#include "job.h"

#include "export_povray.h"
#include "process.h"

#include "../renderer/fs.h"
#include "../renderer/sampler.h"

#include <assert.h>
#include <errno.h>
#include <gsl/gsl_math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

enum {
    WINDOWS = 32,      /* pictures in `fine` */
    WINDOW_GRID = 2,   /* sub-pixels a side in each */
    WINDOW_CELLS = 16, /* spotlights a side for one lamp, 2-point Gauss rule */
    JITTER_CELLS = 3,  /* the same in a replicate, stratified random */
    MIN_BLOCK = 4,
    NUM_BLOCKS = 61 /* block sizes 4 .. 64 */
};
/* An emitter of radiance plan->radiance comes out as 16 .. 32, far from half's 6e-5 and 65504. */
#define TOP_VALUE 16.0
#define ROULETTE  0.1

/* What the workers share. Task t < WINDOWS is a window, the rest are replicates. */
struct crew {
    const struct reference_job *job;
    const struct povray_plan *plan;
    const char *program;
    int num_tasks;
    size_t size;   /* floats in a picture */
    float *result; /* num_tasks pictures: radiance, box-averaged to the job's size */
    pthread_mutex_t lock;
    int next;
    bool failed;
    double cpu_s;
    struct err first; /* of the failures */
};

/* One run of the engine. */
struct picture {
    char name[32]; /* sub-directory of the job's */
    int grid;      /* sub-pixels a side */
    int block;     /* +BS */
    struct povray_variant variant;
};

/* Uniformly random rotation from three uniform numbers, by way of a unit quaternion [Shoemake92].
 */
static void random_rotation(const float u[3], double r[3][3])
{
    double a = sqrt(1 - (double)u[0]), b = sqrt((double)u[0]);
    double x = a * sin(2 * M_PI * (double)u[1]), y = a * cos(2 * M_PI * (double)u[1]);
    double z = b * sin(2 * M_PI * (double)u[2]), w = b * cos(2 * M_PI * (double)u[2]);
    const double m[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                            {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                            {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
    memcpy(r, m, sizeof m);
}

static int block_size(int replicate)
{
    return MIN_BLOCK + 17 * replicate % NUM_BLOCKS;
}

/* Bits of i < 32 in reverse: second coordinate of a Hammersley set. */
static int reverse5(int i)
{
    return (i & 1) << 4 | (i & 2) << 2 | (i & 4) | (i & 8) >> 2 | (i & 16) >> 4;
}

/* Shift by (u, v) - 1/2 sub-pixels. */
static void set_shift(const struct crew *w, struct picture *p, double u, double v)
{
    p->variant.shift_x = (u - 0.5) / (p->grid * w->job->suite->width);
    p->variant.shift_y = (v - 0.5) / (p->grid * w->job->suite->height);
}

static double scale_within_octave(const struct crew *w, double u)
{
    return TOP_VALUE / w->plan->radiance * exp2(u);
}

static void window_picture(const struct crew *w, int j, struct picture *p)
{
    *p = (struct picture){.grid = WINDOW_GRID, .block = 32, .variant = povray_variant_plain()};
    snprintf(p->name, sizeof p->name, "fine_%02d", j);
    set_shift(w, p, (j + 0.5) / WINDOWS, (reverse5(j) + 0.5) / WINDOWS);
    p->variant.lamp_cells = WINDOW_CELLS;
    p->variant.indirect = w->plan->constant;
    p->variant.roulette = 0;
    p->variant.scale = scale_within_octave(w, (j + 0.5) / WINDOWS);
}

static void replicate_picture(const struct crew *w, int i, bool indirect, struct picture *p)
{
    uint32_t seed = replicate_seed(w->job->opt->seed, i);
    struct sample4 a = sampler_get(seed, 0, 0, 0, 0), b = sampler_get(seed, 0, 1, 0, 0);
    *p = (struct picture){.grid = w->job->ref->subgrid,
                          .block = block_size(i),
                          .variant = {.lamp_cells = JITTER_CELLS,
                                      .lamp_jitter = true,
                                      .lamp_seed = seed,
                                      .indirect = indirect,
                                      .roulette = ROULETTE,
                                      .scale = scale_within_octave(w, (double)a.u[3])}};
    snprintf(p->name, sizeof p->name, "%s_%03d", indirect ? "indirect" : "direct", i);
    random_rotation(a.u, p->variant.rotation);
    set_shift(w, p, (double)b.u[0], (double)b.u[1]);
}

/* The log must say that radiosity kept no sample; a cache would be a bias that nobody sees. */
static bool check_log(const char *path, struct err *e)
{
    FILE *f = fopen(path, "r");
    if (f == NULL)
        return err_set(e, "%s: cannot read: %s", path, strerror(errno));
    char line[512];
    long kept = 0;
    while (fgets(line, sizeof line, f) != NULL)
        if (sscanf(line, " retained for re-use: %ld", &kept) == 1 && kept != 0)
            break;
    fclose(f);
    return kept == 0 || err_set(e, "%s: POV-Ray kept %ld radiosity samples for re-use", path, kept);
}

/* out += sign x the box-averaged picture / scale. */
static bool add_picture(const struct crew *w, const struct picture *p, const char *path, float sign,
                        float *out, struct err *e)
{
    int width = w->job->suite->width, height = w->job->suite->height, k = p->grid;
    struct image im = {0};
    if (!image_read(path, &im, NULL, e))
        return false;
    bool ok = im.width == k * width && im.height == k * height && im.channels >= 3;
    if (!ok)
        err_set(e, "%s: POV-Ray wrote %d x %d x %d values, not %d x %d x 3", path, im.width,
                im.height, im.channels, k * width, k * height);
    for (int y = 0; ok && y < height; y++)
        for (int x = 0; ok && x < width; x++)
            for (int c = 0; c < 3; c++) {
                double sum = 0;
                for (int j = 0; j < k; j++)
                    for (int i = 0; i < k; i++)
                        sum += (double)im.data[((size_t)(y * k + j) * (size_t)im.width +
                                                (size_t)(x * k + i)) *
                                                   (size_t)im.channels +
                                               (size_t)c];
                if (!isfinite(sum))
                    ok =
                        err_set(e, "%s: pixel %d,%d is brighter than half floats hold", path, x, y);
                size_t o = ((size_t)y * (size_t)width + (size_t)x) * 3 + (size_t)c;
                out[o] += sign * (float)(sum / (k * k) / p->variant.scale);
            }
    image_free(&im);
    return ok;
}

enum { NUM_ARGS = 16 };

/* The command line, in text that belongs to the caller. */
static void command_line(const struct crew *w, const struct picture *p, char text[4][32],
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

static bool render(struct crew *w, const struct picture *p, float sign, float *out, struct err *e)
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
    struct process_usage usage;
    if (!process_run(
            &(struct process){
                .argv = argv, .cwd = dir, .log = log, .timeout_s = w->job->opt->timeout_s},
            &usage, e))
        return false;
    if (!check_log(log, e) || !add_picture(w, p, exr, sign, out, e) || !remove_tree(dir, e))
        return false;
    pthread_mutex_lock(&w->lock);
    w->cpu_s += usage.cpu_s;
    pthread_mutex_unlock(&w->lock);
    return true;
}

static bool run_task(struct crew *w, int t, struct err *e)
{
    float *out = w->result + (size_t)t * w->size;
    struct picture p;
    if (t < WINDOWS) {
        window_picture(w, t, &p);
        return render(w, &p, 1, out, e);
    }
    replicate_picture(w, t - WINDOWS, true, &p);
    if (!render(w, &p, 1, out, e))
        return false;
    replicate_picture(w, t - WINDOWS, false, &p);
    return render(w, &p, -1, out, e);
}

static void *work(void *arg)
{
    struct crew *w = arg;
    for (;;) {
        pthread_mutex_lock(&w->lock);
        int t = w->failed || w->next == w->num_tasks ? -1 : w->next++;
        pthread_mutex_unlock(&w->lock);
        if (t < 0)
            return NULL;
        struct err e = {0};
        if (run_task(w, t, &e))
            continue;
        pthread_mutex_lock(&w->lock);
        if (!w->failed)
            w->first = e;
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
    *e = w->first;
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

static bool describe(const struct crew *w, json_t *manifest, struct err *e)
{
    char version[128], sha256[65], text[4][32], command[512] = "povray";
    const char *argv[NUM_ARGS];
    struct picture p;
    int replicates = w->num_tasks - WINDOWS;
    if (!engine_version(w, version, e) || !sha256_file(w->program, sha256, e))
        return false;
    if (replicates > 0)
        replicate_picture(w, 0, true, &p);
    else
        window_picture(w, 0, &p);
    command_line(w, &p, text, argv);
    for (int i = 1; argv[i] != NULL; i++)
        snprintf(command + strlen(command), sizeof command - strlen(command), " %s", argv[i]);
    json_t *seeds = json_array(), *blocks = json_array();
    for (int i = 0; i < replicates; i++) {
        json_array_append_new(seeds, json_integer(replicate_seed(w->job->opt->seed, i)));
        json_array_append_new(blocks, json_integer(block_size(i)));
    }
    json_t *settings = json_pack(
        "{s:s, s:i, s:b, s:f, s:[f,f], s:{s:i, s:i, s:s}, s:f}", "lit_by",
        w->plan->sources ? "light sources" : "geometry", "recursion_limit", w->plan->recursion,
        "exact", replicates == 0, "roulette", replicates > 0 ? ROULETTE : 0.0, "scale",
        scale_within_octave(w, 0), scale_within_octave(w, 1), "fine", "windows", (int)WINDOWS,
        "subgrid", (int)WINDOW_GRID, "lamps", "16 x 16, 2-point Gauss", "cpu_s", w->cpu_s);
    if (settings != NULL && replicates > 0)
        json_object_set_new(settings, "replicate",
                            json_pack("{s:i, s:s, s:o}", "subgrid", w->job->ref->subgrid, "lamps",
                                      "3 x 3, stratified random", "block_sizes",
                                      json_incref(blocks)));
    bool ok = settings != NULL &&
              json_object_set_new(manifest, "version", json_string(version)) == 0 &&
              json_object_set_new(manifest, "binary_sha256", json_string(sha256)) == 0 &&
              json_object_set_new(manifest, "command", json_string(command)) == 0 &&
              json_object_set(manifest, "settings", settings) == 0 &&
              json_object_set(manifest, "seeds", seeds) == 0;
    json_decref(settings);
    json_decref(seeds);
    json_decref(blocks);
    return ok || err_set(e, "POV-Ray manifest: out of memory");
}

/* fine + each replicate's difference; fine alone if there are none. */
static bool fold(const struct crew *w, struct moments *out, struct err *e)
{
    const struct suite_scene *suite = w->job->suite;
    double *fine = calloc(w->size, sizeof *fine);
    if (fine == NULL)
        return err_set(e, "POV-Ray pictures: out of memory");
    if (!moments_alloc(out, suite->width, suite->height, e)) {
        free(fine);
        return false;
    }
    for (int t = 0; t < WINDOWS; t++)
        for (size_t i = 0; i < w->size; i++)
            fine[i] += (double)w->result[(size_t)t * w->size + i] / WINDOWS;
    bool exact = w->num_tasks == WINDOWS;
    strcpy(out->unit, exact ? "exact" : "replicate");
    out->spp = exact ? 0 : w->job->ref->subgrid * w->job->ref->subgrid;
    for (int t = WINDOWS; t < w->num_tasks; t++) {
        float *sum = w->result + (size_t)t * w->size;
        for (size_t i = 0; i < w->size; i++)
            sum[i] = (float)(fine[i] + (double)sum[i]);
        moments_add_image(out, sum);
    }
    for (size_t i = 0; exact && i < w->size; i++) {
        out->mean[i] = fine[i];
        out->n[i / 3] = 1;
    }
    free(fine);
    return true;
}

bool povray_render(const struct reference_job *job, struct moments *out, json_t *manifest,
                   struct err *e)
{
    char program[4096];
    struct povray_plan plan;
    if (!process_find("povray", program, sizeof program))
        return err_set(e, "povray: no such program in PATH (POV-Ray 3.7)");
    if (!povray_plan(job->scene, job->camera, job->suite->depth, &plan, e))
        return false;
    bool exact = plan.recursion == 0 || plan.constant;
    assert(exact || (job->ref->replicates > 1 && job->ref->subgrid > 0));
    struct crew w = {.job = job,
                     .plan = &plan,
                     .program = program,
                     .num_tasks = WINDOWS + (exact ? 0 : job->ref->replicates),
                     .size = (size_t)job->suite->width * (size_t)job->suite->height * 3};
    w.result = calloc((size_t)w.num_tasks * w.size, sizeof *w.result);
    if (w.result == NULL)
        return err_set(e, "POV-Ray pictures: out of memory");
    bool ok = run_crew(&w, e) && describe(&w, manifest, e) && fold(&w, out, e);
    free(w.result);
    return ok;
}
