#include "tools/golden/export_job.h"
#include "tools/results/results.h"
#include "commands.h"

#include <stdio.h>

static bool parse(int argc, char **argv, struct exporting *s, struct err *e)
{
    if (!exporting_parse(argc, argv, s, e))
        return false;
    if (s->help)
        return true;
    if (s->scene == NULL || s->out == NULL)
        return err_set(e, "export needs a scene and --out (see --help)");
    return s->engine != EXPORTING_UNKNOWN ||
           err_set(e, "--out: '%s' ends in neither of .json, .pov, .xml and .pbrt; give --engine",
                   s->out);
}

int verb_export(int argc, char **argv, struct err *e)
{
    struct exporting s;
    if (!parse(argc, argv, &s, e))
        return EXIT_NOT_JUDGED;
    if (s.help)
        return 0;
    if (!exporting_run(&s, e))
        return EXIT_NOT_JUDGED;
    printf("%s\n", s.out);
    return 0;
}
