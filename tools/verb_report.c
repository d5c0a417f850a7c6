#include "../renderer/cli.h"
#include "consistency_run.h"
#include "convergence.h"
#include "convergence_matrix.h"
#include "report.h"
#include "results.h"
#include "results_matrix.h"
#include "verbs.h"

#include <stdlib.h>
#include <string.h>

enum option { OPT_OUT, OPT_MARKDOWN, OPT_MATRIX, OPT_CONVERGE, OPT_HELP };

static const struct cli_option options[] = {
    [OPT_OUT] = {'o', "out", 1, "FILE", "the page (index.html beside the results)"},
    [OPT_MARKDOWN] = {0, "markdown", 0, "", "no page; print the verdict table as Markdown"},
    [OPT_MATRIX] = {0, "matrix", 0, "",
                    "the same, a row for each scene: ours against each reference,\n"
                    "and with convergence its slopes, biases and ratios to Cycles"},
    [OPT_CONVERGE] = {0, "converge", 1, "FILE",
                      "results.json of `assay converge`, to go into the same page or table"},
    [OPT_HELP] = {'h', "help", 0, "", "print this"},
    {0}};

static bool print_markdown(const char *path, struct err *e)
{
    json_t *results;
    char *table = NULL;
    if (!results_read(path, &results, e))
        return false;
    bool has_claims = json_array_size(json_object_get(results, "claims")) > 0;
    const json_t *convergence = json_object_get(results, "convergence");
    bool ok = !has_claims || results_print_table(results, true, &table, e);
    if (ok && has_claims)
        fputs(table, stdout);
    if (ok)
        consistency_print(stdout, json_object_get(results, "consistency"), true);
    if (ok && has_claims && convergence != NULL)
        putchar('\n');
    if (ok && convergence != NULL)
        convergence_print_markdown(stdout, convergence);
    free(table);
    json_decref(results);
    return ok;
}

static bool print_matrix(const char *path, struct err *e)
{
    json_t *results;
    if (!results_read(path, &results, e))
        return false;
    const json_t *convergence = json_object_get(results, "convergence");
    bool has_claims = json_array_size(json_object_get(results, "claims")) > 0;
    if (has_claims)
        results_print_matrix(stdout, results);
    if (has_claims && convergence != NULL)
        putchar('\n');
    if (convergence != NULL)
        convergence_print_matrix(stdout, convergence);
    json_decref(results);
    return true;
}

/* index.html in the directory of the results. */
static void page_beside(const char *results, char *path, size_t size)
{
    const char *slash = strrchr(results, '/');
    int n = slash ? (int)(slash - results) + 1 : 0;
    snprintf(path, size, "%.*sindex.html", n, results);
}

int verb_report(int argc, char **argv, struct err *e)
{
    struct cli c = {.options = options, .argc = argc, .argv = argv, .next = 1};
    const char *results = NULL, *converge = NULL, *out = NULL;
    bool markdown = false, matrix = false;
    for (int i; (i = cli_next(&c, e)) != CLI_END;) {
        if (i == CLI_ERROR)
            return EXIT_NOT_JUDGED;
        if (i == CLI_POSITIONAL && results == NULL) {
            results = c.value[0];
        } else if (i == OPT_OUT) {
            out = c.value[0];
        } else if (i == OPT_CONVERGE) {
            converge = c.value[0];
        } else if (i == OPT_MATRIX) {
            matrix = true;
        } else if (i == OPT_MARKDOWN) {
            markdown = true;
        } else if (i == OPT_HELP) {
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
    if (matrix) {
        bool ok = print_matrix(results, e);
        if (ok && converge != NULL) {
            putchar('\n');
            ok = print_matrix(converge, e);
        }
        return ok ? 0 : EXIT_NOT_JUDGED;
    }
    if (markdown) {
        bool ok = print_markdown(results, e);
        if (ok && converge != NULL) {
            putchar('\n');
            ok = print_markdown(converge, e);
        }
        return ok ? 0 : EXIT_NOT_JUDGED;
    }
    char beside[4096];
    if (out == NULL) {
        page_beside(results, beside, sizeof beside);
        out = beside;
    }
    if (!report_write_with(results, converge, out, e))
        return EXIT_NOT_JUDGED;
    printf("%s\n", out);
    return 0;
}
