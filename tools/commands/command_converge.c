/* assay converge: how fast a renderer's error falls with samples. */
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

static bool read_ladder(void *options, const char *const v[4], struct err *e)
{
    struct converge_options *o = options;
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

/* The first --engine replaces the default engines, later ones are added. */
static bool read_engine(void *options, const char *const v[4], struct err *e)
{
    struct converge_options *o = options;
    int n;
    if (!cli_choice("--engine", v[0], converge_engine_names, &n, e))
        return false;
    if (!o->engine_chosen)
        memset(o->engine, 0, sizeof o->engine);
    return o->engine_chosen = o->engine[n] = true;
}

#define TO(member) CLI_TO(struct converge_options, member)

static const struct cli_option options[] = {
    {0, "engine", "NAME",
     "one of pathtracer pathtracer-sobol" ENGINES_WITH_GOLDENS(
         ENGINE_TEXT) "; repeatable\n(the first three)",
     .read = read_engine},
    {0, "ladder", "N,N,...",
     "samples per pixel of the rungs, ascending; povray needs squares\n"
     "(1,4,16,64,256)",
     .read = read_ladder},
    {'k', "replicates", "K", "replicates per rung, each with a different seed (16)", TO(replicates),
     4, CONVERGE_MAX_REPLICATES},
    {0, "depth-spp", "N",
     "samples per pixel of the depth ladder: a pathtracer render for each\n"
     "maximum path depth up to the scene's; 0: no depth ladder (64)",
     TO(depth_spp), 0, 1 << 20},
    {0, "shrink", "N", "divide width and height of the images by N (1)", TO(shrink), 1, 1024},
    {0, "reference", "NAME",
     "reference of the errors: truth (closed form), an engine's stored\n"
     "reference, own (a long pathtracer render), or auto: the first of\n"
     "these that exists (auto)",
     TO(against), .names = converge_against_names},
    {0, "alpha", "A",
     "probability of any wrong verdict in the whole run, for DIFFERENT\n"
     "and for EQUIVALENT each (1e-3)",
     TO(alpha), 1e-12, 0.4},
    {0, "margin", "M", "largest RMS over pixels of the relative bias that passes (0.01)",
     TO(margin), 1e-6, 1},
    {0, "slope-margin", "M",
     "INCONCLUSIVE if the confidence interval of a slope contains -1/2 but\n"
     "is wider than +-M (0.1)",
     TO(slope_margin), 1e-6, 1},
    {0, "seed", "N", "base seed from which all seeds are derived (1)", TO(seed)},
    {'o', "out", "DIR", "output directory: results.json, index.html (build/converge)", TO(out_dir)},
    {0, "suite", "DIR", "directory of scenes (reference/scenes)", TO(suite_dir)},
    {0, "golden", "DIR", "directory of stored references (golden)", TO(golden_dir)},
    {0, "share", "DIR", "directory of cycles.py (reference)", TO(share_dir)},
    {0, "pathtracer", "FILE", "program under test (pathtracer beside this program)",
     TO(pathtracer)},
    {'t', "threads", "N", "number of threads; 0: one per processor (0)", TO(threads), 0, 1024},
    {0, "timeout", "S", "time limit for each program run, seconds (3600)", TO(timeout_s), 1, 1e6},
    {'q', "quiet", "", "print no progress", TO(quiet)},
    {'h', "help", "", "print this", TO(help),
     .usage =
         "usage: assay converge [options] SCENE...\n\n"
         "Renders each scene at increasing sample counts, with several seeds each, and measures how the\n"
         "error falls.\n"},
    {.noun = "scenes", CLI_TO_LIST(struct converge_options, scene, num_scenes)}};

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

int command_converge(int argc, char **argv, struct err *e)
{
    const struct data_dirs at = data_dirs_find();
    struct converge_options o = {
        .out_dir = "build/converge",
        .pathtracer = at.pathtracer.s,
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
        .suite_dir = at.suite.s,
        .golden_dir = at.golden.s,
        .share_dir = at.share.s};
    json_t *results = NULL;
    if (!cli_read(options, argc, argv, &o, e))
        return EXIT_NOT_JUDGED;
    if (o.help)
        return 0;
    if (o.num_scenes == 0) {
        err_set(e, "converge needs the name of a scene (see --help)");
        return EXIT_NOT_JUDGED;
    }
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
