/* A reference in parts (reference_render.h). */
#include "reference_internal.h"

#include "reference/base/json_file.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PART   "part.json"
#define PREFIX "picture"

static const struct engine_driver *need_driver(const struct suite_scene *scene,
                                               const struct suite_reference *ref, struct err *e)
{
    const struct engine_driver *d = engine_driver_of(ref->engine);
    if (d == NULL)
        err_set(e, "%s: '%s' is no engine that is rendered", scene->name, ref->engine);
    return d;
}

/* Identifies the reference that a part belongs to. */
static json_t *identity_of(const struct suite_scene *scene, const struct suite_reference *ref,
                           const struct reference_options *opt)
{
    return json_pack("{ss,ss,ss,si,si,si,si,si,si,sI,si}", "scene", scene->name, "scene_sha256",
                     scene->sha256, "engine", ref->engine, "width", scene->width, "height",
                     scene->height, "depth", scene->depth, "replicates", ref->replicates, "spp",
                     ref->spp, "subgrid", ref->subgrid, "seed", (json_int_t)opt->seed,
                     "first_replicate", opt->first_replicate);
}

static bool part_path(const char *dir, char path[REPLICATE_IMAGE_PATH], struct err *e)
{
    if (strlen(dir) + 64 > REPLICATE_IMAGE_PATH)
        return err_set(e, "%.64s...: path too long", dir);
    snprintf(path, REPLICATE_IMAGE_PATH, "%s/" PART, dir);
    return true;
}

static bool count(const struct suite_scene *scene, const struct suite_reference *ref,
                  const struct reference_options *opt, int *num, struct err *e)
{
    struct scene s = {0};
    struct camera camera;
    const struct reference_job job = {
        .suite = scene, .ref = ref, .opt = opt, .scene = &s, .camera = &camera};
    const struct engine_driver *driver = need_driver(scene, ref, e);
    if (driver == NULL || !suite_open(scene, &s, &camera, e))
        return false;
    bool ok = driver->count(&job, num, e);
    scene_free(&s);
    return ok;
}

bool reference_count(const struct suite_scene *scene, const struct suite_reference *ref,
                     const struct reference_options *opt, int *num, struct err *e)
{
    return count(scene, ref, opt, num, e) || err_prefix(e, "%s, %s", scene->name, ref->engine);
}

struct range {
    int first, last;
    const char *dir;
    json_t *said;
};

/* Reading the images back shows whether they are what was asked for, before the job counts as
 * done. */
static bool render_range(const struct reference_job *job, void *ctx, struct err *e)
{
    const struct range *r = ctx;
    const struct engine_driver *driver = engine_driver_of(job->ref->engine);
    bool ok = driver->render(job, r->first, r->last, r->said, e);
    for (int k = r->first; ok && k < r->last; k++) {
        char from[REPLICATE_IMAGE_PATH], to[REPLICATE_IMAGE_PATH];
        replicate_images_path(job->dir, driver->prefix, k - r->first, from);
        replicate_images_path(r->dir, PREFIX, k, to);
        float *px = replicate_images_read(from, job->suite->width, job->suite->height,
                                          driver->below_zero, e);
        ok = px != NULL && replicate_images_write(to, job->suite->width, job->suite->height, px, e);
        free(px);
    }
    return ok;
}

bool reference_render_part(const struct suite_scene *scene, const struct suite_reference *ref,
                           const struct reference_options *opt, int first, int last,
                           const char *dir, struct err *e)
{
    char path[REPLICATE_IMAGE_PATH];
    int num;
    struct timing t = timing_start();
    struct range r = {.first = first, .last = last, .dir = dir, .said = json_object()};
    bool ok = part_path(dir, path, e) && count(scene, ref, opt, &num, e);
    if (ok && (first < 0 || last > num || first >= last))
        ok = err_set(e, "no images %d:%d among its %d", first, last, num);
    ok = ok && reference_in_directory(scene, ref, opt, render_range, &r, e);
    if (ok) {
        timing_stop(&t);
        json_t *part =
            json_pack("{so, si, si, sO, sf, sf}", "of", identity_of(scene, ref, opt), "first",
                      first, "last", last, "said", r.said, "cpu_s", t.cpu_s, "wall_s", t.wall_s);
        ok = json_write(path, part, e);
        json_decref(part);
    }
    json_decref(r.said);
    return ok || err_prefix(e, "%s, %s", scene->name, ref->engine);
}

/* Which directory each image is in. */
struct gathered {
    const char **dir;
    int num;
    json_t *said; /* of the first part; all others have to equal it */
    double cpu_s, wall_s;
};

static void path_of(const void *ctx, int k, char path[REPLICATE_IMAGE_PATH])
{
    const struct gathered *g = ctx;
    replicate_images_path(g->dir[k], PREFIX, k, path);
}

/* Adds a part, whose images have to begin at number *next. */
static bool add_part(struct gathered *g, const json_t *identity, const char *dir, int *next,
                     struct err *e)
{
    char path[REPLICATE_IMAGE_PATH];
    json_t *part = part_path(dir, path, e) ? json_read_or_say(path, e) : NULL;
    if (part == NULL)
        return false;
    const json_t *first = json_object_get(part, "first"), *last = json_object_get(part, "last");
    json_t *said = json_object_get(part, "said");
    bool ok = json_equal(json_object_get(part, "of"), identity) ||
              err_set(e, "%s: of another reference, or of other settings", path);
    if (ok &&
        (!json_is_integer(first) || json_integer_value(first) != *next || !json_is_integer(last) ||
         json_integer_value(last) <= *next || json_integer_value(last) > g->num))
        ok = err_set(e, "%s: has images %lld:%lld, those from %d on are wanted, of %d", path,
                     (long long)json_integer_value(first), (long long)json_integer_value(last),
                     *next, g->num);
    if (ok && !json_is_string(json_object_get(said, "version")))
        ok = err_set(e, "%s: does not say what made it", path);
    if (ok && g->said == NULL)
        g->said = json_incref(said);
    if (ok && !json_equal(said, g->said))
        ok = err_set(e, "%s: made by %s with other settings than the first part, of %s", path,
                     json_string_value(json_object_get(said, "version")),
                     json_string_value(json_object_get(g->said, "version")));
    if (ok) {
        while (*next < json_integer_value(last))
            g->dir[(*next)++] = dir;
        g->cpu_s += json_number_value(json_object_get(part, "cpu_s"));
        g->wall_s += json_number_value(json_object_get(part, "wall_s"));
    }
    json_decref(part);
    return ok;
}

static bool find_images(const struct suite_scene *scene, const struct suite_reference *ref,
                        const struct reference_options *opt, const char *const *dir, int num,
                        struct gathered *g, struct err *e)
{
    int next = 0;
    if (!count(scene, ref, opt, &g->num, e))
        return false;
    json_t *identity = identity_of(scene, ref, opt);
    g->dir = calloc((size_t)g->num, sizeof *g->dir);
    bool ok = g->dir != NULL || err_set(e, "out of memory");
    for (int i = 0; ok && i < num; i++)
        ok = add_part(g, identity, dir[i], &next, e);
    if (ok && next < g->num)
        ok = err_set(e, "images %d:%d are missing", next, g->num);
    json_decref(identity);
    return ok;
}

static bool fold(const struct suite_scene *scene, const struct suite_reference *ref,
                 const struct reference_options *opt, const struct gathered *g, struct moments *out,
                 json_t *manifest, struct err *e)
{
    struct scene s = {0};
    struct camera camera;
    const struct replicate_images images = {path_of, g};
    const struct reference_job job = {
        .suite = scene, .ref = ref, .opt = opt, .scene = &s, .camera = &camera};
    if (!suite_open(scene, &s, &camera, e))
        return false;
    bool ok = engine_driver_of(ref->engine)->fold(&job, &images, g->said, out, manifest, e);
    scene_free(&s);
    return ok;
}

bool reference_fold_parts(const struct suite_scene *scene, const struct suite_reference *ref,
                          const struct reference_options *opt, const char *const *dir, int num,
                          struct moments *out, json_t **manifest, struct err *e)
{
    struct timing t = timing_start();
    struct gathered g = {.num = 0};
    json_t *m = json_object();
    bool ok = find_images(scene, ref, opt, dir, num, &g, e) && fold(scene, ref, opt, &g, out, m, e);
    if (ok) {
        timing_stop(&t);
        t.cpu_s += g.cpu_s;
        t.wall_s += g.wall_s;
        reference_describe(scene, ref, opt, &t, out, m);
        *manifest = json_incref(m);
    }
    free(g.dir);
    json_decref(g.said);
    json_decref(m);
    return ok || err_prefix(e, "%s, %s", scene->name, ref->engine);
}
