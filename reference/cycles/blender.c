#define _GNU_SOURCE
#include "blender.h"

#include "reference/base/process.h"
#include "renderer/base/fs.h"
#include "renderer/base/shell_quote.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

bool blender_run(const char *command, const char *share_dir, const char *script, const char *dir,
                 double timeout_s, struct err *e)
{
    const struct path relative = fs_path("%s/%s", share_dir, script),
                      log = fs_path("%s/blender.log", dir);
    char *real = realpath(relative.s, NULL);
    if (real == NULL)
        return err_set(e, "%s: %s", relative.s, strerror(errno));
    int num;
    char **argv = shell_quote_split(command, &num, e);
    for (int i = 0; argv != NULL && i < num; i++)
        if (strcmp(argv[i], fs_base(script)) == 0)
            argv[i] = real;
    const struct process p = {
        .argv = (const char *const *)argv, .cwd = dir, .log = log.s, .timeout_s = timeout_s};
    bool ok = argv != NULL && process_run(&p, NULL, e);
    free(argv);
    free(real);
    return ok;
}
