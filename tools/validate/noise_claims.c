/* Claims about noise: the variance of a sample and the slope of the error, against closed forms or records. */
#include "validate_internal.h"

#include "noise_ladder.h"
#include "reference/suite/engine_table.h"
#include "reference/truth/truth_noise.h"
#include "renderer/base/fs.h"
#include "renderer/base/progress.h"
#include "tools/results/results.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Least margins, taken where the record shows that they can be reached: of stated errors, and (a half width) of the
 * slope; and the half width above which the slope is not judged. */
static const double stated_margin = 0.05, slope_margin = 0.1, most_slope = 0.5;
/* Shares of the scene's alpha. A two-sided claim spends half of its share on each side. */
static const double image_share = 0.25, tile_share = 0.25, other_share = 0.125;
/* The first replicate's number: its seeds occur in no other claim of the scene. */
enum { FIRST_SEED = 1 << 20 };

/* The contents of a row; some parts are known for some engines only. */
struct row {
    const struct suite_scene *scene;
    const char *engine;
    double alpha;     /* of the scene */
    const char *what; /* the quantity judged, for the reason */
    const struct noise_ladder *ladder;
    bool timed; /* in this run, on this machine */
    const char *against;
    struct variance_claim image, tile, stated;
    int worst; /* index of the tile in `tile` */
    struct estimate slope;
    double slope_margin; /* 0: not judged */
    bool both;           /* the claim of the variance is two-sided */
    bool has_slope, has_stated, has_tiles;
    bool tiles_inside; /* the estimates of all of them are within their margins */
    enum verdict slope_verdict;
};

/* The interval of V, from that of its logarithm; null without noise, or if it spans a factor of e^20. */
static json_t *variance_ci(struct estimate v, double alpha)
{
    if (v.value <= variance_ladder_none)
        return json_null();
    struct interval i = estimate_interval(variance_ladder_log(v), alpha);
    return i.hi - i.lo < 20 ? json_interval(exp(i.lo), exp(i.hi)) : json_null();
}

static int tile_of_most(const struct variance_map *m)
{
    int most = 0;
    for (int i = 1; i < m->tiles_x * m->tiles_y; i++)
        if (m->tile[i].value > m->tile[most].value)
            most = i;
    return most;
}

static json_t *tile_json(const struct row *r, int tile, json_t *more)
{
    int x = r->ladder->sample.tiles_x;
    json_t *j =
        json_pack("{si,si}", "x", tile % x * r->scene->tile, "y", tile / x * r->scene->tile);
    json_object_update_new(j, more);
    return j;
}

static json_t *claim_json(const struct variance_claim *c)
{
    return json_pack("{so,so,so,ss}", "ratio", json_finite(c->ratio), "ratio_ci",
                     json_interval(c->lo, c->hi), "margin", json_real(c->margin), "ratio_verdict",
                     verdict_name(c->verdict));
}

static void add_measured(json_t *j, const struct row *r)
{
    const struct noise_ladder *l = r->ladder;
    int most = tile_of_most(&l->sample);
    struct estimate eff;
    json_t *rungs = json_array();
    for (int i = 0; i < l->num; i++)
        json_array_append_new(rungs,
                              json_pack("{si,sf,so}", "spp", l->rung[i].spp, "variance",
                                        l->rung[i].variance.value, "variance_ci",
                                        variance_ci(l->rung[i].variance, r->alpha * other_share)));
    json_t *worst = json_pack("{sf,so}", "variance", l->sample.tile[most].value, "variance_ci",
                              variance_ci(l->sample.tile[most], r->alpha * tile_share));
    json_object_update_new(j, json_pack("{so,si,sf,sf,so,so}", "rungs", rungs, "replicates",
                                        l->replicates, "observations", l->n, "variance",
                                        l->sample.image.value, "variance_ci",
                                        variance_ci(l->sample.image, r->alpha * image_share),
                                        "worst_tile", tile_json(r, most, worst)));
    if (r->has_slope) {
        struct interval i = estimate_interval(r->slope, r->alpha * other_share);
        json_object_update_new(j, json_pack("{sf,so}", "slope", r->slope.value, "slope_ci",
                                            json_interval(i.lo, i.hi)));
    }
    if (r->timed && noise_ladder_efficiency(l, &eff)) {
        struct interval i = estimate_interval(eff, r->alpha * other_share);
        json_object_update_new(
            j, json_pack("{sf,so}", "efficiency", exp(eff.value), "efficiency_ci",
                         i.hi - i.lo < 5 ? json_interval(exp(i.lo), exp(i.hi)) : json_null()));
    }
}

static void tell_claim(const struct variance_claim *c, const char *what, const char *of,
                       char reason[256])
{
    snprintf(reason, 256, "%s is %.4g [%.4g, %.4g] times that of the %s, margin %.3g", what,
             c->ratio, c->lo, c->hi, of, c->margin);
}

/* The row's verdict and its reason: those of the first claim that differs, else of the first that is undecided. */
static enum verdict overall(const struct row *r, char reason[256])
{
    char of_tile[64];
    snprintf(of_tile, sizeof of_tile, "the variance of the tile at %d,%d",
             r->worst % r->ladder->sample.tiles_x * r->scene->tile,
             r->worst / r->ladder->sample.tiles_x * r->scene->tile);
    const struct {
        const struct variance_claim *c;
        const char *what, *of;
    } all[] = {
        {&r->image, r->what, r->against},
        {&r->tile, of_tile, r->against},
        {r->has_stated ? &r->stated : NULL, "the variance between renders", "one that they state"}};
    for (int v = 0; v < 2; v++) {
        enum verdict wanted = v == 0 ? VERDICT_DIFFERENT : VERDICT_INCONCLUSIVE;
        for (size_t i = 0; i < sizeof all / sizeof *all; i++)
            if (all[i].c != NULL && all[i].of != NULL && all[i].c->verdict == wanted &&
                (wanted == VERDICT_DIFFERENT || all[i].c != &r->tile)) {
                tell_claim(all[i].c, all[i].what, all[i].of, reason);
                return wanted;
            }
        if (r->slope_margin > 0 && r->slope_verdict == wanted) {
            struct interval i = estimate_interval(r->slope, r->alpha * other_share);
            snprintf(reason, 256, "the error falls with slope %.4f [%.4f, %.4f], not %s-1/2",
                     r->slope.value, i.lo, i.hi, r->has_stated ? "" : "at most ");
            return wanted;
        }
    }
    if (r->against != NULL)
        tell_claim(&r->image, r->what, r->against, reason);
    return VERDICT_EQUIVALENT;
}

static json_t *judged_row(const struct row *r)
{
    char reason[256] = "";
    enum verdict v = overall(r, reason);
    json_t *j = json_pack("{ss,ss,sf,ss,sb,ss}", "scene", r->scene->name, "engine", r->engine,
                          "alpha", r->alpha, "verdict", verdict_name(v), "passed",
                          v == VERDICT_EQUIVALENT, "reason", reason);
    add_measured(j, r);
    json_object_set_new(j, "seconds", json_real(r->ladder->cpu_s));
    json_object_set_new(j, "against", json_string(r->against));
    json_object_update_new(j, claim_json(&r->image));
    if (r->has_tiles)
        json_object_set_new(j, "tile_claim", tile_json(r, r->worst, claim_json(&r->tile)));
    if (r->has_stated)
        json_object_set_new(j, "stated", claim_json(&r->stated));
    if (r->slope_margin > 0)
        json_object_update_new(j,
                               json_pack("{ss,sf}", "slope_verdict", verdict_name(r->slope_verdict),
                                         "slope_margin", r->slope_margin));
    return j;
}

/* Observations over those of the record: at this look, and with NOISE_REPLICATES, for which margins are set. */
struct shares {
    double seen, all;
};

static struct shares shares_of(const struct noise_ladder *run, double of_record)
{
    return (struct shares){of_record, of_record * NOISE_REPLICATES / run->replicates};
}

static bool is_inside(const struct variance_claim *c, bool both)
{
    return c->verdict != VERDICT_DIFFERENT && c->ratio <= 1 + c->margin &&
           (!both || c->ratio >= 1 / (1 + c->margin));
}

/* Judges every tile and keeps the one furthest out. A tile can only be found to differ: the standard error of its few
 * pixels may be too poorly known for EQUIVALENT. */
static void judge_tiles(const struct noise_ladder *run, const struct variance_map *wanted,
                        const struct variance_map *record, const struct shares *share, bool both,
                        double alpha, struct row *r)
{
    int num = run->sample.tiles_x * run->sample.tiles_y;
    double furthest = -INFINITY;
    r->has_tiles = r->tiles_inside = true;
    for (int i = 0; i < num; i++) {
        double margin =
            variance_ladder_margin(record->tile[i], share->all, noise_ladder_least_margin);
        struct estimate v =
            variance_ladder_expect(run->sample.tile[i], record->tile[i], share->seen);
        struct variance_claim c =
            variance_ladder_judge(v, wanted->tile[i], margin, both, alpha / num);
        r->tiles_inside = r->tiles_inside && is_inside(&c, both);
        double out = c.ratio / (1 + c.margin) + (c.verdict == VERDICT_DIFFERENT ? 1e9 : 0);
        if (out > furthest) {
            furthest = out;
            r->tile = c;
            r->worst = i;
        }
    }
}

/* The variance of a sample as seen between renders: n times the variance of a render of n samples, a weighted mean
 * of its logarithm over all rungs (weights as for a slope). */
static struct estimate stated_error(const struct noise_ladder *l)
{
    double mean = 0, sw = 0, sum = 0, var = 0, dof = INFINITY;
    for (int i = 0; i < l->num; i++)
        mean += pow(l->rung[i].variance.se / l->rung[i].variance.value, 2) / l->num;
    for (int i = 0; i < l->num; i++) {
        struct estimate v = l->rung[i].variance;
        double se = v.se / v.value, w = 1 / (se * se + mean);
        sw += w;
        sum += w * log(v.value * l->rung[i].spp);
        var += w * w * se * se;
        dof = fmin(dof, v.dof);
    }
    double value = exp(sum / sw);
    return (struct estimate){value, value * sqrt(var) / sw, dof};
}

/* The slope, and the half width that it can have according to the record. */
static void judge_slope(const struct noise_ladder *run, const struct noise_ladder *record,
                        struct row *r)
{
    struct estimate was;
    struct shares share = shares_of(run, (double)run->replicates / record->replicates);
    r->has_slope = noise_ladder_slope(run, &r->slope);
    if (!r->has_slope || !noise_ladder_slope(record, &was))
        return;
    double half = fmax(slope_margin, variance_ladder_reach(was, share.all));
    r->slope_margin = half <= most_slope ? half : 0;
    r->slope = variance_ladder_expect(r->slope, was, share.seen);
}

/* Judges against the record, or against a closed form; then the record only sets the margins. */
static void judge_independent(const struct noise_ladder *run, const struct variance_map *wanted,
                              const struct noise_ladder *record, bool both, struct row *r)
{
    const struct shares share = shares_of(run, run->n / record->n);
    double a = r->alpha, each = image_share / (both ? 2 : 1);
    double margin =
        variance_ladder_margin(record->sample.image, share.all, noise_ladder_least_margin);
    struct estimate v = variance_ladder_expect(run->sample.image, record->sample.image, share.seen);
    r->image = variance_ladder_judge(v, wanted->image, margin, both, a * each);
    judge_tiles(run, wanted, &record->sample, &share, both, a * tile_share / (both ? 2 : 1), r);
    if (noise_ladder_is_silent(run))
        return;
    judge_slope(run, record, r);
    if (r->slope_margin > 0)
        r->slope_verdict =
            convergence_rate_slope_verdict(r->slope, a * other_share, r->slope_margin);
    struct estimate was = stated_error(record),
                    is = variance_ladder_expect(stated_error(run), was, share.seen);
    margin = variance_ladder_margin(was, share.all, stated_margin);
    r->has_stated = true;
    r->stated = variance_ladder_judge(is, v, margin, true, a * other_share / 2);
}

/* Judges stratified samples: the variance of the last rung against the record, and a slope of at most -1/2. */
static void judge_sobol(const struct noise_ladder *run, const struct noise_ladder *record,
                        struct row *r)
{
    struct estimate top = run->rung[run->num - 1].variance,
                    was = record->rung[record->num - 1].variance;
    const struct shares share = shares_of(run, (double)run->replicates / record->replicates);
    double a = r->alpha * other_share;
    top = variance_ladder_expect(top, was, share.seen);
    r->image = variance_ladder_judge(
        top, was, variance_ladder_margin(was, share.all, noise_ladder_least_margin), false, a);
    judge_slope(run, record, r);
    if (r->slope_margin <= 0)
        return;
    struct interval i = estimate_interval(r->slope, 2 * a);
    r->slope_verdict = i.lo > -0.5                      ? VERDICT_DIFFERENT
                       : i.hi <= -0.5 + r->slope_margin ? VERDICT_EQUIVALENT
                                                        : VERDICT_INCONCLUSIVE;
}

/* The closed form of the variance of a sample, as estimates without error, if there is one (*has). */
static bool closed_form(const struct suite_scene *s, const struct converge_reference *unit,
                        const struct variance_map *like, struct variance_map *out, bool *has,
                        struct err *e)
{
    const struct suite_reference *truth = suite_reference_of(s, "truth");
    double *variance = NULL;
    *has = truth != NULL && s->depth == 1 && suite_noise_is_known(truth->kind);
    if (!*has)
        return true;
    size_t tiles = (size_t)like->tiles_x * (size_t)like->tiles_y;
    double *count = calloc(tiles, sizeof *count);
    *out = (struct variance_map){.tiles_x = like->tiles_x, .tiles_y = like->tiles_y};
    out->tile = calloc(tiles, sizeof *out->tile);
    bool ok = (count != NULL && out->tile != NULL) || err_set(e, "out of memory");
    ok = ok && truth_noise(s, truth, &variance, e);
    for (size_t i = 0; ok && i < unit->size; i++) {
        int p = (int)(i / 3), t = variance_map_tile(like, p % s->width, p / s->width, s->tile);
        double v = variance[i] / (unit->unit[i] * unit->unit[i]);
        out->tile[t].value += v;
        out->image.value += v / (double)unit->size;
        count[t]++;
    }
    out->image.dof = 1;
    for (size_t t = 0; ok && t < tiles; t++) {
        out->tile[t].value /= count[t];
        out->tile[t].dof = 1;
    }
    free(count);
    free(variance);
    if (!ok)
        variance_map_free(out);
    return ok;
}

static const char *const ours[2] = {"pathtracer", "pathtracer-sobol"};

/* Would more replicates change nothing? So it is if something differs, or if all that can be shown to be the same
 * has been shown and the estimates of the rest, which can only be found to differ, lie inside their margins. A
 * deviation that all replicates would find lies z > 4.8 of their standard errors beyond its margin; with half of
 * them its estimate is inside with a probability of Phi(-z/sqrt 2) < 4e-4. */
static bool is_decided(const struct row *r)
{
    char reason[256];
    bool same = r->image.verdict == VERDICT_EQUIVALENT ||
                (r->image.verdict == VERDICT_NOTHING_FOUND && is_inside(&r->image, r->both));
    return overall(r, reason) == VERDICT_DIFFERENT ||
           (same && (!r->has_tiles || r->tiles_inside) &&
            (!r->has_stated || r->stated.verdict != VERDICT_INCONCLUSIVE) &&
            (r->slope_margin <= 0 || r->slope_verdict == VERDICT_EQUIVALENT));
}

/* One look at one sampler with that many replicates. *row: the judged row, a new reference. */
static bool look(const struct noise_job *job, int replicates, struct noise_renders *renders,
                 const struct noise_ladder *record, double alpha, bool *decided, json_t **row,
                 struct err *e)
{
    struct row r = {.scene = job->scene, .engine = ours[job->sobol], .alpha = alpha, .timed = true};
    struct noise_ladder run = {0};
    struct variance_map form = {0};
    bool has_form = false, ok = noise_ladder_render(job, replicates, renders, &run, e);
    if (ok && (run.sample.tiles_x != record->sample.tiles_x ||
               run.sample.tiles_y != record->sample.tiles_y))
        ok = err_set(e, "damaged: its tiles are not those of the scene");
    ok = ok && (job->sobol || closed_form(job->scene, job->unit, &run.sample, &form, &has_form, e));
    if (ok) {
        r.ladder = &run;
        r.what = job->sobol ? "the variance of the last rung" : "the variance of a sample";
        r.against = has_form ? "closed form" : "record";
        r.both = has_form;
        if (job->sobol)
            judge_sobol(&run, record, &r);
        else
            judge_independent(&run, has_form ? &form : &record->sample, record, has_form, &r);
        *decided = is_decided(&r);
        *row = judged_row(&r);
    }
    noise_ladder_free(&run);
    variance_map_free(&form);
    return ok;
}

/* Replicates at each look (looks share alpha equally): half of those that margins are set for, all of them, and, if
 * still undecided, twice as many, since a few rare events can mask how noisy the rest is. */
enum { LOOKS = 3 };
static const int looks[LOOKS] = {NOISE_REPLICATES / 2, NOISE_REPLICATES, 2 * NOISE_REPLICATES};

/* Renders with one sampler, judges it, and appends its row. */
static bool judge_ours(const struct noise_job *job, const json_t *stored, double alpha,
                       json_t *rows, struct err *e)
{
    const char *engine = ours[job->sobol];
    const json_t *entry = json_object_get(stored, engine);
    struct noise_ladder record = {0};
    struct noise_renders renders = {0};
    json_t *row = NULL;
    bool ok =
        entry != NULL || err_set(e, "no record of its noise is stored: `make golden` makes it");
    ok = ok && noise_ladder_parse(entry, job->scene, &record, e);
    bool decided = false;
    for (size_t k = 0; ok && !decided && k < LOOKS; k++) {
        json_decref(row);
        row = NULL;
        ok = look(job, looks[k], &renders, &record, alpha / LOOKS, &decided, &row, e);
    }
    if (ok)
        json_array_append(rows, row);
    json_decref(row);
    noise_ladder_renders_free(&renders);
    noise_ladder_free(&record);
    return ok || err_prefix(e, "%s", engine);
}

/* The row of another engine, as stored: measured, not judged. Its efficiency is given only if ours was timed by the
 * same command. */
static json_t *stored_row(const struct suite_scene *s, const char *engine, const json_t *stored,
                          double alpha)
{
    const json_t *entry = json_object_get(stored, engine);
    const json_t *made = json_object_get(json_object_get(stored, ours[0]), "made");
    struct noise_ladder l;
    struct err e;
    bool ok = entry != NULL || err_set(&e, "not stored: `make golden` makes it");
    if (!ok || !noise_ladder_parse(entry, s, &l, &e))
        return json_pack("{ss,ss,sb,ss}", "scene", s->name, "engine", engine, "passed", 1,
                         "not_stored", e.msg);
    struct row r = {.scene = s,
                    .engine = engine,
                    .alpha = alpha,
                    .ladder = &l,
                    .timed = made != NULL && json_equal(made, json_object_get(entry, "made"))};
    r.has_slope = noise_ladder_slope(&l, &r.slope);
    json_t *j = json_pack("{ss,ss,sf,ss,sb}", "scene", s->name, "engine", engine, "alpha", alpha,
                          "verdict", "MEASURED", "passed", 1);
    add_measured(j, &r);
    noise_ladder_free(&l);
    return j;
}

double noise_claims_samples(const struct suite_scene *s)
{
    double sum = 0;
    for (int i = 0; i < NOISE_RUNGS; i++)
        sum += 2.0 * NOISE_REPLICATES * noise_ladder_spp[i];
    return sum * s->width * s->height;
}

json_t *noise_claims_run(const struct validate_options *opt, const struct suite_scene *s,
                         const struct moments *truth, double alpha, double deadline)
{
    const struct path dir = fs_path("%s/data/%s", opt->out_dir, s->name);
    struct converge_reference unit = {0};
    struct err e = {""};
    json_t *rows = json_array(), *stored = noise_ladder_load(opt->golden_dir, s->name, &e);
    struct noise_job job = {.scene = s,
                            .unit = &unit,
                            .pathtracer = opt->pathtracer,
                            .dir = dir.s,
                            .replicates = looks[LOOKS - 1],
                            .threads = opt->threads,
                            .seed = (uint32_t)opt->seed,
                            .first = FIRST_SEED,
                            .timeout_s = opt->timeout_s,
                            .deadline = deadline};
    bool ok = stored != NULL && fs_make_dirs(dir.s, &e) &&
              noise_ladder_unit(opt->golden_dir, s, truth, 1, &unit, &e);
    for (int sampler = 0; ok && sampler < 2; sampler++) {
        job.sobol = sampler == 1;
        ok = judge_ours(&job, stored, alpha, rows, &e);
    }
    if (!ok) {
        json_array_clear(rows);
        json_array_append_new(rows,
                              validate_bare_row(s->name, e.msg, progress_seconds() >= deadline));
    }
    for (int k = 0; stored != NULL && engine_names[k] != NULL; k++)
        if (suite_reference_of(s, engine_names[k]) != NULL)
            json_array_append_new(rows, stored_row(s, engine_names[k], stored, alpha));
    convergence_rate_reference_free(&unit);
    json_decref(stored);
    return rows;
}
