#include "reference_options.h"

#include "renderer/base/cli.h"
#include "renderer/base/fs.h"

#include <stdio.h>
#include <string.h>

enum option {
    OPT_ONLY,
    OPT_ENGINE,
    OPT_OUT,
    OPT_GOLDEN,
    OPT_FRESH,
    OPT_PICTURES,
    OPT_SUITE,
    OPT_SHARE,
    OPT_WORK,
    OPT_SEED,
    OPT_THREADS,
    OPT_TIMEOUT,
    OPT_SLURM,
    OPT_HELP
};

static const struct cli_option options[] = {
    [OPT_ONLY] = {0, "only", 1, "SCENE", "only this scene; may be given again"},
    [OPT_ENGINE] = {0, "engine", 1, "NAME",
                    "only one engine's, of" ENGINES_WITH_GOLDENS(ENGINE_TEXT)},
    [OPT_OUT] = {'o', "out", 1, "DIR", "where they go (build/golden-candidate)"},
    [OPT_GOLDEN] = {0, "golden", 1, "DIR", "leave out what is stored there and up to date"},
    [OPT_FRESH] = {0, "fresh", 0, "", "render also what is there and up to date"},
    [OPT_PICTURES] = {0, "pictures", 1, "A:B",
                      "of one reference, pictures A to B-1 alone, unfolded, into DIR: of\n"
                      "Cycles its replicates, of POV-Ray 32 windows without noise, then\n"
                      "its replicates; what a job of assay plan does"},
    [OPT_SUITE] = {0, "suite", 1, "DIR", "the scenes (reference/scenes)"},
    [OPT_SHARE] = {0, "share", 1, "DIR", "where cycles.py is (reference)"},
    [OPT_WORK] = {0, "work", 1, "DIR", "temporary files (build/work)"},
    [OPT_SEED] = {0, "seed", 1, "N", "seed of all replicates (that of what is stored, else 1)"},
    [OPT_THREADS] = {'t', "threads", 1, "N", "0: one per processor (0)"},
    [OPT_TIMEOUT] = {0, "timeout", 1, "S", "seconds for one engine and scene (7200)"},
    [OPT_SLURM] = {0, "slurm", 0, "", "jobs of some replicates each on a Slurm cluster"},
    [OPT_HELP] = {'h', "help", 0, "", "print this"},
    {0}};

static bool parse_range(const char *text, struct reference_command *c, struct err *e)
{
    const char *colon = strchr(text, ':');
    char first[16];
    if (colon == NULL || colon - text >= (long)sizeof first)
        return err_set(e, "--pictures: '%s' is not a range A:B", text);
    snprintf(first, sizeof first, "%.*s", (int)(colon - text), text);
    if (!cli_int("--pictures", first, 0, INT32_MAX - 1, &c->first, e) ||
        !cli_int("--pictures", colon + 1, 1, INT32_MAX, &c->last, e))
        return false;
    return c->first < c->last || err_set(e, "--pictures: no picture in '%s'", text);
}

static bool parse(int argc, char **argv, struct reference_command *c, struct err *e)
{
    struct cli cli = {.options = options, .argc = argc, .argv = argv, .next = 1};
    bool ok = true;
    for (int i; ok && (i = cli_next(&cli, e)) != CLI_END;) {
        if (i == CLI_ERROR)
            return false;
        if (i == CLI_POSITIONAL)
            return err_set(e, "reference takes no argument '%s'", cli.value[0]);
        const char *v = cli.value[0];
        int n;
        switch ((enum option)i) {
        case OPT_ONLY:
            if (c->num_only == REFERENCE_MOST_SCENES)
                return err_set(e, "--only: at most %d scenes", REFERENCE_MOST_SCENES);
            c->only[c->num_only++] = v;
            break;
        case OPT_ENGINE:
            ok = cli_choice("--engine", v, engine_names, &n, e);
            c->engine = v;
            break;
        case OPT_OUT: c->out = v; break;
        case OPT_GOLDEN: c->golden = v; break;
        case OPT_FRESH: c->fresh = true; break;
        case OPT_PICTURES: ok = parse_range(v, c, e); break;
        case OPT_SUITE: c->suite_dir = v; break;
        case OPT_SHARE: c->opt.share_dir = v; break;
        case OPT_WORK: c->work = v; break;
        case OPT_SEED:
            ok = cli_int("--seed", v, 0, INT32_MAX, &n, e);
            c->opt.seed = ok ? (uint32_t)n : 0;
            c->has_seed = true;
            break;
        case OPT_THREADS: ok = cli_int("--threads", v, 0, 1024, &c->opt.threads, e); break;
        case OPT_TIMEOUT: ok = cli_double("--timeout", v, 1, 1e6, &c->opt.timeout_s, e); break;
        case OPT_SLURM: c->slurm = true; break;
        case OPT_HELP:
            puts("usage: assay reference [options]\n");
            cli_print_options(stdout, options);
            c->help = true;
            return true;
        }
    }
    return ok;
}

bool reference_options_read(int argc, char **argv, struct reference_command *c, struct err *e)
{
    *c =
        (struct reference_command){.out = "build/golden-candidate",
                                   .suite_dir = "reference/scenes",
                                   .work = "build/work",
                                   .opt = {.seed = 1, .timeout_s = 7200, .share_dir = "reference"}};
    if (!parse(argc, argv, c, e))
        return false;
    if (c->help)
        return true;
    if (c->last > 0 && (c->slurm || c->fresh || c->golden != NULL))
        return err_set(e, "--pictures goes with none of --slurm, --fresh, --golden");
    if (c->opt.threads == 0)
        c->opt.threads = cli_processors();
    c->opt.work_dir = c->work;
    if (!fs_make_dirs(c->work, e) || !suite_load(c->suite_dir, &c->suite, e))
        return false;
    for (int i = 0; i < c->num_only; i++)
        if (suite_find(&c->suite, c->only[i]) == NULL)
            return err_set(e, "no scene '%s' in %s", c->only[i], c->suite_dir);
    return true;
}

void reference_options_free(struct reference_command *c)
{
    suite_free(&c->suite);
}

static bool is_selected(const struct reference_command *c, const struct suite_scene *scene)
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
        for (int k = 0; is_selected(c, scene) && k < scene->num_references; k++) {
            const struct suite_reference *ref = &scene->reference[k];
            if (strcmp(ref->engine, "truth") == 0 ||
                (c->engine != NULL && strcmp(c->engine, ref->engine) != 0))
                continue;
            if (!one(ctx, scene, ref, e))
                return false;
            num++;
        }
    }
    return num > 0 || err_set(e, "no scene of %s has such a reference", c->suite_dir);
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

/* What is stored was made with; otherwise a golden approved with another seed would never be up to date. */
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
    if (!c->has_seed && c->golden != NULL)
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
    /* An older candidate must not be approved over what is stored by now. */
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
    bool ok =
        json_object_set_new(manifest, "key", json_string(key)) == 0 || err_set(e, "out of memory");
    ok = ok && golden_write(c->out, scene->name, ref->engine, m, manifest, e);
    if (ok)
        printf("%s/%s/%s.exr: %d x %d pixels, %g x %s, %.0f s\n", c->out, scene->name, ref->engine,
               m->width, m->height, m->n[0], m->unit, seconds);
    return ok;
}
