#include "converge_judge.h"

#include "reference/base/json_node.h"
#include "renderer/base/version.h"
#include "tools/results/claim_result.h"
#include "tools/stats/distributions.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

const char *converge_judge_name(const struct converge_options *o, enum converge_engine engine)
{
    return engine < CONVERGE_OWN ? converge_engine_names[engine]
                                 : o->described[engine - CONVERGE_DESCRIBED].name;
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
static json_t *verdict_json(const struct converge_options *o, double alpha,
                            enum converge_engine engine, const struct converge_ladder *l,
                            const struct converge_reference *ref)
{
    const struct rung *top = &l->rung[o->num_rungs - 1];
    struct estimate slope = convergence_rate_slope(l->rung, o->num_rungs);
    struct interval si = estimate_interval(slope, alpha), fi = convergence_rate_floor(top, alpha);
    const bool judge_slope = is_slope_judged(engine), judged = is_judged(engine);
    enum verdict vs = is_independent(engine)
                          ? convergence_rate_slope_verdict(slope, alpha, o->slope_margin)
                          : convergence_rate_slope_at_most(slope, alpha, o->slope_margin);
    enum verdict vf = convergence_rate_floor_verdict(top, o->margin, alpha);
    bool different = vf == VERDICT_DIFFERENT || (judge_slope && vs == VERDICT_DIFFERENT);
    bool unclear = vf == VERDICT_INCONCLUSIVE || (judge_slope && vs == VERDICT_INCONCLUSIVE);
    enum verdict v = different ? VERDICT_DIFFERENT
                     : unclear ? VERDICT_INCONCLUSIVE
                               : VERDICT_EQUIVALENT;
    /* What the reference alone contributes to the interval of the squared bias. */
    const double of_reference = stats_normal_quantile(alpha) * sqrt(ref->noise_var);
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

static json_t *engine_json(const struct converge_options *o, double alpha,
                           enum converge_engine engine, const struct converge_ladder *l,
                           const struct converge_reference *ref)
{
    json_t *j = json_pack("{s:s, s:b, s:b}", "engine", converge_judge_name(o, engine),
                          "independent", is_independent(engine), "judged", is_judged(engine));
    if (!l->present) {
        json_object_set_new(j, "passed", json_false());
        json_object_set_new(j, "error", json_string(l->e.msg));
        return j;
    }
    json_t *rungs = json_array();
    for (int i = 0; i < o->num_rungs; i++)
        json_array_append_new(rungs, rung_json(&l->rung[i], &l->cost, alpha));
    json_object_update_new(j, verdict_json(o, alpha, engine, l, ref));
    json_object_update_new(j, json_pack("{ss*,so,so,so}", "version",
                                        engine < CONVERGE_REFERENCES ? assay_version : l->version,
                                        "start_s", json_finite(l->cost.start_s), "cpu_s_per_spp",
                                        json_finite(l->cost.per_spp.value), "rungs", rungs));
    return j;
}

static json_t *ratio_json(const struct converge_options *o, double alpha, enum converge_engine a,
                          const struct converge_ladder *la, enum converge_engine b,
                          const struct converge_ladder *lb)
{
    json_t *rungs = json_array();
    for (int i = 0; i < o->num_rungs; i++) {
        struct estimate v = convergence_rate_log_ratio(&la->rung[i], &lb->rung[i]);
        struct estimate ea = convergence_rate_log_efficiency(&la->rung[i], &la->cost);
        struct estimate eb = convergence_rate_log_efficiency(&lb->rung[i], &lb->cost);
        double var = ea.se * ea.se + eb.se * eb.se;
        struct estimate eff = {ea.value - eb.value, sqrt(var), fmin(ea.dof, eb.dof)};
        json_array_append_new(rungs, json_pack("{s:f, s:f, s:o, s:o, s:o}", "spp", la->rung[i].spp,
                                               "variance", exp(v.value), "variance_ci",
                                               exp_pair(v, alpha, 1), "efficiency",
                                               json_finite(exp(eff.value)), "efficiency_ci",
                                               exp_pair(eff, alpha, 1)));
    }
    return json_pack("{s:s, s:s, s:o}", "a", converge_judge_name(o, a), "b",
                     converge_judge_name(o, b), "rungs", rungs);
}

/* Adds to ratio a/b, and to the first engine `a`, whether its variance at the last rung is inside the margin. */
static void judge_variance(const struct converge_options *o, double alpha,
                           const struct converge_ladder *a, const struct converge_ladder *b,
                           const char *name, json_t *engine, json_t *ratio)
{
    const int top = o->num_rungs - 1;
    const struct estimate v = convergence_rate_log_ratio(&a->rung[top], &b->rung[top]);
    const struct interval i = estimate_interval(v, alpha);
    const double limit = log1p(o->margin_variance);
    const enum verdict found = i.lo > limit    ? VERDICT_DIFFERENT
                               : i.hi <= limit ? VERDICT_EQUIVALENT
                                               : VERDICT_INCONCLUSIVE;
    json_object_set_new(ratio, "variance_verdict", json_string(verdict_name(found)));
    if (found == VERDICT_EQUIVALENT)
        return;
    const bool passed = json_is_true(json_object_get(engine, "passed")),
               undecided =
                   strcmp(member_text(engine, "verdict"), verdict_name(VERDICT_INCONCLUSIVE)) == 0;
    char reason[1024];
    snprintf(reason, sizeof reason,
             "%s%sat %g samples its variance is %.3g times that of %s [%.3g, %.3g], margin %.3g %%",
             passed ? "" : member_text(engine, "reason"), passed ? "" : "; ", a->rung[top].spp,
             exp(v.value), name, exp(i.lo), exp(i.hi), 100 * o->margin_variance);
    json_object_set_new(engine, "reason", json_string(reason));
    json_object_set_new(engine, "passed", json_false());
    if (passed || (undecided && found == VERDICT_DIFFERENT))
        json_object_set_new(engine, "verdict", json_string(verdict_name(found)));
}

int converge_judge_count(const struct converge_options *o)
{
    int num = o->margin_variance > 0 ? o->num_engines - 1 : 0;
    for (int k = 0; k < o->num_engines; k++)
        num += (is_judged(o->engine[k]) ? 1 : 0) + (is_slope_judged(o->engine[k]) ? 1 : 0);
    return num > 0 ? num : 1;
}

void converge_judge(const struct converge_options *o, double alpha,
                    const struct converge_ladder *ladder, const struct converge_reference *ref,
                    json_t **engines, json_t **ratios)
{
    *engines = json_array();
    *ratios = json_array();
    for (int k = 0; k < o->num_engines; k++)
        json_array_append_new(*engines, engine_json(o, alpha, o->engine[k], &ladder[k], ref));
    for (int a = 0; a < o->num_engines; a++)
        for (int b = a + 1; b < o->num_engines; b++) {
            if (!ladder[a].present || !ladder[b].present)
                continue;
            json_t *ratio =
                ratio_json(o, alpha, o->engine[a], &ladder[a], o->engine[b], &ladder[b]);
            if (a == 0 && o->margin_variance > 0)
                judge_variance(o, alpha, &ladder[a], &ladder[b],
                               converge_judge_name(o, o->engine[b]), json_array_get(*engines, 0),
                               ratio);
            json_array_append_new(*ratios, ratio);
        }
}
