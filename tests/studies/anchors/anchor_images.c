#include "anchor_images.h"

#include "reference/suite/suite.h"
#include "renderer/transport/render.h"
#include "tests/studies/calibration/work.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* One scene being rendered. Blocks of the reference are 64 samples; each is a job as a render is. */
enum { BLOCK = 64, EMITTED_SPP = 1024 };

struct rendering {
    struct scene scene;
    struct camera camera;
    struct bvh *bvh;
    struct anchor_pool *pool;
    const struct anchor_job *job;
    int depth, blocks;
    struct moments *block_rgb, *block_xyz;
    struct moments emitted;
};

static bool render_one(struct rendering *j, int depth, uint64_t seed, int first, int spp,
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
static bool render_block(struct rendering *j, int i, struct err *e)
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

static bool render_any(void *arg, int i, struct err *e)
{
    struct rendering *j = arg;
    struct anchor_pool *p = j->pool;
    if (i < p->num_renders)
        return render_one(j, j->depth, j->job->seed + 1 + (uint64_t)i, 0, p->spp, &p->render[i], e);
    if (i < p->num_renders + j->blocks)
        return render_block(j, i - p->num_renders, e);
    return render_one(j, 0, j->job->seed, 0, EMITTED_SPP, &j->emitted, e);
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

static bool finish(struct rendering *j, struct err *e)
{
    struct anchor_pool *p = j->pool;
    size_t values = 3 * (size_t)p->side * (size_t)p->side;
    for (int i = 1; i < j->blocks; i++)
        if (!moments_merge(&j->block_rgb[0], &j->block_rgb[i], e) ||
            !moments_merge(&j->block_xyz[0], &j->block_xyz[i], e))
            return false;
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

static bool render_pool(struct rendering *j, struct err *e)
{
    struct anchor_pool *p = j->pool;
    size_t values = 3 * (size_t)p->side * (size_t)p->side;
    j->blocks = j->job->reference_spp / BLOCK;
    assert(j->blocks >= 1 && j->blocks * BLOCK == j->job->reference_spp);
    p->render = calloc((size_t)p->num_renders, sizeof *p->render);
    p->reference = (struct mitsuba_reference){.width = p->side,
                                              .height = p->side,
                                              .mean = calloc(values, sizeof(double)),
                                              .var = calloc(values, sizeof(double))};
    p->bounced = calloc(values, sizeof *p->bounced);
    j->block_rgb = calloc((size_t)j->blocks, sizeof *j->block_rgb);
    j->block_xyz = calloc((size_t)j->blocks, sizeof *j->block_xyz);
    bool ok = (p->render != NULL && p->reference.mean != NULL && p->reference.var != NULL &&
               p->bounced != NULL && j->block_rgb != NULL && j->block_xyz != NULL) ||
              err_set(e, "out of memory for %d renders", p->num_renders);
    ok = ok && work_run_all(j->job->what, p->num_renders + j->blocks + 1, render_any, j, e) &&
         finish(j, e);
    for (int i = 0; j->block_rgb != NULL && j->block_xyz != NULL && i < j->blocks; i++) {
        moments_free(&j->block_rgb[i]);
        moments_free(&j->block_xyz[i]);
    }
    free(j->block_rgb);
    free(j->block_xyz);
    moments_free(&j->emitted);
    return ok;
}

static bool open_and_render(struct rendering *j, const struct suite_scene *scene, struct err *e)
{
    struct suite_scene square = *scene; /* another size of image: the camera knows its shape */
    square.width = square.height = j->job->side;
    if (!suite_open(&square, &j->scene, &j->camera, e))
        return false;
    j->depth = scene->depth;
    j->bvh = bvh_build(&j->scene, BVH_SAH, e);
    bool ok = j->bvh != NULL && render_pool(j, e);
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
    struct rendering j = {.pool = out, .job = job};
    bool ok = s != NULL || err_set(e, "%s: no such scene", job->scene);
    if (ok) {
        snprintf(out->title, sizeof out->title, "%s", s->title);
        ok = open_and_render(&j, s, e);
    }
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
