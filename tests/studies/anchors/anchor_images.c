#include "anchor_images.h"

#include "reference/suite/suite.h"
#include "renderer/base/fs.h"
#include "renderer/transport/render.h"

#include <assert.h>
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_THREADS = 64 };

struct crew {
    int n;
    atomic_int next;
    void (*fn)(void *arg, int i, int thread);
    void *arg;
};

struct worker {
    struct crew *crew;
    int number;
    pthread_t thread;
};

static void *work(void *arg)
{
    struct worker *w = arg;
    for (int i; (i = atomic_fetch_add(&w->crew->next, 1)) < w->crew->n;)
        w->crew->fn(w->crew->arg, i, w->number);
    return NULL;
}

void anchor_parallel(int n, int threads, void (*fn)(void *arg, int i, int thread), void *arg)
{
    struct crew crew = {.n = n, .fn = fn, .arg = arg};
    struct worker worker[MAX_THREADS];
    assert(threads >= 1 && threads <= MAX_THREADS);
    int started = 1;
    for (int t = 0; t < threads; t++)
        worker[t] = (struct worker){.crew = &crew, .number = t};
    while (started < threads &&
           pthread_create(&worker[started].thread, NULL, work, &worker[started]) == 0)
        started++;
    work(&worker[0]);
    for (int t = 1; t < started; t++)
        pthread_join(worker[t].thread, NULL);
}

/* One scene being rendered. Blocks of the reference are 64 samples; each is a job as a render is. */
enum { BLOCK = 64, EMITTED_SPP = 1024 };

struct crew_job {
    struct scene scene;
    struct camera camera;
    struct bvh *bvh;
    struct anchor_pool *pool;
    const struct anchor_job *job;
    int depth, blocks;
    struct moments *block_rgb, *block_xyz;
    struct moments emitted;
    atomic_int done, failed;
    struct err error; /* of the thread that set failed first */
};

static bool render_one(struct crew_job *j, int depth, uint64_t seed, int first, int spp,
                       struct moments *out, struct err *e)
{
    struct progress quiet;
    struct render_stats stats;
    progress_start(&quiet, "anchors", NULL, true);
    const struct render_options o = {
        .integrator = {.kind = INTEGRATE_PATHS,
                       .direct = DIRECT_MIS,
                       .max_bounces = depth,
                       .light_samples = 1,
                       .roulette = ROULETTE_THROUGHPUT,
                       .sampler = {SAMPLER_INDEPENDENT, seed}},
        .width = j->pool->side,
        .height = j->pool->side,
        .first_sample = (uint32_t)first,
        .num_samples = (uint32_t)spp,
        .threads = 1,
    };
    return render(&j->scene, &j->camera, j->bvh, &o, &quiet, out, &stats, e);
}

/* Moments of single samples in XYZ need the samples one at a time. */
static bool render_block(struct crew_job *j, int i, struct err *e)
{
    if (!moments_alloc(&j->block_rgb[i], j->pool->side, j->pool->side, e) ||
        !moments_alloc(&j->block_xyz[i], j->pool->side, j->pool->side, e))
        return false;
    for (int s = 0; s < BLOCK; s++) {
        struct moments one;
        if (!render_one(j, j->depth, j->job->seed, i * BLOCK + s, 1, &one, e))
            return false;
        for (size_t p = 0; p < (size_t)one.width * (size_t)one.height; p++) {
            double xyz[3];
            anchor_xyz(&one.mean[3 * p], xyz);
            moments_add(&j->block_rgb[i], p, &one.mean[3 * p]);
            moments_add(&j->block_xyz[i], p, xyz);
        }
        moments_free(&one);
    }
    return true;
}

static void render_any(void *arg, int i, int thread)
{
    struct crew_job *j = arg;
    struct anchor_pool *p = j->pool;
    struct err e = {""};
    bool ok;
    if (atomic_load(&j->failed))
        return;
    if (i < p->num_renders) {
        moments_free(&p->render[i]);
        ok = render_one(j, j->depth, j->job->seed + 1 + (uint64_t)i, 0, p->spp, &p->render[i], &e);
    } else if (i < p->num_renders + j->blocks)
        ok = render_block(j, i - p->num_renders, &e);
    else
        ok = render_one(j, 0, j->job->seed, 0, EMITTED_SPP, &j->emitted, &e);
    if (!ok && !atomic_exchange(&j->failed, 1))
        j->error = e;
    int done = atomic_fetch_add(&j->done, 1) + 1;
    if (thread == 0 && j->job->progress != NULL)
        j->job->progress((double)done / (p->num_renders + j->blocks + 1));
}

static double luminance_of(const double c[3])
{
    return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
}

/* Mean luminance of bounced light in a square. */
static double bounced_in(const struct anchor_pool *p, int x, int y, int side)
{
    double sum = 0;
    for (int row = y; row < y + side; row++)
        for (int column = x; column < x + side; column++) {
            size_t at = 3 * ((size_t)row * (size_t)p->side + (size_t)column);
            double light[3];
            for (size_t c = 0; c < 3; c++)
                light[c] = p->bounced[at + c] * p->expected.mean[at + c];
            sum += luminance_of(light);
        }
    return sum / ((double)side * side);
}

static void choose_places(struct anchor_pool *p)
{
    double all = bounced_in(p, 0, 0, p->side);
    for (int y = 4; y + ANCHOR_REGION_SIDE <= p->side; y += 20)
        for (int x = 4; x + ANCHOR_REGION_SIDE <= p->side; x += 20)
            if (p->num_places < 9 && bounced_in(p, x, y, ANCHOR_REGION_SIDE) >= all / 2) {
                p->place[p->num_places][0] = x;
                p->place[p->num_places++][1] = y;
            }
}

static bool finish(struct crew_job *j, struct err *e)
{
    struct anchor_pool *p = j->pool;
    size_t values = 3 * (size_t)p->side * (size_t)p->side;
    for (int i = 1; i < j->blocks; i++)
        if (!moments_merge(&j->block_rgb[0], &j->block_rgb[i], e) ||
            !moments_merge(&j->block_xyz[0], &j->block_xyz[i], e))
            return false;
    moments_free(&p->expected);
    p->expected = j->block_rgb[0];
    j->block_rgb[0] = (struct moments){0};
    for (size_t i = 0; i < values; i++) {
        double n = j->block_xyz[0].n[i / 3], expected = p->expected.mean[i];
        p->reference.mean[i] = j->block_xyz[0].mean[i];
        p->reference.var[i] = j->block_xyz[0].m2[i] / n; /* Mitsuba's E x^2 - (E x)^2 */
        p->bounced[i] = expected > 0 ? fmin(1, fmax(0, 1 - j->emitted.mean[i] / expected)) : 0;
    }
    return true;
}

/* What a file of kept images was made for. */
struct kept_header {
    char magic[16], sha256[72];
    int32_t side, spp, num_renders, reference_spp;
    uint64_t seed;
};

static struct kept_header header_of(const struct anchor_job *job, const struct suite_scene *scene)
{
    struct kept_header h = {.magic = "assay anchors 1",
                            .side = job->side,
                            .spp = job->spp,
                            .num_renders = job->num_renders,
                            .reference_spp = job->reference_spp,
                            .seed = job->seed};
    snprintf(h.sha256, sizeof h.sha256, "%s", scene->sha256);
    return h;
}

/* All arrays of the pool in order, through fn (fread or fwrite); `n` of moments is known. */
typedef bool transfer(FILE *f, double *values, size_t num);

static bool put(FILE *f, double *values, size_t num)
{
    return fwrite(values, sizeof *values, num, f) == num;
}

static bool get(FILE *f, double *values, size_t num)
{
    return fread(values, sizeof *values, num, f) == num;
}

static bool transfer_pool(FILE *f, struct anchor_pool *p, transfer *fn)
{
    size_t values = 3 * (size_t)p->side * (size_t)p->side;
    for (int i = -1; i < p->num_renders; i++) {
        struct moments *m = i < 0 ? &p->expected : &p->render[i];
        if (!fn(f, m->mean, values) || !fn(f, m->m2, values) || !fn(f, m->m3, values))
            return false;
    }
    return fn(f, p->reference.mean, values) && fn(f, p->reference.var, values) &&
           fn(f, p->bounced, values);
}

static bool alloc_pool(const struct anchor_job *job, struct anchor_pool *p, struct err *e)
{
    size_t values = 3 * (size_t)p->side * (size_t)p->side;
    p->render = calloc((size_t)p->num_renders, sizeof *p->render);
    p->reference = (struct mitsuba_reference){.width = p->side,
                                              .height = p->side,
                                              .mean = calloc(values, sizeof(double)),
                                              .var = calloc(values, sizeof(double))};
    p->bounced = calloc(values, sizeof *p->bounced);
    if (p->render == NULL || p->reference.mean == NULL || p->reference.var == NULL ||
        p->bounced == NULL)
        return err_set(e, "out of memory for %d renders", p->num_renders);
    for (int i = -1; i < p->num_renders; i++) {
        struct moments *m = i < 0 ? &p->expected : &p->render[i];
        if (!moments_alloc(m, p->side, p->side, e))
            return false;
        for (size_t k = 0; k < values / 3; k++)
            m->n[k] = i < 0 ? job->reference_spp : job->spp;
    }
    return true;
}

/* False, without a reason, if there is no file that can be believed. */
static bool read_kept(struct crew_job *j, const struct kept_header *want)
{
    struct kept_header got;
    struct moments first;
    struct err e;
    FILE *f = j->job->kept != NULL ? fopen(j->job->kept, "rb") : NULL;
    if (f == NULL)
        return false;
    bool ok = fread(&got, sizeof got, 1, f) == 1 && memcmp(&got, want, sizeof got) == 0 &&
              transfer_pool(f, j->pool, get) && fgetc(f) == EOF;
    fclose(f);
    if (!ok || !render_one(j, j->depth, j->job->seed + 1, 0, j->job->spp, &first, &e))
        return false;
    size_t bytes = 3 * (size_t)first.width * (size_t)first.height * sizeof(double);
    ok = memcmp(first.mean, j->pool->render[0].mean, bytes) == 0 &&
         memcmp(first.m3, j->pool->render[0].m3, bytes) == 0;
    moments_free(&first);
    return ok;
}

static bool write_kept(const struct crew_job *j, const struct kept_header *h, struct err *e)
{
    struct out_file o;
    if (j->job->kept == NULL)
        return true;
    if (!fs_make_parent_dirs(j->job->kept, e) || !out_open(&o, j->job->kept, e))
        return false;
    fwrite(h, sizeof *h, 1, o.f); /* out_commit() asks ferror() */
    transfer_pool(o.f, j->pool, put);
    return out_commit(&o, e);
}

static bool render_pool(struct crew_job *j, struct err *e)
{
    j->blocks = j->job->reference_spp / BLOCK;
    assert(j->blocks >= 1 && j->blocks * BLOCK == j->job->reference_spp);
    j->block_rgb = calloc((size_t)j->blocks, sizeof *j->block_rgb);
    j->block_xyz = calloc((size_t)j->blocks, sizeof *j->block_xyz);
    bool ok = j->block_rgb != NULL && j->block_xyz != NULL;
    if (!ok)
        err_set(e, "out of memory for a reference");
    if (ok)
        anchor_parallel(j->pool->num_renders + j->blocks + 1, j->job->threads, render_any, j);
    if (ok && atomic_load(&j->failed)) {
        *e = j->error;
        ok = false;
    }
    ok = ok && finish(j, e);
    for (int i = 0; i < j->blocks; i++) {
        if (j->block_rgb != NULL)
            moments_free(&j->block_rgb[i]);
        if (j->block_xyz != NULL)
            moments_free(&j->block_xyz[i]);
    }
    free(j->block_rgb);
    free(j->block_xyz);
    moments_free(&j->emitted);
    return ok;
}

static bool open_and_render(struct crew_job *j, const struct suite_scene *scene, struct err *e)
{
    const struct kept_header h = header_of(j->job, scene);
    struct suite_scene square = *scene; /* another size of image: the camera knows its shape */
    square.width = square.height = j->job->side;
    if (!suite_open(&square, &j->scene, &j->camera, e))
        return false;
    j->depth = scene->depth;
    j->bvh = bvh_build(&j->scene, BVH_SAH, e);
    bool ok = j->bvh != NULL && alloc_pool(j->job, j->pool, e) &&
              (read_kept(j, &h) || (render_pool(j, e) && write_kept(j, &h, e)));
    if (ok) {
        choose_places(j->pool);
        ok = j->pool->num_places > 0 || err_set(e, "no place for a local error");
    }
    bvh_free(j->bvh);
    scene_free(&j->scene);
    return ok;
}

bool anchor_render(const struct anchor_job *job, struct anchor_pool *out, struct err *e)
{
    *out =
        (struct anchor_pool){.side = job->side, .spp = job->spp, .num_renders = job->num_renders};
    struct suite suite;
    if (!suite_load("reference/scenes", &suite, e))
        return false;
    const struct suite_scene *s = suite_find(&suite, job->scene);
    struct crew_job *j = calloc(1, sizeof *j);
    bool ok = (s != NULL && j != NULL) || err_set(e, "%s: no such scene, or no memory", job->scene);
    if (ok) {
        snprintf(out->title, sizeof out->title, "%s", s->title);
        j->pool = out;
        j->job = job;
        ok = open_and_render(j, s, e);
    }
    free(j);
    suite_free(&suite);
    if (!ok)
        anchor_pool_free(out);
    return ok;
}

void anchor_pool_free(struct anchor_pool *p)
{
    for (int i = 0; p->render != NULL && i < p->num_renders; i++)
        moments_free(&p->render[i]);
    free(p->render);
    free(p->reference.mean);
    free(p->reference.var);
    moments_free(&p->expected);
    free(p->bounced);
    *p = (struct anchor_pool){0};
}

double anchor_noise(const struct anchor_pool *p)
{
    size_t pixels = (size_t)p->side * (size_t)p->side;
    double mean = 0, var = 0;
    for (size_t i = 0; i < pixels; i++) { /* Y is the luminance */
        mean += p->reference.mean[3 * i + 1];
        var += p->reference.var[3 * i + 1];
    }
    return sqrt(var / (double)pixels) / (mean / (double)pixels);
}

static void brighten(struct moments *m, size_t i, double f)
{
    m->mean[i] *= f;
    m->m2[i] *= f * f;
    m->m3[i] *= f * f * f;
}

void anchor_make_wrong(const struct anchor_pool *p, const struct moments *in,
                       enum anchor_error kind, double b, int place, struct moments *out)
{
    size_t pixels = (size_t)in->width * (size_t)in->height;
    memcpy(out->n, in->n, pixels * sizeof *out->n);
    memcpy(out->mean, in->mean, 3 * pixels * sizeof *out->mean);
    memcpy(out->m2, in->m2, 3 * pixels * sizeof *out->m2);
    memcpy(out->m3, in->m3, 3 * pixels * sizeof *out->m3);
    const int *at = p->place[place % p->num_places];
    switch (kind) {
    case ANCHOR_GLOBAL:
        for (size_t i = 0; i < 3 * pixels; i++)
            brighten(out, i, 1 + b);
        return;
    case ANCHOR_BOUNCED:
        for (size_t i = 0; i < 3 * pixels; i++)
            brighten(out, i, 1 + b * p->bounced[i]);
        return;
    case ANCHOR_REGION:
        for (int y = at[1]; y < at[1] + ANCHOR_REGION_SIDE; y++)
            for (int x = at[0]; x < at[0] + ANCHOR_REGION_SIDE; x++)
                for (size_t c = 0; c < 3; c++) {
                    size_t i = 3 * ((size_t)y * (size_t)p->side + (size_t)x) + c;
                    brighten(out, i, 1 + b * p->bounced[i]);
                }
        return;
    case NUM_ANCHOR_ERRORS: break;
    }
    assert(!"an error of the picture");
}
