#include "renderer/base/cli.h"
#include "tools/results/results.h"
#include "commands.h"
#include "tools/report/watch.h"

#include <signal.h>
#include <stdio.h>

enum option { OPT_PORT, OPT_HELP };

static const struct cli_option options[] = {
    [OPT_PORT] = {'p', "port", 1, "N", "port on 127.0.0.1; 0: any that is free (0)"},
    [OPT_HELP] = {'h', "help", 0, "", "print this"},
    {0}};

int command_watch(int argc, char **argv, struct err *e)
{
    struct cli c = {.options = options, .argc = argc, .argv = argv, .next = 1};
    const char *dir = NULL;
    int port = 0;
    for (int i; (i = cli_next(&c, e)) != CLI_END;) {
        if (i == CLI_ERROR)
            return EXIT_NOT_JUDGED;
        if (i == OPT_PORT) {
            if (!cli_int("--port", c.value[0], 0, 65535, &port, e))
                return EXIT_NOT_JUDGED;
        } else if (i == OPT_HELP) {
            puts(
                "usage: assay watch [options] DIR\n\n"
                "Serves the newest index.html in DIR, or one level below, to this machine alone and\n"
                "reloads it when there is a newer one. Ends with Ctrl-C.\n");
            cli_print_options(stdout, options);
            return 0;
        } else if (dir == NULL) {
            dir = c.value[0];
        } else {
            err_set(e, "watch takes one directory, '%s' is one more", c.value[0]);
            return EXIT_NOT_JUDGED;
        }
    }
    if (dir == NULL) {
        err_set(e, "watch needs a directory (see --help)");
        return EXIT_NOT_JUDGED;
    }
    /* Before the server's thread is there, so that it has them blocked too. */
    sigset_t ends;
    sigemptyset(&ends);
    sigaddset(&ends, SIGINT);
    sigaddset(&ends, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &ends, NULL);
    struct watch *w;
    if (!watch_start(dir, &port, &w, e))
        return EXIT_NOT_JUDGED;
    printf("http://127.0.0.1:%d/\n", port);
    fflush(stdout);
    int which;
    sigwait(&ends, &which);
    watch_stop(w);
    return 0;
}
