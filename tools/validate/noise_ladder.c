#include "noise_ladder.h"

#include "reference/base/json_file.h"
#include "reference/store/reference_render.h"
#include "reference/truth/truth.h"
#include "renderer/base/fs.h"
#include "renderer/base/progress.h"
#include "renderer/pathtracer/options.h"
#include "run_pathtracer.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

const double noise_ladder_least_margin = 0.1;
const int noise_ladder_spp[NOISE_RUNGS] = {1, 4, 16, NOISE_TOP};

void noise_ladder_free(struct noise_ladder *l)
{
    variance_map_free(&l->sample);
    *l = (struct noise_ladder){0};
}

bool noise_ladder_unit(const char *golden_dir, const struct suite_scene *scene,
                       const struct moments *truth, int shrink, struct converge_reference *out,
                       struct err *e)
{
    const struct suite_reference *form = suite_reference_of(scene, "truth");
    struct moments m = {0};
    json_t *manifest = NULL;
    bool ok = truth != NULL || (form != NULL ? truth_render(scene, form, &m, e)
                                             : golden_read(golden_dir, scene, &scene->reference[0],
                                                           &m, &manifest, e));
    json_decref(manifest);
    if (!ok)
        return false;
    ok = convergence_rate_reference_init(out, truth != NULL ? truth : &m, shrink, e);
    moments_free(&m);
    return ok || err_prefix(e, "%s", scene->name);
}

bool noise_ladder_add(struct noise_ladder *l, const float *images, int spp, double cpu_s,
                      const struct converge_reference *unit, int width, int tile, struct err *e)
{
    struct variance_map map;
    assert(l->num < NOISE_RUNGS);
    if (!variance_ladder_between(images, l->replicates, unit, width, tile, &map, e))
        return false;
    l->rung[l->num] = (struct noise_rung){.spp = spp, .variance = map.image, .cpu_s = cpu_s};
    l->cpu_s += cpu_s * l->replicates;
    if (l->num++ == 0) {
        l->sample = map;
        l->n = l->replicates;
    } else {
        variance_map_free(&map);
    }
    return true;
}

/* Replicates first .. first+num-1 of a rung, at most MAX_SEEDS. */
static bool render_rung(const struct noise_job *job, int rung, int first, int num,
                        struct moments *out, double *cpu_s, struct err *e)
{
    static const char *const sobol[] = {"--sampler", "sobol", NULL};
    double left = job->deadline - progress_seconds();
    if (left <= 0)
        return err_set(e, "the budget is spent");
    const struct path files = fs_path("%s/noise", job->dir);
    uint64_t seed[MAX_SEEDS];
    for (int i = 0, k = first; i < num; i++, k++) {
        /* Numbered in batches, so that rendering more replicates does not change the seeds of the first ones. */
        int batch = k / NOISE_REPLICATES * 2 * NOISE_RUNGS + job->sobol * NOISE_RUNGS + rung;
        int number = batch * NOISE_REPLICATES + k % NOISE_REPLICATES;
        seed[i] = replicate_seed(job->seed, (int)job->first + number);
    }
    const struct pathtracer_job ours = {.program = job->pathtracer,
                                        .scene = job->scene,
                                        .spp = noise_ladder_spp[rung],
                                        .options = job->sobol ? sobol : NULL,
                                        .threads = job->threads,
                                        .timeout_s = fmin(left / num, job->timeout_s),
                                        .files = files.s};
    return run_pathtracer_seeds(&ours, seed, num, out, cpu_s, e);
}

void noise_ladder_renders_free(struct noise_renders *r)
{
    for (int i = 0; i < NOISE_RUNGS; i++)
        free(r->images[i]);
    for (int k = 0; r->last != NULL && k < r->done; k++)
        moments_free(&r->last[k]);
    free(r->last);
    *r = (struct noise_renders){0};
}

static bool begin(const struct noise_job *job, struct noise_renders *r, struct err *e)
{
    bool ok = true;
    for (int i = 0; i < NOISE_RUNGS && r->images[i] == NULL; i++) {
        r->images[i] = malloc((size_t)job->replicates * job->unit->size * sizeof *r->images[i]);
        ok = ok && r->images[i] != NULL;
    }
    if (!job->sobol && r->last == NULL)
        r->last = calloc((size_t)job->replicates, sizeof *r->last);
    return (ok && (job->sobol || r->last != NULL)) || err_set(e, "out of memory");
}

/* Renders the next replicates of every rung, up to replicate `count` and at most MAX_SEEDS at once. */
static bool climb(const struct noise_job *job, int count, struct noise_renders *r, struct err *e)
{
    const size_t size = job->unit->size;
    const int first = r->done, num = count - first < MAX_SEEDS ? count - first : MAX_SEEDS;
    for (int rung = 0; rung < NOISE_RUNGS; rung++) {
        struct moments m[MAX_SEEDS];
        double cpu_s;
        if (!render_rung(job, rung, first, num, m, &cpu_s, e))
            return false;
        for (int k = 0; k < num; k++) {
            float *image = r->images[rung] + (size_t)(first + k) * size;
            for (size_t i = 0; i < size; i++)
                image[i] = (float)m[k].mean[i];
            if (rung == NOISE_RUNGS - 1 && !job->sobol)
                r->last[first + k] = m[k];
            else
                moments_free(&m[k]);
        }
        r->cpu_s[rung] += cpu_s;
    }
    r->done = first + num;
    return true;
}

bool noise_ladder_render(const struct noise_job *job, int count, struct noise_renders *r,
                         struct noise_ladder *out, struct err *e)
{
    const int width = job->scene->width, tile = job->scene->tile;
    *out = (struct noise_ladder){.replicates = count};
    bool ok = begin(job, r, e);
    while (ok && r->done < count)
        ok = climb(job, count, r, e);
    for (int i = 0; ok && i < NOISE_RUNGS; i++)
        ok = noise_ladder_add(out, r->images[i], noise_ladder_spp[i], r->cpu_s[i] / count,
                              job->unit, width, tile, e);
    if (ok && !job->sobol) { /* the last rung also gives the variance of a sample */
        variance_map_free(&out->sample);
        out->n = (double)count * NOISE_TOP;
        ok = variance_ladder_within(r->last, count, job->unit, tile, &out->sample, e);
    }
    if (!ok)
        noise_ladder_free(out);
    return ok;
}

static bool has_noise(struct estimate v)
{
    return v.value > variance_ladder_none;
}

bool noise_ladder_is_silent(const struct noise_ladder *l)
{
    for (int i = 0; i < l->num; i++)
        if (has_noise(l->rung[i].variance))
            return false;
    return true;
}

/* The rungs with noise as rungs of convergence_rate.h, with the variance in place of the squared error. */
static int as_rungs(const struct noise_ladder *l, struct rung out[NOISE_RUNGS])
{
    int num = 0;
    for (int i = 0; i < l->num; i++) {
        const struct noise_rung *g = &l->rung[i];
        if (!has_noise(g->variance))
            continue;
        struct estimate v = variance_ladder_log(g->variance);
        out[num++] = (struct rung){.spp = g->spp,
                                   .replicates = l->replicates,
                                   .cpu_s = g->cpu_s,
                                   .log_mse = v,
                                   .log_variance = v};
    }
    return num;
}

bool noise_ladder_slope(const struct noise_ladder *l, struct estimate *slope)
{
    struct rung rung[NOISE_RUNGS];
    int num = as_rungs(l, rung);
    if (num >= 2) {
        *slope = convergence_rate_slope(rung, num);
        slope->dof = fmax(convergence_rate_slope_dof(rung, num), 1);
    }
    return num >= 2;
}

bool noise_ladder_efficiency(const struct noise_ladder *l, struct estimate *log_efficiency)
{
    struct rung rung[NOISE_RUNGS];
    int num = as_rungs(l, rung);
    for (int i = 0; i < num; i++)
        if (!(rung[i].cpu_s > 0))
            return false;
    if (num < 3)
        return false;
    struct cost cost = convergence_rate_cost(rung, num);
    *log_efficiency = convergence_rate_log_efficiency(&rung[num - 1], &cost);
    return isfinite(log_efficiency->value);
}

/* Rounded to five digits: more would be noise and waste space. */
static json_t *short_number(double v)
{
    char text[32];
    snprintf(text, sizeof text, "%.5g", v);
    return json_real(strtod(text, NULL));
}

static json_t *estimate_json(struct estimate v)
{
    return json_pack("[o,o,o]", short_number(v.value), short_number(v.se), short_number(v.dof));
}

json_t *noise_ladder_json(const struct noise_ladder *l)
{
    json_t *rungs = json_array(), *tiles = json_array();
    for (int i = 0; i < l->num; i++)
        json_array_append_new(rungs, json_pack("{si,so,so}", "spp", l->rung[i].spp, "variance",
                                               estimate_json(l->rung[i].variance), "cpu_s",
                                               short_number(l->rung[i].cpu_s)));
    for (int i = 0; i < l->sample.tiles_x * l->sample.tiles_y; i++)
        json_array_append_new(tiles, estimate_json(l->sample.tile[i]));
    return json_pack("{si,so,sf,s{sf,si,si,so,so}}", "replicates", l->replicates, "rungs", rungs,
                     "cpu_s", l->cpu_s, "sample", "n", l->n, "tiles_x", l->sample.tiles_x,
                     "tiles_y", l->sample.tiles_y, "variance", estimate_json(l->sample.image),
                     "tile", tiles);
}

static bool parse_estimate(const json_t *v, struct estimate *out)
{
    return json_unpack((json_t *)v, "[FFF!]", &out->value, &out->se, &out->dof) == 0 &&
           out->value >= 0 && out->se >= 0 && out->dof > 0;
}

static bool parse_sample(const json_t *sample, struct noise_ladder *out)
{
    struct variance_map *m = &out->sample;
    const json_t *tile = json_object_get(sample, "tile");
    size_t num = json_array_size(tile);
    int x, y;
    if (json_unpack((json_t *)sample, "{s:F,s:i,s:i}", "n", &out->n, "tiles_x", &x, "tiles_y",
                    &y) != 0 ||
        !(out->n > 0) || x < 1 || y < 1 || x > 4096 || y > 4096 || num != (size_t)x * (size_t)y ||
        !parse_estimate(json_object_get(sample, "variance"), &m->image))
        return false;
    m->tiles_x = x;
    m->tiles_y = y;
    m->tile = calloc(num, sizeof *m->tile);
    for (size_t i = 0; i < num; i++)
        if (m->tile == NULL || !parse_estimate(json_array_get(tile, i), &m->tile[i]))
            return false;
    return true;
}

static bool parse_rungs(const json_t *rungs, struct noise_ladder *out)
{
    out->num = (int)json_array_size(rungs);
    if (out->num < 1 || out->num > NOISE_RUNGS)
        return false;
    for (int i = 0; i < out->num; i++) {
        struct noise_rung *g = &out->rung[i];
        json_t *variance;
        if (json_unpack(json_array_get(rungs, (size_t)i), "{s:i,s:o,s?F}", "spp", &g->spp,
                        "variance", &variance, "cpu_s", &g->cpu_s) != 0 ||
            g->spp < 1 || !parse_estimate(variance, &g->variance))
            return false;
    }
    return true;
}

bool noise_ladder_parse(const json_t *entry, const struct suite_scene *scene,
                        struct noise_ladder *out, struct err *e)
{
    const char *sha = json_string_value(json_object_get(entry, "scene_sha256"));
    const struct {
        const char *key;
        int value;
    } same[] = {{"width", scene->width},
                {"height", scene->height},
                {"depth", scene->depth},
                {"tile", scene->tile}};
    *out = (struct noise_ladder){.replicates =
                                     (int)json_integer_value(json_object_get(entry, "replicates")),
                                 .cpu_s = json_number_value(json_object_get(entry, "cpu_s"))};
    if (sha == NULL || strcmp(sha, scene->sha256) != 0)
        return err_set(e, "stale: the scene file has changed since: make it again");
    for (size_t i = 0; i < sizeof same / sizeof *same; i++)
        if (json_integer_value(json_object_get(entry, same[i].key)) != same[i].value)
            return err_set(e, "stale: its %s is not that of the suite: make it again", same[i].key);
    if (out->replicates >= 3 && parse_rungs(json_object_get(entry, "rungs"), out) &&
        parse_sample(json_object_get(entry, "sample"), out))
        return true;
    noise_ladder_free(out);
    return err_set(e, "damaged: a number is missing or out of its range");
}

static struct path place(const char *golden_dir, const char *scene)
{
    return fs_path("%s/%s/noise.json", golden_dir, scene);
}

bool noise_ladder_is_kept(const char *golden_dir, const struct suite *suite)
{
    for (int i = 0; i < suite->num_scenes; i++)
        if (access(place(golden_dir, suite->scene[i].name).s, F_OK) == 0)
            return true;
    return false;
}

json_t *noise_ladder_load(const char *golden_dir, const char *scene, struct err *e)
{
    return json_read_object(place(golden_dir, scene).s, e);
}

bool noise_ladder_store(const char *golden_dir, const char *scene, const json_t *all, struct err *e)
{
    const struct path path = place(golden_dir, scene);
    return fs_make_parent_dirs(path.s, e) &&
           json_write_as(path.s, all, JSON_COMPACT | JSON_REAL_PRECISION(6), e);
}
