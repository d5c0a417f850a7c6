/* assay converge: how fast a renderer's error falls with samples. */
#include "renderer/base/cli.h"
#include "renderer/base/fs.h"
#include "tools/converge/converge_run.h"
#include "tools/results/convergence_results.h"
#include "tools/base/data_dirs.h"
#include "reference/suite/suite_own.h"
#include "tools/report/report.h"
#include "tools/results/results.h"
#include "commands.h"

#include <stdlib.h>
#include <string.h>

/* What the command line names, and what it becomes. */
struct converge_command {
    struct converge_options o;
    const char *engine[CONVERGE_MAX_ENGINES]; /* --engine */
    int num_engines;
    struct engine described[CONVERGE_MAX_DESCRIBED];
    int num_described;
    struct data_dirs at;
    bool help;
};

static bool read_ladder(void *options, const char *const v[4], struct err *e)
{
    struct converge_options *o = &((struct converge_command *)options)->o;
    const char *text = v[0];
    o->num_rungs = 0;
    for (const char *c = text; c != NULL;) {
        char number[16];
        size_t n = strcspn(c, ",");
        if (n >= sizeof number)
            return err_set(e, "--ladder: '%s' is no list of numbers", text);
        memcpy(number, c, n);
        number[n] = '\0';
        if (o->num_rungs == CONVERGE_MAX_RUNGS)
            return err_set(e, "--ladder: at most %d rungs", CONVERGE_MAX_RUNGS);
        int *spp = &o->ladder[o->num_rungs++];
        if (!cli_int("--ladder", number, 1, 1 << 20, spp, e))
            return false;
        if (o->num_rungs > 1 && spp[0] <= spp[-1])
            return err_set(e, "--ladder: %d does not ascend", *spp);
        c = c[n] == ',' ? c + n + 1 : NULL;
    }
    return o->num_rungs >= 3 || err_set(e, "--ladder: at least three rungs");
}

static void free_command(struct converge_command *c)
{
    for (int i = 0; i < c->num_described; i++)
        engine_free(&c->described[i]);
}

/* Reads a description and checks what convergence asks of it. */
static bool add_described(struct converge_command *c, const char *name, struct err *e)
{
    char filter[2][PIXEL_FILTER_TEXT];
    if (c->num_described == CONVERGE_MAX_DESCRIBED)
        return err_set(e, "--engine: at most %d descriptions", CONVERGE_MAX_DESCRIBED);
    struct engine *en = &c->described[c->num_described];
    if (!engine_load_named(name, c->o.share_dir, en, e))
        return false;
    c->o.engine[c->o.num_engines++] = (enum converge_engine)(CONVERGE_DESCRIBED + c->num_described);
    c->num_described++;
    if (en->output != OUTPUT_MEAN && en->output != OUTPUT_MOMENTS)
        return err_set(e,
                       "%s: convergence is measured on images with seeds of their own: "
                       "\"output\": \"mean\" or \"moments\"",
                       name);
    for (int i = 0; i < 2; i++)
        pixel_filter_print(&c->described[i * (c->num_described - 1)].filter, filter[i]);
    if (strcmp(filter[0], filter[1]) != 0)
        return err_set(e,
                       "%s: its pixel filter is %s, that of %s %s: there is one reference for all",
                       en->name, filter[1], c->described[0].name, filter[0]);
    if (en->filter.radius > 0 && c->o.shrink > 1)
        return err_set(e, "%s: --shrink is for pixel filters of one box", en->name);
    return engine_fits_suite(en, c->o.suite_dir, e);
}

/* Finds the engines that are named, or those that are measured by default. */
static bool find_engines(struct converge_command *c, const struct suite *suite, struct err *e)
{
    struct converge_options *o = &c->o;
    if (c->num_engines == 0 && suite->engine[0] != '\0')
        return add_described(c, suite->engine, e);
    if (c->num_engines == 0)
        for (o->num_engines = 0; o->num_engines <= CONVERGE_REFERENCES; o->num_engines++)
            o->engine[o->num_engines] = (enum converge_engine)o->num_engines;
    for (int i = 0; i < c->num_engines; i++) {
        int k = 0;
        while (converge_engine_names[k] != NULL &&
               strcmp(converge_engine_names[k], c->engine[i]) != 0)
            k++;
        for (int j = 0; j < i; j++)
            if (strcmp(c->engine[j], c->engine[i]) == 0)
                return err_set(e, "--engine %s is given twice", c->engine[i]);
        if (k < CONVERGE_OWN)
            o->engine[o->num_engines++] = (enum converge_engine)k;
        else if (!add_described(c, c->engine[i], e))
            return false;
    }
    for (int i = 0; i < c->num_described; i++)
        for (int j = 0; j < i; j++)
            if (strcmp(c->described[i].name, c->described[j].name) == 0)
                return err_set(e, "%s and %s both have the name '%s'", c->described[j].file,
                               c->described[i].file, c->described[i].name);
    return true;
}

#define TO(member) CLI_TO(struct converge_command, member)

static const struct cli_option options[] = {
    {0, "engine", "NAME|FILE",
     "one of pathtracer pathtracer-sobol" ENGINES_WITH_GOLDENS(
         ENGINE_TEXT) ", or any renderer: its\n"
                      "description FILE, or NAME for SHARE/engines/NAME.json; repeatable\n"
                      "(the first three; of a suite of your own its engine)",
     CLI_TO_LIST(struct converge_command, engine, num_engines), .noun = "engines"},
    {0, "ladder", "N,N,...",
     "samples per pixel of the rungs, ascending; povray needs squares\n"
     "(1,4,16,64,256)",
     .read = read_ladder},
    {'k', "replicates", "K", "replicates per rung, each with a different seed (16)",
     TO(o.replicates), 4, CONVERGE_MAX_REPLICATES},
    {0, "depth-spp", "N",
     "samples per pixel of the depth ladder: a pathtracer render for each\n"
     "maximum path depth up to the scene's; 0: no depth ladder (64)",
     TO(o.depth_spp), 0, 1 << 20},
    {0, "shrink", "N", "divide width and height of the images by N (1)", TO(o.shrink), 1, 1024},
    {0, "reference", "NAME",
     "reference of the errors: truth (closed form), another of the scene's\n"
     "stored references, own (a long pathtracer render), or auto: the\n"
     "first of these that exists (auto)",
     TO(o.against)},
    {0, "alpha", "A",
     "probability of any wrong verdict in the whole run, for DIFFERENT\n"
     "and for EQUIVALENT each (1e-3)",
     TO(o.alpha), 1e-12, 0.4},
    {0, "margin", "M", "largest RMS over pixels of the relative bias that passes (0.01)",
     TO(o.margin), 1e-6, 1},
    {0, "margin-variance", "M",
     "the first --engine may have 1 + M times the variance of each other\n"
     "one, at the last rung; more is DIFFERENT (measured, not judged)",
     TO(o.margin_variance), 1e-6, 1000},
    {0, "slope-margin", "M",
     "INCONCLUSIVE if the confidence interval of a slope contains -1/2 but\n"
     "is wider than +-M or, of a described renderer, ends above -1/2 + M\n"
     "(0.1)",
     TO(o.slope_margin), 1e-6, 1},
    {0, "seed", "N", "base seed from which all seeds are derived (1)", TO(o.seed)},
    {'o', "out", "DIR", "output directory: results.json, index.html (build/converge)",
     TO(o.out_dir)},
    {0, "suite", "DIR",
     "directory of scenes (current directory if it has a suite.json, else\n"
     "reference/scenes)",
     TO(o.suite_dir)},
    {0, "golden", "DIR", "directory of stored references (that of the suite)", TO(o.golden_dir)},
    {0, "share", "DIR", "directory of cycles.py (reference)", TO(o.share_dir)},
    {0, "pathtracer", "FILE", "program under test (pathtracer beside this program)",
     TO(o.pathtracer)},
    {'t', "threads", "N", "number of threads; 0: one per processor (0)", TO(o.threads), 0, 1024},
    {0, "timeout", "S", "time limit for each program run, seconds (3600)", TO(o.timeout_s), 1, 1e6},
    {'q', "quiet", "", "print no progress", TO(o.quiet)},
    {'h', "help", "", "print this", TO(help),
     .usage =
         "usage: assay converge [options] SCENE...\n\n"
         "Renders each scene at increasing sample counts, with several seeds each, and measures how the\n"
         "error falls.\n"},
    {.noun = "scenes", CLI_TO_LIST(struct converge_command, o.scene, o.num_scenes)}};

static bool write_all(const json_t *results, const char *out_dir, struct err *e)
{
    const struct path json = fs_path("%s/results.json", out_dir);
    const struct path html = fs_path("%s/index.html", out_dir);
    if (!json_write(json.s, results, e) || !report_write(json.s, html.s, e))
        return false;
    convergence_results_print(stdout, json_object_get(results, "convergence"));
    printf("\n%s\n", html.s);
    return true;
}

/* The line on stderr that goes with exit code 3. */
static void tell_not_judged(void *ctx, const struct convergence_row *r)
{
    struct err *e = ctx;
    if (r->outcome == OUTCOME_NOT_JUDGED && e->msg[0] == '\0')
        err_set(e, "%s: could not be judged: %s", r->engine, r->value);
}

/* Reads the command line, and finds what it names. The caller calls free_command(), even after a failure. */
static bool read_command(struct converge_command *c, int argc, char **argv, struct err *e)
{
    struct converge_options *o = &c->o;
    struct suite suite = {0};
    if (!cli_read(options, argc, argv, c, e))
        return false;
    if (c->help)
        return true;
    if (o->num_scenes == 0)
        return err_set(e, "converge needs the name of a scene (see --help)");
    if (o->threads == 0)
        o->threads = cli_processors();
    c->at = data_dirs_of_suite(o->suite_dir);
    o->suite_dir = c->at.suite.s;
    if (o->golden_dir == NULL)
        o->golden_dir = c->at.golden.s;
    o->described = c->described;
    if (o->margin_variance > 0 && (c->num_engines < 2 || engine_with_goldens(c->engine[0]) != NULL))
        return err_set(e, "--margin-variance is of the first --engine over others: give yours, "
                          "then these");
    bool ok = (!suite_own_is(o->suite_dir) || suite_load(o->suite_dir, &suite, e)) &&
              find_engines(c, &suite, e);
    suite_free(&suite);
    return ok;
}

int command_converge(int argc, char **argv, struct err *e)
{
    struct converge_command c = {.at = data_dirs_find()};
    c.o = (struct converge_options){.out_dir = "build/converge",
                                    .pathtracer = c.at.pathtracer.s,
                                    .ladder = {1, 4, 16, 64, 256},
                                    .num_rungs = 5,
                                    .replicates = 16,
                                    .depth_spp = 64,
                                    .shrink = 1,
                                    .against = "auto",
                                    .seed = 1,
                                    .alpha = 1e-3,
                                    .margin = 0.01,
                                    .slope_margin = 0.1,
                                    .timeout_s = 3600,
                                    .share_dir = c.at.share.s};
    json_t *results = NULL;
    int code = EXIT_NOT_JUDGED;
    if (read_command(&c, argc, argv, e) &&
        (c.help ||
         (converge_run(&c.o, argc, argv, &results, e) && write_all(results, c.o.out_dir, e))))
        code = c.help ? 0 : results_exit_code(results);
    free_command(&c);
    const json_t *scenes = json_object_get(results, "convergence");
    for (size_t i = 0; code == EXIT_NOT_JUDGED && i < json_array_size(scenes); i++)
        convergence_results_rows(json_array_get(scenes, i), tell_not_judged, e);
    json_decref(results);
    return code;
}
