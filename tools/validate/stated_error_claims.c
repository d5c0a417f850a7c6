#include "validate_internal.h"

#include "reference/replicates/engine_driver.h"
#include "reference/truth/truth_noise.h"
#include "renderer/base/fs.h"
#include "renderer/base/progress.h"
#include "tools/stats/stated_error.h"
#include "tools/stats/sample_efficiency.h"
#include "tools/sequential/adaptive_stop.h"
#include "tools/results/results.h"

#include <math.h>
#include <stdlib.h>
#include <unistd.h>

/* Render k of the scene with those samples and further options; the image is removed. */
static bool render_one(const struct validate_options *opt, const struct suite_scene *s, int k,
                       int spp, const char *const *options, double deadline, struct moments *out,
                       double *seconds, struct err *e)
{
    double left = deadline - now_seconds();
    if (left <= 0)
        return err_set(e, "the budget is spent");
    const struct path image = fs_path("%s/data/%s/consistency.exr", opt->out_dir, s->name);
    const struct path log = fs_path("%s/data/%s/consistency.log", opt->out_dir, s->name);
    const struct pathtracer_job job = {.program = opt->pathtracer,
                                       .scene = s,
                                       .spp = spp,
                                       .options = options,
                                       .seed = replicate_seed((uint32_t)opt->seed, k),
                                       .threads = opt->threads,
                                       .timeout_s = fmin(left, opt->timeout_s),
                                       .image = image.s,
                                       .log = log.s};
    double cpu_s;
    if (!fs_make_parent_dirs(image.s, e) || !run_pathtracer(&job, out, &cpu_s, NULL, e))
        return false;
    *seconds += cpu_s;
    unlink(image.s);
    unlink(log.s);
    return true;
}

/* What the three questions came to; the later ones are asked of some scenes. */
struct findings {
    struct stated_error c;
    struct sample_efficiency noise;
    struct adaptive_stop stop;
};

static bool judge_noise(const struct suite_scene *s, const struct moments *render, double alpha,
                        struct sample_efficiency *out, struct err *e)
{
    double *variance;
    const struct suite_reference *truth = suite_reference_of(s, "truth");
    if (!truth_noise(s, truth, &variance, e))
        return false;
    bool ok = sample_efficiency_judge(render, s->consistency.renders, s->consistency.spp, variance,
                                      s->consistency.noise_margin, alpha, out, e);
    free(variance);
    return ok;
}

static bool judge_stop(const struct validate_options *opt, const struct suite_scene *s,
                       double deadline, struct adaptive_stop *out, double *seconds, struct err *e)
{
    char batch[16], tolerance[32];
    snprintf(batch, sizeof batch, "%d", s->consistency.batch);
    snprintf(tolerance, sizeof tolerance, "%.17g", s->consistency.tolerance);
    const char *const options[] = {"-a", batch, tolerance, NULL};
    struct moments m;
    if (!render_one(opt, s, s->consistency.renders, s->consistency.most, options, deadline, &m,
                    seconds, e))
        return false;
    *out = adaptive_stop_check(&m, s->consistency.batch, s->consistency.tolerance,
                               s->consistency.most);
    moments_free(&m);
    return true;
}

/* The first of them that differs, else the first that is undecided. */
static enum verdict overall(const struct suite_scene *s, const struct findings *f, char reason[256])
{
    if (f->stop.too_early + f->stop.too_late > 0 && f->c.verdict != VERDICT_DIFFERENT) {
        snprintf(reason, 256,
                 "adaptive sampling: %d pixels stop before their interval is inside the tolerance, "
                 "%d after it must have been",
                 f->stop.too_early, f->stop.too_late);
        return VERDICT_DIFFERENT;
    }
    bool noise = s->consistency.noise_margin > 0 && f->c.verdict != VERDICT_DIFFERENT &&
                 f->noise.verdict != VERDICT_EQUIVALENT &&
                 !(f->c.verdict == VERDICT_INCONCLUSIVE && f->noise.verdict != VERDICT_DIFFERENT);
    snprintf(reason, 256, "%s", noise ? f->noise.reason : f->c.reason);
    return noise ? f->noise.verdict : f->c.verdict;
}

static json_t *judged(const struct suite_scene *s, double alpha, const struct findings *f,
                      double seconds)
{
    char reason[256];
    const struct stated_error *c = &f->c;
    enum verdict v = overall(s, f, reason);
    json_t *j =
        json_pack("{ss,ss,si,si,sf,sf,ss,sb,ss,sf,s[ff],sf,s[ff],sf}", "scene", s->name, "engine",
                  "pathtracer", "renders", s->consistency.renders, "spp", s->consistency.spp,
                  "alpha", alpha, "margin", s->consistency.margin, "verdict", verdict_name(v),
                  "passed", v == VERDICT_EQUIVALENT, "reason", reason, "pixels", c->pixels,
                  "pixels_ci", c->pixels_lo, c->pixels_hi, "image", c->image, "image_range",
                  c->image_lo, c->image_hi, "seconds", seconds);
    if (j != NULL && s->consistency.noise_margin > 0) {
        json_object_set_new(j, "noise", json_real(f->noise.ratio));
        json_object_set_new(j, "noise_ci", json_pack("[ff]", f->noise.lo, f->noise.hi));
    }
    if (j != NULL && s->consistency.batch > 0) {
        json_object_set_new(j, "too_early", json_integer(f->stop.too_early));
        json_object_set_new(j, "too_late", json_integer(f->stop.too_late));
    }
    return j;
}

json_t *stated_error_run(const struct validate_options *opt, const struct suite_scene *s,
                         double alpha, double deadline)
{
    int num = s->consistency.renders, done = 0;
    bool asks_noise = s->consistency.noise_margin > 0;
    double each = asks_noise ? alpha / 2 : alpha;
    struct moments *render = calloc((size_t)num, sizeof *render);
    struct findings f = {0};
    struct err e = {""};
    double seconds = 0;
    bool ok = render != NULL || err_set(&e, "out of memory");
    for (; ok && done < num; done += ok)
        ok = render_one(opt, s, done, s->consistency.spp, NULL, deadline, &render[done], &seconds,
                        &e);
    ok = ok && stated_error_judge(render, num, s->consistency.margin, each, &f.c, &e) &&
         (!asks_noise || judge_noise(s, render, each, &f.noise, &e)) &&
         (s->consistency.batch == 0 || judge_stop(opt, s, deadline, &f.stop, &seconds, &e));
    for (int k = 0; k < done; k++)
        moments_free(&render[k]);
    free(render);
    if (!ok && now_seconds() >= deadline)
        return json_pack("{ss,ss,sb,ss,ss}", "scene", s->name, "engine", "pathtracer", "passed", 0,
                         "verdict", verdict_name(VERDICT_INCONCLUSIVE), "error",
                         BUDGET_SPENT " before its renders were done");
    return ok ? judged(s, alpha, &f, seconds)
              : json_pack("{ss,ss,sb,ss}", "scene", s->name, "engine", "pathtracer", "passed", 0,
                          "error", e.msg);
}
