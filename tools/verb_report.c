#include "../renderer/cli.h"
#include "report.h"
#include "results.h"
#include "verbs.h"

#include <string.h>

static const struct cli_option options[] = {
    {'o', "out", 1, "FILE", "the page (index.html beside the results)"},
    {'h', "help", 0, "", "print this"},
    {0}};

int verb_report(int argc, char **argv, struct err *e)
{
    struct cli c = {.options = options, .argc = argc, .argv = argv, .next = 1};
    const char *results = NULL, *out = NULL;
    for (int i; (i = cli_next(&c, e)) != CLI_END;) {
        if (i == CLI_ERROR)
            return EXIT_NOT_JUDGED;
        if (i == CLI_POSITIONAL && results == NULL) {
            results = c.value[0];
        } else if (i == 0) {
            out = c.value[0];
        } else if (i == 1) {
            puts("usage: assay report [options] RESULTS.json\n");
            cli_print_options(stdout, options);
            return 0;
        } else {
            err_set(e, "report takes one results file, '%s' is one more", c.value[0]);
            return EXIT_NOT_JUDGED;
        }
    }
    if (results == NULL) {
        err_set(e, "report needs a results.json (see --help)");
        return EXIT_NOT_JUDGED;
    }
    char beside[4096];
    if (out == NULL) {
        const char *slash = strrchr(results, '/');
        int n = slash ? (int)(slash - results) + 1 : 0;
        snprintf(beside, sizeof beside, "%.*sindex.html", n, results);
        out = beside;
    }
    if (!report_write(results, out, e))
        return EXIT_NOT_JUDGED;
    printf("%s\n", out);
    return 0;
}
