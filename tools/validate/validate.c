#include "validate.h"

#include "reference/import_check/import_check.h"
#include "renderer/base/fs.h"
#include "renderer/base/parallel.h"
#include "renderer/base/progress.h"
#include "tools/results/claim_result.h"
#include "tools/results/results.h"
#include "noise_ladder.h"
#include "validate_internal.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The cost of starting a program and judging its image, in path vertices. */
static const double start_cost = 3e5;

/* Approximate cost of a claim's next look, in path vertices; 0: nothing has to be rendered. */
static double cost(const struct claim_run *t)
{
    const struct suite_scene *s = t->scene;
    double samples, starts = 1;
    if (t->of_noise) {
        samples = noise_claims_samples(s);
        starts = 2.0 * NOISE_RUNGS * NOISE_REPLICATES;
    } else if (t->a == NULL) {
        samples = (double)s->width * s->height * s->consistency.renders * s->consistency.spp;
        starts = s->consistency.renders + (s->consistency.batch > 0);
    } else {
        samples = side_cost(t->a, t->next) + side_cost(t->b, t->next);
    }
    return samples > 0 ? samples * (s->depth + 1) + starts * start_cost : 0;
}

/* Order of the looks. With a budget they go round by round, so that every claim gets its first look before any gets
 * its second, and within a round the cheapest comes first. A claim with a single look, which costs about as much as
 * the third look of others, comes before that round, or before the second if nothing is rendered for it.
 * --until-different goes by cost alone; a scene that must differ cannot end it, and comes last. */
static double round_of(const struct validation *v, const struct claim_run *t)
{
    if (v->opt->until_different)
        return t->scene->expect == VERDICT_DIFFERENT;
    if (t->looks == &alpha_spending_single)
        return cost(t) > 0 ? 1.5 : 0.5;
    return (double)json_array_size(t->history);
}

static struct claim_run *choose(const struct validation *v)
{
    struct claim_run *best = NULL;
    for (int i = 0; i < v->num_tasks; i++) {
        struct claim_run *t = &v->task[i];
        if (t->result != NULL || t->stalled)
            continue;
        if (v->sequence == &alpha_spending_single)
            return t;
        if (best == NULL || round_of(v, t) < round_of(v, best) ||
            (round_of(v, t) == round_of(v, best) && cost(t) < cost(best)))
            best = t;
    }
    return best;
}

static void tell_round(struct validation *v, const struct claim_run *t)
{
    char note[160];
    if (t->a == NULL || v->sequence == &alpha_spending_single)
        return;
    snprintf(note, sizeof note, "look %d of %d, %s against %s: %d samples; %d claims undecided",
             t->next + 1, NUM_LOOKS, t->a->name, t->ref.engine, side_count(t->a, t->next),
             v->num_tasks - v->done);
    validate_log(v, t->scene->name, note);
}

/* Collects the results of all claims; those that --until-different did not look at have none. */
static void collect(const struct validation *v, json_t *root)
{
    json_t *consistency = json_array(), *noise = json_array();
    json_object_set_new(root, "consistency", consistency);
    json_object_set_new(root, "noise", noise);
    for (int i = 0; i < v->num_tasks; i++) {
        const struct claim_run *t = &v->task[i];
        if (t->of_noise)
            json_array_extend(noise, t->result);
        else if (t->result != NULL)
            json_array_append(t->a != NULL ? json_object_get(root, "claims") : consistency,
                              t->result);
    }
    json_object_set_new(root, "seconds", json_real(progress_seconds() - v->start));
}

/* Shows the results so far, if due. */
static bool show_so_far(struct validation *v, const json_t *root, struct err *e)
{
    if (!(v->opt->show_every_s > 0) || progress_seconds() < v->shown + v->opt->show_every_s)
        return true;
    json_t *copy = json_copy((json_t *)root), *claims = json_array();
    bool ok = true;
    json_object_set_new(copy, "claims", claims);
    collect(v, copy);
    int left = v->num_tasks;
    for (int i = 0; i < v->num_tasks; i++)
        left -= v->task[i].result != NULL;
    if (left > 0 && json_array_size(claims) > 0) {
        json_object_set_new(copy, "unfinished", json_integer(left));
        json_object_set_new(copy, "page_every_s", json_real(v->opt->show_every_s));
        ok = v->opt->show(copy, v->opt, e);
    }
    json_decref(copy);
    v->shown = progress_seconds();
    return ok;
}

static const struct suite_scene *root_of(const struct validation *v, const struct claim_run *t)
{
    return suite_find(&v->suite, t->scene->references_of);
}

/* Takes looks scene by scene (together with scenes that share its references), until each has been begun by some
 * thread. */
static void take_scenes(void *ctx, size_t first, size_t last)
{
    struct validation *v = ctx;
    const struct suite_scene *root;
    (void)first;
    (void)last;
    do {
        root = NULL;
        pthread_mutex_lock(&v->lock);
        for (int i = 0; i < v->num_tasks; i++) {
            struct claim_run *t = &v->task[i];
            if (root == NULL && !t->begun)
                root = root_of(v, t);
            t->begun = t->begun || root_of(v, t) == root;
        }
        pthread_mutex_unlock(&v->lock);
        for (int i = 0; root != NULL && i < v->num_tasks; i++)
            if (root_of(v, &v->task[i]) == root)
                claim_run_look(v, &v->task[i]);
    } while (root != NULL);
}

/* Takes scenes side by side, each with a part of the threads, if the order is free and only our program runs: it
 * starts up and files are written single-threaded, which leaves processors idle. */
static void take_side_by_side(struct validation *v)
{
    enum { MOST = 8 };
    const struct validate_options *all = v->opt;
    struct validate_options part = *all;
    const int crew = all->threads < MOST ? all->threads : MOST;
    if (v->sequence != &alpha_spending_single || all->live || all->engine != NULL ||
        all->show_every_s > 0 || crew < 2)
        return;
    part.threads = all->threads / crew;
    v->opt = &part;
    parallel_for(crew, (size_t)crew, take_scenes, v);
    v->opt = all;
}

/* Takes looks until all is decided, the time is over, or, with --until-different, a claim differs; claims not
 * looked at by then stay without a result. */
static bool take_looks(struct validation *v, const json_t *root, struct err *e)
{
    bool found = false, ok = true;
    take_side_by_side(v);
    for (struct claim_run *t;
         ok && !found && (t = choose(v)) != NULL && validate_time_left(v) > 0;) {
        tell_round(v, t);
        claim_run_look(v, t);
        found = v->opt->until_different && claim_run_differs(t);
        ok = show_so_far(v, root, e);
    }
    for (int i = 0; i < v->num_tasks; i++) {
        struct claim_run *t = &v->task[i];
        if (t->result == NULL && (t->seen[0] != NULL || !found))
            claim_run_give_up(v, t,
                              found ? "stopped at the difference of another claim" : BUDGET_SPENT);
    }
    return ok;
}

static const double small_alpha = 1e-5; /* of a run; no tail is known well enough below it */

static const struct alpha_spending *sequence_of(const struct validate_options *o)
{
    if (o->budget_s > 0)
        return &alpha_spending_open;
    return o->until_different ? &alpha_spending_declared : &alpha_spending_single;
}

static int stages_of(const struct validate_options *o)
{
    return o->stages > 0 ? o->stages : o->alpha < small_alpha ? 2 : 1;
}

bool validate_start(const struct validate_options *o, int argc, char **argv, json_t **results,
                    struct err *e)
{
    *results = claim_result_new_results(argc, argv, o->alpha, e);
    json_object_update_new(*results, json_pack("{ss,so*,si,so*}", "mode",
                                               o->live ? "live" : "golden", "reference_seed",
                                               o->live ? json_integer(o->reference_seed) : NULL,
                                               "stages", stages_of(o), "budget_s",
                                               o->budget_s > 0 ? json_real(o->budget_s) : NULL));
    return *results != NULL;
}

static void validation_free(struct validation *v)
{
    for (int i = 0; i < v->num_tasks; i++)
        claim_run_free(&v->task[i]);
    for (int i = 0; v->sides != NULL && i < v->suite.num_scenes; i++) {
        struct scene_sides *s = &v->sides[i];
        side_free(&s->ours);
        side_free(&s->engine);
        side_free(&s->peer_ours);
        for (int k = 0; k < MAX_VARIANTS; k++)
            side_free(&s->variant[k]);
        for (int k = 0; k < MAX_REFERENCES; k++)
            side_free(&s->reference[k]), side_free(&s->peer[k]);
    }
    json_decref(v->left_out);
    free(v->task);
    free(v->sides);
    suite_free(&v->suite);
}

/* Compares our loader with Blender's on each selected scene. */
static bool check_loader(const struct validation *v, json_t *root, struct err *e)
{
    const struct import_options io = {.work_dir = v->opt->out_dir,
                                      .share_dir = v->opt->share_dir,
                                      .timeout_s = v->opt->timeout_s};
    json_t *loader;
    /* NOLINTNEXTLINE(bugprone-sizeof-expression): an array of pointers it is. */
    const struct suite_scene **scene = malloc((size_t)v->suite.num_scenes * sizeof *scene);
    int num = 0;
    for (int i = 0; scene != NULL && i < v->suite.num_scenes; i++)
        if (scene_is_selected(v->opt, v->suite.scene[i].name))
            scene[num++] = &v->suite.scene[i];
    bool ok = (scene != NULL || err_set(e, "out of memory")) &&
              import_check(scene, num, &io, &loader, e) &&
              json_object_set_new(root, "loader", loader) == 0;
    free(scene);
    return ok;
}

static json_t *filter_sentence(const struct validation *v)
{
    char filter[PIXEL_FILTER_TEXT], left_out[256] = "";
    const json_t *count;
    const char *name;
    json_object_foreach(v->left_out, name, count)
        snprintf(
            left_out + strlen(left_out), sizeof left_out - strlen(left_out), "%s%s in %d scenes",
            left_out[0] != '\0' ? ", " : "; left out, as known for the box of one pixel alone: ",
            name, (int)json_integer_value(count));
    pixel_filter_print(&v->opt->engine->filter, filter);
    return json_sprintf("%s has the pixel filter %s, and so has what it is held against%s",
                        v->opt->engine->name, filter, left_out);
}

/* Prints which folders are used. */
static void tell_where(const struct validation *v)
{
    const struct validate_options *o = v->opt;
    char suite[PATH_MAX + 1], golden[PATH_MAX + 1];
    if (o->quiet)
        return;
    fprintf(stderr, "suite %s (%d scene%s), goldens %s%s%s\n",
            realpath(o->suite_dir, suite) != NULL ? suite : o->suite_dir, v->suite.num_scenes,
            v->suite.num_scenes > 1 ? "s" : "",
            realpath(o->golden_dir, golden) != NULL ? golden : o->golden_dir,
            o->engine != NULL ? ", engine " : "", o->engine != NULL ? o->engine->file : "");
}

/* Adds to the results what is known before the first look. */
static void describe(const struct validation *v, json_t *cannot, json_t *root)
{
    const struct engine *en = v->opt->engine;
    if (en != NULL)
        json_object_set(root, "not_expressible", cannot);
    if (en != NULL && en->margin_global > 0)
        json_object_set_new(root, "engine_margin",
                            json_pack("{ss,sf,sf,ss}", "engine", en->name, "global",
                                      en->margin_global, "tile", en->margin_tile, "reason",
                                      en->margin_reason));
    if (v->left_out != NULL)
        json_object_set_new(root, "engine_filter", filter_sentence(v));
}

bool validate(const struct validate_options *opt, int argc, char **argv, json_t **results,
              struct err *e)
{
    struct validation v = {.opt = opt,
                           .start = progress_seconds(),
                           .shown = progress_seconds(),
                           .sequence = sequence_of(opt),
                           .lock = PTHREAD_MUTEX_INITIALIZER};
    json_t *root = NULL, *cannot = json_array();
    v.deadline = opt->budget_s > 0 ? v.start + opt->budget_s : INFINITY;
    v.stages = stages_of(opt);
    bool ok = suite_load(opt->suite_dir, &v.suite, e) && fs_make_dirs(opt->out_dir, e) &&
              select_claims(&v, cannot, e);
    if (ok) {
        tell_where(&v);
        /* Bonferroni over the claims of this run: one alpha for the whole family. */
        v.alpha = opt->alpha / (opt->of_claims > 0 ? opt->of_claims : v.num_tasks);
        ok = validate_start(opt, argc, argv, &root, e);
        describe(&v, cannot, root);
    }
    ok = ok && (!opt->live || check_loader(&v, root, e)) && take_looks(&v, root, e);
    if (ok) {
        collect(&v, root);
        *results = json_incref(root);
    }
    json_decref(root);
    json_decref(cannot);
    validation_free(&v);
    return ok;
}

/* Tasks first .. last-1, which are of one scene. */
static bool call_part(const struct validation *v, int first, int last, bool by_claim,
                      bool (*part)(void *ctx, const struct validate_part *part, struct err *e),
                      void *ctx, struct err *e)
{
    char name[MAX_CLAIMS][CLAIM_NAME];
    const char *only[MAX_CLAIMS];
    struct validate_part p = {
        .scene = v->task[first].scene, .only = only, .num_claims = v->num_tasks};
    if (!by_claim && scene_is_selected_whole(v->opt, p.scene->name))
        only[p.num_only++] = p.scene->name;
    else
        for (int i = first; i < last; i++, p.num_only++) {
            claim_run_name(&v->task[i], name[p.num_only]);
            only[p.num_only] = name[p.num_only];
        }
    return part(ctx, &p, e);
}

bool validate_parts(const struct validate_options *opt, bool by_claim,
                    bool (*part)(void *ctx, const struct validate_part *part, struct err *e),
                    void *ctx, struct err *e)
{
    struct validation v = {.opt = opt, .sequence = sequence_of(opt), .stages = stages_of(opt)};
    json_t *cannot = json_array();
    bool ok = suite_load(opt->suite_dir, &v.suite, e) && fs_make_dirs(opt->out_dir, e) &&
              select_claims(&v, cannot, e);
    for (int i = 0, end; ok && i < v.num_tasks; i = end) {
        for (end = i + 1; !by_claim && end < v.num_tasks && v.task[end].scene == v.task[i].scene;)
            end++;
        ok = call_part(&v, i, end, by_claim, part, ctx, e);
    }
    json_decref(cannot);
    validation_free(&v);
    return ok;
}
