#include "renderer/base/cli.h"
#include "renderer/base/shell_quote.h"
#include "tools/jobs/merge.h"
#include "tools/results/results.h"
#include "commands.h"

#include <stdlib.h>

static const struct cli_option options[] = {{'h', "help", 0, "", "print this"}, {0}};

int command_merge(int argc, char **argv, struct err *e)
{
    struct cli c = {.options = options, .argc = argc, .argv = argv, .next = 1};
    int code = EXIT_NOT_JUDGED, num = 0;
    const char *out = NULL;
    struct share whole = {0};
    char *command = NULL;
    struct share *share = calloc((size_t)argc, sizeof *share);
    if (share == NULL) {
        err_set(e, "out of memory");
        return code;
    }
    for (int i; (i = cli_next(&c, e)) != CLI_END;) {
        if (i == CLI_ERROR)
            goto done;
        if (i == CLI_POSITIONAL && out == NULL) {
            out = c.value[0];
        } else if (i == CLI_POSITIONAL) {
            if (!share_read(c.value[0], &share[num], e))
                goto done;
            num++;
        } else {
            puts("usage: assay merge OUT.exr SHARE.exr SHARE.exr ...\n\n"
                 "Adds pictures that pathtracer rendered of one scene with --samples A:B or -p:\n"
                 "samples of the same cell, cells of the same samples. Refuses what overlaps and\n"
                 "what is not of the same picture.\n");
            cli_print_options(stdout, options);
            code = 0;
            goto done;
        }
    }
    if (num < 2) {
        err_set(e, "merge needs an output and two shares or more (see --help)");
        goto done;
    }
    command = shell_quote_join("assay", (const char *const *)argv);
    if ((command != NULL || err_set(e, "out of memory")) && merge_shares(share, num, &whole, e) &&
        share_write(out, &whole, command, e)) {
        printf("%s\n", out);
        code = 0;
    }
done:
    for (int i = 0; i < num; i++)
        share_free(&share[i]);
    free(share);
    free(command);
    share_free(&whole);
    return code;
}
