#include "renderer/base/cli.h"
#include "renderer/base/version.h"
#include "tools/reproduce/reproduce.h"
#include "tools/results/results.h"
#include "commands.h"

#include <string.h>

enum { OPT_SCENE, OPT_PATHTRACER, OPT_KEEP, OPT_THREADS, OPT_RUN_FOREIGN, OPT_HELP };

static const struct cli_option options[] = {
    [OPT_SCENE] = {0, "scene", 1, "FILE", "where the scene is now (as the file says)"},
    [OPT_PATHTRACER] = {0, "pathtracer", 1, "FILE", "the renderer (the one beside this program)"},
    [OPT_KEEP] = {0, "keep", 1, "FILE", "write what was made again"},
    [OPT_THREADS] = {'t', "threads", 1, "N", "0: one per processor (0)"},
    [OPT_RUN_FOREIGN] = {0, "run-foreign", 0, "",
                         "run other programs than ours that results.json names, too:\n"
                         "--pathtracer, --engine FILE, --share; refused otherwise"},
    [OPT_HELP] = {'h', "help", 0, "", "print this"},
    {0}};

static void print_help(void)
{
    puts(
        "usage: assay reproduce [options] FILE\n\n"
        "Makes a file again by what it says of its origin, and compares.\n"
        "  a render of pathtracer or of `assay merge` (EXR): all values bit by bit\n"
        "  a stored reference (golden/SCENE/ENGINE.exr): the same, by the engine; it must be installed\n"
        "  results.json of validate, compare and converge: all values but dates and times\n"
        "Exit code: 0 the same, 1 not, 3 cannot be made again (one line on stderr).\n");
    cli_print_options(stdout, options);
}

int command_reproduce(int argc, char **argv, struct err *e)
{
    struct cli c = {.options = options, .argc = argc, .argv = argv, .next = 1};
    struct reproduce_options opt = {0};
    const char *path = NULL;
    for (int i; (i = cli_next(&c, e)) != CLI_END;) {
        if (i == CLI_ERROR)
            return EXIT_NOT_JUDGED;
        bool ok = true;
        if (i == CLI_POSITIONAL) {
            ok = path == NULL || err_set(e, "reproduce takes one file");
            path = c.value[0];
        } else if (i == OPT_SCENE) {
            opt.scene = c.value[0];
        } else if (i == OPT_PATHTRACER) {
            opt.pathtracer = c.value[0];
        } else if (i == OPT_KEEP) {
            opt.keep = c.value[0];
        } else if (i == OPT_RUN_FOREIGN) {
            opt.run_foreign = true;
        } else if (i == OPT_THREADS) {
            ok = cli_int("--threads", c.value[0], 0, 1024, &opt.threads, e);
        } else {
            print_help();
            return 0;
        }
        if (!ok)
            return EXIT_NOT_JUDGED;
    }
    if (path == NULL) {
        err_set(e, "reproduce needs a file (see --help)");
        return EXIT_NOT_JUDGED;
    }
    struct reproduced r;
    if (!reproduce(path, &opt, &r, e))
        return EXIT_NOT_JUDGED;
    err_hide_controls(r.command); /* these are texts of the file */
    err_hide_controls(r.made_by);
    err_hide_controls(r.first);
    err_hide_controls(r.note);
    bool same = r.num_different == 0;
    if (same)
        printf("%s: the same bits in all %.0f values\n", path, r.num_values);
    else
        printf("%s: %.0f of %.0f values DIFFER, first %s\n", path, r.num_different, r.num_values,
               r.first);
    printf("made again by: %s\n", r.command);
    if (r.made_by[0] != '\0' && strcmp(r.made_by, assay_version) != 0)
        printf("it is of version %s, this is %s\n", r.made_by, assay_version);
    if (r.note[0] != '\0')
        puts(r.note);
    reproduced_free(&r);
    return same ? 0 : 1;
}
