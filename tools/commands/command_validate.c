/* assay validate: judges renderers on the suite. */
#include "tools/base/dir_lock.h"
#include "tools/results/results.h"
#include "tools/validate/validate_command.h"
#include "commands.h"

int command_validate(int argc, char **argv, struct err *e)
{
    struct validate_command c;
    struct dir_lock lock = {0};
    json_t *results = NULL;
    int code = EXIT_NOT_JUDGED;
    if (!validate_command_read(argc, argv, &c, e))
        return EXIT_NOT_JUDGED;
    if (c.help)
        code = 0;
    else if (c.slurm)
        code = command_slurm_run(NULL, argc, argv, NULL, e);
    else if (dir_lock_take(&lock, c.opt.out_dir, e) && validate(&c.opt, argc, argv, &results, e))
        code = validate_command_finish(&c, results, e);
    dir_lock_release(&lock);
    json_decref(results);
    engine_free(&c.engine);
    return code;
}
