#include "tools/golden/export_job.h"
#include "tools/results/results.h"
#include "commands.h"

#include <stdio.h>

static bool parse(int argc, char **argv, struct export_job *s, struct err *e)
{
    if (!export_job_parse(argc, argv, s, e))
        return false;
    if (s->help)
        return true;
    if (s->scene == NULL || s->out == NULL)
        return err_set(e, "export needs a scene and --out (see --help)");
    return s->engine != EXPORT_UNKNOWN ||
           err_set(e, "--out: '%s' ends in neither of .json, .pov, .xml and .pbrt; give --engine",
                   s->out);
}

int command_export(int argc, char **argv, struct err *e)
{
    struct export_job s;
    if (!parse(argc, argv, &s, e))
        return EXIT_NOT_JUDGED;
    if (s.help)
        return 0;
    if (!export_job_run(&s, e))
        return EXIT_NOT_JUDGED;
    printf("%s\n", s.out);
    return 0;
}
