/* References as jobs: each renders some images of one reference (replicate_images.h), for example replicates of
 * Cycles; one that is stored and up to date has no job. The plan's head also has
 *   "references": [{"scene": , "engine": , "seed": , "key": reference_key(), "binary_sha256": of the engine,
 *                   "job": of its first images, "jobs": how many}] */
#include "reference/base/process.h"
#include "reference/external/engine_bindings.h"
#include "renderer/base/cli_rewrite.h"
#include "renderer/base/fs.h"
#include "job_kinds.h"
#include "tools/golden/reference_options.h"
#include "tools/results/results.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Options that each job sets itself, or that planning settles. */
static const struct option_words not_of_a_job[] = {{"--only", 1},
                                                   {"--engine", 1},
                                                   {"-o", 1},
                                                   {"--out", 1},
                                                   {"--golden", 1},
                                                   {"--fresh", 0},
                                                   {"--seed", 1},
                                                   {"-t", 1},
                                                   {"--threads", 1},
                                                   {"--slurm", 0},
                                                   {0}};

static bool add_words(struct plan *p, int argc, char **argv, int threads, struct err *e)
{
    char t[16];
    const struct path assay = fs_beside_program("assay");
    snprintf(t, sizeof t, "%d", threads);
    const char *const first[] = {assay.s, "reference", "-t", t, "--out", "{out}", "{job}"};
    return plan_run_words(p, first, sizeof first / sizeof *first, false, e) &&
           plan_user_words(p, not_of_a_job, argc - 1, argv + 1, e);
}

/* Adds an engine's program and its scripts in share_dir as inputs. *sha256 (may be NULL): that of the
 * program, owned by the plan. Fails if it is not in PATH. */
static bool engine_inputs(struct plan *p, const char *engine, const char *share_dir,
                          const char **sha256, struct err *e)
{
    const struct engine_driver *driver = engine_driver_of(engine);
    const char *program = engine_kind_of(engine)->program;
    bool ok = true;
    char path[PLAN_PATH + 64];
    for (int i = 0; ok && driver->scripts != NULL && driver->scripts[i] != NULL; i++)
        ok = plan_input(p, fs_path("%s/%s", share_dir, driver->scripts[i]).s, e);
    if (ok && !process_find(program, path, sizeof path))
        return err_set(e, "%s: no such program in PATH", program);
    ok = ok && plan_input(p, path, e);
    if (ok && sha256 != NULL)
        *sha256 = json_string_value(json_object_get(json_object_get(p->head, "inputs"), path));
    return ok;
}

bool job_reference_live_inputs(struct plan *p, const char *share_dir, struct err *e)
{
    char path[PLAN_PATH + 64];
    bool ok = plan_input(p, fs_path("%s/import_check/blender_import.py", share_dir).s, e);
    for (int i = 0; ok && i < NUM_ENGINES_WITH_GOLDENS; i++)
        if (i == ENGINE_cycles || process_find(engine_table[i].program, path, sizeof path))
            ok = engine_inputs(p, engine_names[i], share_dir, NULL, e);
    return ok;
}

/* A reference that has to be rendered. */
struct wanted {
    const struct suite_scene *scene;
    const struct suite_reference *ref;
    struct reference_state state;
    int images;
};

struct planning {
    const struct reference_command *c;
    struct wanted *wanted;
    int num, images; /* of all */
};

static bool look_at_one(void *ctx, const struct suite_scene *scene,
                        const struct suite_reference *ref, struct err *e)
{
    struct planning *g = ctx;
    struct wanted w = {.scene = scene, .ref = ref};
    if (!reference_options_state(g->c, scene, ref, &w.state, e))
        return false;
    if (w.state.there != NULL)
        return true;
    struct wanted *more = realloc(g->wanted, ((size_t)g->num + 1) * sizeof *more);
    if (more == NULL)
        return err_set(e, "out of memory");
    g->wanted = more;
    if (!reference_count(scene, ref, &w.state.opt, &w.images, e))
        return false;
    g->wanted[g->num++] = w;
    g->images += w.images;
    return true;
}

/* A reference's share of `parts` jobs, in proportion to its images: at least 1, at most one for each image. */
static int jobs_of(const struct wanted *w, int parts, int images)
{
    long long share = ((long long)parts * w->images + images / 2) / images;
    return share < 1 ? 1 : share > w->images ? w->images : (int)share;
}

static bool plan_one(struct plan *p, const struct wanted *w, int jobs, const char *binary,
                     struct err *e)
{
    char seed[16], range[32];
    const struct suite_scene *s = w->scene;
    const struct path json = fs_path("%.*s.json", (int)(strlen(s->dae) - strlen(".dae")), s->dae);
    snprintf(seed, sizeof seed, "%u", (unsigned)w->state.opt.seed);
    const char *const word[] = {"--only", s->name, "--engine",   w->ref->engine,
                                "--seed", seed,    "--images", range};
    const char *const input[] = {s->dae, json.s, s->environment[0] != '\0' ? s->environment : NULL,
                                 NULL};
    json_t *entry = json_pack("{ss, ss, sI, ss, ss, si, si}", "scene", s->name, "engine",
                              w->ref->engine, "seed", (json_int_t)w->state.opt.seed, "key",
                              w->state.key, "binary_sha256", binary, "job", p->num, "jobs", jobs);
    bool ok = json_array_append_new(json_object_get(p->head, "references"), entry) == 0 ||
              err_set(e, "%s: cannot be written into a plan", s->name);
    for (int i = 0; ok && i < jobs; i++) {
        snprintf(range, sizeof range, "%d:%d", (int)((long long)w->images * i / jobs),
                 (int)((long long)w->images * (i + 1) / jobs));
        ok = plan_job(p, word, sizeof word / sizeof *word, input, e);
    }
    return ok;
}

/* Index of the reference's engine in engine_table. */
static ptrdiff_t index_of(const struct wanted *w)
{
    return engine_kind_of(w->ref->engine) - engine_table;
}

/* Plans all jobs; inputs have to be added before the first. */
static bool plan_jobs(struct planning *g, int argc, char **argv, int parts, struct plan *p,
                      struct err *e)
{
    const struct reference_command *c = g->c;
    const char *binary[NUM_ENGINES_WITH_GOLDENS] = {NULL};
    int threads = cli_rewrite_has_word(argc, argv, "-t", "--threads") ? c->opt.threads : 1;
    if (c->last > 0)
        return err_set(e, "--images: these are a job already");
    bool ok = plan_begin(p, c->out, "part.json", threads, e) &&
              reference_options_each(c, look_at_one, g, e) && add_words(p, argc, argv, threads, e);
    for (int k = 0; ok && k < NUM_ENGINES_WITH_GOLDENS; k++)
        for (int i = 0; ok && binary[k] == NULL && i < g->num; i++)
            if (index_of(&g->wanted[i]) == k)
                ok = engine_inputs(p, engine_names[k], c->opt.share_dir, &binary[k], e);
    json_object_set_new(p->head, "references", json_array());
    for (int i = 0; ok && i < g->num; i++) {
        const struct wanted *w = &g->wanted[i];
        ok = plan_one(p, w, jobs_of(w, parts, g->images), binary[index_of(w)], e);
    }
    return ok;
}

bool job_reference_plan(int argc, char **argv, const struct plan_wishes *w, struct plan *p,
                        struct err *e)
{
    struct reference_command c;
    struct planning g = {.c = &c};
    bool ok = reference_options_read(argc, argv, &c, e);
    if (ok)
        ok = c.help ? err_set(e, "--help cannot be planned")
                    : plan_jobs(&g, argc, argv, w->parts > 0 ? w->parts : PLAN_PARTS, p, e);
    free(g.wanted);
    reference_options_free(&c);
    return ok;
}

struct gathering {
    const struct plan *p;
    const struct reference_command *c;
    size_t used;
};

static const json_t *entry_of(const struct plan *p, const struct suite_scene *scene,
                              const struct suite_reference *ref)
{
    json_each(entry, json_object_get(p->head, "references"))
        if (strcmp(member_text(entry, "scene"), scene->name) == 0 &&
            strcmp(member_text(entry, "engine"), ref->engine) == 0)
            return entry;
    return NULL;
}

/* Paths of the artefacts of jobs first .. first+num-1, after verifying them; one block, to free(). NULL with a line. */
static const char **artefacts(const struct plan *p, int first, int num, struct err *e)
{
    if (first < 0 || num < 1 || num > p->num - first) {
        err_set(e, "%s/plan.jsonl: no such jobs of a reference", p->dir);
        return NULL;
    }
    const char **dir = malloc((size_t)num * (sizeof *dir + sizeof(struct path)));
    bool ok = dir != NULL || err_set(e, "out of memory");
    struct path *path = ok ? (struct path *)(void *)(dir + num) : NULL;
    for (int i = 0; ok && i < num; i++) {
        path[i] = job_run_artefact(p, first + i, NULL);
        dir[i] = path[i].s;
        ok = job_run_verify(p, first + i, e);
    }
    if (ok)
        return dir;
    free(dir);
    return NULL;
}

static bool gather_one(const struct gathering *g, const json_t *entry,
                       const struct suite_scene *scene, const struct suite_reference *ref,
                       struct err *e)
{
    struct reference_options opt = g->c->opt;
    struct moments m;
    json_t *manifest;
    int num = (int)member_number(entry, "jobs");
    opt.seed = (uint32_t)member_number(entry, "seed");
    const char **dir = artefacts(g->p, (int)member_number(entry, "job"), num, e);
    if (dir == NULL)
        return false;
    bool ok = reference_fold_parts(scene, ref, &opt, dir, num, &m, &manifest, e);
    free(dir);
    if (!ok)
        return false;
    if (strcmp(member_text(manifest, "binary_sha256"), member_text(entry, "binary_sha256")) != 0)
        ok = err_set(e, "%s, %s: rendered by another program than was planned with", scene->name,
                     ref->engine);
    ok = ok && reference_options_write(g->c, scene, ref, member_text(entry, "key"), &m, manifest,
                                       member_number(manifest, "wall_s"), e);
    moments_free(&m);
    json_decref(manifest);
    return ok;
}

static bool settle_one(void *ctx, const struct suite_scene *scene,
                       const struct suite_reference *ref, struct err *e)
{
    struct gathering *g = ctx;
    struct reference_state state;
    const json_t *entry = entry_of(g->p, scene, ref);
    if (entry != NULL) {
        g->used++;
        return gather_one(g, entry, scene, ref, e);
    }
    if (!reference_options_state(g->c, scene, ref, &state, e))
        return false;
    return state.there != NULL
               ? reference_options_keep(g->c, scene, ref, &state, e)
               : err_set(e, "%s, %s: was up to date when this was planned, and is not now",
                         scene->name, ref->engine);
}

/* Folds the images of all planned references and writes these; keeps the others, if still up to date. */
int job_reference_gather(const struct plan *p, int argc, char **argv, struct err *e)
{
    struct reference_command c;
    struct gathering g = {.p = p, .c = &c};
    bool ok =
        reference_options_read(argc, argv, &c, e) && reference_options_each(&c, settle_one, &g, e);
    if (ok && g.used != json_array_size(json_object_get(p->head, "references")))
        ok = err_set(e, "%s: has references that the suite no longer has", p->dir);
    reference_options_free(&c);
    return ok ? 0 : EXIT_NOT_JUDGED;
}
