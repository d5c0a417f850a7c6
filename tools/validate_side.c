#include "validate_parts.h"

#include "../reference/json_file.h"
#include "../reference/reference.h"
#include "../reference/truth.h"
#include "../renderer/fs.h"
#include "ours.h"

#include <stdio.h>
#include <string.h>

void side_free(struct side *s)
{
    moments_free(&s->m);
    json_decref(s->manifest);
    *s = (struct side){0};
}

void data_path(const struct validation *v, char *path, const char *scene, const char *file)
{
    snprintf(path, MAX_PATH, "%s/data/%s/%s", v->opt->out_dir, scene, file);
}

void say(const struct validation *v, const char *scene, const char *what)
{
    if (!v->opt->quiet)
        fprintf(stderr, "[%2d/%d] %s: %s\n", v->done, v->num_claims, scene, what);
}

void render_ours(const struct validation *v, const struct suite_scene *s, const char *name,
                 const struct suite_variant *variant, struct side *out)
{
    char path[MAX_PATH], log[MAX_PATH], file[96];
    snprintf(file, sizeof file, "%s.exr", name);
    data_path(v, path, s->name, file);
    snprintf(file, sizeof file, "%s.log", name);
    data_path(v, log, s->name, file);
    const struct ours_job job = {.program = v->opt->pathtracer,
                                 .scene = s,
                                 .spp = variant != NULL ? variant->spp : s->spp,
                                 .seed = v->opt->seed,
                                 .options = variant != NULL ? variant->options : NULL,
                                 .threads = v->opt->threads,
                                 .timeout_s = v->opt->timeout_s,
                                 .picture = path,
                                 .log = log};
    char note[128];
    snprintf(note, sizeof note, "rendering with %s", name);
    say(v, s->name, note);
    *out = (struct side){0};
    out->present =
        make_parent_dirs(path, &out->e) && ours_render(&job, &out->m, &out->seconds, &out->e);
}

static bool load_reference(const struct validation *v, const struct suite_scene *s,
                           const struct suite_reference *ref, struct side *out)
{
    const struct validate_options *o = v->opt;
    if (strcmp(ref->engine, "truth") == 0)
        return truth_render(s, ref, &out->m, &out->e);
    if (!o->live)
        return golden_read(o->golden_dir, s, ref, &out->m, &out->manifest, &out->e);
    const struct reference_options ro = {.seed = o->reference_seed,
                                         .threads = o->threads,
                                         .timeout_s = o->timeout_s,
                                         .work_dir = o->out_dir,
                                         .share_dir = o->share_dir};
    char note[64];
    snprintf(note, sizeof note, "rendering with %s", ref->engine);
    say(v, s->name, note);
    return reference_render(s, ref, &ro, &out->m, &out->manifest, &out->e);
}

const struct side *get_reference(struct validation *v, const struct suite_scene *s, int i)
{
    const struct suite_reference *ref = &s->reference[i];
    struct side *out = &v->reference[s - v->suite.scene][i];
    if (out->tried)
        return out;
    char path[MAX_PATH], file[64];
    out->tried = true;
    snprintf(file, sizeof file, "%s.exr", ref->engine);
    data_path(v, path, s->name, file);
    if (!load_reference(v, s, ref, out))
        return out;
    out->seconds = json_number_value(json_object_get(out->manifest, "cpu_s"));
    out->present =
        make_parent_dirs(path, &out->e) && moments_write(path, &out->m, NULL, 0, &out->e);
    return out;
}

void render_engine(const struct validation *v, const struct suite_scene *s, struct side *out)
{
    const struct validate_options *o = v->opt;
    const struct engine_options eo = {.spp = o->engine_spp,
                                      .replicates = o->engine_replicates,
                                      .seed = o->reference_seed,
                                      .threads = o->threads,
                                      .timeout_s = o->timeout_s,
                                      .work_dir = o->out_dir};
    char path[MAX_PATH], manifest[MAX_PATH], file[64];
    *out = (struct side){0};
    snprintf(file, sizeof file, "%s.exr", o->engine->name);
    data_path(v, path, s->name, file);
    snprintf(file, sizeof file, "%s.json", o->engine->name);
    data_path(v, manifest, s->name, file);
    snprintf(file, sizeof file, "rendering with %s", o->engine->name);
    say(v, s->name, file);
    if (!engine_render(o->engine, s, &eo, &out->m, &out->manifest, &out->e))
        return;
    out->seconds = json_number_value(json_object_get(out->manifest, "cpu_s"));
    out->present = make_parent_dirs(path, &out->e) &&
                   moments_write(path, &out->m, NULL, 0, &out->e) &&
                   json_write(manifest, out->manifest, &out->e);
}
