/* Claims about stated errors ("consistency"): does the error that renders state agree with the
 * error between them? */
#include "validate_internal.h"

#include "reference/replicates/engine_driver.h"
#include "reference/truth/truth_noise.h"
#include "renderer/base/fs.h"
#include "renderer/base/progress.h"
#include "tools/stats/stated_error.h"
#include "tools/stats/same_samples.h"
#include "tools/stats/sample_efficiency.h"
#include "tools/sequential/adaptive_stop.h"
#include "tools/results/results.h"

#include <math.h>
#include <stdlib.h>
#include <unistd.h>

/* Numbers of pixels in which the same samples, added up in another way, give another result. */
struct parts {
    int merged, resumed, adaptive;
    char reason[128]; /* of the first of them */
};

static struct path files_of(const struct validate_options *opt, const struct suite_scene *s)
{
    return fs_path("%s/data/%s/consistency", opt->out_dir, s->name);
}

struct share {
    int k, first, spp; /* samples first..spp-1 of render k */
    const char *const *options;
    bool keep; /* image and state stay, for a resumed render */
};

/* Renders the scene once; unless share->keep, image, log and state are removed. */
static bool render_one(const struct validate_options *opt, const struct suite_scene *s,
                       const struct share *share, double deadline, struct moments *out,
                       double *seconds, struct err *e)
{
    double left = deadline - progress_seconds();
    if (left <= 0)
        return err_set(e, "the budget is spent");
    const struct path files = files_of(opt, s);
    const struct pathtracer_job job = {.program = opt->pathtracer,
                                       .scene = s,
                                       .first = share->first,
                                       .spp = share->spp,
                                       .options = share->options,
                                       .seed = replicate_seed((uint32_t)opt->seed, share->k),
                                       .threads = opt->threads,
                                       .timeout_s = fmin(left, opt->timeout_s),
                                       .files = files.s,
                                       .keep = share->keep};
    double cpu_s;
    if (!fs_make_parent_dirs(files.s, e) || !run_pathtracer(&job, out, &cpu_s, NULL, e))
        return false;
    *seconds += cpu_s;
    if (!share->keep)
        unlink(fs_path("%s.exr.state", files.s).s);
    return true;
}

/* Renders the samples of the first render again: interrupted and resumed, and as two shares that are merged. */
static bool judge_parts(const struct validate_options *opt, const struct suite_scene *s,
                        const struct moments *whole, double deadline, struct parts *out,
                        double *seconds, struct err *e)
{
    const int cut = s->consistency.parts, all = s->consistency.spp;
    const struct path image = fs_path("%s.exr", files_of(opt, s).s);
    const char *const keep[] = {"--keep-state", NULL}, *const resume[] = {"--resume", image.s,
                                                                          NULL};
    struct moments first, rest;
    if (!render_one(opt, s, &(struct share){0, 0, cut, keep, true}, deadline, &first, seconds, e))
        return false;
    bool ok =
        render_one(opt, s, &(struct share){0, 0, all, resume, false}, deadline, &rest, seconds, e);
    if (ok) {
        out->resumed = same_samples_differing(whole, &rest, 0, out->reason);
        moments_free(&rest);
        ok = render_one(opt, s, &(struct share){0, cut, all, NULL, false}, deadline, &rest, seconds,
                        e);
    }
    if (ok) {
        char reason[128] = "";
        ok = moments_merge(&first, &rest, e);
        out->merged = ok ? same_samples_differing(whole, &first, 0, reason) : 0;
        if (out->resumed == 0)
            snprintf(out->reason, sizeof out->reason, "%s", reason);
        moments_free(&rest);
    }
    moments_free(&first);
    return ok;
}

/* Answers to the four questions; the last three are asked of some scenes only. */
struct findings {
    struct stated_error c;
    struct sample_efficiency noise;
    struct adaptive_stop stop;
    struct parts parts;
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

/* The most frequent number of samples per pixel, among whole batches up to 64. */
static int frequent_count(const struct moments *m, int batch)
{
    enum { BATCHES = 64 };
    int pixels[BATCHES + 1] = {0}, best = 1;
    for (size_t p = 0; p < (size_t)m->width * (size_t)m->height; p++) {
        double k = m->n[p] / batch;
        if (k >= 1 && k <= BATCHES && k == floor(k))
            pixels[(int)k]++;
    }
    for (int k = 2; k <= BATCHES; k++)
        best = pixels[k] > pixels[best] ? k : best;
    return best * batch;
}

static bool judge_stop(const struct validate_options *opt, const struct suite_scene *s,
                       double deadline, struct findings *f, double *seconds, struct err *e)
{
    const int most = s->consistency.most;
    char batch[16], tolerance[32];
    snprintf(batch, sizeof batch, "%d", s->consistency.batch);
    snprintf(tolerance, sizeof tolerance, "%.17g", s->consistency.tolerance);
    const char *const options[] = {"-a", batch, tolerance, NULL};
    struct moments m;
    if (!render_one(opt, s, &(struct share){s->consistency.renders, 0, most, options, false},
                    deadline, &m, seconds, e))
        return false;
    f->stop = adaptive_stop_check(&m, s->consistency.batch, s->consistency.tolerance, most);
    struct moments plain;
    const int n = frequent_count(&m, s->consistency.batch);
    bool asks = s->consistency.parts > 0 && f->parts.merged + f->parts.resumed == 0, ok = true;
    if (asks)
        ok = render_one(opt, s, &(struct share){s->consistency.renders, 0, n, NULL, false},
                        deadline, &plain, seconds, e);
    if (asks && ok) {
        f->parts.adaptive = same_samples_differing(&plain, &m, n, f->parts.reason);
        moments_free(&plain);
    }
    moments_free(&m);
    return ok;
}

/* Verdict and reason of the row: those of a finding that differs, else of one that is undecided. */
static enum verdict overall(const struct suite_scene *s, const struct findings *f, char reason[256])
{
    if (f->stop.too_early + f->stop.too_late > 0 && f->c.verdict != VERDICT_DIFFERENT) {
        snprintf(reason, 256,
                 "adaptive sampling: %d pixels stop before their interval is inside the tolerance, "
                 "%d after it must have been",
                 f->stop.too_early, f->stop.too_late);
        return VERDICT_DIFFERENT;
    }
    const struct parts *p = &f->parts;
    if (p->merged + p->resumed + p->adaptive > 0 && f->c.verdict != VERDICT_DIFFERENT) {
        snprintf(reason, 256,
                 "%d pixels of %s are not those of one whole render of the same samples; %s",
                 p->resumed > 0  ? p->resumed
                 : p->merged > 0 ? p->merged
                                 : p->adaptive,
                 p->resumed > 0  ? "a resumed render"
                 : p->merged > 0 ? "two merged shares"
                                 : "an adaptive render",
                 p->reason);
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
        ok = render_one(opt, s, &(struct share){done, 0, s->consistency.spp, NULL, false}, deadline,
                        &render[done], &seconds, &e);
    ok = ok && stated_error_judge(render, num, s->consistency.margin, each, &f.c, &e) &&
         (!asks_noise || judge_noise(s, render, each, &f.noise, &e)) &&
         (s->consistency.parts == 0 ||
          judge_parts(opt, s, &render[0], deadline, &f.parts, &seconds, &e)) &&
         (s->consistency.batch == 0 || judge_stop(opt, s, deadline, &f, &seconds, &e));
    for (int k = 0; k < done; k++)
        moments_free(&render[k]);
    free(render);
    return ok ? judged(s, alpha, &f, seconds)
              : validate_bare_row(s->name, e.msg, progress_seconds() >= deadline);
}
