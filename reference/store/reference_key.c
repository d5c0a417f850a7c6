/* The hash of all that a reference depends on: program, scripts, scene, settings. It says
 * whether stored work can be used. */
#include "reference_internal.h"

#include "reference/base/process.h"

#include "renderer/base/fs.h"
#include "renderer/base/sha256.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

/* RECIPE is raised when a driver makes other results from the same files: other replicates, another
 * fold. */
enum { RECIPE = 1, MOST_SCRIPTS = 8 };

/* Hashes of the program, of its scripts, and of the driver's key file. */
static bool hash_parts(const struct reference_job *job, void *ctx, struct err *e)
{
    char(*hex)[65] = ctx, program[4096], all[64 * MOST_SCRIPTS + 1];
    const struct engine_driver *driver = engine_driver_of(job->ref->engine);
    const char *name = engine_kind_of(job->ref->engine)->program;
    const struct path said = fs_path("%s/scene", job->dir);
    strcpy(hex[1], "none");
    for (int i = 0; driver->scripts != NULL && driver->scripts[i] != NULL; i++) {
        assert(i < MOST_SCRIPTS);
        if (!sha256_file(fs_path("%s/%s", job->opt->share_dir, driver->scripts[i]).s, all + 64 * i,
                         e))
            return false;
        sha256_text(all, hex[1]);
    }
    if (!process_find(name, program, sizeof program))
        return err_set(e, "%s: no such program in PATH", name);
    return sha256_file(program, hex[0], e) && driver->write_key(job, said.s, e) &&
           sha256_file(said.s, hex[2], e);
}

bool reference_key(const struct suite_scene *scene, const struct suite_reference *ref,
                   const struct reference_options *opt, char key[65], struct err *e)
{
    assert(opt->first_replicate == 0);
    if (engine_driver_of(ref->engine) == NULL)
        return err_set(e, "%s: '%s' is no engine that is rendered", scene->name, ref->engine);
    char text[1024], hex[3][65];
    if (!reference_in_directory(scene, ref, opt, hash_parts, hex, e))
        return err_prefix(e, "%s, %s", scene->name, ref->engine);
    snprintf(text, sizeof text,
             "recipe %d engine %s %s script %s export %s scene %s %d x %d depth %d replicates %d "
             "spp %d subgrid %d seed %u",
             RECIPE, ref->engine, hex[0], hex[1], hex[2], scene->sha256, scene->width,
             scene->height, scene->depth, ref->replicates, ref->spp, ref->subgrid, opt->seed);
    sha256_text(text, key);
    return true;
}
