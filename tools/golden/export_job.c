#include "export_job.h"

#include "reference/external/engine_bindings.h"
#include "reference/base/json_file.h"
#include "reference/base/json_node.h"
#include "renderer/base/cli.h"
#include "renderer/collada/collada.h"
#include "renderer/base/fs.h"

#include <stdio.h>
#include <string.h>

/* " .json (cycles)" */
#define ENGINE_ENDING(name, title, ending, subgrid) " " ending " (" #name ")"

static bool read_engine(void *job, const char *const v[4], struct err *e)
{
    static const char *const engines[] = {ENGINES(ENGINE_WORD) NULL};
    struct export_job *s = job;
    int n;
    if (!cli_choice("--engine", v[0], engines, &n, e))
        return false;
    s->engine = &engine_table[n];
    return true;
}

#define TO(member) CLI_TO(struct export_job, member)

static const struct cli_option options[] = {
    {'o', "out", "FILE", "required; its ending says which engine's:\n" ENGINES(ENGINE_ENDING),
     TO(out)},
    {0, "engine", "NAME", "one of" ENGINES(ENGINE_TEXT) " (by the ending of --out)",
     .read = read_engine},
    {'r', "resolution", "W H", "pixels (480 360)", TO(width), 1, 65535},
    {'m', "max-bounces", "N", "as pathtracer counts them (5)", TO(depth), 0, 10000},
    {'e', "environment", "FILE", "as pathtracer's", TO(environment)},
    {'b', "lens-radius", "R", "as pathtracer's; 0: pinhole (0)", TO(lens_radius), 0, 1e6},
    {'d', "focal-distance", "D", "as pathtracer's (4.7)", TO(focal_distance), 1e-6, 1e9},
    {'h', "help", "", "print this", TO(help),
     .usage = "usage: assay export [options] -o OUT SCENE.dae\n"},
    {.args = "one scene", TO(scene)}};

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
    *s = (struct export_job){.width = 480, .height = 360, .depth = 5, .focal_distance = 4.7};
    if (!cli_read(options, argc, argv, s, e))
        return false;
    if (s->help)
        return true;
    if (s->scene == NULL || s->out == NULL)
        return err_set(e, "export needs a scene and --out (see --help)");
    if (s->engine == NULL)
        s->engine = engine_of_ending(s->out);
    return s->engine != NULL ||
           err_set(e, "--out: '%s' ends in none of:" ENGINES(ENGINE_ENDING) "; give --engine",
                   s->out);
}

static void note_missing_light(struct export_job *s, const struct scene *scene)
{
    const char *ending = strrchr(s->scene, '.');
    json_error_t why;
    json_t *description =
        ending != NULL
            ? json_read(fs_path("%.*s.json", (int)(ending - s->scene), s->scene).s, 0, &why)
            : NULL;
    const char *sky = member_text(description, "environment");
    s->note[0] = '\0';
    if (s->environment == NULL && sky != NULL)
        snprintf(s->note, sizeof s->note, "without its sky: give -e %.400s",
                 fs_beside_file(s->scene, sky).s);
    else if (s->environment == NULL && scene->num_lights == 0)
        snprintf(s->note, sizeof s->note, "the scene has no light (-e FILE: an environment)");
    json_decref(description);
}

bool export_job_run(struct export_job *s, struct err *e)
{
    struct scene scene = {0};
    struct camera camera;
    bool ok = fs_make_parent_dirs(s->out, e) && collada_load(s->scene, DIALECT_AUTO, &scene, e) &&
              (s->environment == NULL || scene_read_environment(&scene, s->environment, e));
    if (ok && !camera_init(&camera, &scene, s->width, s->height, e))
        ok = err_prefix(e, "%s", s->scene);
    if (ok) {
        note_missing_light(s, &scene);
        camera.lens_radius = (float)s->lens_radius;
        camera.focal_distance = (float)s->focal_distance;
        ok = engine_export(s->engine, &scene, &camera, s->depth, s->out, e);
    }
    scene_free(&scene);
    return ok;
}
