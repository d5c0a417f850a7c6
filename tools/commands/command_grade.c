/* assay grade: grades submissions by a rubric. */
#include "tools/gradebook/grade_options.h"
#include "tools/results/results.h"
#include "commands.h"

#include <stdlib.h>

int command_grade(int argc, char **argv, struct err *e)
{
    struct data_dirs at;
    struct grade_settings s = grade_options_default(argc, &at);
    int code = EXIT_NOT_JUDGED;
    if (s.submission == NULL) {
        err_set(e, "out of memory");
    } else if (grade_options_parse(argc, argv, &s, e)) {
        if (s.help)
            grade_options_help();
        code = s.help    ? 0
               : s.slurm ? command_slurm_run(NULL, argc, argv, NULL, e)
                         : grade_command(&s, argc, argv, e);
    }
    free(s.submission);
    return code;
}
