/* A validation as jobs: one for each scene, whose claims share renders, or one for each claim, which renders all it
 * needs. */
#include "reference/base/process.h"
#include "renderer/base/cli_rewrite.h"
#include "renderer/base/fs.h"
#include "job_kinds.h"
#include "tools/results/results.h"
#include "tools/validate/validate_command.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Options that each job sets itself. */
static const struct option_words not_of_a_job[] = {{"--only", 1},
                                                   {"--out", 1},
                                                   {"--reference-seed", 1},
                                                   {"-t", 1},
                                                   {"--threads", 1},
                                                   {"--of-claims", 1},
                                                   {"--page-every", 1},
                                                   {"--slurm", 0},
                                                   {"-q", 0},
                                                   {"--quiet", 0},
                                                   {0}};

static bool add_words(struct plan *p, int argc, char **argv, const struct validate_options *o,
                      const char *threads, int claims, struct err *e)
{
    char n[16], seed[16];
    const struct path assay = fs_beside_program("assay");
    snprintf(n, sizeof n, "%d", claims);
    snprintf(seed, sizeof seed, "%u", (unsigned)o->reference_seed);
    const char *const first[] = {
        assay.s, "validate", "-q",    "--of-claims",      n,   "-t", threads,
        "--out", "{out}",    "{job}", "--reference-seed", seed};
    return plan_run_words(p, first, sizeof first / sizeof *first, false, e) &&
           plan_user_words(p, not_of_a_job, argc - 1, argv + 1, e);
}

/* What a plan is made of. */
struct planning {
    struct plan *p;
    const struct validate_options *opt;
    int argc, cpus;
    char **argv;
};

/* Plans a job. The common words are added with the first, when the number of claims is known. */
static bool plan_part(void *ctx, const struct validate_part *part, struct err *e)
{
    struct planning *g = ctx;
    const struct suite_scene *s = part->scene;
    char threads[16];
    const char *input[6], **next = input;
    snprintf(threads, sizeof threads, "%d", g->cpus);
    if (g->p->num == 0 && !add_words(g->p, g->argc, g->argv, g->opt, threads, part->num_claims, e))
        return false;
    const struct path json = fs_path("%.*s.json", (int)(strlen(s->dae) - strlen(".dae")), s->dae);
    const struct path from = fs_path("%s/%s.json", g->opt->suite_dir, s->references_of);
    const struct path golden = fs_path("%s/%s", g->opt->golden_dir, s->references_of);
    *next++ = s->dae;
    *next++ = json.s;
    if (strcmp(s->name, s->references_of) != 0)
        *next++ = from.s;
    if (s->environment[0] != '\0')
        *next++ = s->environment;
    if (!g->opt->live && access(golden.s, F_OK) == 0)
        *next++ = golden.s;
    *next = NULL;
    const char **word = calloc(2 * (size_t)part->num_only, sizeof *word);
    if (word == NULL)
        return err_set(e, "out of memory");
    for (int i = 0; i < part->num_only; i++) {
        word[2 * i] = "--only";
        word[2 * i + 1] = part->only[i];
    }
    bool ok = plan_job(g->p, word, 2 * part->num_only, input, e);
    free(word);
    return ok;
}

static bool plan_jobs(struct validate_command *c, int argc, char **argv, bool by_claim,
                      struct plan *p, struct err *e)
{
    const struct validate_options *o = &c->opt;
    struct planning g = {.p = p, .opt = o, .argc = argc, .argv = argv};
    g.cpus = cli_rewrite_has_word(argc, argv, "-t", "--threads") ? o->threads : 1;
    if (o->budget_s > 0 || o->until_different || o->of_claims > 0)
        return err_set(e, "%s cannot be cut into jobs: what is looked at next depends on the rest",
                       o->budget_s > 0      ? "--budget"
                       : o->until_different ? "--until-different"
                                            : "--of-claims");
    for (int code = EXIT_DIFFERENT; code <= EXIT_NOT_JUDGED; code++)
        plan_may_end(p, code);
    return plan_begin(p, o->out_dir, "results.json", g.cpus, e) &&
           plan_input(p, o->pathtracer, e) &&
           (!o->live || job_reference_live_inputs(p, o->share_dir, e)) &&
           (o->engine == NULL || plan_input(p, o->engine->file, e)) &&
           validate_parts(o, by_claim, plan_part, &g, e);
}

bool job_validate_plan(int argc, char **argv, const struct plan_wishes *w, struct plan *p,
                       struct err *e)
{
    struct validate_command c;
    if (!validate_command_read(argc, argv, &c, e))
        return false;
    bool ok = c.help ? err_set(e, "--help cannot be planned")
                     : plan_jobs(&c, argc, argv, w->by == PLAN_BY_CLAIM, p, e);
    engine_free(&c.engine);
    return ok;
}

/* Appends the entries of `more`, except those of the scene of the last entry: with a job for each claim they are
 * repeated. */
static void add_new(json_t *all, json_t *more)
{
    const json_t *last = json_array_get(all, json_array_size(all) - 1);
    const char *scene = json_string_value(json_object_get(last, "scene"));
    json_each(entry, more) {
        const char *of = json_string_value(json_object_get(entry, "scene"));
        if (scene == NULL || of == NULL || strcmp(scene, of) != 0)
            json_array_append(all, entry);
    }
}

/* Appends the lists of a job's results to those of the jobs before, and copies its data/ into out. */
static bool add_results(const struct plan *p, int k, const char *out, json_t *results,
                        struct err *e)
{
    /* engine_margin and engine_filter are not lists; they are the same in all jobs. */
    static const char *const lists[] = {"claims", "not_expressible", "loader",       "consistency",
                                        "noise",  "engine_margin",   "engine_filter"};
    const struct path path = job_run_artefact(p, k, "results.json"),
                      data = job_run_artefact(p, k, "data");
    json_t *part;
    if (!job_run_verify(p, k, e) || !results_read(path.s, &part, e))
        return false;
    for (size_t i = 0; i < sizeof lists / sizeof *lists; i++) {
        json_t *more = json_object_get(part, lists[i]), *all = json_object_get(results, lists[i]);
        if (more != NULL && all == NULL)
            json_object_set(results, lists[i], more);
        else if (more != NULL && strcmp(lists[i], "claims") != 0)
            add_new(all, more);
        else if (more != NULL)
            json_array_extend(all, more);
    }
    if (json_object_get(results, "reference_seed") != NULL) /* chosen when it was planned */
        json_object_set(results, "reference_seed", json_object_get(part, "reference_seed"));
    double seconds = member_number(results, "seconds") + member_number(part, "seconds");
    json_object_set_new(results, "seconds", json_real(seconds));
    json_decref(part);
    const char *const copy[] = {"cp", "-a", "--", data.s, out, NULL};
    const struct process process = {.argv = copy};
    return access(data.s, F_OK) != 0 || process_run(&process, NULL, e);
}

int job_validate_gather(const struct plan *p, int argc, char **argv, struct err *e)
{
    struct validate_command c;
    json_t *results = NULL;
    int code = EXIT_NOT_JUDGED;
    if (!validate_command_read(argc, argv, &c, e))
        return EXIT_NOT_JUDGED;
    bool ok = fs_make_dirs(c.opt.out_dir, e) && validate_start(&c.opt, argc, argv, &results, e);
    for (int k = 0; ok && k < p->num; k++)
        ok = add_results(p, k, c.opt.out_dir, results, e);
    if (ok)
        code = validate_command_finish(&c, results, e);
    json_decref(results);
    engine_free(&c.engine);
    return code;
}
