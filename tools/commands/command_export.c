/* assay export: writes a scene for another renderer. */
#include "reference/base/json_file.h"
#include "reference/base/json_node.h"
#include "reference/external/engine_bindings.h"
#include "renderer/base/cli.h"
#include "renderer/base/fs.h"
#include "renderer/collada/collada.h"
#include "tools/results/results.h"
#include "commands.h"

#include <stdio.h>
#include <string.h>

/* Texts point into the command line. */
struct settings {
    const char *scene;
    const char *environment; /* NULL: none */
    const char *out;
    double lens_radius, focal_distance;
    const struct engine_kind *engine; /* as --engine or the ending of `out` says */
    int width, height, depth;
    bool help;
};

/* " .json (cycles)" */
#define ENGINE_ENDING(name, title, ending, ...) " " ending " (" #name ")"

static bool read_engine(void *settings, const char *const v[4], struct err *e)
{
    static const char *const engines[] = {ENGINES(ENGINE_WORD) NULL};
    struct settings *s = settings;
    int n;
    if (!cli_choice("--engine", v[0], engines, &n, e))
        return false;
    s->engine = &engine_table[n];
    return true;
}

#define TO(member) CLI_TO(struct settings, member)

static const struct cli_option options[] = {
    {'o', "out", "FILE",
     "output file, required; its ending selects the engine:\n" ENGINES(ENGINE_ENDING), TO(out)},
    {0, "engine", "NAME", "one of" ENGINES(ENGINE_TEXT) " (chosen by the ending of --out)",
     .read = read_engine},
    {'r', "resolution", "W H", "image size in pixels (480 360)", TO(width), 1, 65535},
    {'m', "max-bounces", "N", "maximum bounces, counted as by pathtracer (5)", TO(depth), 0, 10000},
    {'e', "environment", "FILE", "environment map, as for pathtracer (none)", TO(environment)},
    {'b', "lens-radius", "R", "lens radius, as for pathtracer; 0: pinhole (0)", TO(lens_radius), 0,
     1e6},
    {'d', "focal-distance", "D", "focal distance, as for pathtracer (4.7)", TO(focal_distance),
     1e-6, 1e9},
    {'h', "help", "", "print this", TO(help),
     .usage = "usage: assay export [options] -o OUT SCENE.dae\n\n"
              "Converts a COLLADA scene for another renderer.\n"},
    {.args = "one scene", TO(scene)}};

static bool choose_engine(struct settings *s, struct err *e)
{
    const char *dot = s->out != NULL ? strrchr(s->out, '.') : NULL;
    if (s->scene == NULL || s->out == NULL)
        return err_set(e, "export needs a scene and --out (see --help)");
    for (const struct engine_kind *k = engine_table; s->engine == NULL && k->name != NULL; k++)
        if (dot != NULL && strcmp(dot, k->ending) == 0)
            s->engine = k;
    return s->engine != NULL ||
           err_set(e, "--out: '%s' ends in none of:" ENGINES(ENGINE_ENDING) "; give --engine",
                   s->out);
}

/* Warns if the scene's .json names an environment that was not given, or if the scene has no light at all. It is
 * exported all the same. */
static void warn_of_missing_light(const struct settings *s, const struct scene *scene)
{
    const char *ending = strrchr(s->scene, '.');
    json_error_t why;
    json_t *description =
        ending != NULL
            ? json_read(fs_path("%.*s.json", (int)(ending - s->scene), s->scene).s, 0, &why)
            : NULL;
    const char *sky = member_text(description, "environment");
    if (s->environment == NULL && sky != NULL)
        fprintf(stderr, "assay: warning: %s: without its sky: give -e %.400s\n", s->out,
                fs_beside_file(s->scene, sky).s);
    else if (s->environment == NULL && scene->num_lights == 0)
        fprintf(stderr, "assay: warning: %s: the scene has no light (-e FILE: an environment)\n",
                s->out);
    json_decref(description);
}

int command_export(int argc, char **argv, struct err *e)
{
    struct settings s = {.width = 480, .height = 360, .depth = 5, .focal_distance = 4.7};
    struct scene scene = {0};
    struct camera camera;
    if (!cli_read(options, argc, argv, &s, e))
        return EXIT_NOT_JUDGED;
    if (s.help)
        return 0;
    bool ok = choose_engine(&s, e) && fs_make_parent_dirs(s.out, e) &&
              collada_load(s.scene, DIALECT_AUTO, &scene, e) &&
              (s.environment == NULL || scene_read_environment(&scene, s.environment, e)) &&
              (camera_init(&camera, &scene, s.width, s.height, e) || err_prefix(e, "%s", s.scene));
    if (ok) {
        camera.lens_radius = (float)s.lens_radius;
        camera.focal_distance = (float)s.focal_distance;
        ok = engine_export(s.engine, &scene, &camera, s.depth, s.out, e);
    }
    if (ok) {
        warn_of_missing_light(&s, &scene);
        printf("%s\n", s.out);
    }
    scene_free(&scene);
    return ok ? 0 : EXIT_NOT_JUDGED;
}
