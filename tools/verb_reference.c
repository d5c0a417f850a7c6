#include "../reference/reference.h"
#include "../renderer/cli.h"
#include "../renderer/fs.h"
#include "../renderer/progress.h"
#include "results.h"
#include "verbs.h"

#include <string.h>

enum { MAX_SCENES = 64 };

enum option {
    OPT_ONLY,
    OPT_ENGINE,
    OPT_OUT,
    OPT_GOLDEN,
    OPT_FRESH,
    OPT_SUITE,
    OPT_SHARE,
    OPT_WORK,
    OPT_SEED,
    OPT_THREADS,
    OPT_TIMEOUT,
    OPT_HELP
};

static const struct cli_option options[] = {
    [OPT_ONLY] = {0, "only", 1, "SCENE", "only this scene; may be given again"},
    [OPT_ENGINE] = {0, "engine", 1, "NAME", "only cycles, or only povray"},
    [OPT_OUT] = {'o', "out", 1, "DIR", "where they go (build/golden-candidate)"},
    [OPT_GOLDEN] = {0, "golden", 1, "DIR", "leave out what is stored there and up to date"},
    [OPT_FRESH] = {0, "fresh", 0, "", "render also what is there and up to date"},
    [OPT_SUITE] = {0, "suite", 1, "DIR", "the scenes (reference/scenes)"},
    [OPT_SHARE] = {0, "share", 1, "DIR", "where cycles.py is (reference)"},
    [OPT_WORK] = {0, "work", 1, "DIR", "temporary files (build/work)"},
    [OPT_SEED] = {0, "seed", 1, "N", "seed of all replicates (that of what is stored, else 1)"},
    [OPT_THREADS] = {'t', "threads", 1, "N", "0: one per processor (0)"},
    [OPT_TIMEOUT] = {0, "timeout", 1, "S", "seconds for one engine and scene (7200)"},
    [OPT_HELP] = {'h', "help", 0, "", "print this"},
    {0}};

struct settings {
    const char *only[MAX_SCENES], *engine, *out, *golden, *suite, *work;
    int num_only;
    struct reference_options opt;
    bool fresh, has_seed, done;
};

static bool parse(int argc, char **argv, struct settings *s, struct err *e)
{
    static const char *const engines[] = {"cycles", "povray", NULL};
    struct cli c = {.options = options, .argc = argc, .argv = argv, .next = 1};
    bool ok = true;
    for (int i; ok && (i = cli_next(&c, e)) != CLI_END;) {
        if (i == CLI_ERROR)
            return false;
        if (i == CLI_POSITIONAL)
            return err_set(e, "reference takes no argument '%s'", c.value[0]);
        const char *v = c.value[0];
        int n;
        switch ((enum option)i) {
        case OPT_ONLY:
            if (s->num_only == MAX_SCENES)
                return err_set(e, "--only: at most %d scenes", MAX_SCENES);
            s->only[s->num_only++] = v;
            break;
        case OPT_ENGINE:
            ok = cli_choice("--engine", v, engines, &n, e);
            s->engine = v;
            break;
        case OPT_OUT: s->out = v; break;
        case OPT_GOLDEN: s->golden = v; break;
        case OPT_FRESH: s->fresh = true; break;
        case OPT_SUITE: s->suite = v; break;
        case OPT_SHARE: s->opt.share_dir = v; break;
        case OPT_WORK: s->work = v; break;
        case OPT_SEED:
            ok = cli_int("--seed", v, 0, INT32_MAX, &n, e);
            s->opt.seed = ok ? (uint32_t)n : 0;
            s->has_seed = true;
            break;
        case OPT_THREADS: ok = cli_int("--threads", v, 0, 1024, &s->opt.threads, e); break;
        case OPT_TIMEOUT: ok = cli_double("--timeout", v, 1, 1e6, &s->opt.timeout_s, e); break;
        case OPT_HELP:
            puts("usage: assay reference [options]\n");
            cli_print_options(stdout, options);
            s->done = true;
            return true;
        }
    }
    return ok;
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
static uint32_t stored_seed(const struct settings *s, const struct suite_scene *scene,
                            const struct suite_reference *ref)
{
    struct golden g;
    golden_inspect(s->golden, scene, ref, &g);
    const json_t *seed = json_object_get(g.manifest, "seed");
    json_int_t n = json_is_integer(seed) ? json_integer_value(seed) : s->opt.seed;
    golden_free(&g);
    return n >= 0 && n <= UINT32_MAX ? (uint32_t)n : s->opt.seed;
}

static bool make_golden(const struct settings *s, const struct suite_scene *scene,
                        const struct suite_reference *ref, struct err *e)
{
    struct moments m;
    json_t *manifest;
    char key[65];
    double start = now_seconds();
    struct reference_options opt = s->opt;
    if (!s->has_seed && s->golden != NULL)
        opt.seed = stored_seed(s, scene, ref);
    if (!reference_key(scene, ref, &opt, key, e))
        return false;
    const char *there = NULL;
    if (!s->fresh && s->golden != NULL && is_up_to_date(s->golden, scene, ref, key))
        there = s->golden;
    bool has_candidate = !s->fresh && is_up_to_date(s->out, scene, ref, key);
    /* An older candidate must not be approved over what is stored by now. */
    if (there != NULL && !has_candidate && !golden_remove(s->out, scene->name, ref->engine, e))
        return false;
    if (there == NULL && has_candidate)
        there = s->out;
    if (there != NULL) {
        printf("%s/%s/%s.exr: up to date\n", there, scene->name, ref->engine);
        return true;
    }
    fprintf(stderr, "%s: rendering with %s\n", scene->name, ref->engine);
    if (!reference_render(scene, ref, &opt, &m, &manifest, e))
        return false;
    bool ok =
        json_object_set_new(manifest, "key", json_string(key)) == 0 || err_set(e, "out of memory");
    ok = ok && golden_write(s->out, scene->name, ref->engine, &m, manifest, e);
    if (ok)
        printf("%s/%s/%s.exr: %d x %d pixels, %g x %s, %.0f s\n", s->out, scene->name, ref->engine,
               m.width, m.height, m.n[0], m.unit, now_seconds() - start);
    moments_free(&m);
    json_decref(manifest);
    return ok;
}

static bool is_selected(const struct settings *s, const struct suite_scene *scene)
{
    if (strcmp(scene->references_of, scene->name) != 0)
        return false;
    for (int i = 0; i < s->num_only; i++)
        if (strcmp(s->only[i], scene->name) == 0)
            return true;
    return s->num_only == 0;
}

int verb_reference(int argc, char **argv, struct err *e)
{
    struct settings s = {.out = "build/golden-candidate",
                         .suite = "reference/scenes",
                         .work = "build/work",
                         .opt = {.seed = 1, .timeout_s = 7200, .share_dir = "reference"}};
    struct suite suite;
    if (!parse(argc, argv, &s, e))
        return EXIT_NOT_JUDGED;
    if (s.done)
        return 0;
    if (s.opt.threads == 0)
        s.opt.threads = cli_processors();
    s.opt.work_dir = s.work;
    if (!make_dirs(s.work, e) || !suite_load(s.suite, &suite, e))
        return EXIT_NOT_JUDGED;
    bool ok = true;
    for (int i = 0; ok && i < s.num_only; i++)
        ok = suite_find(&suite, s.only[i]) != NULL ||
             err_set(e, "no scene '%s' in %s", s.only[i], s.suite);
    int made = 0;
    for (int i = 0; ok && i < suite.num_scenes; i++) {
        const struct suite_scene *scene = &suite.scene[i];
        if (!is_selected(&s, scene))
            continue;
        for (int k = 0; ok && k < scene->num_references; k++) {
            const struct suite_reference *ref = &scene->reference[k];
            if (strcmp(ref->engine, "truth") == 0 ||
                (s.engine != NULL && strcmp(s.engine, ref->engine) != 0))
                continue;
            ok = make_golden(&s, scene, ref, e);
            made++;
        }
    }
    if (ok && made == 0)
        ok = err_set(e, "no scene of %s has such a reference", s.suite);
    suite_free(&suite);
    return ok ? 0 : EXIT_NOT_JUDGED;
}
