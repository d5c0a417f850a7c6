#include "validate_command.h"

#include "reference/suite/suite_own.h"
#include "renderer/base/cli.h"
#include "renderer/base/fs.h"
#include "tools/results/plain_words.h"
#include "tools/results/render_cost.h"
#include "tools/report/report.h"
#include "tools/results/results_table.h"
#include "import_result.h"
#include "shared_features.h"

#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

static bool read_reference_seed(void *command, const char *const v[4], struct err *e)
{
    struct validate_command *c = command;
    c->has_reference_seed = true;
    return cli_uint32("--reference-seed", v[0], &c->opt.reference_seed, e);
}

#define TO(member) CLI_TO(struct validate_command, member)

static const struct cli_option options[] = {
    {0, "live", "", "render the references now instead of reading the stored ones", TO(opt.live)},
    {0, "only", "SCENE[/CLAIM]",
     "judge only this scene, or only this claim of it: the name of a\n"
     "reference (compared with ours) or of a variant of ours, A:B for\n"
     "any other pair, consistency, or noise; repeatable",
     CLI_TO_LIST(struct validate_command, opt.only, opt.num_only), .noun = "scenes and claims"},
    {0, "alpha", "A",
     "probability of any wrong verdict in the whole run, for DIFFERENT\n"
     "and for EQUIVALENT each, 1e-12 to 0.4 (1e-3)",
     TO(opt.alpha), 1e-12, 0.4},
    {'o', "out", "DIR", "output directory: report, results, images (build/report)",
     TO(opt.out_dir)},
    {0, "suite", "DIR",
     "directory of scenes (current directory if it has a suite.json, else\n"
     "reference/scenes)",
     TO(opt.suite_dir)},
    {0, "golden", "DIR",
     "directory of stored references (golden; with a suite.json, golden\n"
     "beside it)",
     TO(opt.golden_dir)},
    {0, "share", "DIR", "directory of cycles.py and engines/ (reference)", TO(opt.share_dir)},
    {0, "pathtracer", "FILE", "program under test (pathtracer beside this program)",
     TO(opt.pathtracer)},
    {0, "engine", "FILE",
     "judge the renderer described by FILE in place of ours, against\n"
     "references and ours; a bare NAME means SHARE/engines/NAME.json",
     TO(engine_file)},
    {0, "engine-spp", "N", "samples per pixel of --engine (as in its file)", TO(opt.engine_spp), 1,
     1 << 24},
    {0, "engine-replicates", "K", "number of replicates of --engine (as in its file)",
     TO(opt.engine_replicates), 3, 4096},
    {0, "seed", "N", "seed of the renders by --pathtracer (1)", TO(opt.seed)},
    {0, "reference-seed", "N",
     "with --live: seed of the references (random); else of --engine (0,\n"
     "in a suite of your own after the seeds of its references)",
     .read = read_reference_seed},
    {'t', "threads", "N", "number of threads; 0: one per processor (0)", TO(opt.threads), 0, 1024},
    {0, "timeout", "S", "time limit for each program run, seconds (3600)", TO(opt.timeout_s), 1,
     1e6},
    {0, "budget", "T",
     "judge each claim with more and more samples until it is decided\n"
     "or this time is over: 90, 90s, 10m, 1h; alpha is divided among\n"
     "the looks (off: one look at the declared samples)",
     TO(opt.budget_s), 0, 1e7, .unit = cli_time_units},
    {0, "stages", "1|2",
     "2: DIFFERENT must be confirmed with fresh seeds, each stage tested\n"
     "at sqrt(alpha), where both sides can be rendered again, so not\n"
     "against stored references (2 if alpha < 1e-5, else 1)",
     TO(opt.stages), 1, 2},
    {0, "until-different", "",
     "start with few samples, increase them to the declared number, and\n"
     "stop at the first claim with an unexpected difference",
     TO(opt.until_different)},
    {0, "of-claims", "N",
     "divide alpha among N claims, those of the larger run of which this\n"
     "one judges a part (the claims judged)",
     TO(opt.of_claims), 1, 100000000},
    {0, "slurm", "",
     "run one job per scene on a Slurm cluster (one job per claim: assay\n"
     "slurm --by claim validate)",
     TO(slurm)},
    {0, "page-every", "S",
     "write the page with the results so far every S seconds; a browser\n"
     "that shows it reloads it until the run ends (off)",
     TO(opt.show_every_s), 0.1, 1e6},
    {'q', "quiet", "", "print no progress", TO(opt.quiet)},
    {'h', "help", "", "print this", TO(help),
     .usage =
         "usage: assay validate [options]\n\n"
         "Renders the scenes of a suite and judges each claim about them, mostly that a render agrees with\n"
         "a reference.\n"},
    {0}};

/* A suite of one's own names the engine that it judges; its references are stored. */
static bool ask_own_suite(struct validate_command *c, struct err *e)
{
    struct suite suite;
    if (c->opt.live)
        return err_set(
            e,
            "--live renders Cycles and POV-Ray anew, for our scenes: the references of %s/suite.json are stored (assay golden render)",
            c->opt.suite_dir);
    if (!suite_load(c->opt.suite_dir, &suite, e))
        return false;
    if (c->engine_file == NULL)
        snprintf(c->own_engine, sizeof c->own_engine, "%s", suite.engine);
    suite_free(&suite);
    return c->engine_file != NULL || c->own_engine[0] != '\0' ||
           err_set(e, "%s/suite.json names no 'engine': give --engine FILE", c->opt.suite_dir);
}

static bool load_engine(struct validate_command *c, struct err *e)
{
    const char *file = c->engine_file != NULL ? c->engine_file : c->own_engine;
    c->opt.engine = &c->engine;
    return engine_load_named(file, c->opt.share_dir, &c->engine, e);
}

static void print_not_expressible(const json_t *results)
{
    const json_t *margin = json_object_get(results, "engine_margin");
    if (margin != NULL)
        printf("%s declares margins of its own, %g %% of an image and %g %% of a tile: %s\n",
               member_or_empty(margin, "engine"), 100 * member_number(margin, "global"),
               100 * member_number(margin, "tile"), member_or_empty(margin, "reason"));
    if (json_object_get(results, "engine_filter") != NULL)
        puts(member_text(results, "engine_filter"));
    json_each(entry, json_object_get(results, "not_expressible"))
        printf("%s cannot express %s: %s\n", member_text(entry, "engine"),
               member_text(entry, "scene"), member_text(entry, "reason"));
}

/* Writes index.html from a temporary results file, removed at once so that it is not mistaken for that of a run. */
static bool write_page_so_far(const json_t *so_far, const struct validate_options *o, struct err *e)
{
    const struct path json = fs_path("%s/so_far.json", o->out_dir);
    bool ok = json_write(json.s, so_far, e) &&
              report_write(json.s, fs_path("%s/index.html", o->out_dir).s, e);
    remove(json.s);
    return ok;
}

static bool locate(json_t *results, const char *suite_dir, struct err *e)
{
    char text[1024];
    bool ok = shared_features_tell(results, suite_dir, text, sizeof text, e);
    if (ok && text[0] != '\0')
        json_object_set_new(results, "located", json_string(text));
    return ok;
}

static bool write_all(const json_t *results, const char *out_dir, bool quiet, struct err *e)
{
    const struct path json = fs_path("%s/results.json", out_dir);
    const struct path junit = fs_path("%s/junit.xml", out_dir);
    const struct path html = fs_path("%s/index.html", out_dir);
    if (!json_write(json.s, results, e) || !junit_write(junit.s, results, e) ||
        !report_write(json.s, html.s, e))
        return false;
    results_table_print(stdout, results, false);
    if (member_text(results, "located") != NULL)
        printf("\n%s\n", member_text(results, "located"));
    const json_t *loader = json_object_get(results, "loader");
    if (loader != NULL) {
        puts("");
        import_result_print(stdout, loader);
    }
    print_not_expressible(results);
    fflush(stdout); /* else what follows may stand in the middle of a table */
    if (!quiet)
        render_cost_print(stderr, results);
    plain_words_print(stdout, results, html.s);
    return true;
}

/* The line on stderr that goes with exit code 3: the table on stdout may have gone elsewhere. */
static void tell_not_judged(const json_t *results, struct err *e)
{
    struct results_walk first = {.kind = NUM_JUDGED};
    size_t n = 0;
    for (struct results_walk w = {.results = results}; results_next(&w);) {
        if (w.outcome != OUTCOME_NOT_JUDGED || w.lacks_time)
            continue;
        n += w.kind == JUDGED_CLAIM;
        if (first.kind == NUM_JUDGED)
            first = w;
    }
    if (first.kind == JUDGED_CLAIM)
        err_set(e, "%zu of %zu claims could not be judged; %s, %s against %s: %s", n,
                json_array_size(json_object_get(results, "claims")), first.scene,
                member_text(first.json, "a"), member_text(first.json, "b"),
                member_text(first.json, "error"));
    else
        err_set(e, "%s, its %s: %s", first.scene,
                first.kind == JUDGED_NOISE ? "noise" : "stated errors",
                member_text(first.json, "error"));
}

/* Combines both exit codes: not judged takes precedence, then a difference, then an inconclusive claim. */
static int with_loader(int code, const json_t *results, struct err *e)
{
    int loader = import_result_exit_code(json_object_get(results, "loader"));
    if (loader == EXIT_NOT_JUDGED && code != EXIT_NOT_JUDGED)
        err_set(e, "Blender's importer: a scene could not be judged, see above");
    return loader == EXIT_NOT_JUDGED || (loader == EXIT_DIFFERENT && code != EXIT_NOT_JUDGED)
               ? loader
               : code;
}

bool validate_command_read(int argc, char **argv, struct validate_command *c, struct err *e)
{
    *c = (struct validate_command){.at = data_dirs_find()};
    c->opt = (struct validate_options){.out_dir = "build/report",
                                       .pathtracer = c->at.pathtracer.s,
                                       .alpha = 1e-3,
                                       .seed = 1,
                                       .timeout_s = 3600,
                                       .share_dir = c->at.share.s,
                                       .show = write_page_so_far};
    if (!cli_read(options, argc, argv, c, e) || c->help)
        return c->help;
    c->at = data_dirs_of_suite(c->opt.suite_dir);
    c->opt.suite_dir = c->at.suite.s;
    if (c->opt.golden_dir == NULL)
        c->opt.golden_dir = c->at.golden.s;
    if (suite_own_is(c->opt.suite_dir) && !ask_own_suite(c, e))
        return false;
    c->opt.repeats_seeds = suite_own_is(c->opt.suite_dir) && !c->has_reference_seed;
    uint32_t *seed = &c->opt.reference_seed;
    if (c->opt.live && !c->has_reference_seed &&
        getrandom(seed, sizeof *seed, 0) != (ssize_t)sizeof *seed)
        return err_set(e, "no random numbers from the system; give --reference-seed");
    if ((c->engine_file != NULL || c->own_engine[0] != '\0') && !load_engine(c, e))
        return false;
    if (c->opt.engine != NULL && !engine_fits_suite(&c->engine, c->opt.suite_dir, e))
        return false;
    if (c->opt.threads == 0)
        c->opt.threads = cli_processors();
    return true;
}

int validate_command_finish(const struct validate_command *c, json_t *results, struct err *e)
{
    int code = EXIT_NOT_JUDGED;
    if (locate(results, c->opt.suite_dir, e) && write_all(results, c->opt.out_dir, c->opt.quiet, e))
        code = with_loader(results_exit_code(results), results, e);
    if (code == EXIT_NOT_JUDGED && e->msg[0] == '\0')
        tell_not_judged(results, e);
    return code;
}
