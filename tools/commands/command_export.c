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
    if (s.note[0] != '\0')
        fprintf(stderr, "assay: warning: %s: %s\n", s.out, s.note);
    printf("%s\n", s.out);
    return 0;
}
