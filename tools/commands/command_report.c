/* assay report: pages, tables and histories from results.json. */
#include "renderer/base/cli.h"
#include "renderer/base/fs.h"
#include "tools/results/github_annotations.h"
#include "tools/results/convergence_results.h"
#include "tools/results/history.h"
#include "tools/results/plain_words.h"
#include "tools/report/report.h"
#include "tools/results/results_table.h"
#include "tools/results/results_matrix.h"
#include "commands.h"

#include <stdlib.h>
#include <string.h>

struct settings {
    const char *results, *converge, *out, *history;
    bool markdown, matrix, github, help;
};

#define TO(member) CLI_TO(struct settings, member)

static const struct cli_option options[] = {
    {'o', "out", "FILE", "the HTML page (index.html beside the results)", TO(out)},
    {0, "markdown", "", "print the verdict table as Markdown instead of writing a page",
     TO(markdown)},
    {0, "matrix", "",
     "the same, with one row per scene: ours against each reference, and\n"
     "with convergence its slopes, biases and ratios to Cycles",
     TO(matrix)},
    {0, "converge", "FILE", "results.json of `assay converge`, to add to the same page or table",
     TO(converge)},
    {0, "github", "",
     "instead of a page, print GitHub Actions annotations for unexpected\n"
     "results, and append headline and verdict table to the file named by\n"
     "GITHUB_STEP_SUMMARY",
     TO(github)},
    {0, "history", "DIR",
     "instead, plot all results.json in and below DIR over time (page\n"
     "DIR/history.html); exit code 1 if the last run differs significantly\n"
     "from the earlier ones",
     TO(history)},
    {'h', "help", "", "print this", TO(help),
     .usage = "usage: assay report [options] RESULTS.json\n\n"
              "Writes the HTML page of a results.json, or prints its tables.\n"},
    {.args = "one results file", TO(results)}};

static void print_markdown(FILE *f, const json_t *results, bool headline)
{
    bool has_claims = json_array_size(json_object_get(results, "claims")) > 0;
    const json_t *convergence = json_object_get(results, "convergence");
    if (headline) {
        fputs("## ", f);
        github_annotations_headline(f, results);
        fputs("\n\n", f);
    }
    results_table_print(f, results, true);
    if (has_claims && convergence != NULL)
        putc('\n', f);
    if (convergence != NULL)
        convergence_results_print_markdown(f, convergence);
}

static bool print_github(const json_t *results, struct err *e)
{
    github_annotations_print(stdout, results);
    const char *summary = getenv("GITHUB_STEP_SUMMARY");
    if (summary == NULL || summary[0] == '\0')
        return true;
    FILE *f = fopen(summary, "a");
    if (f != NULL)
        print_markdown(f, results, true);
    return (f != NULL && fclose(f) == 0) || err_set(e, "%s: cannot be written", summary);
}

/* Family-wise error rate over all series of the page (history.h). */
static const double history_alpha = 1e-3;

static int write_history(const char *dir, const char *out, struct err *e)
{
    struct history h;
    size_t length = strlen(dir);
    while (length > 1 && dir[length - 1] == '/')
        length--;
    const struct path path = fs_path("%.*s/history.html", (int)length, dir);
    if (!history_read(dir, history_alpha, &h, e))
        return EXIT_NOT_JUDGED;
    int code = h.moved > 0 ? EXIT_DIFFERENT : EXIT_EQUIVALENT;
    out = out != NULL ? out : path.s;
    if (report_history(&h, out, e))
        printf("%zu of %zu claims moved in the last of %zu runs: %s\n", h.moved, h.num_series,
               h.num_runs, out);
    else
        code = EXIT_NOT_JUDGED;
    history_free(&h);
    return code;
}

/* Prints for one file what was asked for; after writing the page, the last lines of `assay validate`, or, if there
 * are no claims, only where the page is. */
static bool print_one(const struct settings *s, const char *path, struct err *e)
{
    json_t *results;
    bool ok = true;
    if (!results_read(path, &results, e))
        return false;
    if (s->github)
        ok = print_github(results, e);
    else if (s->matrix)
        results_matrix_print(stdout, results);
    else if (s->markdown)
        print_markdown(stdout, results, false);
    else if (json_array_size(json_object_get(results, "claims")) > 0)
        plain_words_print(stdout, results, s->out);
    else
        printf("%s\n", s->out);
    json_decref(results);
    return ok;
}

/* Rules between options. */
static bool check(const struct settings *s, struct err *e)
{
    bool others = s->converge != NULL || s->matrix || s->markdown;
    if (s->history != NULL)
        return (s->results == NULL && !others && !s->github) ||
               err_set(e, "--history goes with --out alone");
    if (s->results == NULL)
        return err_set(e, "report needs a results.json (see --help)");
    return !s->github || (!others && s->out == NULL) ||
           err_set(e, "--github goes with no other option");
}

int command_report(int argc, char **argv, struct err *e)
{
    struct settings s = {0};
    struct path beside;
    if (!cli_read(options, argc, argv, &s, e) || (!s.help && !check(&s, e)))
        return EXIT_NOT_JUDGED;
    if (s.help)
        return 0;
    if (s.history != NULL)
        return write_history(s.history, s.out, e);
    if (s.out == NULL) {
        beside = fs_beside_file(s.results, "index.html");
        s.out = beside.s;
    }
    const bool tables = s.matrix || s.markdown;
    bool ok = s.github || tables || report_write_with(s.results, s.converge, s.out, e);
    ok = ok && print_one(&s, s.results, e);
    if (ok && tables && s.converge != NULL) {
        putchar('\n');
        ok = print_one(&s, s.converge, e);
    }
    return ok ? 0 : EXIT_NOT_JUDGED;
}
