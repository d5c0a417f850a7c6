#include "export_job.h"

#include "reference/cycles/export_cycles.h"
#include "reference/mitsuba/export_mitsuba.h"
#include "reference/pbrt/export_pbrt.h"
#include "reference/povray/export_povray.h"
#include "renderer/base/cli.h"
#include "renderer/collada/collada.h"
#include "renderer/base/fs.h"

#include <stdio.h>
#include <string.h>

enum { EXPORT_CYCLES, EXPORT_POVRAY, EXPORT_MITSUBA, EXPORT_PBRT, EXPORT_UNKNOWN };

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

static const struct cli_option options[] = {
    [OPT_OUT] = {'o', "out", 1, "FILE",
                 "required; .json: for cycles.py, .pov: for POV-Ray,\n"
                 ".xml: for Mitsuba 3, with meshes beside it, .pbrt: for pbrt-v4"},
    [OPT_ENGINE] = {0, "engine", 1, "NAME",
                    "cycles, povray, mitsuba or pbrt (by the ending of --out)"},
    [OPT_RESOLUTION] = {'r', "resolution", 2, "W H", "pixels (480 360)"},
    [OPT_BOUNCES] = {'m', "max-bounces", 1, "N", "as pathtracer counts them (5)"},
    [OPT_ENVIRONMENT] = {'e', "environment", 1, "FILE", "as pathtracer's"},
    [OPT_LENS] = {'b', "lens-radius", 1, "R", "as pathtracer's; 0: pinhole (0)"},
    [OPT_FOCUS] = {'d', "focal-distance", 1, "D", "as pathtracer's (4.7)"},
    [OPT_HELP] = {'h', "help", 0, "", "print this"},
    {0}};

static const char *const engine_names[] = {"cycles", "povray", "mitsuba", "pbrt", NULL};
static const char *const endings[] = {".json", ".pov", ".xml", ".pbrt", NULL};

static void engine_of_ending(struct export_job *s)
{
    const char *dot = s->out != NULL ? strrchr(s->out, '.') : NULL;
    for (int i = 0; s->engine == EXPORT_UNKNOWN && dot != NULL && endings[i] != NULL; i++)
        if (strcmp(dot, endings[i]) == 0)
            s->engine = i;
}

bool export_job_parse(int argc, char **argv, struct export_job *s, struct err *e)
{
    struct cli c = {.options = options, .argc = argc, .argv = argv, .next = 1};
    bool ok = true;
    *s = (struct export_job){
        .engine = EXPORT_UNKNOWN, .width = 480, .height = 360, .depth = 5, .focal_distance = 4.7};
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
        case OPT_ENGINE: ok = cli_choice("--engine", v, engine_names, &s->engine, e); break;
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
    engine_of_ending(s);
    if (!ok)
        return false;
    if (s->scene == NULL || s->out == NULL)
        return err_set(e, "export needs a scene and --out (see --help)");
    return s->engine != EXPORT_UNKNOWN ||
           err_set(e, "--out: '%s' ends in neither of .json, .pov, .xml and .pbrt; give --engine",
                   s->out);
}

static bool write_text(const struct export_job *s, const struct scene *scene,
                       const struct camera *camera, struct err *e)
{
    struct out_file out;
    struct povray_variant plain = povray_variant_plain();
    bool povray = s->engine == EXPORT_POVRAY;
    if (!out_open(&out, s->out, e))
        return false;
    if (povray ? !export_povray(scene, camera, s->depth, &plain, out.f, e)
               : !export_pbrt(scene, camera, s->depth, out.f, e)) {
        out_abandon(&out);
        return false;
    }
    return out_commit(&out, e);
}

static bool write_scene(const struct export_job *s, const struct scene *scene,
                        const struct camera *camera, struct err *e)
{
    if (s->engine == EXPORT_CYCLES)
        return export_cycles(scene, camera, s->depth, s->out, e);
    if (s->engine == EXPORT_MITSUBA)
        return export_mitsuba(scene, camera, s->depth, s->out, e);
    return write_text(s, scene, camera, e);
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
        ok = write_scene(s, &scene, &camera, e);
    }
    scene_free(&scene);
    return ok;
}
