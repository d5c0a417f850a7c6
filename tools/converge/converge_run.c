#include "converge_run.h"

#include "reference/truth/truth.h"
#include "reference/base/json_node.h"
#include "renderer/base/fs.h"
#include "renderer/base/version.h"
#include "tools/results/claim_result.h"
#include "tools/stats/convergence_rate.h"
#include "tools/stats/distributions.h"
#include "depth_ladder.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Our own reference has this many times the samples of the top rung. */
enum { OWN_FACTOR = 64 };

/* One engine's ladder on one scene. */
struct ladder {
    struct rung rung[CONVERGE_MAX_RUNGS];
    struct cost cost;
    char *version;
    bool present;
    struct err e;
};

struct run {
    const struct converge_options *opt;
    struct suite suite;
    char dir[4200]; /* temporary */
    double alpha;   /* of one judgement */
};

static const char *name_of(const struct run *r, enum converge_engine engine)
{
    return engine < CONVERGE_OWN ? converge_engine_names[engine]
                                 : r->opt->described[engine - CONVERGE_DESCRIBED].name;
}

static bool is_independent(enum converge_engine engine)
{
    return engine == CONVERGE_PATHTRACER;
}

/* Ours and described ones must leave no bias whatever the sampler; Cycles and POV-Ray are measured. */
static bool is_judged(enum converge_engine engine)
{
    return engine < CONVERGE_REFERENCES || engine >= CONVERGE_DESCRIBED;
}

/* Of independent samples the slope is -1/2; of described engines, whose samples may be stratified, at most that. */
static bool is_slope_judged(enum converge_engine engine)
{
    return is_independent(engine) || engine >= CONVERGE_DESCRIBED;
}

/* The first that there is with the pixel filter of scene s; NULL: a long run of ours. */
static const struct suite_reference *choose_reference(const struct suite_scene *s,
                                                      const struct suite_scene *from)
{
    struct err why;
    const struct suite_reference *ref = suite_reference_of(from, "truth");
    if (ref != NULL && truth_knows(s, ref, &why))
        return ref;
    for (int k = 0; engine_names[k] != NULL && s->filter.radius <= 0; k++)
        if ((ref = suite_reference_of(from, engine_names[k])) != NULL)
            return ref;
    for (int k = 0; k < from->num_references; k++)
        if (reference_is_rendered(&from->reference[k]) &&
            engine_with_goldens(from->reference[k].engine) == NULL)
            return &from->reference[k];
    return NULL;
}

/* Loads or renders the reference of scene s, which uses the references of `from`, and names it. */
static bool load_reference(const struct run *r, const struct suite_scene *s,
                           const struct suite_scene *from, const struct converge_job *job,
                           struct converge_reference *out, char name[64], struct err *e)
{
    const struct converge_options *o = r->opt;
    const bool choose = strcmp(o->against, "auto") == 0, own = strcmp(o->against, "own") == 0;
    const struct suite_reference *ref = choose ? choose_reference(s, from)
                                        : own  ? NULL
                                               : suite_reference_of(from, o->against);
    struct moments m;
    int shrink = o->shrink;
    if (ref == NULL && !choose && !own)
        return err_set(e, "%s has no reference '%s'", from->name, o->against);
    if (ref == NULL || (!reference_is_rendered(ref) && strcmp(ref->engine, "truth") != 0)) {
        shrink = 1;
        int spp = OWN_FACTOR * o->ladder[o->num_rungs - 1];
        snprintf(name, 64, "pathtracer, %d samples", spp);
        if (!converge_render_own(job, spp, &m, e))
            return false;
    } else {
        const bool truth = strcmp(ref->engine, "truth") == 0;
        snprintf(name, 64, truth ? "closed form" : "golden of %s", ref->engine);
        json_t *manifest = NULL;
        bool ok = truth ? truth_render(s, ref, &m, e)
                        : golden_read(o->golden_dir, from, ref, &m, &manifest, e);
        if (ok && !truth && !golden_has_filter(manifest, s, ref->engine, e)) {
            moments_free(&m);
            ok = false;
        }
        json_decref(manifest);
        if (!ok)
            return false;
    }
    bool ok = convergence_rate_reference_init(out, &m, shrink, e);
    moments_free(&m);
    return ok || err_prefix(e, "%s", s->name);
}

static void climb(const struct run *r, const struct converge_job *job, enum converge_engine engine,
                  const struct converge_reference *ref, struct ladder *out)
{
    const struct converge_options *o = r->opt;
    char what[128];
    if (engine >= CONVERGE_DESCRIBED &&
        !engine_expresses(&o->described[engine - CONVERGE_DESCRIBED], job->scene, job->dir,
                          &out->e)) {
        err_prefix(&out->e, "it cannot express this scene");
        return;
    }
    float *images = malloc((size_t)o->replicates * ref->size * sizeof *images);
    if (images == NULL) {
        err_set(&out->e, "out of memory for %d replicates", o->replicates);
        return;
    }
    struct progress progress;
    snprintf(what, sizeof what, "%s, %s", job->scene->name, name_of(r, engine));
    progress_start(&progress, what, NULL, o->quiet);
    /* An image costs its samples and a start; this guess of the start is good enough for a progress bar. */
    const double start = o->ladder[o->num_rungs - 1] / 4.0;
    double done = 0, total = 0;
    for (int i = 0; i < o->num_rungs; i++)
        total += (o->ladder[i] + start) * o->replicates;
    bool ok = true;
    for (int i = 0; ok && i < o->num_rungs; i++) {
        double cpu_s = 0;
        free(out->version);
        ok = converge_render(
            job, engine, i, o->ladder[i], images, &cpu_s, &out->version,
            &(struct converge_progress){&progress, done, o->ladder[i] + start, total}, &out->e);
        if (ok && !convergence_rate_rung(images, o->replicates, o->ladder[i], ref, &out->rung[i],
                                         &out->e))
            ok = err_prefix(&out->e, "%s, %d samples", what, o->ladder[i]);
        out->rung[i].cpu_s = cpu_s;
        done += (o->ladder[i] + start) * o->replicates;
        progress_update(&progress, done, total);
    }
    progress_end(&progress, total);
    free(images);
    out->present = ok;
    if (ok)
        out->cost = convergence_rate_cost(out->rung, o->num_rungs);
}

/* Interval of exp(x)^power; null if it spans a factor of e^20 or more. */
static json_t *exp_pair(struct estimate x, double alpha, double power)
{
    struct interval i = estimate_interval(x, alpha);
    return i.hi - i.lo < 20 ? json_interval(exp(power * i.lo), exp(power * i.hi)) : json_null();
}

static json_t *rung_json(const struct rung *g, const struct cost *c, double alpha)
{
    struct estimate eff = convergence_rate_log_efficiency(g, c);
    double bias = copysign(sqrt(fabs(g->bias2.value)), g->bias2.value);
    return json_pack("{s:f, s:f, s:o, s:f, s:o, s:f, s:f, s:o, s:o}", "spp", g->spp, "rmse",
                     exp(0.5 * g->log_mse.value), "rmse_ci", exp_pair(g->log_mse, alpha, 0.5),
                     "variance", exp(g->log_variance.value), "variance_ci",
                     exp_pair(g->log_variance, alpha, 1), "bias", bias, "cpu_s", g->cpu_s,
                     "efficiency", json_finite(exp(eff.value)), "efficiency_ci",
                     exp_pair(eff, alpha, 1));
}

/* The judgements of one engine: each, the worst of them as the verdict, and a reason. */
static json_t *verdict_json(const struct run *r, enum converge_engine engine,
                            const struct ladder *l, const struct converge_reference *ref)
{
    const struct converge_options *o = r->opt;
    const struct rung *top = &l->rung[o->num_rungs - 1];
    struct estimate slope = convergence_rate_slope(l->rung, o->num_rungs);
    struct interval si = estimate_interval(slope, r->alpha),
                    fi = convergence_rate_floor(top, r->alpha);
    const bool judge_slope = is_slope_judged(engine), judged = is_judged(engine);
    enum verdict vs = is_independent(engine)
                          ? convergence_rate_slope_verdict(slope, r->alpha, o->slope_margin)
                          : convergence_rate_slope_at_most(slope, r->alpha, o->slope_margin);
    enum verdict vf = convergence_rate_floor_verdict(top, o->margin, r->alpha);
    bool different = vf == VERDICT_DIFFERENT || (judge_slope && vs == VERDICT_DIFFERENT);
    bool unclear = vf == VERDICT_INCONCLUSIVE || (judge_slope && vs == VERDICT_INCONCLUSIVE);
    enum verdict v = different ? VERDICT_DIFFERENT
                     : unclear ? VERDICT_INCONCLUSIVE
                               : VERDICT_EQUIVALENT;
    /* What the reference alone contributes to the interval of the squared bias. */
    const double of_reference = stats_normal_quantile(r->alpha) * sqrt(ref->noise_var);
    const double too_much = of_reference / (o->margin * o->margin);
    char reason[640], of_slope[160] = "", advice[160] = "";
    if (v == VERDICT_INCONCLUSIVE && vf == VERDICT_INCONCLUSIVE && too_much > 1)
        snprintf(advice, sizeof advice,
                 ": the reference is too noisy for this margin (--margin); %.3g times its samples "
                 "would do",
                 ceil(2 * too_much));
    else if (v == VERDICT_INCONCLUSIVE)
        snprintf(advice, sizeof advice, ": more images (--replicates) would tell%s",
                 vf == VERDICT_INCONCLUSIVE ? ", or a rung of more samples (--ladder)" : "");
    if (judge_slope)
        snprintf(of_slope, sizeof of_slope,
                 vs == VERDICT_DIFFERENT ? "the slope is not %s-1/2; "
                 : vs == VERDICT_INCONCLUSIVE
                     ? "the slope is not shown to be %s-1/2 within +-%.3g; "
                     : "the slope is %s-1/2 within +-%.3g; ",
                 is_independent(engine) ? "" : "at most ", o->slope_margin);
    snprintf(reason, sizeof reason,
             "%sat %g samples the RMS bias is %s %.3g %%, from %.3g %% to %.3g %%%s", of_slope,
             top->spp,
             vf == VERDICT_DIFFERENT      ? "above"
             : vf == VERDICT_INCONCLUSIVE ? "not shown to be below"
                                          : "below",
             100 * o->margin, 100 * fi.lo, 100 * fi.hi, advice);
    return json_pack(
        "{s:f, s:o, s:s, s:o, s:s, s:s, s:b, s:s}", "slope", slope.value, "slope_ci",
        json_interval(si.lo, si.hi), "slope_verdict", judge_slope ? verdict_name(vs) : "MEASURED",
        "floor_ci", json_interval(fi.lo, fi.hi), "floor_verdict",
        judged ? verdict_name(vf) : "MEASURED", "verdict", judged ? verdict_name(v) : "MEASURED",
        "passed", !judged || v == VERDICT_EQUIVALENT, "reason", reason);
}

static json_t *engine_json(const struct run *r, enum converge_engine engine, const struct ladder *l,
                           const struct converge_reference *ref)
{
    json_t *j = json_pack("{s:s, s:b, s:b}", "engine", name_of(r, engine), "independent",
                          is_independent(engine), "judged", is_judged(engine));
    if (!l->present) {
        json_object_set_new(j, "passed", json_false());
        json_object_set_new(j, "error", json_string(l->e.msg));
        return j;
    }
    json_t *rungs = json_array();
    for (int i = 0; i < r->opt->num_rungs; i++)
        json_array_append_new(rungs, rung_json(&l->rung[i], &l->cost, r->alpha));
    json_object_update_new(j, verdict_json(r, engine, l, ref));
    json_object_update_new(j, json_pack("{ss*,so,so,so}", "version",
                                        engine < CONVERGE_REFERENCES ? assay_version : l->version,
                                        "start_s", json_finite(l->cost.start_s), "cpu_s_per_spp",
                                        json_finite(l->cost.per_spp.value), "rungs", rungs));
    return j;
}

static json_t *ratio_json(const struct run *r, enum converge_engine a, const struct ladder *la,
                          enum converge_engine b, const struct ladder *lb)
{
    json_t *rungs = json_array();
    for (int i = 0; i < r->opt->num_rungs; i++) {
        struct estimate v = convergence_rate_log_ratio(&la->rung[i], &lb->rung[i]);
        struct estimate ea = convergence_rate_log_efficiency(&la->rung[i], &la->cost);
        struct estimate eb = convergence_rate_log_efficiency(&lb->rung[i], &lb->cost);
        double var = ea.se * ea.se + eb.se * eb.se;
        struct estimate eff = {ea.value - eb.value, sqrt(var), fmin(ea.dof, eb.dof)};
        json_array_append_new(rungs, json_pack("{s:f, s:f, s:o, s:o, s:o}", "spp", la->rung[i].spp,
                                               "variance", exp(v.value), "variance_ci",
                                               exp_pair(v, r->alpha, 1), "efficiency",
                                               json_finite(exp(eff.value)), "efficiency_ci",
                                               exp_pair(eff, r->alpha, 1)));
    }
    return json_pack("{s:s, s:s, s:o}", "a", name_of(r, a), "b", name_of(r, b), "rungs", rungs);
}

static bool run_scene(const struct run *r, const struct suite_scene *scene, json_t *convergence,
                      struct err *e)
{
    const struct converge_options *o = r->opt;
    const struct suite_scene *from = suite_find(&r->suite, scene->references_of);
    if (scene->width % o->shrink != 0 || scene->height % o->shrink != 0)
        return err_set(e, "%s: %d x %d pixels cannot be made %d times smaller", scene->name,
                       scene->width, scene->height, o->shrink);
    struct suite_scene whole = *scene;
    for (int k = 0; k < o->num_engines; k++)
        if (o->engine[k] >= CONVERGE_DESCRIBED)
            whole.filter = o->described[0].filter;
    struct suite_scene small = whole;
    small.width /= o->shrink;
    small.height /= o->shrink;
    const struct converge_job job = {.scene = &small,
                                     .pathtracer = o->pathtracer,
                                     .dir = r->dir,
                                     .share_dir = o->share_dir,
                                     .described = o->described,
                                     .seed = o->seed,
                                     .threads = o->threads,
                                     .timeout_s = o->timeout_s,
                                     .replicates = o->replicates};
    struct converge_reference ref;
    char name[64];
    if (!load_reference(r, &whole, from, &job, &ref, name, e))
        return false;
    json_t *depths = NULL;
    struct err why;
    bool ours = false;
    for (int k = 0; k < o->num_engines; k++)
        ours |= o->engine[k] < CONVERGE_REFERENCES;
    if (ours && o->depth_spp > 0 &&
        !depth_ladder_measure(&job, suite_reference_of(from, "truth"), o->depth_spp, &depths,
                              &why)) {
        if (err_is_of_memory(&why)) {
            convergence_rate_reference_free(&ref);
            return err_set(e, "%s", why.msg);
        }
        depths = json_pack("{s:s}", "error", why.msg);
    }
    struct ladder ladder[CONVERGE_MAX_ENGINES] = {0};
    json_t *engines = json_array(), *ratios = json_array();
    for (int k = 0; k < o->num_engines; k++) {
        climb(r, &job, o->engine[k], &ref, &ladder[k]);
        json_array_append_new(engines, engine_json(r, o->engine[k], &ladder[k], &ref));
    }
    for (int a = 0; a < o->num_engines; a++)
        for (int b = a + 1; b < o->num_engines; b++)
            if (ladder[a].present && ladder[b].present)
                json_array_append_new(
                    ratios, ratio_json(r, o->engine[a], &ladder[a], o->engine[b], &ladder[b]));
    json_t *j = json_pack("{s:s, s:s, s:i, s:i, s:i, s:i, s:s, s:f, s:f, s:f, s:f, s:o, s:o, s:o*}",
                          "scene", scene->name, "title", scene->title, "width", small.width,
                          "height", small.height, "depth", scene->depth, "replicates",
                          o->replicates, "reference", name, "reference_noise", sqrt(ref.noise),
                          "alpha", r->alpha, "margin", o->margin, "slope_margin", o->slope_margin,
                          "engines", engines, "ratios", ratios, "depths", depths);
    for (int k = 0; k < o->num_engines; k++)
        free(ladder[k].version);
    convergence_rate_reference_free(&ref);
    return json_array_append_new(convergence, j) == 0;
}

/* Bonferroni over all that is judged in this run. */
static double alpha_of_one(const struct converge_options *o)
{
    int num = 0;
    for (int k = 0; k < o->num_engines; k++)
        num += (is_judged(o->engine[k]) ? 1 : 0) + (is_slope_judged(o->engine[k]) ? 1 : 0);
    return o->alpha / (o->num_scenes * (num > 0 ? num : 1));
}

bool converge_run(const struct converge_options *opt, int argc, char **argv, json_t **results,
                  struct err *e)
{
    struct run r = {.opt = opt, .alpha = alpha_of_one(opt)};
    double start = progress_seconds();
    if (!suite_load(opt->suite_dir, &r.suite, e))
        return false;
    json_t *root = claim_result_new_results(argc, argv, opt->alpha, e), *convergence = json_array();
    bool ok = root != NULL;
    for (int i = 0; ok && i < opt->num_scenes; i++)
        if (suite_find(&r.suite, opt->scene[i]) == NULL)
            ok = err_set(e, "no scene '%s' in %s", opt->scene[i], opt->suite_dir);
    if (ok && (ok = fs_make_dirs(opt->out_dir, e))) {
        snprintf(r.dir, sizeof r.dir, "%.4096s/converge-XXXXXX", opt->out_dir);
        if (mkdtemp(r.dir) == NULL)
            ok = err_set(e, "%s: cannot make a directory in it: %s", opt->out_dir, strerror(errno));
        for (int i = 0; ok && i < opt->num_scenes; i++)
            ok = run_scene(&r, suite_find(&r.suite, opt->scene[i]), convergence, e);
        rmdir(r.dir); /* unless a failed engine has left something to look at */
    }
    if (ok) {
        json_object_set(root, "convergence", convergence);
        json_object_set_new(root, "seed", json_integer(opt->seed));
        json_object_set_new(root, "seconds", json_real(progress_seconds() - start));
        *results = json_incref(root);
    }
    json_decref(convergence);
    json_decref(root);
    suite_free(&r.suite);
    return ok;
}
