#include "reference_options.h"

#include "reference/suite/suite_own.h"
#include "renderer/base/cli.h"
#include "renderer/base/fs.h"

#include <stdio.h>
#include <string.h>

#define TO(member) CLI_TO(struct reference_command, member)

static const struct cli_option options[] = {
    {0, "only", "SCENE", "render only this scene; repeatable",
     CLI_TO_LIST(struct reference_command, only, num_only), .noun = "scenes"},
    {0, "engine", "NAME|FILE",
     "render only this engine's references, one of" ENGINES_WITH_GOLDENS(
         ENGINE_TEXT) ";\n"
                      "with --noise also pathtracer, pathtracer-sobol; FILE.json: any\n"
                      "renderer, for the reference --as NAME of a suite.json",
     TO(engine)},
    {0, "as", "NAME",
     "with --engine FILE.json: the reference that it renders (the one named\n"
     "like the engine, or like the engine with -VERSION)",
     TO(as)},
    {0, "noise", "",
     "instead of references, measure the noise of each engine, ours too:\n"
     "variance per sample, and its decrease over 1, 4, 16, 64 samples",
     TO(noise)},
    {'o', "out", "DIR", "output directory (build/golden-candidate)", TO(out)},
    {0, "golden", "DIR", "skip references that are stored in DIR and up to date", TO(golden)},
    {0, "fresh", "", "also render references that exist and are up to date", TO(fresh)},
    {0, "images", "A:B",
     "render only images A to B-1 of one reference, and do not combine\n"
     "them: for Cycles its replicates; for POV-Ray 32 noise-free windows,\n"
     "then its replicates. Used by the jobs of assay plan",
     CLI_TO_RANGE(struct reference_command, first), 0, INT32_MAX, .noun = "image"},
    {0, "suite", "DIR",
     "directory of scenes (current directory if it has a suite.json, else\n"
     "reference/scenes)",
     TO(suite_dir)},
    {0, "share", "DIR", "directory of cycles.py (reference)", TO(opt.share_dir)},
    {0, "work", "DIR", "directory for temporary files (build/work)", TO(work)},
    {0, "seed", "N", "seed of all replicates (that of the stored reference, else 1)", TO(seed), 0,
     INT32_MAX},
    {'t', "threads", "N", "number of threads; 0: one per processor (0)", TO(opt.threads), 0, 1024},
    {0, "timeout", "S", "time limit for each engine and scene, seconds (7200)", TO(opt.timeout_s),
     1, 1e6},
    {0, "slurm", "", "run jobs of several replicates each on a Slurm cluster", TO(slurm)},
    {'q', "quiet", "", "print only what was made", TO(quiet)},
    {'h', "help", "", "print this", TO(help),
     .usage =
         "usage: assay golden render [options]\n"
         "       assay reference [options]         the same\n\n"
         "Renders references with Cycles, POV-Ray or your own renderer, as candidates for golden approve.\n"},
    {0}};

/* Sets c->as to the reference that the described engine makes: --as NAME, else the one that is called as the
 * engine, else the only one called ENGINE-VERSION. */
static bool choose_name(struct reference_command *c, struct err *e)
{
    const char *name = c->described.name;
    char list[512] = "";
    size_t n = strlen(name);
    bool exact = false, ambiguous = false;
    const char *found = NULL;
    for (int i = 0; i < c->suite.num_scenes; i++)
        for (int k = 0; k < c->suite.scene[i].num_references; k++) {
            const char *r = c->suite.scene[i].reference[k].engine;
            if (c->as != NULL ? strcmp(r, c->as) == 0 : strcmp(r, name) == 0) {
                exact = true;
                found = r;
            }
            if (!exact && c->as == NULL && strncmp(r, name, n) == 0 && r[n] == '-') {
                ambiguous |= found != NULL && strcmp(found, r) != 0;
                found = r;
            }
            if (strstr(list, r) == NULL)
                snprintf(list + strlen(list), sizeof list - strlen(list), " %s", r);
        }
    if (found == NULL || (ambiguous && !exact))
        return err_set(e, "%s: is it one of%s, the references of %s/suite.json? give --as NAME",
                       c->as != NULL ? c->as : name, list, c->suite_dir);
    c->as = found;
    return true;
}

bool reference_options_read(int argc, char **argv, struct reference_command *c, struct err *e)
{
    *c = (struct reference_command){.out = "build/golden-candidate",
                                    .suite_dir = suite_own_is(".") ? "." : "reference/scenes",
                                    .work = "build/work",
                                    .seed = -1,
                                    .opt = {.timeout_s = 7200, .share_dir = "reference"}};
    if (!cli_read(options, argc, argv, c, e))
        return false;
    if (c->help)
        return true;
    bool ours = c->noise && c->engine != NULL && strncmp(c->engine, "pathtracer", 10) == 0;
    const bool file = c->engine != NULL && strpbrk(c->engine, "./") != NULL;
    if (c->as != NULL && !file)
        return err_set(e, "--as is for --engine FILE.json");
    if (file && (c->noise || c->last > 0 || c->slurm))
        return err_set(e, "--engine FILE.json goes with none of --noise, --images, --slurm");
    if (file && !engine_load(c->engine, &c->described, e))
        return false;
    if (c->engine != NULL && engine_with_goldens(c->engine) == NULL && !ours && !file)
        return err_set(e, "--engine: '%s' is none of" ENGINES_WITH_GOLDENS(ENGINE_TEXT), c->engine);
    if (c->noise && (c->last > 0 || c->slurm))
        return err_set(e, "--noise goes with neither --images nor --slurm");
    if (c->last > 0 && (c->slurm || c->fresh || c->golden != NULL))
        return err_set(e, "--images goes with none of --slurm, --fresh, --golden");
    if (c->opt.threads == 0)
        c->opt.threads = cli_processors();
    c->opt.seed = c->seed < 0 ? 1 : (uint32_t)c->seed;
    c->opt.work_dir = c->work;
    if (!fs_make_dirs(c->work, e) || !suite_load(c->suite_dir, &c->suite, e))
        return false;
    for (int i = 0; i < c->num_only; i++)
        if (suite_find(&c->suite, c->only[i]) == NULL)
            return err_set(e, "no scene '%s' in %s", c->only[i], c->suite_dir);
    if (!file)
        return true;
    if (!c->suite.is_own)
        return err_set(e, "--engine FILE.json renders references of a suite.json, which %s has not",
                       c->suite_dir);
    return choose_name(c, e);
}

void reference_options_free(struct reference_command *c)
{
    engine_free(&c->described);
    suite_free(&c->suite);
}

bool reference_options_selects(const struct reference_command *c, const struct suite_scene *scene)
{
    if (strcmp(scene->references_of, scene->name) != 0)
        return false;
    for (int i = 0; i < c->num_only; i++)
        if (strcmp(c->only[i], scene->name) == 0)
            return true;
    return c->num_only == 0;
}

bool reference_options_each(const struct reference_command *c,
                            bool (*one)(void *ctx, const struct suite_scene *scene,
                                        const struct suite_reference *ref, struct err *e),
                            void *ctx, struct err *e)
{
    int num = 0;
    for (int i = 0; i < c->suite.num_scenes; i++) {
        const struct suite_scene *scene = &c->suite.scene[i];
        for (int k = 0; reference_options_selects(c, scene) && k < scene->num_references; k++) {
            const struct suite_reference *ref = &scene->reference[k];
            if (!reference_is_rendered(ref) ||
                (c->as != NULL       ? strcmp(c->as, ref->engine) != 0
                 : c->engine != NULL ? strcmp(c->engine, ref->engine) != 0
                                     : engine_with_goldens(ref->engine) == NULL))
                continue;
            if (!one(ctx, scene, ref, e))
                return false;
            num++;
        }
    }
    return num > 0 || err_set(e, "no scene of %s has such a reference%s", c->suite_dir,
                              c->suite.is_own && c->as == NULL
                                  ? " (of an engine of your own: --engine FILE.json)"
                                  : "");
}

static bool is_up_to_date(const char *dir, const struct suite_scene *scene,
                          const struct suite_reference *ref, const char *key)
{
    struct golden g;
    golden_inspect(dir, scene, ref, &g);
    const char *has = json_string_value(json_object_get(g.manifest, "key"));
    bool same = g.state == GOLDEN_CURRENT && has != NULL && strcmp(has, key) == 0;
    golden_free(&g);
    return same;
}

/* The seed of the stored reference, if any: with another default, one approved with its own seed would never be up to
 * date. */
static uint32_t stored_seed(const struct reference_command *c, const struct suite_scene *scene,
                            const struct suite_reference *ref)
{
    struct golden g;
    golden_inspect(c->golden, scene, ref, &g);
    const json_t *seed = json_object_get(g.manifest, "seed");
    json_int_t n = json_is_integer(seed) ? json_integer_value(seed) : c->opt.seed;
    golden_free(&g);
    return n >= 0 && n <= UINT32_MAX ? (uint32_t)n : c->opt.seed;
}

bool reference_options_state(const struct reference_command *c, const struct suite_scene *scene,
                             const struct suite_reference *ref, struct reference_state *out,
                             struct err *e)
{
    *out = (struct reference_state){.opt = c->opt};
    if (c->seed < 0 && c->golden != NULL)
        out->opt.seed = stored_seed(c, scene, ref);
    if (!reference_key(scene, ref, &out->opt, out->key, e))
        return false;
    if (!c->fresh && c->golden != NULL && is_up_to_date(c->golden, scene, ref, out->key))
        out->there = c->golden;
    else if (!c->fresh && is_up_to_date(c->out, scene, ref, out->key))
        out->there = c->out;
    return true;
}

bool reference_options_keep(const struct reference_command *c, const struct suite_scene *scene,
                            const struct suite_reference *ref, const struct reference_state *state,
                            struct err *e)
{
    /* An outdated candidate must not be approved over a stored reference that is up to date. */
    if (state->there == c->golden && !is_up_to_date(c->out, scene, ref, state->key) &&
        !golden_remove(c->out, scene->name, ref->engine, e))
        return false;
    printf("%s/%s/%s.exr: up to date\n", state->there, scene->name, ref->engine);
    return true;
}

bool reference_options_write(const struct reference_command *c, const struct suite_scene *scene,
                             const struct suite_reference *ref, const char *key,
                             const struct moments *m, json_t *manifest, double seconds,
                             struct err *e)
{
    json_object_set_new(manifest, "key", json_string(key));
    bool ok = golden_write(c->out, scene->name, ref->engine, m, manifest, e);
    if (ok)
        printf("%s/%s/%s.exr: %d x %d pixels, %g x %s, %.0f s\n", c->out, scene->name, ref->engine,
               m->width, m->height, m->n[0], m->unit, seconds);
    return ok;
}
