/* Takes one look at a claim, decides it, and writes its row of results.json with the maps (z,
 * relative). */
#include "validate_internal.h"
#include "renderer/base/fs.h"
#include "tools/base/data_dirs.h"

#include "tools/compare/hint.h"
#include "tools/compare/variance_ratio.h"
#include "tools/results/claim_result.h"
#include "tools/results/noise_results.h"
#include "tools/results/stated_error_results.h"
#include "tools/results/results.h"
#include "tools/stats/pair_noise.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Appends an option and its value, which may be NULL; takes ownership of it. */
static void add_option(json_t *words, const char *option, json_t *value)
{
    json_array_append_new(words, json_string(option));
    if (value != NULL)
        json_array_append_new(words, value);
}

/* Appends a path option, unless the path is the default. */
static void add_place(json_t *words, const char *option, const char *place, struct path found)
{
    if (place != NULL && strcmp(place, found.s) != 0)
        add_option(words, option, json_string(place));
}

/* What of an alpha is left for images of fresh seeds, or was for pairs. */
static double alpha_left(const struct claim_run *t, double alpha)
{
    return t->tried_pairs ? alpha / 2 : alpha;
}

/* The command that judges this claim alone with the alpha that it has here, to free(); NULL: out of memory. */
static char *rerun_command(const struct validation *v, const struct claim_run *t)
{
    const struct validate_options *o = v->opt;
    const struct data_dirs at = data_dirs_find();
    char name[CLAIM_NAME];
    claim_run_name(t, name);
    /* The stages of the whole run: the claim's share of alpha alone might ask for two. */
    const bool fresh = t->seeds == SEEDS_FRESH;
    json_t *w = json_pack("[s,s,s,s,o,s,o,s,o]", "validate", "--only", name, "--alpha",
                          json_sprintf("%.6g", fresh ? alpha_left(t, v->alpha) : v->alpha),
                          "--stages", json_sprintf("%d", v->stages), "--seed",
                          json_sprintf("%llu", (unsigned long long)o->seed));
    if (o->live)
        add_option(w, "--live", NULL);
    if (o->live || (o->engine != NULL && fresh))
        add_option(w, "--reference-seed", json_sprintf("%u", o->reference_seed));
    if (o->engine != NULL)
        add_option(w, "--engine", json_string(o->engine->file));
    if (o->engine_spp > 0)
        add_option(w, "--engine-spp", json_sprintf("%d", o->engine_spp));
    if (o->engine_replicates > 0)
        add_option(w, "--engine-replicates", json_sprintf("%d", o->engine_replicates));
    if (o->budget_s > 0)
        add_option(w, "--budget", json_sprintf("%gs", o->budget_s));
    else if (v->sequence != &alpha_spending_single)
        add_option(w, "--until-different", NULL);
    side_add_places(v, true, w);
    add_place(w, "--share", o->share_dir, at.share);
    add_place(w, "--pathtracer", o->pathtracer, at.pathtracer);
    char *command = json_command_line("assay", w);
    json_decref(w);
    return command;
}

static struct compare_options options_of(const struct claim_run *t, double alpha)
{
    return (struct compare_options){.alpha = alpha_left(t, alpha),
                                    .margin_global = t->ref.margin_global,
                                    .margin_tile = t->ref.margin_tile,
                                    .margin_variance = t->ref.margin_variance,
                                    .tile = t->scene->tile};
}

static struct claim_context context(const struct validation *v, const struct claim_run *t,
                                    const char *rerun)
{
    double share = t->looks->share[t->seen[0] != NULL ? t->look : LOOK_DECLARED];
    return (struct claim_context){.scene = t->scene,
                                  .a = t->a->name,
                                  .b = t->ref.engine,
                                  .fidelity = t->ref.fidelity,
                                  .expected = t->expected,
                                  .rerun = rerun,
                                  .opt = options_of(t, v->alpha * share)};
}

static bool write_maps(const struct validation *v, const struct claim_run *t, json_t *files,
                       struct err *e)
{
    static const char *const kind[2] = {"z", "rel"};
    const struct image *map[2] = {&t->c.z, &t->c.relative};
    for (int k = 0; k < 2; k++) {
        char file[256];
        snprintf(file, sizeof file, "data/%s/%s_%s_%s.exr", t->scene->name, kind[k], t->a->name,
                 t->ref.engine);
        if (!image_write_exr(fs_path("%s/%s", v->opt->out_dir, file).s, map[k], e))
            return false;
        json_object_set_new(files, k == 0 ? "z" : "relative", json_string(file));
    }
    return true;
}

/* renewal: of side_renewal(), or NULL. */
static void add_provenance(json_t *claim, const struct validation *v, const struct claim_run *t,
                           json_t *renewal)
{
    const struct side_image *a = t->seen[0], *b = t->seen[1];
    claim_result_add_observations(claim, "a", &a->m);
    claim_result_add_observations(claim, "b", &b->m);
    json_object_set_new(claim, "seconds_a", json_real(a->seconds));
    json_object_set_new(claim, "seconds_b", json_real(b->seconds));
    if (a->rays.rays > 0)
        json_object_set_new(claim, "rays_a",
                            json_pack("{s:f, s:f, s:f}", "rays", a->rays.rays, "box_tests",
                                      a->rays.box_tests, "primitive_tests",
                                      a->rays.primitive_tests));
    if (a->manifest == NULL)
        json_object_set_new(claim, "seed_a", json_integer((json_int_t)v->opt->seed));
    if (!pair_noise_is_unknown(&a->m, &b->m))
        json_object_set_new(claim, "noise_share_a", json_real(pair_noise_share(&a->m, &b->m)));
    const char *version_a = member_or_empty(a->manifest, "version");
    if (version_a[0] != '\0' && strcmp(version_a, ENGINE_VERSION_UNKNOWN) != 0)
        json_object_set_new(claim, "version_a", json_string(version_a));
    json_t *version = json_object_get(b->manifest, "version");
    json_t *seeds = json_object_get(b->manifest, "seeds");
    if (t->seeds != SEEDS_FRESH || t->again.differs)
        json_object_set_new(claim, "same_bits", json_boolean(t->seeds == SEEDS_SAME_BITS));
    if (t->tried_pairs)
        json_object_set_new(claim, "paired", json_boolean(t->seeds == SEEDS_PAIRED));
    if (version != NULL)
        json_object_set(claim, "version_b", version);
    if (seeds != NULL)
        json_object_set(claim, "seeds_b", seeds);
    if (renewal != NULL)
        json_object_set(claim, "renew", renewal);
}

static json_t *files_of(const struct validation *v, const struct claim_run *t, struct err *e)
{
    struct path a, b;
    if (!side_write(v, t->a, t->stage, t->look, &a, e) ||
        !side_write(v, t->b, t->stage, t->look, &b, e))
        return NULL;
    json_t *files = json_pack("{s:s, s:s}", "a", a.s, "b", b.s);
    if (files == NULL || !write_maps(v, t, files, e)) {
        json_decref(files);
        return NULL;
    }
    return files;
}

/* Frees a side after its last claim, unless it is a closed form, which the claim of noise may need, too. */
static void release(struct side *s)
{
    if (--s->users == 0 && s->kind != SIDE_TRUTH)
        side_free(s);
}

/* Adds the looks, what they spent of alpha, and the CPU time of both sides. */
static void add_looks(json_t *claim, const struct validation *v, const struct claim_run *t)
{
    double spent = 0;
    for (size_t i = 0; i < json_array_size(t->history); i++)
        spent += member_number(json_array_get(t->history, i), "alpha");
    json_object_set(claim, "looks", t->history);
    json_object_set_new(claim, "stages", json_integer(t->stages));
    json_object_set_new(claim, "alpha_claim", json_real(v->alpha));
    json_object_set_new(claim, "alpha_spent", json_real(spent));
    json_object_set_new(claim, "cost_s", json_pack("{sf,sf}", "a", t->cpu_a, "b", t->cpu_b));
}

/* The row to announce: of several the first that did not pass, else the first. */
static const json_t *row_to_tell(const json_t *result)
{
    for (size_t i = 0; i < json_array_size(result); i++)
        if (!json_is_true(json_object_get(json_array_get(result, i), "passed")))
            return json_array_get(result, i);
    return json_is_array(result) ? json_array_get(result, 0) : result;
}

static void announce(struct validation *v, struct claim_run *t)
{
    const json_t *told = row_to_tell(t->result);
    const char *verdict = member_text(told, "verdict"), *error = member_text(told, "error");
    char line[1024];
    pthread_mutex_lock(&v->lock);
    v->done++;
    for (int i = 0; error != NULL && i < v->num_tasks; i++) {
        const json_t *other = v->task[i].result;
        if (v->task[i].told &&
            json_equal(json_object_get(other, "error"), json_object_get(t->result, "error")))
            error = "not judged, for the reason above";
    }
    t->told = true;
    pthread_mutex_unlock(&v->lock);
    if (t->a != NULL)
        snprintf(line, sizeof line, "%s against %s: %s", t->a->name, t->ref.engine,
                 error != NULL ? error : verdict);
    else
        snprintf(line, sizeof line, "%s: %s", t->of_noise ? "noise" : "stated errors",
                 error != NULL ? error : verdict);
    validate_log(v, t->scene->name, line);
    if (t->a != NULL) {
        release(t->a);
        release(t->b);
    }
}

/* Ends the claim with the verdict of its last look; why, unless NULL, is put before its reason. */
static void finish(struct validation *v, struct claim_run *t, const char *why)
{
    char *rerun = rerun_command(v, t), reason[512];
    struct err e = {""};
    struct claim_context c = context(v, t, rerun);
    json_t *files = files_of(v, t, &e), *renewal = NULL;
    if (files != NULL && rerun != NULL &&
        (t->b->kind != SIDE_GOLDEN || side_renewal(v, t->b, t->seen[1]->manifest, &renewal)))
        t->result = claim_result_judged(&c, &t->c);
    if (t->result != NULL) {
        json_object_set(t->result, "files", files);
        add_provenance(t->result, v, t, renewal);
        if (why != NULL) {
            snprintf(reason, sizeof reason, "%s; %s", why, t->c.reason);
            json_object_set_new(t->result, "reason", json_string(reason));
        }
        if (t->a->kind == SIDE_ENGINE && t->scene->convention[0] != '\0') {
            char more[1200];
            snprintf(more, sizeof more, "%s; a convention, not an error, if this is all: %s",
                     member_text(t->result, "reason"), t->scene->convention);
            if (t->c.verdict == VERDICT_DIFFERENT)
                json_object_set_new(t->result, "reason", json_string(more));
        }
    } else {
        t->result = claim_result_not_judged(&c, e.msg[0] ? e.msg : "out of memory");
    }
    json_decref(files);
    json_decref(renewal);
    free(rerun);
    add_looks(t->result, v, t);
    announce(v, t);
}

static void finish_unseen(struct validation *v, struct claim_run *t, const char *error,
                          bool no_time)
{
    char *rerun = rerun_command(v, t);
    struct claim_context c = context(v, t, rerun);
    t->result = claim_result_not_judged(&c, rerun != NULL ? error : "out of memory");
    if (no_time)
        json_object_set_new(t->result, "verdict", json_string(verdict_name(VERDICT_INCONCLUSIVE)));
    free(rerun);
    add_looks(t->result, v, t);
    announce(v, t);
}

struct pair {
    struct validation *v;
    struct claim_run *t;
    bool no_time;
    struct side_image *image[2]; /* of the last stage */
    /* If a side is a single image without known noise: copies of both, with noise estimated from A - B. */
    bool is_estimated;
    struct moments estimated[2];
};

static void pair_free(struct pair *p)
{
    moments_free(&p->estimated[0]);
    moments_free(&p->estimated[1]);
}

static bool one_of(struct pair *p, struct side *s, int stage, struct side_image **image,
                   struct err *e)
{
    switch (side_at(p->v, s, stage, p->t->next, image)) {
    case FETCH_OK: return true;
    case FETCH_FAILED: *e = s->e; return false;
    case FETCH_NO_TIME: p->no_time = true; break;
    }
    return err_set(e, "the budget is spent");
}

static bool both_of(void *ctx, int stage, const struct moments **a, const struct moments **b,
                    struct err *e)
{
    struct pair *p = ctx;
    /* A stored reference first: if there is none, nothing is rendered in vain. */
    const int first = p->t->b->kind == SIDE_GOLDEN ? 1 : 0;
    struct side *const side[2] = {p->t->a, p->t->b};
    if (!one_of(p, side[first], stage, &p->image[first], e) ||
        !one_of(p, side[!first], stage, &p->image[!first], e))
        return false;
    *a = &p->image[0]->m;
    *b = &p->image[1]->m;
    if (!pair_noise_is_unknown(*a, *b))
        return true;
    pair_free(p);
    p->is_estimated = true;
    if (!pair_noise_estimate(*a, *b, p->estimated, e))
        return false;
    *a = &p->estimated[0];
    *b = &p->estimated[1];
    return true;
}

/* Below this share of our noise, more samples of ours gain nothing against a stored reference. */
static const double least_noise_share = 0.1;

static void look(struct validation *v, struct claim_run *t)
{
    struct pair p = {.v = v, .t = t};
    struct compare_options opt = options_of(t, v->alpha);
    struct comparison c;
    struct err e = {""};
    int stage = 0;
    double before_a = t->a->cpu_s, before_b = t->b->cpu_s;
    struct side *const first = t->a;
    bool ok = t->seen[0] == NULL && repeated_seeds_judge(v, t, &opt, p.image, &c);
    if (!ok) {
        opt = options_of(t, v->alpha);
        ok = alpha_spending_judge(t->looks, t->next, t->stages, &opt, both_of, &p, &c, &stage, &e);
    }
    if (ok && t->seeds == SEEDS_FRESH &&
        !hint_add(p.is_estimated ? &p.estimated[0] : &p.image[0]->m,
                  p.is_estimated ? &p.estimated[1] : &p.image[1]->m, 1, &c, &e)) {
        comparison_free(&c);
        ok = false;
    }
    pair_free(&p);
    t->cpu_a += t->a->cpu_s - (t->a == first ? before_a : 0);
    t->cpu_b += t->b->cpu_s - before_b;
    if (!ok && p.no_time) {
        t->stalled = true;
        return;
    }
    if (!ok) {
        if (p.image[0] != NULL && p.image[1] != NULL)
            variance_ratio_advise(&p.image[0]->m, &p.image[1]->m,
                                  v->opt->engine != NULL ? "give another --reference-seed"
                                                         : "give another --seed",
                                  &e);
        finish_unseen(v, t, e.msg, false);
        return;
    }
    comparison_free(&t->c);
    t->c = c;
    t->stage = stage;
    t->look = t->next++;
    memcpy(t->seen, p.image, sizeof t->seen);
    const double alpha = t->seeds == SEEDS_PAIRED ? v->alpha / 2 : v->alpha;
    json_array_append_new(t->history,
                          json_pack("{sf,sf,sf,si,ss}", "n_a", p.image[0]->m.n[0], "n_b",
                                    p.image[1]->m.n[0], "alpha", alpha * t->looks->share[t->look],
                                    "stage", stage + 1, "verdict", verdict_name(c.verdict)));
    claim_next_look(t);
    if (verdict_decides(c.verdict))
        finish(v, t, NULL);
    else if (t->next == NUM_LOOKS)
        finish(v, t, t->looks == &alpha_spending_single ? NULL : "all looks are taken");
    else if (t->look >= LOOK_DECLARED && t->b->kind == SIDE_GOLDEN &&
             pair_noise_share(&t->seen[0]->m, &t->seen[1]->m) < least_noise_share)
        finish(v, t, "the noise left is that of the stored reference");
}

/* Judges a claim that renders for itself: stated errors or noise. */
static void judge_alone(struct validation *v, struct claim_run *t, double deadline)
{
    const struct scene_sides *s = &v->sides[t->scene - v->suite.scene];
    const struct moments *truth = NULL;
    for (int k = 0; k < t->scene->num_references; k++)
        if (s->reference[k].kind == SIDE_TRUTH && s->reference[k].at[0][0].present)
            truth = &s->reference[k].at[0][0].m;
    t->result = t->of_noise ? noise_claims_run(v->opt, t->scene, truth, v->alpha, deadline)
                            : stated_error_run(v->opt, t->scene, v->alpha, deadline);
    announce(v, t);
}

void claim_run_look(struct validation *v, struct claim_run *t)
{
    if (t->a != NULL) {
        look(v, t);
        return;
    }
    validate_log(v, t->scene->name, "rendering with seeds of their own");
    judge_alone(v, t, v->deadline);
}

void claim_run_give_up(struct validation *v, struct claim_run *t, const char *why)
{
    if (t->a == NULL)
        judge_alone(v, t, 0);
    else if (t->seen[0] != NULL)
        finish(v, t, why);
    else
        finish_unseen(v, t, BUDGET_SPENT " before a first look was possible", true);
}

bool claim_run_differs(const struct claim_run *t)
{
    if (t->result == NULL)
        return false;
    for (size_t i = 0; i < json_array_size(t->result); i++)
        if (results_row_outcome(json_array_get(t->result, i)) == OUTCOME_OPPOSITE)
            return true;
    if (t->of_noise)
        return false;
    if (t->a == NULL)
        return results_row_outcome(t->result) == OUTCOME_OPPOSITE;
    const char *verdict = member_text(t->result, "verdict");
    return verdict != NULL && strcmp(verdict, verdict_name(VERDICT_DIFFERENT)) == 0 &&
           results_claim_outcome(t->result) == OUTCOME_OPPOSITE;
}
