#include "renderer/base/cli.h"
#include "renderer/base/fs.h"
#include "tools/converge/converge_run.h"
#include "tools/results/convergence_results.h"
#include "tools/base/data_dirs.h"
#include "tools/report/report.h"
#include "tools/results/results.h"
#include "commands.h"

#include <stdlib.h>
#include <string.h>

enum option {
    OPT_ENGINE,
    OPT_LADDER,
    OPT_REPLICATES,
    OPT_DEPTH_SPP,
    OPT_SHRINK,
    OPT_REFERENCE,
    OPT_ALPHA,
    OPT_MARGIN,
    OPT_SLOPE_MARGIN,
    OPT_SEED,
    OPT_OUT,
    OPT_SUITE,
    OPT_GOLDEN,
    OPT_SHARE,
    OPT_PATHTRACER,
    OPT_THREADS,
    OPT_TIMEOUT,
    OPT_QUIET,
    OPT_HELP
};

static const struct cli_option options[] = {
    [OPT_ENGINE] = {0, "engine", 1, "NAME",
                    "one of pathtracer pathtracer-sobol" ENGINES_WITH_GOLDENS(
                        ENGINE_TEXT) "; may be given\nagain (the first three)"},
    [OPT_LADDER] = {0, "ladder", 1, "N,N,...",
                    "samples per pixel of the rungs, ascending; povray needs squares\n"
                    "(1,4,16,64,256)"},
    [OPT_REPLICATES] = {'k', "replicates", 1, "K",
                        "pictures per rung, each with its own seed (16)"},
    [OPT_DEPTH_SPP] =
        {0, "depth-spp", 1, "N",
         "samples per pixel of the depth ladder, pathtracer's picture at every greatest\n"
         "depth up to the scene's; 0: none (64)"},
    [OPT_SHRINK] = {0, "shrink", 1, "N", "pictures N times smaller on both sides (1)"},
    [OPT_REFERENCE] =
        {0, "reference", 1, "NAME",
         "what errors are measured against: truth (closed form), an engine's golden,\n"
         "own (a long run of pathtracer), or auto: the first there is"},
    [OPT_ALPHA] = {0, "alpha", 1, "A",
                   "chance of any wrong verdict in the whole run, for wrong\n"
                   "DIFFERENT and for wrong EQUIVALENT each (1e-3)"},
    [OPT_MARGIN] = {0, "margin", 1, "M",
                    "RMS over the pixels of the relative bias that counts as none (0.01)"},
    [OPT_SLOPE_MARGIN] = {0, "slope-margin", 1, "M",
                          "a slope known to no better than +-M decides nothing (0.1)"},
    [OPT_SEED] = {0, "seed", 1, "N", "all seeds follow from it (1)"},
    [OPT_OUT] = {'o', "out", 1, "DIR", "results.json and index.html (build/converge)"},
    [OPT_SUITE] = {0, "suite", 1, "DIR", "the scenes (reference/scenes)"},
    [OPT_GOLDEN] = {0, "golden", 1, "DIR", "stored references (golden)"},
    [OPT_SHARE] = {0, "share", 1, "DIR", "where cycles.py is (reference)"},
    [OPT_PATHTRACER] = {0, "pathtracer", 1, "FILE", "the program under test (beside this one)"},
    [OPT_THREADS] = {'t', "threads", 1, "N", "0: one per processor (0)"},
    [OPT_TIMEOUT] = {0, "timeout", 1, "S", "seconds for any one program (3600)"},
    [OPT_QUIET] = {'q', "quiet", 0, "", "no progress"},
    [OPT_HELP] = {'h', "help", 0, "", "print this"},
    {0}};

static bool parse_ladder(const char *text, struct converge_options *o, struct err *e)
{
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

static bool parse_one(int i, const char *v, struct converge_options *o, bool *chosen, struct err *e)
{
    int n;
    uint64_t seed;
    switch ((enum option)i) {
    case OPT_ENGINE:
        if (!cli_choice("--engine", v, converge_engine_names, &n, e))
            return false;
        if (!*chosen)
            memset(o->engine, 0, sizeof o->engine);
        *chosen = o->engine[n] = true;
        return true;
    case OPT_LADDER: return parse_ladder(v, o, e);
    case OPT_REPLICATES:
        return cli_int("--replicates", v, 4, CONVERGE_MAX_REPLICATES, &o->replicates, e);
    case OPT_DEPTH_SPP: return cli_int("--depth-spp", v, 0, 1 << 20, &o->depth_spp, e);
    case OPT_SHRINK: return cli_int("--shrink", v, 1, 1024, &o->shrink, e);
    case OPT_REFERENCE:
        if (!cli_choice("--reference", v, converge_against_names, &n, e))
            return false;
        o->against = (enum converge_against)n;
        return true;
    case OPT_ALPHA: return cli_double("--alpha", v, 1e-12, 0.4, &o->alpha, e);
    case OPT_MARGIN: return cli_double("--margin", v, 1e-6, 1, &o->margin, e);
    case OPT_SLOPE_MARGIN: return cli_double("--slope-margin", v, 1e-6, 1, &o->slope_margin, e);
    case OPT_SEED:
        if (!cli_uint64("--seed", v, &seed, e))
            return false;
        o->seed = (uint32_t)seed;
        return seed <= UINT32_MAX || err_set(e, "--seed: '%s' is above 2^32-1", v);
    case OPT_OUT: o->out_dir = v; return true;
    case OPT_SUITE: o->suite_dir = v; return true;
    case OPT_GOLDEN: o->golden_dir = v; return true;
    case OPT_SHARE: o->share_dir = v; return true;
    case OPT_PATHTRACER: o->pathtracer = v; return true;
    case OPT_THREADS: return cli_int("--threads", v, 0, 1024, &o->threads, e);
    case OPT_TIMEOUT: return cli_double("--timeout", v, 1, 1e6, &o->timeout_s, e);
    case OPT_QUIET: o->quiet = true; return true;
    case OPT_HELP: return true;
    }
    return true;
}

/* Sets *done where only the help was asked for. */
static bool parse(int argc, char **argv, struct converge_options *o, bool *done, struct err *e)
{
    struct cli c = {.options = options, .argc = argc, .argv = argv, .next = 1};
    bool chosen = false;
    for (int i; (i = cli_next(&c, e)) != CLI_END;) {
        if (i == CLI_ERROR)
            return false;
        if (i == OPT_HELP) {
            puts("usage: assay converge [options] SCENE...\n");
            cli_print_options(stdout, options);
            *done = true;
            return true;
        }
        if (i == CLI_POSITIONAL && o->num_scenes == CONVERGE_MAX_SCENES)
            return err_set(e, "at most %d scenes", CONVERGE_MAX_SCENES);
        if (i == CLI_POSITIONAL)
            o->scene[o->num_scenes++] = c.value[0];
        else if (!parse_one(i, c.value[0], o, &chosen, e))
            return false;
    }
    return o->num_scenes > 0 || err_set(e, "converge needs the name of a scene (see --help)");
}

static bool write_all(const json_t *results, const char *out_dir, struct err *e)
{
    char json[4096], html[4096];
    snprintf(json, sizeof json, "%s/results.json", out_dir);
    snprintf(html, sizeof html, "%s/index.html", out_dir);
    if (!json_write(json, results, e) || !report_write(json, html, e))
        return false;
    convergence_results_print(stdout, json_object_get(results, "convergence"));
    printf("\n%s\n", html);
    return true;
}

/* The one line on stderr that exit code 3 owes. */
static void tell_not_judged(void *ctx, const struct convergence_row *r)
{
    struct err *e = ctx;
    if (r->outcome == OUTCOME_NOT_JUDGED && e->msg[0] == '\0')
        err_set(e, "%s: could not be judged: %s", r->engine, r->value);
}

int command_converge(int argc, char **argv, struct err *e)
{
    char pathtracer[4096], suite[4096], golden[4096], share[4096];
    fs_beside_program(pathtracer, sizeof pathtracer, "pathtracer");
    struct converge_options o = {
        .out_dir = "build/converge",
        .pathtracer = pathtracer,
        .engine =
            {[CONVERGE_PATHTRACER] = true, [CONVERGE_SOBOL] = true, [CONVERGE_REFERENCES] = true},
        .ladder = {1, 4, 16, 64, 256},
        .num_rungs = 5,
        .replicates = 16,
        .depth_spp = 64,
        .shrink = 1,
        .seed = 1,
        .alpha = 1e-3,
        .margin = 0.01,
        .slope_margin = 0.1,
        .timeout_s = 3600,
        .suite_dir = data_dir(suite, sizeof suite, "reference/scenes", "../share/assay/scenes"),
        .golden_dir = data_dir(golden, sizeof golden, "golden", "../share/assay/golden"),
        .share_dir = data_dir(share, sizeof share, "reference", "../share/assay")};
    bool done = false;
    json_t *results = NULL;
    if (!parse(argc, argv, &o, &done, e))
        return EXIT_NOT_JUDGED;
    if (done)
        return 0;
    if (o.threads == 0)
        o.threads = cli_processors();
    int code = EXIT_NOT_JUDGED;
    if (converge_run(&o, argc, argv, &results, e) && write_all(results, o.out_dir, e))
        code = results_exit_code(results);
    const json_t *scenes = json_object_get(results, "convergence");
    for (size_t i = 0; code == EXIT_NOT_JUDGED && i < json_array_size(scenes); i++)
        convergence_results_rows(json_array_get(scenes, i), tell_not_judged, e);
    json_decref(results);
    return code;
}
