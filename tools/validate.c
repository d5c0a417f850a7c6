#include "validate.h"

#include "../reference/process.h"
#include "../reference/reference.h"
#include "../reference/truth.h"
#include "../renderer/fs.h"
#include "../renderer/progress.h"
#include "claim.h"
#include "consistency_run.h"
#include "import_lines.h"
#include "ours.h"
#include "results.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_PATH = 8192 };

enum { MAX_REFERENCES = 3 };

/* One side of a claim: an image, how it came to be, or why there is none. */
struct side {
    struct moments m;
    json_t *manifest; /* of a reference; NULL for ours */
    double seconds;
    bool tried, present;
    struct err e;
};

struct validation {
    const struct validate_options *opt;
    struct suite suite;
    const struct suite_scene **order;         /* in which scenes are judged */
    struct side (*reference)[MAX_REFERENCES]; /* per scene: 9x scenes share those of another */
    json_t *claims, *consistency;
    bool *engine_can; /* per scene: the further engine can express it */
    double alpha;     /* of one claim */
    int num_claims, done;
};

static void side_free(struct side *s)
{
    moments_free(&s->m);
    json_decref(s->manifest);
    *s = (struct side){0};
}

static bool is_selected(const struct validate_options *o, const char *name)
{
    for (int i = 0; i < o->num_only; i++)
        if (strcmp(o->only[i], name) == 0)
            return true;
    return o->num_only == 0;
}

/* Ours against each reference; each engine against the closed form, where there is one: the probes
 * that show the engine to be set up right; and a further engine against all of these and ours. */
static int count_claims(const struct validation *v, const struct suite_scene *s)
{
    bool has_truth = suite_reference_of(s, "truth") != NULL;
    return s->num_references + (has_truth ? s->num_references - 1 : 0) +
           (v->engine_can[s - v->suite.scene] ? s->num_references + 1 : 0) + s->num_variants +
           (s->consistency.renders > 0);
}

static void data_path(const struct validation *v, char *path, const char *scene, const char *file)
{
    snprintf(path, MAX_PATH, "%s/data/%s/%s", v->opt->out_dir, scene, file);
}

static void say(const struct validation *v, const char *scene, const char *what)
{
    if (!v->opt->quiet)
        fprintf(stderr, "[%2d/%d] %s: %s\n", v->done, v->num_claims, scene, what);
}

static void render_ours(const struct validation *v, const struct suite_scene *s, const char *name,
                        const struct suite_variant *variant, struct side *out)
{
    char path[MAX_PATH], log[MAX_PATH], file[96];
    snprintf(file, sizeof file, "%s.exr", name);
    data_path(v, path, s->name, file);
    snprintf(file, sizeof file, "%s.log", name);
    data_path(v, log, s->name, file);
    const struct ours_job job = {.program = v->opt->pathtracer,
                                 .scene = s,
                                 .spp = variant != NULL ? variant->spp : s->spp,
                                 .seed = v->opt->seed,
                                 .options = variant != NULL ? variant->options : NULL,
                                 .threads = v->opt->threads,
                                 .timeout_s = v->opt->timeout_s,
                                 .picture = path,
                                 .log = log};
    char note[128];
    snprintf(note, sizeof note, "rendering with %s", name);
    say(v, s->name, note);
    *out = (struct side){0};
    out->present =
        make_parent_dirs(path, &out->e) && ours_render(&job, &out->m, &out->seconds, &out->e);
}

static bool load_reference(const struct validation *v, const struct suite_scene *s,
                           const struct suite_reference *ref, struct side *out)
{
    const struct validate_options *o = v->opt;
    if (strcmp(ref->engine, "truth") == 0)
        return truth_render(s, ref, &out->m, &out->e);
    if (!o->live)
        return golden_read(o->golden_dir, s, ref, &out->m, &out->manifest, &out->e);
    const struct reference_options ro = {.seed = o->reference_seed,
                                         .threads = o->threads,
                                         .timeout_s = o->timeout_s,
                                         .work_dir = o->out_dir,
                                         .share_dir = o->share_dir};
    char note[64];
    snprintf(note, sizeof note, "rendering with %s", ref->engine);
    say(v, s->name, note);
    return reference_render(s, ref, &ro, &out->m, &out->manifest, &out->e);
}

/* The image of one reference of scene s, also as a file for the report. Each is made once a run. */
static const struct side *get_reference(struct validation *v, const struct suite_scene *s, int i)
{
    const struct suite_reference *ref = &s->reference[i];
    struct side *out = &v->reference[s - v->suite.scene][i];
    if (out->tried)
        return out;
    char path[MAX_PATH], file[64];
    out->tried = true;
    snprintf(file, sizeof file, "%s.exr", ref->engine);
    data_path(v, path, s->name, file);
    if (!load_reference(v, s, ref, out))
        return out;
    out->seconds = json_number_value(json_object_get(out->manifest, "cpu_s"));
    out->present =
        make_parent_dirs(path, &out->e) && moments_write(path, &out->m, NULL, 0, &out->e);
    return out;
}

static bool write_maps(const struct validation *v, const char *scene, const char *a, const char *b,
                       const struct comparison *r, json_t *files, struct err *e)
{
    static const char *const kind[2] = {"z", "rel"};
    const struct image *map[2] = {&r->z, &r->relative};
    for (int k = 0; k < 2; k++) {
        char path[MAX_PATH], file[128], relative[256];
        snprintf(file, sizeof file, "%s_%s_%s.exr", kind[k], a, b);
        data_path(v, path, scene, file);
        if (!image_write_exr(path, map[k], e))
            return false;
        snprintf(relative, sizeof relative, "data/%s/%s", scene, file);
        json_object_set_new(files, k == 0 ? "z" : "relative", json_string(relative));
    }
    return true;
}

static json_t *files_of(const char *scene_a, const char *a, const char *scene_b, const char *b)
{
    char path_a[256], path_b[256];
    snprintf(path_a, sizeof path_a, "data/%s/%s.exr", scene_a, a);
    snprintf(path_b, sizeof path_b, "data/%s/%s.exr", scene_b, b);
    return json_pack("{s:s, s:s}", "a", path_a, "b", path_b);
}

static void add_provenance(json_t *claim, const struct validation *v, const struct side *a,
                           const struct side *b)
{
    claim_add_observations(claim, "a", &a->m);
    claim_add_observations(claim, "b", &b->m);
    json_object_set_new(claim, "seconds_a", json_real(a->seconds));
    json_object_set_new(claim, "seconds_b", json_real(b->seconds));
    if (a->manifest == NULL)
        json_object_set_new(claim, "seed_a", json_integer((json_int_t)v->opt->seed));
    json_t *version = json_object_get(b->manifest, "version");
    json_t *seeds = json_object_get(b->manifest, "seeds");
    if (version != NULL)
        json_object_set(claim, "version_b", version);
    if (seeds != NULL)
        json_object_set(claim, "seeds_b", seeds);
}

/* Judges a (of scene s) against b (of scene `from`) and appends the claim. */
static void judge(struct validation *v, const struct suite_scene *s, const struct suite_scene *from,
                  const char *a_name, const struct side *a, const struct suite_reference *ref,
                  const struct side *b)
{
    /* Of this scene alone, and yet with the same alpha for each of its claims. */
    char rerun[8192], live[64] = "", engine[4200] = "";
    if (v->opt->live)
        snprintf(live, sizeof live, " --live --reference-seed %u", v->opt->reference_seed);
    if (v->opt->engine != NULL && !v->opt->live)
        snprintf(live, sizeof live, " --reference-seed %u", v->opt->reference_seed);
    if (v->opt->engine != NULL)
        snprintf(engine, sizeof engine, " --engine %s --engine-spp %d --engine-replicates %d",
                 v->opt->engine->file, v->opt->engine_spp, v->opt->engine_replicates);
    snprintf(rerun, sizeof rerun, "assay validate --only %s --alpha %.6g --seed %llu%s%s", s->name,
             v->alpha * count_claims(v, s), (unsigned long long)v->opt->seed, live, engine);
    struct claim_context c = {.scene = s,
                              .a = a_name,
                              .b = ref->engine,
                              .fidelity = ref->fidelity,
                              .expected = strcmp(ref->engine, "pathtracer") == 0
                                              ? VERDICT_EQUIVALENT /* of the same scene, also 9x */
                                              : s->expect,
                              .rerun = rerun,
                              .opt = {.alpha = v->alpha,
                                      .margin_global = ref->margin_global,
                                      .margin_tile = ref->margin_tile,
                                      .tile = s->tile}};
    struct comparison r;
    struct err e = {0};
    json_t *claim = NULL;
    v->done++;
    if (!a->present || !b->present) {
        e = a->present ? b->e : a->e;
    } else if (compare_moments(&a->m, &b->m, &c.opt, &r, &e)) {
        json_t *files = files_of(s->name, a_name, from->name, ref->engine);
        if (files != NULL && write_maps(v, s->name, a_name, ref->engine, &r, files, &e))
            claim = claim_judged(&c, &r);
        if (claim != NULL) {
            json_object_set(claim, "files", files);
            add_provenance(claim, v, a, b);
        }
        json_decref(files);
        comparison_free(&r);
    }
    if (claim == NULL)
        claim = claim_not_judged(&c, e.msg[0] ? e.msg : "out of memory");
    say(v, s->name,
        json_string_value(json_object_get(claim, "verdict"))
            ? json_string_value(json_object_get(claim, "verdict"))
            : e.msg);
    json_array_append_new(v->claims, claim);
}

static void render_engine(const struct validation *v, const struct suite_scene *s, struct side *out)
{
    const struct validate_options *o = v->opt;
    const struct engine_options eo = {.spp = o->engine_spp,
                                      .replicates = o->engine_replicates,
                                      .seed = o->reference_seed,
                                      .threads = o->threads,
                                      .timeout_s = o->timeout_s,
                                      .work_dir = o->out_dir};
    char path[MAX_PATH], manifest[MAX_PATH], file[64];
    *out = (struct side){0};
    snprintf(file, sizeof file, "%s.exr", o->engine->name);
    data_path(v, path, s->name, file);
    snprintf(file, sizeof file, "%s.json", o->engine->name);
    data_path(v, manifest, s->name, file);
    snprintf(file, sizeof file, "rendering with %s", o->engine->name);
    say(v, s->name, file);
    if (!engine_render(o->engine, s, &eo, &out->m, &out->manifest, &out->e))
        return;
    out->seconds = json_number_value(json_object_get(out->manifest, "cpu_s"));
    out->present = make_parent_dirs(path, &out->e) &&
                   moments_write(path, &out->m, NULL, 0, &out->e) &&
                   json_write(manifest, out->manifest, &out->e);
}

/* Against all references, inside their margins, and against ours inside the widest of them. */
static void judge_engine(struct validation *v, const struct suite_scene *s,
                         const struct suite_scene *from, const struct side *ours)
{
    struct suite_reference self = {.engine = "pathtracer", .fidelity = "exact"};
    struct side engine;
    render_engine(v, s, &engine);
    for (int i = 0; i < s->num_references; i++) {
        const struct suite_reference *ref = &s->reference[i];
        judge(v, s, from, v->opt->engine->name, &engine, ref, get_reference(v, from, i));
        self.margin_global = fmax(self.margin_global, ref->margin_global);
        self.margin_tile = fmax(self.margin_tile, ref->margin_tile);
    }
    judge(v, s, s, v->opt->engine->name, &engine, &self, ours);
    side_free(&engine);
}

/* Our other ways to the same picture, against the closed form or else the first reference. */
static void judge_variants(struct validation *v, const struct suite_scene *s,
                           const struct suite_scene *from)
{
    const struct suite_reference *truth = suite_reference_of(s, "truth");
    int against = truth != NULL ? (int)(truth - s->reference) : 0;
    for (int i = 0; i < s->num_variants; i++) {
        struct side ours;
        struct suite_reference ref = s->reference[against];
        ref.margin_global = s->variant[i].margin_global;
        ref.margin_tile = s->variant[i].margin_tile;
        render_ours(v, s, s->variant[i].name, &s->variant[i], &ours);
        judge(v, s, from, s->variant[i].name, &ours, &ref, get_reference(v, from, against));
        side_free(&ours);
    }
}

static void judge_consistency(struct validation *v, const struct suite_scene *s)
{
    if (s->consistency.renders == 0)
        return;
    say(v, s->name, "rendering with seeds of their own");
    v->done++;
    json_t *c = consistency_run(v->opt, s, v->alpha);
    const char *error = member_text(c, "error");
    say(v, s->name, error != NULL ? error : member_text(c, "verdict"));
    json_array_append_new(v->consistency, c);
}

static void validate_scene(struct validation *v, const struct suite_scene *s)
{
    const struct suite_scene *from = suite_find(&v->suite, s->references_of);
    const struct side *truth_side = NULL;
    const struct suite_reference *truth = suite_reference_of(s, "truth");
    struct side ours;
    render_ours(v, s, "pathtracer", NULL, &ours);
    for (int i = 0; i < s->num_references; i++) {
        const struct side *reference = get_reference(v, from, i);
        if (&s->reference[i] == truth)
            truth_side = reference;
        judge(v, s, from, "pathtracer", &ours, &s->reference[i], reference);
    }
    for (int i = 0; truth != NULL && i < s->num_references; i++)
        if (&s->reference[i] != truth)
            judge(v, s, from, s->reference[i].engine, get_reference(v, from, i), truth, truth_side);
    if (v->engine_can[s - v->suite.scene])
        judge_engine(v, s, from, &ours);
    side_free(&ours);
    judge_variants(v, s, from);
    judge_consistency(v, s);
}

static bool check_selection(const struct validation *v, struct err *e)
{
    for (int i = 0; i < v->opt->num_only; i++)
        if (suite_find(&v->suite, v->opt->only[i]) == NULL)
            return err_set(e, "no scene '%s' in %s", v->opt->only[i], v->opt->suite_dir);
    return true;
}

static bool differs_unexpectedly(const struct validation *v)
{
    for (size_t i = 0; i < json_array_size(v->claims); i++) {
        const json_t *c = json_array_get(v->claims, i);
        const char *verdict = member_text(c, "verdict");
        if (verdict != NULL && strcmp(verdict, verdict_name(VERDICT_DIFFERENT)) == 0 &&
            claim_outcome(c) == OUTCOME_OPPOSITE)
            return true;
    }
    for (size_t i = 0; i < json_array_size(v->consistency); i++)
        if (consistency_outcome(json_array_get(v->consistency, i)) == OUTCOME_OPPOSITE)
            return true;
    return false;
}

/* Samples are what a scene of the suite costs, about. */
static int by_cost(const void *a, const void *b)
{
    const struct suite_scene *s = *(const struct suite_scene *const *)a;
    const struct suite_scene *t = *(const struct suite_scene *const *)b;
    double x = (double)s->width * s->height * s->spp, y = (double)t->width * t->height * t->spp;
    return x != y ? (x > y) - (x < y) : strcmp(s->name, t->name);
}

static bool order_scenes(struct validation *v, struct err *e)
{
    v->order = calloc((size_t)v->suite.num_scenes, sizeof(const struct suite_scene *));
    if (v->order == NULL)
        return err_set(e, "out of memory");
    for (int i = 0; i < v->suite.num_scenes; i++)
        v->order[i] = &v->suite.scene[i];
    if (v->opt->until_different)
        qsort(v->order, (size_t)v->suite.num_scenes, sizeof(const struct suite_scene *), by_cost);
    return true;
}

/* Which of the selected scenes the further engine can express; appends the others to `cannot`. */
static bool ask_engine(struct validation *v, json_t *cannot, struct err *e)
{
    const struct validate_options *o = v->opt;
    int num_can = 0;
    if (o->engine == NULL)
        return true;
    for (int i = 0; i < v->suite.num_scenes; i++) {
        const struct suite_scene *s = &v->suite.scene[i];
        if (!is_selected(o, s->name))
            continue;
        v->engine_can[i] = engine_expresses(o->engine, s, o->out_dir, e);
        num_can += v->engine_can[i];
        if (!v->engine_can[i])
            json_array_append_new(cannot, json_pack("{ss,ss,ss}", "scene", s->name, "engine",
                                                    o->engine->name, "reason", e->msg));
    }
    if (num_can == 0)
        return err_prefix(e, "%s can express none of the scenes, of the last because",
                          o->engine->name);
    e->msg[0] = '\0';
    return true;
}

bool validate(const struct validate_options *opt, int argc, char **argv, json_t **results,
              struct err *e)
{
    struct validation v = {.opt = opt};
    json_t *root = NULL, *cannot = json_array();
    double start = now_seconds();
    if (!suite_load(opt->suite_dir, &v.suite, e)) {
        json_decref(cannot);
        return false;
    }
    bool ok = check_selection(&v, e) && order_scenes(&v, e) && make_dirs(opt->out_dir, e);
    if (!ok)
        goto done;
    v.reference = calloc((size_t)v.suite.num_scenes, sizeof *v.reference);
    v.engine_can = calloc((size_t)v.suite.num_scenes, sizeof *v.engine_can);
    if (v.reference == NULL || v.engine_can == NULL || cannot == NULL) {
        ok = err_set(e, "out of memory");
        goto done;
    }
    ok = ask_engine(&v, cannot, e);
    if (!ok)
        goto done;
    for (int i = 0; i < v.suite.num_scenes; i++)
        if (is_selected(opt, v.suite.scene[i].name))
            v.num_claims += count_claims(&v, &v.suite.scene[i]);
    /* Bonferroni over the claims of this run: one alpha for the whole family. */
    v.alpha = opt->alpha / v.num_claims;
    root = results_new(argc, argv, opt->alpha);
    if (root == NULL) {
        ok = err_set(e, "out of memory");
        goto done;
    }
    v.claims = json_object_get(root, "claims");
    v.consistency = json_array();
    json_object_set_new(root, "consistency", v.consistency);
    if (opt->engine != NULL)
        json_object_set(root, "not_expressible", cannot);
    json_object_set_new(root, "mode", json_string(opt->live ? "live" : "golden"));
    if (opt->live)
        json_object_set_new(root, "reference_seed", json_integer(opt->reference_seed));
    if (opt->live) {
        /* The loader is not believed either. */
        const struct import_options io = {
            .work_dir = opt->out_dir, .share_dir = opt->share_dir, .timeout_s = opt->timeout_s};
        json_t *loader;
        ok = import_check_suite(&v.suite, opt->only, opt->num_only, &io, &loader, e);
        if (!ok)
            goto done;
        json_object_set_new(root, "loader", loader);
    }
    for (int i = 0; i < v.suite.num_scenes; i++)
        if (is_selected(opt, v.order[i]->name)) {
            validate_scene(&v, v.order[i]);
            if (opt->until_different && differs_unexpectedly(&v))
                break;
        }
    json_object_set_new(root, "seconds", json_real(now_seconds() - start));
    *results = root;
    root = NULL;
done:
    json_decref(root);
    json_decref(cannot);
    for (int i = 0; v.reference != NULL && i < v.suite.num_scenes; i++)
        for (int k = 0; k < MAX_REFERENCES; k++)
            side_free(&v.reference[i][k]);
    free(v.reference);
    free(v.order);
    free(v.engine_can);
    suite_free(&v.suite);
    return ok;
}
