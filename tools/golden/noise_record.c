#include "noise_record.h"

#include "reference/base/json_node.h"
#include "reference/base/utc_date.h"
#include "reference/suite/engine_table.h"
#include "renderer/base/progress.h"
#include "renderer/base/version.h"
#include "tools/converge/converge_engine.h"
#include "tools/validate/noise_ladder.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Is the engine's noise recorded? Ours with both samplers, and engines that the scene has references of. */
static bool is_of(const struct suite_scene *scene, enum converge_engine engine)
{
    return engine < CONVERGE_REFERENCES ||
           suite_reference_of(scene, converge_engine_names[engine]) != NULL;
}

/* The noise of one engine, to be recorded. */
struct recording {
    const struct reference_command *c;
    const struct suite_scene *scene;
    enum converge_engine engine;
    const char *pathtracer, *made; /* see the header */
    int shrink;
    struct converge_reference unit;
    struct noise_ladder ladder;
    char *version; /* of another engine, if known; owned */
};

/* Renders another engine's ladder. If its images have no noise, it is one rung with variance 0. */
static bool render_reference(struct recording *r, struct err *e)
{
    struct suite_scene small = *r->scene;
    struct noise_ladder *l = &r->ladder;
    const int tile = r->scene->tile / r->shrink;
    small.width /= r->shrink;
    small.height /= r->shrink;
    const struct converge_job job = {.scene = &small,
                                     .dir = r->c->work,
                                     .share_dir = r->c->opt.share_dir,
                                     .seed = r->c->opt.seed,
                                     .threads = r->c->opt.threads,
                                     .timeout_s = r->c->opt.timeout_s,
                                     .replicates = NOISE_REPLICATES};
    float *images = calloc((size_t)job.replicates * r->unit.size, sizeof *images);
    *l = (struct noise_ladder){.replicates = job.replicates};
    bool ok = images != NULL || err_set(e, "out of memory");
    for (int rung = 0; ok && rung < NOISE_RUNGS; rung++) {
        const int spp = noise_ladder_spp[rung];
        double cpu_s;
        free(r->version);
        ok = converge_render(&job, r->engine, rung, spp, images, &cpu_s, &r->version, NULL, e) &&
             noise_ladder_add(l, images, spp, cpu_s, &r->unit, small.width, tile, e);
        if (!ok && rung == 0 && strstr(e->msg, CONVERGE_NO_NOISE) != NULL) {
            e->msg[0] = '\0';
            ok = noise_ladder_add(l, images, 1, 0, &r->unit, small.width, tile, e);
            break;
        }
    }
    free(images);
    return ok;
}

static bool render_ours(struct recording *r, struct err *e)
{
    const struct noise_job job = {.scene = r->scene,
                                  .unit = &r->unit,
                                  .pathtracer = r->pathtracer,
                                  .dir = r->c->work,
                                  .sobol = r->engine == CONVERGE_SOBOL,
                                  .replicates = NOISE_RECORD_REPLICATES,
                                  .threads = r->c->opt.threads,
                                  .seed = r->c->opt.seed,
                                  .timeout_s = r->c->opt.timeout_s,
                                  .deadline = INFINITY};
    struct noise_renders renders = {0};
    bool ok = noise_ladder_render(&job, job.replicates, &renders, &r->ladder, e);
    noise_ladder_renders_free(&renders);
    return ok;
}

/* The ladder as an entry of noise.json, with its provenance. */
static json_t *entry_json(const struct recording *r)
{
    const struct suite_scene *s = r->scene;
    const char *version = r->engine < CONVERGE_REFERENCES ? assay_version
                          : r->version != NULL            ? r->version
                                                          : "?";
    json_t *entry = noise_ladder_json(&r->ladder);
    json_object_update_new(entry,
                           json_pack("{ss,ss,ss,si,si,si,si,sI,si}", "version", version, "made",
                                     r->made, "scene_sha256", s->sha256, "width", s->width,
                                     "height", s->height, "depth", s->depth, "tile", s->tile,
                                     "seed", (json_int_t)r->c->opt.seed, "shrink", r->shrink));
    return entry;
}

static bool render_one(struct recording r, json_t **entry, struct err *e)
{
    const struct suite_scene *s = r.scene;
    const bool is_ours = r.engine < CONVERGE_REFERENCES,
               halves = s->width % 2 == 0 && s->height % 2 == 0 && s->tile % 2 == 0;
    r.shrink = !is_ours && halves ? 2 : 1;
    if ((r.c->golden == NULL || !noise_ladder_unit(r.c->golden, s, NULL, r.shrink, &r.unit, e)) &&
        !noise_ladder_unit(r.c->out, s, NULL, r.shrink, &r.unit, e))
        return false;
    bool ok = is_ours ? render_ours(&r, e) : render_reference(&r, e);
    *entry = ok ? entry_json(&r) : NULL;
    convergence_rate_reference_free(&r.unit);
    noise_ladder_free(&r.ladder);
    free(r.version);
    return ok;
}

/* Is the entry whole, and of this scene and its settings? */
static bool is_current(const json_t *entry, const struct suite_scene *scene, struct err *e)
{
    struct noise_ladder l;
    if (entry == NULL)
        return err_set(e, "not stored: `make golden` makes it");
    bool ok = noise_ladder_parse(entry, scene, &l, e);
    if (ok)
        noise_ladder_free(&l);
    return ok;
}

static bool is_there(const char *dir, const struct suite_scene *scene, const char *engine)
{
    struct err ignored;
    json_t *all = dir != NULL ? noise_ladder_load(dir, scene->name, &ignored) : NULL;
    bool there = is_current(json_object_get(all, engine), scene, &ignored);
    json_decref(all);
    return there;
}

bool noise_record_render(const struct reference_command *c, const struct suite_scene *scene,
                         const char *pathtracer, const char *made, struct err *e)
{
    for (enum converge_engine k = 0; k < CONVERGE_NUM_ENGINES; k++) {
        const char *engine = converge_engine_names[k];
        double start = progress_seconds();
        if (!is_of(scene, k) || (c->engine != NULL && strcmp(c->engine, engine) != 0) ||
            (!c->fresh && (is_there(c->golden, scene, engine) || is_there(c->out, scene, engine))))
            continue;
        if (!c->quiet)
            fprintf(stderr, "%s: the noise of %s\n", scene->name, engine);
        const struct recording r = {
            .c = c, .scene = scene, .engine = k, .pathtracer = pathtracer, .made = made};
        json_t *entry = NULL, *all = noise_ladder_load(c->out, scene->name, e);
        bool ok = all != NULL && render_one(r, &entry, e) &&
                  json_object_set_new(all, engine, entry) == 0 &&
                  noise_ladder_store(c->out, scene->name, all, e);
        json_decref(all);
        if (!ok)
            return err_prefix(e, "%s, %s", scene->name, engine);
        printf("%s/%s/noise.json: %s, %.0f s\n", c->out, scene->name, engine,
               progress_seconds() - start);
    }
    return true;
}

/* Reads an entry, of whatever scene file it was made; other settings must be those of the scene. */
static bool parse_any(const json_t *entry, const struct suite_scene *scene,
                      struct noise_ladder *out, struct err *e)
{
    struct suite_scene was = *scene;
    const char *sha = member_text(entry, "scene_sha256");
    if (sha != NULL)
        snprintf(was.sha256, sizeof was.sha256, "%s", sha);
    return noise_ladder_parse(entry, &was, out, e);
}

static enum verdict worse(enum verdict a, enum verdict b)
{
    if (a == VERDICT_DIFFERENT || b == VERDICT_DIFFERENT)
        return VERDICT_DIFFERENT;
    return a == VERDICT_INCONCLUSIVE ? a : b;
}

static struct variance_claim judge(const char *what, struct estimate v, struct estimate was,
                                   double share, bool both, double alpha, FILE *out)
{
    double margin = variance_ladder_margin(was, share, noise_ladder_least_margin);
    struct variance_claim c = variance_ladder_judge(v, was, margin, both, alpha / 2);
    fprintf(out, "  %s: %s, %.4g [%.4g, %.4g] times that stored, margin %.3g\n", what,
            verdict_name(c.verdict), c.ratio, c.lo, c.hi, c.margin);
    return c;
}

/* The entry of "changes", a new reference. If the stored one cannot be compared, its "verdict" is "NOT COMPARABLE", and
 * *verdict DIFFERENT. */
static json_t *compare(const json_t *entry, const json_t *was, const struct suite_scene *scene,
                       bool both, double alpha, FILE *out, enum verdict *verdict)
{
    struct noise_ladder a, b;
    struct err e;
    *verdict = VERDICT_DIFFERENT;
    if (!parse_any(was, scene, &b, &e)) {
        fprintf(out, "  NOT COMPARABLE: what is stored: %s\n", e.msg);
        return json_pack("{ss}", "verdict", "NOT COMPARABLE");
    }
    if (!noise_ladder_parse(entry, scene, &a, &e)) {
        noise_ladder_free(&b);
        return NULL;
    }
    struct variance_claim sample =
        judge("variance of a sample", a.sample.image, b.sample.image, a.n / b.n, both, alpha, out);
    struct variance_claim top =
        judge("variance of the last rung", a.rung[a.num - 1].variance, b.rung[b.num - 1].variance,
              (double)a.replicates / b.replicates, both, alpha, out);
    *verdict = worse(sample.verdict, top.verdict);
    noise_ladder_free(&a);
    noise_ladder_free(&b);
    return json_pack("{ss,sf,sf,sf}", "verdict", verdict_name(*verdict), "sample", sample.ratio,
                     "last_rung", top.ratio, "alpha", alpha);
}

static bool put(const struct approve_options *opt, const struct suite_scene *scene,
                const char *engine, const json_t *entry, json_t *change, json_t *all, struct err *e)
{
    const json_t *was = json_object_get(all, engine);
    json_t *old = json_object_get(was, "changes"), *mine = json_copy((json_t *)entry);
    json_t *changes = old != NULL ? json_copy(old) : json_array();
    json_object_set_new(change, "date", json_string(utc_date_now().s));
    json_object_set(change, "was", json_object_get(was, "version"));
    if (opt->why != NULL)
        json_object_set_new(change, "why", json_string(opt->why));
    json_array_append(changes, change);
    json_object_set_new(mine, "changes", changes);
    json_object_set_new(all, engine, mine);
    return noise_ladder_store(opt->golden_dir, scene->name, all, e);
}

/* Are the entries equal but for "changes", which a candidate has if it was itself stored somewhere? */
static bool is_same(const json_t *entry, const json_t *was)
{
    json_t *a = json_copy((json_t *)was), *b = json_copy((json_t *)entry);
    json_object_del(a, "changes");
    json_object_del(b, "changes");
    bool same = json_equal(a, b);
    json_decref(a);
    json_decref(b);
    return same;
}

static enum approval approve_one(const struct approve_options *opt, const struct suite_scene *scene,
                                 const char *engine, const json_t *entry, json_t *all, FILE *out,
                                 struct err *e)
{
    const json_t *was = json_object_get(all, engine);
    enum verdict verdict = VERDICT_EQUIVALENT;
    json_t *change;
    fprintf(out, "%s/noise, %s\n", scene->name, engine);
    if (!is_current(entry, scene, e)) {
        err_prefix(e, "%s/noise, %s: candidate", scene->name, engine);
        return APPROVE_IMPOSSIBLE;
    }
    if (was == NULL && !opt->accept_new) {
        err_set(e, "%s/noise, %s: nothing is stored: approve it with --new", scene->name, engine);
        return APPROVE_IMPOSSIBLE;
    }
    if (was != NULL && is_same(entry, was)) {
        fprintf(out, "  IDENTICAL\n");
        return APPROVE_UNCHANGED;
    }
    if (was == NULL) {
        fprintf(out, "  NEW: nothing is stored\n");
        change = json_pack("{ss}", "verdict", "NEW");
    } else {
        bool both = engine_with_goldens(engine) != NULL;
        change = compare(entry, was, scene, both, opt->alpha, out, &verdict);
    }
    enum approval done = APPROVE_ACCEPTED;
    if (verdict == VERDICT_DIFFERENT && opt->why == NULL) {
        fprintf(out, "  refused: give --accept-difference \"why\"\n");
        done = APPROVE_DIFFERENT;
    } else if (verdict == VERDICT_INCONCLUSIVE) {
        fprintf(out, "  refused: render it again with another --seed\n");
        done = APPROVE_INCONCLUSIVE;
    } else if (!put(opt, scene, engine, entry, change, all, e)) {
        done = APPROVE_IMPOSSIBLE;
    } else {
        fprintf(out, "  approved\n");
    }
    json_decref(change);
    return done;
}

int noise_record_count(const char *from_dir, const struct suite_scene *scene)
{
    struct err e; /* told by noise_record_approve() */
    json_t *candidate = noise_ladder_load(from_dir, scene->name, &e);
    int num = 0;
    for (enum converge_engine k = 0; k < CONVERGE_NUM_ENGINES; k++)
        num += is_of(scene, k) && json_object_get(candidate, converge_engine_names[k]) != NULL;
    json_decref(candidate);
    return num;
}

void noise_record_approve(const struct approve_options *opt, const struct suite_scene *scene,
                          FILE *out, int count[APPROVE_IMPOSSIBLE + 1], struct err *why)
{
    struct err e = {""};
    json_t *candidate = noise_ladder_load(opt->from_dir, scene->name, &e);
    json_t *all = noise_ladder_load(opt->golden_dir, scene->name, &e);
    bool ok = candidate != NULL && all != NULL;
    for (enum converge_engine k = 0; ok && k < CONVERGE_NUM_ENGINES; k++) {
        const char *engine = converge_engine_names[k];
        const json_t *entry = json_object_get(candidate, engine);
        if (entry == NULL || !is_of(scene, k))
            continue;
        enum approval done = approve_one(opt, scene, engine, entry, all, out, &e);
        if (done == APPROVE_IMPOSSIBLE)
            fprintf(out, "  refused: %s\n", e.msg);
        if (done == APPROVE_IMPOSSIBLE && count[done] == 0)
            *why = e;
        count[done]++;
    }
    if (!ok && count[APPROVE_IMPOSSIBLE]++ == 0)
        *why = e;
    json_decref(candidate);
    json_decref(all);
}

size_t noise_record_status(const char *golden_dir, const struct suite_scene *scene, int *total,
                           FILE *out)
{
    struct err e = {""};
    json_t *all = noise_ladder_load(golden_dir, scene->name, &e);
    size_t bad = 0;
    for (enum converge_engine k = 0; k < CONVERGE_NUM_ENGINES; k++) {
        const char *engine = converge_engine_names[k];
        const json_t *entry = json_object_get(all, engine);
        if (!is_of(scene, k))
            continue;
        bool current = all != NULL && is_current(entry, scene, &e);
        fprintf(out, "%-8s %s/noise, %s%s%s\n",
                current                                         ? "current"
                : all == NULL                                   ? "damaged"
                : entry == NULL                                 ? "missing"
                : strncmp(e.msg, "stale", strlen("stale")) == 0 ? "stale"
                                                                : "damaged",
                scene->name, engine, current ? "" : ": ", current ? "" : e.msg);
        bool counts = entry != NULL || k < CONVERGE_REFERENCES;
        bad += counts && !current;
        *total += counts;
    }
    json_decref(all);
    return bad;
}
