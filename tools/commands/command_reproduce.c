/* assay reproduce: makes a file again and compares bits. */
#include "renderer/base/cli.h"
#include "renderer/base/version.h"
#include "tools/reproduce/reproduce.h"
#include "tools/results/results.h"
#include "commands.h"

#include <string.h>

struct settings {
    struct reproduce_options opt;
    const char *path;
    bool help;
};

#define TO(member) CLI_TO(struct settings, member)

static const struct cli_option options[] = {
    {0, "scene", "FILE", "current path of the scene (as recorded in FILE)", TO(opt.scene)},
    {0, "pathtracer", "FILE", "the renderer (pathtracer beside this program)", TO(opt.pathtracer)},
    {0, "keep", "FILE", "save the reproduced file as this", TO(opt.keep)},
    {'t', "threads", "N", "number of threads; 0: one per processor (0)", TO(opt.threads), 0, 1024},
    {0, "run-foreign", "",
     "also run programs other than ours that results.json names:\n"
     "--pathtracer, --engine FILE, --share; refused otherwise",
     TO(opt.run_foreign)},
    {'h', "help", "", "print this", TO(help),
     .usage =
         "usage: assay reproduce [options] FILE\n\n"
         "Reproduces a file from the provenance recorded in it, and compares the two.\n"
         "  a render of pathtracer or of `assay merge` (EXR): all values bit by bit\n"
         "  a stored reference (golden/SCENE/ENGINE.exr): the same, by the engine, which must be installed\n"
         "  results.json of validate, compare and converge: all values except dates and times\n"
         "Exit code: 0 identical, 1 different, 3 could not be reproduced (one line on stderr).\n"},
    {.args = "one file", TO(path)}};

int command_reproduce(int argc, char **argv, struct err *e)
{
    struct settings s = {0};
    if (!cli_read(options, argc, argv, &s, e))
        return EXIT_NOT_JUDGED;
    if (s.help)
        return 0;
    if (s.path == NULL) {
        err_set(e, "reproduce needs a file (see --help)");
        return EXIT_NOT_JUDGED;
    }
    struct reproduced r;
    if (!reproduce(s.path, &s.opt, &r, e))
        return EXIT_NOT_JUDGED;
    err_hide_controls(r.command); /* these are texts of the file */
    err_hide_controls(r.made_by);
    err_hide_controls(r.first);
    err_hide_controls(r.note);
    bool same = r.num_different == 0;
    if (same)
        printf("%s: the same bits in all %.0f values\n", s.path, r.num_values);
    else
        printf("%s: %.0f of %.0f values DIFFER, first %s\n", s.path, r.num_different, r.num_values,
               r.first);
    printf("made again by: %s\n", r.command);
    if (r.made_by[0] != '\0' && strcmp(r.made_by, assay_version) != 0)
        printf("it is of version %s, this is %s\n", r.made_by, assay_version);
    if (!same && r.note[0] != '\0')
        puts(r.note);
    reproduced_free(&r);
    return same ? 0 : 1;
}
