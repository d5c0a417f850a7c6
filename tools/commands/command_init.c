/* assay init: starts a suite of the user's own. */
#include "renderer/base/cli.h"
#include "renderer/base/fs.h"
#include "renderer/base/shell_quote.h"
#include "tools/base/data_dirs.h"
#include "tools/golden/starter.h"
#include "tools/results/results.h"
#include "commands.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct settings {
    const char *dir[1];
    int num_dirs;
    bool help;
};

static const struct cli_option options[] = {
    {'h', "help", "", "print this", CLI_TO(struct settings, help),
     .usage =
         "usage: assay init [DIR]\n\n"
         "Creates a test suite for your own renderer in DIR (the current directory): a scene, the command\n"
         "that runs your renderer, a reference, a CI file, and a README with the next steps.\n"},
    {.noun = "folders", CLI_TO_LIST(struct settings, dir, num_dirs)}};

int command_init(int argc, char **argv, struct err *e)
{
    struct settings s = {.dir = {"."}};
    const struct data_dirs at = data_dirs_find();
    if (!cli_read(options, argc, argv, &s, e))
        return EXIT_NOT_JUDGED;
    if (s.help)
        return 0;
    struct path suite = fs_path("%s", s.dir[0]), engine = fs_path("%s/mine.json", s.dir[0]);
    struct path temp = fs_path("%s/init-XXXXXX", s.dir[0]);
    if (!starter_write(s.dir[0], at.share.s, e))
        return EXIT_NOT_JUDGED;
    if (mkdtemp(temp.s) == NULL) {
        starter_remove(s.dir[0]);
        err_set(e, "%s: cannot make a directory in it: %s", s.dir[0], strerror(errno));
        return EXIT_NOT_JUDGED;
    }
    struct path work = fs_path("%s/work", temp.s), candidate = fs_path("%s/candidate", temp.s);
    char word[][12] = {"golden", "render",  "--suite", "--engine", "--work",
                       "--out",  "approve", "--from",  "--new",    "--all"};
    char *render[] = {word[0], word[1], word[2], suite.s,     word[3], engine.s,
                      word[4], work.s,  word[5], candidate.s, NULL};
    char *approve[] = {word[0],     word[6], word[2], suite.s, word[7],
                       candidate.s, word[8], word[9], NULL};
    int code = command_golden(10, render, e);
    code = code == 0 ? command_golden(8, approve, e) : code;
    if (code == 0 && !fs_remove_tree(temp.s, e))
        code = EXIT_NOT_JUDGED;
    if (code != 0) {
        /* What a renderer left to look at stays. */
        struct err ignored;
        starter_remove(s.dir[0]);
        if (fs_remove_tree(candidate.s, &ignored))
            rmdir(work.s);
        rmdir(temp.s);
        return code;
    }
    const char *suite_option = strcmp(s.dir[0], ".") != 0 ? "--suite" : NULL;
    char *command =
        shell_quote_join("assay", (const char *[]){"validate", suite_option, s.dir[0], NULL});
    printf("\n%s: `%s` is green; README.md there says what to do next\n", s.dir[0],
           command != NULL ? command : "assay validate");
    free(command);
    return code;
}
