#define _GNU_SOURCE
#include "blender.h"

#include "reference/base/process.h"
#include "renderer/base/fs.h"
#include "renderer/base/shell_quote.h"

#include <assert.h>
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A distribution's Blender takes the modules of the first python3 in PATH; in a virtual environment numpy is not among
 * them. One that was unpacked elsewhere, perhaps with a link to it in /usr/bin, has a Python of its own. */
static const char *python_option(void)
{
    char found[PATH_MAX], real[PATH_MAX];
    bool is_distributed = process_find("blender", found, sizeof found) &&
                          realpath(found, real) != NULL &&
                          strncmp(real, "/usr/bin/", strlen("/usr/bin/")) == 0;
    return is_distributed ? "--env-system-python /usr" : "";
}

bool blender_run(const char *command, const char *share_dir, const char *script, const char *dir,
                 double timeout_s, struct err *e)
{
    const struct path relative = fs_path("%s/%s", share_dir, script),
                      log = fs_path("%s/blender.log", dir);
    char *real = realpath(relative.s, NULL);
    if (real == NULL)
        return err_set(e, "%s: %s", relative.s, strerror(errno));
    assert(strncmp(command, BLENDER_RUN, strlen(BLENDER_RUN)) == 0);
    char all[1024];
    int num =
        snprintf(all, sizeof all, "blender %s %s", python_option(), command + strlen("blender "));
    assert(num < (int)sizeof all);
    char **argv = shell_quote_split(all, &num, e);
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
