/* assay diagnose: which known bug explains an image. */
#include "reference/base/json_file.h"
#include "renderer/base/cli.h"
#include "renderer/base/fs.h"
#include "tools/diagnose/diagnose_gather.h"
#include "tools/diagnose/diagnose_print.h"
#include "tools/base/data_dirs.h"
#include "tools/results/results.h"
#include "tools/base/temp_dir.h"
#include "commands.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct settings {
    const char *pathtracer, *view, *input, *json, *catalogue_dir, *suite_dir;
    struct diagnose_options diagnose;
    uint64_t seed;
    int threads;
    double timeout_s;
    bool quiet, help;
};

#define TO(member) CLI_TO(struct settings, member)

static const struct cli_option options[] = {
    {0, "pathtracer", "PROGRAM", "program under test (pathtracer beside this program)",
     TO(pathtracer)},
    {0, "scene", "VIEW", "the view that X.exr shows, one of those listed below", TO(view)},
    {0, "json", "FILE", "also write the diagnosis as JSON", TO(json)},
    {0, "alpha", "A", "false-positive rate: chance of accusing a correct renderer (1e-6)",
     TO(diagnose.alpha), 1e-12, 0.1},
    {0, "seed", "N", "seed of the renders (1)", TO(seed)},
    {0, "without", "BUG", "exclude BUG from the known bugs", TO(diagnose.without)},
    {0, "catalogue", "DIR", "directory of the stored effects of known bugs (golden/diagnose)",
     TO(catalogue_dir)},
    {0, "suite", "DIR", "directory of scenes (reference/scenes)", TO(suite_dir)},
    {'t', "threads", "N", "threads per render; 0: one per processor (0)", TO(threads), 0, 1024},
    {0, "timeout", "S", "time limit for each render, seconds (600)", TO(timeout_s), 1, 1e6},
    {'q', "quiet", "", "print nothing; only return the exit code", TO(quiet)},
    {'h', "help", "", "print this and the list of views", TO(help), .stops = true},
    {.args = "one file", TO(input)}};

/* Rules between options. */
static bool check(const struct settings *s, struct err *e)
{
    if (s->view != NULL && s->input == NULL)
        return err_set(e, "--scene needs the image that shows it (see --help)");
    return s->pathtracer == NULL || s->input == NULL ||
           err_set(e, "either a program or a file is looked at, not both");
}

static void print_help(const struct catalogue *c)
{
    cli_print_help(
        "usage: assay diagnose [options]                       render the views and examine them\n"
        "       assay diagnose [options] results.json          the images of a validation\n"
        "       assay diagnose [options] --scene VIEW X.exr    one moments image\n\n"
        "Identifies the known bug that explains how images differ from the correct ones.\n",
        options);
    puts(
        "\nViews, with size and spp of their renders. X.exr may have another size with the same aspect\n"
        "ratio, if its width is a multiple of the last number:");
    for (int i = 0; i < c->num_views; i++)
        printf("  %-36s %d x %d, %d spp, %d\n", c->view[i].name, c->view[i].width,
               c->view[i].height, c->view[i].spp, c->view[i].correct.columns);
    puts("\nExit code: 0 no bug found, 1 a known or an unknown bug found, 3 could not judge.");
}

static bool gather(const struct settings *s, const struct diagnose_gather_options *g,
                   struct observation *clue, int *num, json_t *skipped, struct err *e)
{
    if (s->input == NULL)
        return diagnose_gather_program(g, s->pathtracer, clue, num, e);
    if (s->view == NULL)
        return diagnose_gather_results(g, s->input, clue, num, skipped, e);
    *num = 1;
    return diagnose_gather_image(g, s->view, s->input, clue, e);
}

/* Says where to look if no known bug explains the difference. */
static bool tell_place(const struct settings *s, struct err *e)
{
    if (s->input == NULL) {
        printf("where: assay validate --pathtracer %s says what the claims that "
               "differ have in common\n",
               s->pathtracer);
        return true;
    }
    json_t *results;
    if (!results_read(s->input, &results, e))
        return false;
    const char *located = member_text(results, "located");
    if (located != NULL)
        printf("where: %s\n", located);
    json_decref(results);
    return true;
}

static bool run(const struct settings *s, const struct diagnose_gather_options *g,
                struct observation *clue, struct diagnosis *d, struct err *e)
{
    int num = 0;
    json_t *skipped = json_array();
    bool ok = gather(s, g, clue, &num, skipped, e) &&
              diagnose(g->catalogue, clue, num, &s->diagnose, d, e);
    if (ok && !s->quiet)
        diagnose_print(stdout, g->catalogue, clue, num, d, skipped);
    if (ok && !s->quiet && s->view == NULL && d->finding == FINDING_UNKNOWN)
        ok = tell_place(s, e);
    if (ok && s->json != NULL) {
        json_t *root = diagnose_print_json(g->catalogue, clue, num, d, skipped);
        ok = json_write(s->json, root, e);
        json_decref(root);
    }
    json_decref(skipped);
    return ok;
}

static int look(const struct settings *s, const struct catalogue *c, struct err *e)
{
    struct temp_dir work;
    struct suite suite;
    struct diagnosis d;
    struct observation *clue = calloc((size_t)c->num_views, sizeof *clue);
    if (clue == NULL) {
        err_set(e, "out of memory");
        return EXIT_NOT_JUDGED;
    }
    if (!temp_dir_open(&work, "diagnose", e)) {
        free(clue);
        return EXIT_NOT_JUDGED;
    }
    const struct diagnose_gather_options g = {.catalogue = c,
                                              .suite = &suite,
                                              .alpha = s->diagnose.alpha,
                                              .seed = s->seed,
                                              .threads =
                                                  s->threads == 0 ? cli_processors() : s->threads,
                                              .timeout_s = s->timeout_s,
                                              .work_dir = work.path};
    bool ok = suite_load(s->suite_dir, &suite, e);
    if (ok) {
        ok = run(s, &g, clue, &d, e);
        suite_free(&suite);
    }
    free(clue);
    struct err removing;
    if (!temp_dir_close(&work, &removing) && ok)
        ok = err_set(e, "%s", removing.msg);
    return !ok ? EXIT_NOT_JUDGED : d.finding == FINDING_CORRECT ? EXIT_EQUIVALENT : EXIT_DIFFERENT;
}

int command_diagnose(int argc, char **argv, struct err *e)
{
    const struct data_dirs at = data_dirs_find();
    struct settings s = {.diagnose = {.alpha = 1e-6},
                         .seed = 1,
                         .timeout_s = 600,
                         .suite_dir = at.suite.s,
                         .catalogue_dir = at.catalogue.s};
    struct catalogue c;
    int code = EXIT_NOT_JUDGED;
    if (!cli_read(options, argc, argv, &s, e) || (!s.help && !check(&s, e)) ||
        !catalogue_read(s.catalogue_dir, &c, e))
        return code;
    if (s.pathtracer == NULL)
        s.pathtracer = at.pathtracer.s;
    if (s.help) {
        print_help(&c);
        code = 0;
    } else if (s.diagnose.without != NULL && catalogue_bug(&c, s.diagnose.without) < 0) {
        err_set(e, "--without: the catalogue has no bug '%s'", s.diagnose.without);
    } else {
        code = look(&s, &c, e);
    }
    catalogue_free(&c);
    return code;
}
