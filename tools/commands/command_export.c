#include "tools/golden/export_job.h"
#include "tools/results/results.h"
#include "commands.h"

#include <stdio.h>

int command_export(int argc, char **argv, struct err *e)
{
    struct export_job s;
    if (!export_job_parse(argc, argv, &s, e))
        return EXIT_NOT_JUDGED;
    if (s.help)
        return 0;
    if (!export_job_run(&s, e))
        return EXIT_NOT_JUDGED;
    printf("%s\n", s.out);
    return 0;
}
