#include "renderer/base/cli.h"
#include "renderer/base/fs.h"
#include "tools/results/github_annotations.h"
#include "tools/results/stated_error_results.h"
#include "tools/results/convergence_results.h"
#include "tools/results/convergence_matrix.h"
#include "tools/results/history.h"
#include "tools/report/report.h"
#include "tools/results/results_table.h"
#include "tools/results/results_matrix.h"
#include "commands.h"

#include <stdlib.h>
#include <string.h>

enum option { OPT_OUT, OPT_MARKDOWN, OPT_MATRIX, OPT_CONVERGE, OPT_GITHUB, OPT_HISTORY, OPT_HELP };

static const struct cli_option options[] = {
    [OPT_OUT] = {'o', "out", 1, "FILE", "the page (index.html beside the results)"},
    [OPT_MARKDOWN] = {0, "markdown", 0, "", "no page; print the verdict table as Markdown"},
    [OPT_MATRIX] = {0, "matrix", 0, "",
                    "the same, a row for each scene: ours against each reference,\n"
                    "and with convergence its slopes, biases and ratios to Cycles"},
    [OPT_CONVERGE] = {0, "converge", 1, "FILE",
                      "results.json of `assay converge`, to go into the same page or table"},
    [OPT_GITHUB] = {0, "github", 0, "",
                    "no page; print workflow commands of GitHub Actions that annotate what is\n"
                    "not as expected, and add the headline and the verdict table to the file\n"
                    "that GITHUB_STEP_SUMMARY names"},
    [OPT_HISTORY] = {0, "history", 1, "DIR",
                     "instead: a page of all results.json in and below DIR, against time\n"
                     "(DIR/history.html); exit code 1 if the last run has moved"},
    [OPT_HELP] = {'h', "help", 0, "", "print this"},
    {0}};

static bool print_markdown(FILE *f, const char *path, bool headline, struct err *e)
{
    json_t *results;
    if (!results_read(path, &results, e))
        return false;
    bool has_claims = json_array_size(json_object_get(results, "claims")) > 0;
    const json_t *convergence = json_object_get(results, "convergence");
    if (headline) {
        fputs("## ", f);
        github_annotations_headline(f, results);
        fputs("\n\n", f);
    }
    if (has_claims)
        results_table_print(f, results, true);
    stated_error_print(f, json_object_get(results, "consistency"), true);
    if (has_claims && convergence != NULL)
        putc('\n', f);
    if (convergence != NULL)
        convergence_results_print_markdown(f, convergence);
    json_decref(results);
    return true;
}

static bool print_github(const char *path, struct err *e)
{
    json_t *results;
    if (!results_read(path, &results, e))
        return false;
    github_annotations_print(stdout, results);
    json_decref(results);
    const char *summary = getenv("GITHUB_STEP_SUMMARY");
    if (summary == NULL || summary[0] == '\0')
        return true;
    FILE *f = fopen(summary, "a");
    if (f == NULL)
        return err_set(e, "%s: cannot be written", summary);
    bool ok = print_markdown(f, path, true, e);
    bool written = fclose(f) == 0;
    return ok && (written || err_set(e, "%s: cannot be written", summary));
}

static bool print_matrix(const char *path, struct err *e)
{
    json_t *results;
    if (!results_read(path, &results, e))
        return false;
    const json_t *convergence = json_object_get(results, "convergence");
    bool has_claims = json_array_size(json_object_get(results, "claims")) > 0;
    if (has_claims)
        results_matrix_print(stdout, results);
    if (has_claims && convergence != NULL)
        putchar('\n');
    if (convergence != NULL)
        convergence_matrix_print(stdout, convergence);
    json_decref(results);
    return true;
}

/* Family-wise, over all claims of the page. */
static const double history_alpha = 1e-3;

static int write_history(const char *dir, const char *out, struct err *e)
{
    struct history h;
    char path[4096];
    size_t length = strlen(dir);
    while (length > 1 && dir[length - 1] == '/')
        length--;
    int n = snprintf(path, sizeof path, "%.*s/history.html", (int)length, dir);
    if (n < 0 || (size_t)n >= sizeof path) {
        err_set(e, "%.64s...: path too long", dir);
        return EXIT_NOT_JUDGED;
    }
    if (!history_read(dir, history_alpha, &h, e))
        return EXIT_NOT_JUDGED;
    int code = h.moved > 0 ? EXIT_DIFFERENT : EXIT_EQUIVALENT;
    out = out != NULL ? out : path;
    if (report_history(&h, out, e))
        printf("%zu of %zu claims moved in the last of %zu runs: %s\n", h.moved, h.num_series,
               h.num_runs, out);
    else
        code = EXIT_NOT_JUDGED;
    history_free(&h);
    return code;
}

int command_report(int argc, char **argv, struct err *e)
{
    struct cli c = {.options = options, .argc = argc, .argv = argv, .next = 1};
    const char *results = NULL, *converge = NULL, *out = NULL, *history = NULL;
    bool markdown = false, matrix = false, github = false;
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
        } else if (i == OPT_HISTORY) {
            history = c.value[0];
        } else if (i == OPT_GITHUB) {
            github = true;
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
    if (history != NULL) {
        if (results == NULL && converge == NULL && !matrix && !markdown && !github)
            return write_history(history, out, e);
        err_set(e, "--history goes with --out alone");
        return EXIT_NOT_JUDGED;
    }
    if (results == NULL) {
        err_set(e, "report needs a results.json (see --help)");
        return EXIT_NOT_JUDGED;
    }
    if (github && (converge != NULL || matrix || markdown || out != NULL)) {
        err_set(e, "--github goes with no other option");
        return EXIT_NOT_JUDGED;
    }
    if (github)
        return print_github(results, e) ? 0 : EXIT_NOT_JUDGED;
    if (matrix) {
        bool ok = print_matrix(results, e);
        if (ok && converge != NULL) {
            putchar('\n');
            ok = print_matrix(converge, e);
        }
        return ok ? 0 : EXIT_NOT_JUDGED;
    }
    if (markdown) {
        bool ok = print_markdown(stdout, results, false, e);
        if (ok && converge != NULL) {
            putchar('\n');
            ok = print_markdown(stdout, converge, false, e);
        }
        return ok ? 0 : EXIT_NOT_JUDGED;
    }
    char beside[4096];
    if (out == NULL) {
        fs_beside_file(results, "index.html", beside, sizeof beside);
        out = beside;
    }
    if (!report_write_with(results, converge, out, e))
        return EXIT_NOT_JUDGED;
    printf("%s\n", out);
    return 0;
}
