/* The claims of a run: of every scene all pairs of sides, variants, stated errors and noise, without
 * those that --only excludes. */
#include "noise_ladder.h"
#include "validate_internal.h"

#include "reference/external/engine_bindings.h"
#include "reference/store/reference_render.h"
#include "reference/truth/truth.h"
#include "tools/base/text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Is it SCENE or SCENE/CLAIM? */
static bool is_of_scene(const char *only, const char *scene)
{
    size_t n = strcspn(only, "/");
    return strlen(scene) == n && strncmp(only, scene, n) == 0;
}

bool scene_is_selected(const struct validate_options *o, const char *name)
{
    for (int i = 0; i < o->num_only; i++)
        if (is_of_scene(o->only[i], name))
            return true;
    return o->num_only == 0;
}

bool scene_is_selected_whole(const struct validate_options *o, const char *name)
{
    for (int i = 0; i < o->num_only; i++)
        if (strcmp(o->only[i], name) == 0)
            return true;
    return o->num_only == 0;
}

void claim_run_name(const struct claim_run *t, char name[CLAIM_NAME])
{
    if (t->a == NULL)
        snprintf(name, CLAIM_NAME, "%s/%s", t->scene->name, t->of_noise ? "noise" : "consistency");
    else if (t->a->kind == SIDE_OURS)
        snprintf(name, CLAIM_NAME, "%s/%s", t->scene->name,
                 t->a->variant != NULL ? t->a->name : t->ref.engine);
    else
        snprintf(name, CLAIM_NAME, "%s/%s:%s", t->scene->name, t->a->name, t->ref.engine);
}

static bool check_scenes(const struct validation *v, struct err *e)
{
    for (int i = 0; i < v->opt->num_only; i++) {
        int k = 0;
        while (k < v->suite.num_scenes && !is_of_scene(v->opt->only[i], v->suite.scene[k].name))
            k++;
        if (k == v->suite.num_scenes)
            return err_set(e, "no scene '%.*s' in %s", (int)strcspn(v->opt->only[i], "/"),
                           v->opt->only[i], v->opt->suite_dir);
    }
    return true;
}

/* Checks that each SCENE/CLAIM of --only is one of the tasks, which still are all of those scenes. */
static bool check_claims(const struct validation *v, struct err *e)
{
    for (int i = 0; i < v->opt->num_only; i++) {
        const char *only = v->opt->only[i];
        char name[CLAIM_NAME], names[sizeof e->msg] = "";
        bool found = strchr(only, '/') == NULL;
        for (int k = 0; k < v->num_tasks && !found; k++) {
            if (!is_of_scene(only, v->task[k].scene->name))
                continue;
            claim_run_name(&v->task[k], name);
            found = strcmp(name, only) == 0;
            text_append(names, sizeof names, "%s%s", names[0] != '\0' ? ", " : "",
                        strchr(name, '/') + 1);
        }
        if (!found)
            return err_set(e, "--only: no claim '%s'; there are %s", only, names);
    }
    return true;
}

/* Removes the tasks that --only does not name. */
static void keep_selected(struct validation *v)
{
    int kept = 0;
    for (int k = 0; k < v->num_tasks; k++) {
        struct claim_run *t = &v->task[k];
        char name[CLAIM_NAME];
        bool keep = scene_is_selected_whole(v->opt, t->scene->name);
        claim_run_name(t, name);
        for (int i = 0; i < v->opt->num_only && !keep; i++)
            keep = strcmp(v->opt->only[i], name) == 0;
        if (keep) {
            v->task[kept++] = *t;
            continue;
        }
        if (t->a != NULL) {
            t->a->users--;
            t->b->users--;
        }
        claim_run_free(t);
    }
    v->num_tasks = kept;
}

/* Sets can[i] for the selected scenes that the other engine can express; appends the others to `cannot`. */
static bool ask_engine(const struct validation *v, bool *can, json_t *cannot, struct err *e)
{
    const struct validate_options *o = v->opt;
    int num_can = 0;
    if (o->engine == NULL)
        return true;
    for (int i = 0; i < v->suite.num_scenes; i++) {
        const struct suite_scene *s = &v->suite.scene[i];
        if (!scene_is_selected(o, s->name))
            continue;
        can[i] = engine_expresses(o->engine, s, o->out_dir, e);
        num_can += can[i];
        if (!can[i])
            json_array_append_new(cannot, json_pack("{ss,ss,ss}", "scene", s->name, "engine",
                                                    o->engine->name, "reason", e->msg));
    }
    if (num_can == 0 && o->of_claims == 0) /* the larger run has other scenes */
        return err_prefix(e, "%s can express none of the scenes, of the last because",
                          o->engine->name);
    e->msg[0] = '\0';
    return true;
}

static enum side_kind kind_of(const struct validation *v, const struct suite_reference *ref)
{
    return strcmp(ref->engine, "truth") == 0        ? SIDE_TRUTH
           : strcmp(ref->engine, "pathtracer") == 0 ? SIDE_OURS
           : v->opt->live                           ? SIDE_LIVE
                                                    : SIDE_GOLDEN;
}

/* Is the reference available with the scene's pixel filter? Else why may say the reason. */
static bool is_filtered(const struct validation *v, const struct suite_scene *s,
                        const struct suite_reference *ref, struct err *why)
{
    switch (kind_of(v, ref)) {
    case SIDE_TRUTH: return truth_knows(s, ref, why);
    case SIDE_LIVE: {
        const struct reference_options ro = {.work_dir = v->opt->out_dir};
        return reference_is_expressible(s, ref, &ro, why);
    }
    case SIDE_OURS:
    case SIDE_ENGINE: return true;
    case SIDE_GOLDEN: break;
    }
    /* Goldens of Cycles and POV-Ray have the box of one pixel; those of others name their filter, which make() in
     * claim_side.c checks. */
    return engine_driver_of(ref->engine) == NULL;
}

/* Sets up what the engine with a filter is compared with, for all scenes, so that every part of a run reports the
 * same. */
static void init_peers(struct validation *v)
{
    v->left_out = json_object();
    for (int i = 0; i < v->suite.num_scenes; i++) {
        struct scene_sides *own = &v->sides[i];
        const struct suite_scene *s = &v->suite.scene[i];
        own->filtered = *s;
        own->filtered.filter = v->opt->engine->filter;
        own->peer_ours = own->ours;
        own->peer_ours.scene = &own->filtered;
        for (int k = 0; k < s->num_references; k++) {
            const char *name = s->reference[k].engine;
            struct err why;
            own->peer[k] = own->reference[k];
            if (is_filtered(v, &own->filtered, &s->reference[k], &why)) {
                own->peer[k].scene = &own->filtered;
                continue;
            }
            own->peer[k].scene = NULL;
            json_object_set_new(
                v->left_out, name,
                json_integer(1 + json_integer_value(json_object_get(v->left_out, name))));
        }
    }
}

static void init_sides(struct validation *v)
{
    for (int i = 0; i < v->suite.num_scenes; i++) {
        const struct suite_scene *s = &v->suite.scene[i];
        struct scene_sides *own = &v->sides[i];
        own->ours = (struct side){.kind = SIDE_OURS, .name = "pathtracer", .scene = s};
        if (v->opt->engine != NULL)
            own->engine =
                (struct side){.kind = SIDE_ENGINE, .name = v->opt->engine->name, .scene = s};
        for (int k = 0; k < s->num_variants; k++)
            own->variant[k] = (struct side){.kind = SIDE_OURS,
                                            .name = s->variant[k].name,
                                            .scene = s,
                                            .variant = &s->variant[k]};
        for (int k = 0; k < s->num_references; k++) {
            const struct suite_reference *ref = &s->reference[k];
            own->reference[k] =
                (struct side){.kind = kind_of(v, ref), .name = ref->engine, .scene = s, .ref = ref};
        }
    }
}

/* Counts depend on the scene file and the options alone, so the looks are fixed beforehand. */
void claim_next_look(struct claim_run *t)
{
    for (; t->next < NUM_LOOKS; t->next++) {
        if (t->looks->share[t->next] == 0)
            continue;
        int a = side_count(t->a, t->next), b = side_count(t->b, t->next);
        bool is_new =
            t->seen[0] == NULL || a != side_count(t->a, t->look) || b != side_count(t->b, t->look);
        if (a > 0 && b > 0 && is_new)
            return;
    }
}

/* The run's looks, if one side can grow and the other has an image at any look; else a single one. */
static const struct alpha_spending *looks_of(const struct validation *v, const struct side *a,
                                             const struct side *b)
{
    bool grows = side_grows(a) || side_grows(b);
    return grows && side_is_at_any_look(a) && side_is_at_any_look(b) ? v->sequence
                                                                     : &alpha_spending_single;
}

static void add_task(struct validation *v, const struct suite_scene *s, struct side *a,
                     struct side *b, const struct suite_reference *ref, enum verdict expected)
{
    struct claim_run *t = &v->task[v->num_tasks++];
    const struct engine *en = v->opt->engine;
    bool widens = a->kind == SIDE_ENGINE && expected == VERDICT_EQUIVALENT;
    /* A program that renders a single image without seeds gives the same again. */
    bool same_again = a->kind == SIDE_ENGINE && en->output == OUTPUT_NOISY;
    bool can_be_fresh = side_can_be_fresh(a) && side_can_be_fresh(b) && !same_again;
    *t = (struct claim_run){.scene = s,
                            .a = a,
                            .b = b,
                            .ref = *ref,
                            .expected = expected,
                            .looks = looks_of(v, a, b),
                            .stages = can_be_fresh ? v->stages : 1,
                            .history = json_array()};
    if (widens) {
        t->ref.margin_global = fmax(t->ref.margin_global, en->margin_global);
        t->ref.margin_tile = fmax(t->ref.margin_tile, en->margin_tile);
    }
    a->users++;
    b->users++;
    claim_next_look(t);
}

/* The other engine against each reference and, of our suite, against ours. */
static void add_engine(struct validation *v, const struct suite_scene *s)
{
    struct scene_sides *own = &v->sides[s - v->suite.scene];
    struct scene_sides *theirs =
        &v->sides[suite_find(&v->suite, s->references_of) - v->suite.scene];
    const bool is_filtered = v->opt->engine->filter.radius > 0;
    struct side *peer = is_filtered ? theirs->peer : theirs->reference;
    struct suite_reference self = {.engine = "pathtracer", .fidelity = "exact"};
    for (int i = 0; i < s->num_references; i++) {
        const struct suite_reference *ref = &s->reference[i];
        if (peer[i].scene != NULL)
            add_task(v, s, &own->engine, &peer[i], ref, s->expect);
        /* Against ours the widest margins of any reference hold. */
        self.margin_global = fmax(self.margin_global, ref->margin_global);
        self.margin_tile = fmax(self.margin_tile, ref->margin_tile);
    }
    if (!v->suite.is_own) /* ours renders the same scene: equal in scenes 9x, too */
        add_task(v, s, &own->engine, is_filtered ? &own->peer_ours : &own->ours, &self,
                 VERDICT_EQUIVALENT);
}

/* Adds a scene's tasks in the order of the results: our renderer against each reference; each engine against the closed
 * form, if there is one (probes that the engine is set up right); our variants; stated errors; noise. */
static void add_scene(struct validation *v, const struct suite_scene *s, bool of_noise)
{
    struct scene_sides *own = &v->sides[s - v->suite.scene];
    struct side *from = v->sides[suite_find(&v->suite, s->references_of) - v->suite.scene].reference;
    const struct suite_reference *truth = suite_reference_of(s, "truth");
    const int t = truth != NULL ? (int)(truth - s->reference) : 0;
    for (int i = 0; i < s->num_references; i++)
        add_task(v, s, &own->ours, &from[i], &s->reference[i], s->expect);
    for (int i = 0; truth != NULL && i < s->num_references; i++)
        if (i != t)
            add_task(v, s, &from[i], &from[t], truth, s->expect);
    /* Variants of our renderer, against the closed form or else the first reference. */
    for (int i = 0; i < s->num_variants; i++) {
        struct suite_reference ref = s->reference[t];
        ref.margin_global = s->variant[i].margin_global;
        ref.margin_tile = s->variant[i].margin_tile;
        add_task(v, s, &own->variant[i], &from[t], &ref, s->expect);
    }
    if (s->consistency.renders > 0)
        v->task[v->num_tasks++] =
            (struct claim_run){.scene = s, .looks = &alpha_spending_single, .next = LOOK_DECLARED};
    if (of_noise && strcmp(s->references_of, s->name) == 0)
        v->task[v->num_tasks++] = (struct claim_run){
            .scene = s, .of_noise = true, .looks = &alpha_spending_single, .next = LOOK_DECLARED};
}

bool select_claims(struct validation *v, json_t *cannot, struct err *e)
{
    size_t num = (size_t)v->suite.num_scenes;
    if (!check_scenes(v, e))
        return false;
    v->sides = calloc(num, sizeof *v->sides);
    bool *can = calloc(num, sizeof *can);
    if (v->sides == NULL || can == NULL) {
        free(can);
        return err_set(e, "out of memory");
    }
    init_sides(v);
    bool ok = ask_engine(v, can, cannot, e);
    if (ok && v->opt->engine != NULL && v->opt->engine->filter.radius > 0)
        init_peers(v);
    v->num_tasks = 0;
    v->task = calloc(num * MAX_CLAIMS, sizeof *v->task);
    ok = ok && (v->task != NULL || err_set(e, "out of memory"));
    bool of_noise = noise_ladder_is_kept(v->opt->golden_dir, &v->suite);
    for (int i = 0; ok && i < v->suite.num_scenes; i++)
        if (can[i])
            add_engine(v, &v->suite.scene[i]);
        else if (v->opt->engine == NULL && scene_is_selected(v->opt, v->suite.scene[i].name))
            add_scene(v, &v->suite.scene[i], of_noise);
    free(can);
    ok = ok && check_claims(v, e);
    if (ok)
        keep_selected(v);
    return ok;
}

void claim_run_free(struct claim_run *t)
{
    comparison_free(&t->c);
    side_free(&t->again);
    json_decref(t->history);
    json_decref(t->result);
}
