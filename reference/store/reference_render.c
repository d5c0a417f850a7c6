#include "reference_internal.h"

#include "reference/truth/truth.h"

#include "renderer/base/fs.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

bool reference_in_directory(const struct suite_scene *scene, const struct suite_reference *ref,
                            const struct reference_options *opt,
                            bool (*act)(const struct reference_job *job, void *ctx, struct err *e),
                            void *ctx, struct err *e)
{
    struct path dir = fs_path("%s/%s-%s-XXXXXX", opt->work_dir, scene->name, ref->engine);
    if (mkdtemp(dir.s) == NULL)
        return err_set(e, "%s: cannot make a directory in it: %s", opt->work_dir, strerror(errno));
    struct scene s = {0};
    struct camera camera;
    struct reference_job job = {
        .suite = scene, .ref = ref, .opt = opt, .scene = &s, .camera = &camera, .dir = dir.s};
    bool ok = suite_open(scene, &s, &camera, e);
    if (ok) {
        ok = act(&job, ctx, e);
        scene_free(&s);
    }
    if (ok)
        return fs_remove_tree(dir.s, e);
    if (rmdir(dir.s) != 0) {
        struct err what = *e;
        err_set(e, "%.900s (see %s)", what.msg, dir.s);
    }
    return false;
}

struct whole {
    struct moments *out;
    json_t *manifest;
    bool rendered;
};

static bool render_whole(const struct reference_job *job, void *ctx, struct err *e)
{
    struct whole *w = ctx;
    return w->rendered = engine_driver_render(engine_driver_of(job->ref->engine), job, w->out,
                                              w->manifest, e);
}

static bool export_only(const struct reference_job *job, void *ctx, struct err *e)
{
    (void)ctx;
    return engine_export(engine_kind_of(job->ref->engine), job->scene, job->camera,
                         job->suite->depth, fs_path("%s/scene", job->dir).s, e);
}

bool reference_is_expressible(const struct suite_scene *scene, const struct suite_reference *ref,
                              const struct reference_options *opt, struct err *why)
{
    return reference_in_directory(scene, ref, opt, export_only, NULL, why);
}

bool reference_is_rendered(const struct suite_reference *ref)
{
    return strcmp(ref->engine, "truth") != 0 && strcmp(ref->engine, "pathtracer") != 0;
}

static bool engine_render(const struct suite_scene *scene, const struct suite_reference *ref,
                          const struct reference_options *opt, struct moments *out,
                          json_t *manifest, struct err *e)
{
    struct whole w = {.out = out, .manifest = manifest};
    if (reference_in_directory(scene, ref, opt, render_whole, &w, e))
        return true;
    if (w.rendered)
        moments_free(out);
    return false;
}

void reference_describe(const struct suite_scene *scene, const struct suite_reference *ref,
                        const struct reference_options *opt, const struct timing *t,
                        const struct moments *m, json_t *manifest)
{
    json_t *common = json_pack(
        "{ss,ss,ss,ss,ss,sf,si,si,si,si,si,si,sI,sf,sf}", "scene", scene->name, "scene_sha256",
        scene->sha256, "engine", ref->engine, "date", t->date, "unit", m->unit, "spp_of_unit",
        m->spp, "width", scene->width, "height", scene->height, "depth", scene->depth, "replicates",
        ref->replicates, "spp", ref->spp, "subgrid", ref->subgrid, "seed", (json_int_t)opt->seed,
        "cpu_s", t->cpu_s, "wall_s", t->wall_s);
    json_object_update_new(manifest, common);
}

bool reference_render(const struct suite_scene *scene, const struct suite_reference *ref,
                      const struct reference_options *opt, struct moments *out, json_t **manifest,
                      struct err *e)
{
    bool is_truth = strcmp(ref->engine, "truth") == 0;
    if (!is_truth && engine_driver_of(ref->engine) == NULL)
        return err_set(e, "%s: unknown reference engine '%s'", scene->name, ref->engine);
    struct timing t = timing_start();
    json_t *m = json_object();
    if (is_truth ? !truth_render(scene, ref, out, e) : !engine_render(scene, ref, opt, out, m, e)) {
        json_decref(m);
        return err_prefix(e, "%s, %s", scene->name, ref->engine);
    }
    timing_stop(&t);
    reference_describe(scene, ref, opt, &t, out, m);
    if (is_truth)
        json_object_update_new(m, json_pack("{ss,sO}", "kind", ref->kind, "values", ref->values));
    *manifest = m;
    return true;
}
