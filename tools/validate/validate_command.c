#include "validate_command.h"

#include "renderer/base/cli.h"
#include "renderer/base/fs.h"
#include "tools/base/data_dirs.h"
#include "tools/results/render_cost.h"
#include "tools/report/report.h"
#include "tools/results/results_table.h"
#include "tools/results/stated_error_results.h"
#include "import_result.h"

#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

enum option {
    OPT_LIVE,
    OPT_ONLY,
    OPT_ALPHA,
    OPT_OUT,
    OPT_SUITE,
    OPT_GOLDEN,
    OPT_SHARE,
    OPT_PATHTRACER,
    OPT_ENGINE,
    OPT_ENGINE_SPP,
    OPT_ENGINE_REPLICATES,
    OPT_SEED,
    OPT_REFERENCE_SEED,
    OPT_THREADS,
    OPT_TIMEOUT,
    OPT_BUDGET,
    OPT_STAGES,
    OPT_UNTIL_DIFFERENT,
    OPT_OF_CLAIMS,
    OPT_SLURM,
    OPT_PAGE_EVERY,
    OPT_QUIET,
    OPT_HELP
};

static const struct cli_option options[] = {
    [OPT_LIVE] = {0, "live", 0, "", "render the references now instead of reading the goldens"},
    [OPT_ONLY] = {0, "only", 1, "SCENE[/CLAIM]",
                  "judge only this scene, or of it only this claim: the name of the\n"
                  "reference that ours is held against, of a variant of ours, A:B\n"
                  "of any other pair, or consistency; may be given again"},
    [OPT_ALPHA] = {0, "alpha", 1, "A",
                   "chance of any wrong verdict in the whole run, for wrong\n"
                   "DIFFERENT and for wrong EQUIVALENT each, down to 1e-12 (1e-3)"},
    [OPT_BUDGET] = {0, "budget", 1, "T",
                    "look at each claim with more and more samples until it is\n"
                    "decided or the time is over: 90, 90s, 10m, 1h; alpha is spent\n"
                    "over the looks (off: one look at the declared samples)"},
    [OPT_STAGES] = {0, "stages", 1, "1|2",
                    "2: DIFFERENT must be confirmed with fresh seeds, each stage at\n"
                    "sqrt(alpha), where both sides can be rendered again, so not\n"
                    "against goldens (2 if alpha < 1e-5, else 1)"},
    [OPT_OUT] = {'o', "out", 1, "DIR", "report, results and images (build/report)"},
    [OPT_SUITE] = {0, "suite", 1, "DIR", "the scenes (reference/scenes)"},
    [OPT_GOLDEN] = {0, "golden", 1, "DIR", "stored references (golden)"},
    [OPT_SHARE] = {0, "share", 1, "DIR", "where cycles.py is (reference)"},
    [OPT_PATHTRACER] = {0, "pathtracer", 1, "FILE", "the program under test (beside this one)"},
    [OPT_ENGINE] = {0, "engine", 1, "FILE",
                    "also judge the renderer that this file describes: against\n"
                    "references and ours; a NAME alone is SHARE/engines/NAME.json"},
    [OPT_ENGINE_SPP] = {0, "engine-spp", 1, "N", "its samples per pixel (as in its file)"},
    [OPT_ENGINE_REPLICATES] = {0, "engine-replicates", 1, "K", "its pictures (as in its file)"},
    [OPT_SEED] = {0, "seed", 1, "N", "seed of our render (1)"},
    [OPT_REFERENCE_SEED] = {0, "reference-seed", 1, "N",
                            "with --live (a fresh one), of --engine otherwise (0)"},
    [OPT_THREADS] = {'t', "threads", 1, "N", "0: one per processor (0)"},
    [OPT_TIMEOUT] = {0, "timeout", 1, "S", "seconds for any one program (3600)"},
    [OPT_UNTIL_DIFFERENT] = {0, "until-different", 0, "",
                             "few samples first, then more, up to the declared; stop at the\n"
                             "first claim that differs where it should not"},
    [OPT_OF_CLAIMS] = {0, "of-claims", 1, "N",
                       "judge some of the N claims of a larger run, whose alpha it is (all)"},
    [OPT_SLURM] = {0, "slurm", 0, "",
                   "a job for each scene on a Slurm cluster (assay slurm --by claim\n"
                   "validate: for each claim)"},
    [OPT_PAGE_EVERY] = {0, "page-every", 1, "S",
                        "write the page every S seconds, with what is judged so far;\n"
                        "open in a browser it reloads itself until the run ends (off)"},
    [OPT_QUIET] = {'q', "quiet", 0, "", "no progress"},
    [OPT_HELP] = {'h', "help", 0, "", "print this"},
    {0}};

static bool fresh_seed(uint32_t *seed, struct err *e)
{
    if (getrandom(seed, sizeof *seed, 0) != (ssize_t)sizeof *seed)
        return err_set(e, "no random numbers from the system; give --reference-seed");
    return true;
}

/* engine: file or name; NULL: none. */
static bool parse(int argc, char **argv, struct validate_options *o, struct validate_command *w,
                  const char **engine, struct err *e)
{
    struct cli c = {.options = options, .argc = argc, .argv = argv, .next = 1};
    bool ok = true, has_seed = false;
    for (int i; ok && (i = cli_next(&c, e)) != CLI_END;) {
        if (i == CLI_ERROR)
            return false;
        if (i == CLI_POSITIONAL)
            return err_set(e, "validate takes no argument '%s'", c.value[0]);
        const char *v = c.value[0];
        uint64_t seed;
        switch ((enum option)i) {
        case OPT_LIVE: o->live = true; break;
        case OPT_ONLY:
            if (o->num_only == MAX_ONLY)
                return err_set(e, "--only: at most %d scenes and claims", MAX_ONLY);
            o->only[o->num_only++] = v;
            break;
        case OPT_ALPHA: ok = cli_double("--alpha", v, 1e-12, 0.4, &o->alpha, e); break;
        case OPT_OUT: o->out_dir = v; break;
        case OPT_SUITE: o->suite_dir = v; break;
        case OPT_GOLDEN: o->golden_dir = v; break;
        case OPT_SHARE: o->share_dir = v; break;
        case OPT_PATHTRACER: o->pathtracer = v; break;
        case OPT_ENGINE: *engine = v; break;
        case OPT_ENGINE_SPP: ok = cli_int("--engine-spp", v, 1, 1 << 24, &o->engine_spp, e); break;
        case OPT_ENGINE_REPLICATES:
            ok = cli_int("--engine-replicates", v, 3, 4096, &o->engine_replicates, e);
            break;
        case OPT_SEED: ok = cli_uint64("--seed", v, &o->seed, e); break;
        case OPT_REFERENCE_SEED:
            ok = cli_uint64("--reference-seed", v, &seed, e);
            if (ok && seed > UINT32_MAX)
                return err_set(e, "--reference-seed: '%s' is above 2^32-1", v);
            o->reference_seed = ok ? (uint32_t)seed : 0;
            has_seed = true;
            break;
        case OPT_THREADS: ok = cli_int("--threads", v, 0, 1024, &o->threads, e); break;
        case OPT_TIMEOUT: ok = cli_double("--timeout", v, 1, 1e6, &o->timeout_s, e); break;
        case OPT_BUDGET:
            ok = cli_with_unit("--budget", v, cli_time_units, 1e7, &o->budget_s, e);
            break;
        case OPT_STAGES: ok = cli_int("--stages", v, 1, 2, &o->stages, e); break;
        case OPT_UNTIL_DIFFERENT: o->until_different = true; break;
        case OPT_OF_CLAIMS: ok = cli_int("--of-claims", v, 1, 100000000, &o->of_claims, e); break;
        case OPT_SLURM: w->slurm = true; break;
        case OPT_PAGE_EVERY:
            ok = cli_double("--page-every", v, 0.1, 1e6, &o->show_every_s, e);
            break;
        case OPT_QUIET: o->quiet = true; break;
        case OPT_HELP:
            puts("usage: assay validate [options]\n");
            cli_print_options(stdout, options);
            return w->help = true;
        }
    }
    return ok && (has_seed || !o->live || fresh_seed(&o->reference_seed, e));
}

/* A name alone is one of those that came with us. */
static bool load_engine(const char *wish, const char *share_dir, struct engine *out, struct err *e)
{
    char path[4096];
    bool is_name = strpbrk(wish, "./") == NULL;
    int n = snprintf(path, sizeof path, "%s%s%s%s", is_name ? share_dir : "",
                     is_name ? "/engines/" : "", wish, is_name ? ".json" : "");
    if (n < 0 || (size_t)n >= sizeof path)
        return err_set(e, "%.64s...: path too long", wish);
    return engine_load(path, out, e);
}

static void print_not_expressible(const json_t *results)
{
    size_t i;
    const json_t *entry;
    json_array_foreach(json_object_get(results, "not_expressible"), i, entry)
        printf("%s cannot express %s: %s\n", member_text(entry, "engine"),
               member_text(entry, "scene"), member_text(entry, "reason"));
}

/* index.html from results that are there only as long as that takes, so that nothing takes them for a run's. */
static bool write_page_so_far(const json_t *so_far, const struct validate_options *o, struct err *e)
{
    char json[4096], html[4096];
    snprintf(json, sizeof json, "%s/so_far.json", o->out_dir);
    snprintf(html, sizeof html, "%s/index.html", o->out_dir);
    bool ok = json_write(json, so_far, e) && report_write(json, html, e);
    remove(json);
    return ok;
}

static bool write_all(const json_t *results, const char *out_dir, bool quiet, struct err *e)
{
    char json[4096], junit[4096], html[4096];
    snprintf(json, sizeof json, "%s/results.json", out_dir);
    snprintf(junit, sizeof junit, "%s/junit.xml", out_dir);
    snprintf(html, sizeof html, "%s/index.html", out_dir);
    if (!json_write(json, results, e) || !junit_write(junit, results, e) ||
        !report_write(json, html, e))
        return false;
    if (json_array_size(json_object_get(results, "claims")) > 0)
        results_table_print(stdout, results, false);
    stated_error_print(stdout, json_object_get(results, "consistency"), false);
    const json_t *loader = json_object_get(results, "loader");
    if (loader != NULL) {
        puts("");
        import_result_print(stdout, loader);
    }
    print_not_expressible(results);
    if (!quiet)
        render_cost_print(stderr, results);
    printf("\n%s\n", html);
    return true;
}

/* The one line on stderr that exit code 3 owes, also where the table on stdout has gone elsewhere. */
static void tell_not_judged(const json_t *results, struct err *e)
{
    const json_t *claims = json_object_get(results, "claims"), *first = NULL;
    size_t n = 0;
    for (size_t i = json_array_size(claims); i-- > 0;) {
        const json_t *claim = json_array_get(claims, i);
        if (results_claim_outcome(claim) == OUTCOME_NOT_JUDGED &&
            !results_claim_lacks_time(claim)) {
            first = claim;
            n++;
        }
    }
    json_t *consistency = json_object_get(results, "consistency");
    for (size_t i = 0; first == NULL && i < json_array_size(consistency); i++) {
        const json_t *c = json_array_get(consistency, i);
        if (stated_error_outcome(c) == OUTCOME_NOT_JUDGED) {
            err_set(e, "%s, its stated errors: %s", member_text(c, "scene"),
                    member_text(c, "error"));
            return;
        }
    }
    err_set(e, "%zu of %zu claims could not be judged; %s, %s against %s: %s", n,
            json_array_size(claims), member_text(first, "scene"), member_text(first, "a"),
            member_text(first, "b"), member_text(first, "error"));
}

/* Not judged counts most, then a difference, then an inconclusive claim. */
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
    const char *engine = NULL;
    *c = (struct validate_command){.help = false};
    fs_beside_program(c->pathtracer, sizeof c->pathtracer, "pathtracer");
    c->opt = (struct validate_options){
        .out_dir = "build/report",
        .pathtracer = c->pathtracer,
        .alpha = 1e-3,
        .seed = 1,
        .timeout_s = 3600,
        .suite_dir =
            data_dir(c->suite, sizeof c->suite, "reference/scenes", "../share/assay/scenes"),
        .golden_dir = data_dir(c->golden, sizeof c->golden, "golden", "../share/assay/golden"),
        .share_dir = data_dir(c->share, sizeof c->share, "reference", "../share/assay"),
        .show = write_page_so_far};
    if (!parse(argc, argv, &c->opt, c, &engine, e))
        return false;
    if (engine != NULL) {
        if (!load_engine(engine, c->opt.share_dir, &c->engine, e))
            return false;
        c->opt.engine = &c->engine;
    }
    if (c->opt.threads == 0)
        c->opt.threads = cli_processors();
    return true;
}

int validate_command_finish(const struct validate_command *c, const json_t *results, struct err *e)
{
    int code = EXIT_NOT_JUDGED;
    if (write_all(results, c->opt.out_dir, c->opt.quiet, e))
        code = with_loader(results_exit_code(results), results, e);
    if (code == EXIT_NOT_JUDGED && e->msg[0] == '\0')
        tell_not_judged(results, e);
    return code;
}
