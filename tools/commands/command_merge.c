/* assay merge: merges renders of sample ranges or of cells of one image. */
#include "renderer/base/cli.h"
#include "renderer/base/shell_quote.h"
#include "tools/jobs/merge.h"
#include "tools/results/results.h"
#include "commands.h"

#include <stdlib.h>

struct settings {
    const char *out;
    struct share *share;
    int num;
    bool help;
};

/* The first word is the output, the others are shares. */
static bool read_word(void *settings, const char *const v[4], struct err *e)
{
    struct settings *s = settings;
    if (s->out == NULL) {
        s->out = v[0];
        return true;
    }
    if (!share_read(v[0], &s->share[s->num], e))
        return false;
    s->num++;
    return true;
}

static const struct cli_option options[] = {
    {'h', "help", "", "print this", CLI_TO(struct settings, help),
     .usage =
         "usage: assay merge OUT.exr SHARE.exr SHARE.exr ...\n\n"
         "Combines partial renders of one image that pathtracer made with --samples A:B or -p:\n"
         "sample ranges of the same cell, or cells with the same samples. Refuses parts that\n"
         "overlap or belong to different images.\n"},
    {.read = read_word}};

int command_merge(int argc, char **argv, struct err *e)
{
    int code = EXIT_NOT_JUDGED;
    struct share whole = {0};
    char *command = NULL;
    struct settings s = {.share = calloc((size_t)argc, sizeof *s.share)};
    if (s.share == NULL) {
        err_set(e, "out of memory");
        return code;
    }
    if (!cli_read(options, argc, argv, &s, e))
        goto done;
    if (s.help) {
        code = 0;
        goto done;
    }
    if (s.num < 2) {
        err_set(e, "merge needs an output and two shares or more (see --help)");
        goto done;
    }
    command = shell_quote_join("assay", (const char *const *)argv);
    if ((command != NULL || err_set(e, "out of memory")) &&
        merge_shares(s.share, s.num, &whole, e) && share_write(s.out, &whole, command, e)) {
        printf("%s\n", s.out);
        code = 0;
    }
done:
    for (int i = 0; i < s.num; i++)
        share_free(&s.share[i]);
    free(s.share);
    free(command);
    share_free(&whole);
    return code;
}
