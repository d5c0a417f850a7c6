#include "export_job.h"

#include "reference/external/engine_bindings.h"
#include "renderer/base/cli.h"
#include "renderer/collada/collada.h"
#include "renderer/base/fs.h"

#include <stdio.h>
#include <string.h>

enum option {
    OPT_OUT,
    OPT_ENGINE,
    OPT_RESOLUTION,
    OPT_BOUNCES,
    OPT_ENVIRONMENT,
    OPT_LENS,
    OPT_FOCUS,
    OPT_HELP
};

/* " .json (cycles)" */
#define ENGINE_ENDING(name, title, ending, subgrid) " " ending " (" #name ")"

static const struct cli_option options[] = {
    [OPT_OUT] = {'o', "out", 1, "FILE",
                 "required; its ending says which engine's:\n" ENGINES(ENGINE_ENDING)},
    [OPT_ENGINE] = {0, "engine", 1, "NAME",
                    "one of" ENGINES(ENGINE_TEXT) " (by the ending of --out)"},
    [OPT_RESOLUTION] = {'r', "resolution", 2, "W H", "pixels (480 360)"},
    [OPT_BOUNCES] = {'m', "max-bounces", 1, "N", "as pathtracer counts them (5)"},
    [OPT_ENVIRONMENT] = {'e', "environment", 1, "FILE", "as pathtracer's"},
    [OPT_LENS] = {'b', "lens-radius", 1, "R", "as pathtracer's; 0: pinhole (0)"},
    [OPT_FOCUS] = {'d', "focal-distance", 1, "D", "as pathtracer's (4.7)"},
    [OPT_HELP] = {'h', "help", 0, "", "print this"},
    {0}};

static const struct engine_kind *engine_of_ending(const char *path)
{
    const char *dot = strrchr(path, '.');
    const struct engine_kind *k = engine_table;
    while (k->name != NULL && (dot == NULL || strcmp(dot, k->ending) != 0))
        k++;
    return k->name != NULL ? k : NULL;
}

bool export_job_parse(int argc, char **argv, struct export_job *s, struct err *e)
{
    struct cli c = {.options = options, .argc = argc, .argv = argv, .next = 1};
    static const char *const engines[] = {ENGINES(ENGINE_WORD) NULL};
    bool ok = true;
    int n;
    *s = (struct export_job){.width = 480, .height = 360, .depth = 5, .focal_distance = 4.7};
    for (int i; ok && (i = cli_next(&c, e)) != CLI_END;) {
        if (i == CLI_ERROR)
            return false;
        const char *v = c.value[0];
        if (i == CLI_POSITIONAL) {
            if (s->scene != NULL)
                return err_set(e, "export takes one scene, '%s' is one more", v);
            s->scene = v;
            continue;
        }
        switch ((enum option)i) {
        case OPT_OUT: s->out = v; break;
        case OPT_ENGINE:
            ok = cli_choice("--engine", v, engines, &n, e);
            s->engine = ok ? &engine_table[n] : NULL;
            break;
        case OPT_RESOLUTION:
            ok = cli_int("--resolution", v, 1, 65535, &s->width, e) &&
                 cli_int("--resolution", c.value[1], 1, 65535, &s->height, e);
            break;
        case OPT_BOUNCES: ok = cli_int("--max-bounces", v, 0, 10000, &s->depth, e); break;
        case OPT_ENVIRONMENT: s->environment = v; break;
        case OPT_LENS: ok = cli_double("--lens-radius", v, 0, 1e6, &s->lens_radius, e); break;
        case OPT_FOCUS:
            ok = cli_double("--focal-distance", v, 1e-6, 1e9, &s->focal_distance, e);
            break;
        case OPT_HELP:
            puts("usage: assay export [options] -o OUT SCENE.dae\n");
            cli_print_options(stdout, options);
            s->help = true;
            return true;
        }
    }
    if (!ok)
        return false;
    if (s->scene == NULL || s->out == NULL)
        return err_set(e, "export needs a scene and --out (see --help)");
    if (s->engine == NULL)
        s->engine = engine_of_ending(s->out);
    return s->engine != NULL ||
           err_set(e, "--out: '%s' ends in none of:" ENGINES(ENGINE_ENDING) "; give --engine",
                   s->out);
}

bool export_job_run(const struct export_job *s, struct err *e)
{
    struct scene scene = {0};
    struct camera camera;
    bool ok = fs_make_parent_dirs(s->out, e) && collada_load(s->scene, DIALECT_AUTO, &scene, e) &&
              (s->environment == NULL || scene_read_environment(&scene, s->environment, e));
    if (ok && !camera_init(&camera, &scene, s->width, s->height, e))
        ok = err_prefix(e, "%s", s->scene);
    if (ok) {
        camera.lens_radius = (float)s->lens_radius;
        camera.focal_distance = (float)s->focal_distance;
        ok = engine_export(s->engine, &scene, &camera, s->depth, s->out, e);
    }
    scene_free(&scene);
    return ok;
}
