#include "reference_render.h"

#include "reference/cycles/export_cycles.h"
#include "reference/povray/povray_replicate_parts.h"
#include "reference/base/process.h"

#include "renderer/base/fs.h"
#include "renderer/base/sha256.h"

#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Raised when a driver makes something else of the same files: other replicates, another fold. */
enum { RECIPE = 1 };

static bool hash_binary(const char *name, char hex[65], struct err *e)
{
    char path[4096];
    return process_find(name, path, sizeof path) ? sha256_file(path, hex, e)
                                                 : err_set(e, "%s: no such program in PATH", name);
}

static bool hash_cycles(const struct reference_job *job, const char *path, char hex[3][65],
                        struct err *e)
{
    static const char *const scripts[] = {"cycles", "cycles_blender", "cycles_geometry",
                                          "cycles_light", "cycles_material"};
    char all[65 * 5] = "";
    for (size_t i = 0; i < sizeof scripts / sizeof *scripts; i++) {
        char script[4096];
        if (snprintf(script, sizeof script, "%s/cycles/%s.py", job->opt->share_dir, scripts[i]) >=
            (int)sizeof script)
            return err_set(e, "%.64s...: path too long", job->opt->share_dir);
        if (!sha256_file(script, all + 64 * i, e))
            return false;
    }
    sha256_text(all, hex[1]);
    return hash_binary("blender", hex[0], e) &&
           export_cycles(job->scene, job->camera, job->suite->depth, path, e) &&
           sha256_file(path, hex[2], e);
}

/* One picture of each of the three kinds in each pass; the others differ from them by the seed. */
static bool hash_povray(const struct reference_job *job, const char *path, char hex[3][65],
                        struct err *e)
{
    const struct suite_scene *s = job->suite;
    struct povray_passes plan;
    if (!hash_binary("povray", hex[0], e) ||
        !povray_passes(job->scene, job->camera, s->depth, &plan, e))
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
    strcpy(hex[1], "none");
    return ok && sha256_file(path, hex[2], e);
}

bool reference_key(const struct suite_scene *scene, const struct suite_reference *ref,
                   const struct reference_options *opt, char key[65], struct err *e)
{
    assert(opt->first_replicate == 0);
    bool cycles = strcmp(ref->engine, "cycles") == 0;
    if (!cycles && strcmp(ref->engine, "povray") != 0)
        return err_set(e, "%s: '%s' is no engine that is rendered", scene->name, ref->engine);
    char dir[4000], path[4096], text[1024], hex[3][65];
    struct scene s;
    struct camera camera;
    int n = snprintf(dir, sizeof dir, "%s/key-XXXXXX", opt->work_dir);
    if (n < 0 || (size_t)n >= sizeof dir)
        return err_set(e, "%.64s...: path too long", opt->work_dir);
    if (!suite_open(scene, &s, &camera, e))
        return false;
    struct reference_job job = {
        .suite = scene, .ref = ref, .opt = opt, .scene = &s, .camera = &camera};
    bool ok = mkdtemp(dir) != NULL ||
              err_set(e, "%s: cannot make a directory in it: %s", opt->work_dir, strerror(errno));
    if (ok) {
        snprintf(path, sizeof path, "%s/scene", dir);
        ok = cycles ? hash_cycles(&job, path, hex, e) : hash_povray(&job, path, hex, e);
        struct err cleanup;
        if (!fs_remove_tree(dir, &cleanup) && ok) {
            *e = cleanup;
            ok = false;
        }
    }
    scene_free(&s);
    if (!ok)
        return err_prefix(e, "%s, %s", scene->name, ref->engine);
    snprintf(text, sizeof text,
             "recipe %d engine %s %s script %s export %s scene %s %d x %d depth %d replicates %d "
             "spp %d subgrid %d seed %u",
             RECIPE, ref->engine, hex[0], hex[1], hex[2], scene->sha256, scene->width,
             scene->height, scene->depth, ref->replicates, ref->spp, ref->subgrid, opt->seed);
    sha256_text(text, key);
    return true;
}
