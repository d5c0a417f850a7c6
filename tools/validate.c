#include "validate.h"

#include "../renderer/fs.h"
#include "../renderer/progress.h"
#include "claim.h"
#include "consistency_run.h"
#include "import_lines.h"
#include "results.h"
#include "validate_parts.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool is_selected(const struct validate_options *o, const char *name)
{
    for (int i = 0; i < o->num_only; i++)
        if (strcmp(o->only[i], name) == 0)
            return true;
    return o->num_only == 0;
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
