#include "consistency_run.h"

#include "../reference/job.h"
#include "../renderer/fs.h"
#include "../renderer/progress.h"
#include "consistency.h"
#include "ours.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { PATH_SIZE = 8192 };

/* Render k of the scene; the picture is removed. */
static bool render_one(const struct validate_options *opt, const struct suite_scene *s, int k,
                       double deadline, struct moments *out, double *seconds, struct err *e)
{
    double left = deadline - now_seconds();
    if (left <= 0)
        return err_set(e, "the budget is spent");
    char picture[PATH_SIZE], log[PATH_SIZE];
    snprintf(picture, sizeof picture, "%s/data/%s/consistency.exr", opt->out_dir, s->name);
    snprintf(log, sizeof log, "%s/data/%s/consistency.log", opt->out_dir, s->name);
    const struct ours_job job = {.program = opt->pathtracer,
                                 .scene = s,
                                 .spp = s->consistency.spp,
                                 .seed = replicate_seed((uint32_t)opt->seed, k),
                                 .threads = opt->threads,
                                 .timeout_s = fmin(left, opt->timeout_s),
                                 .picture = picture,
                                 .log = log};
    double cpu_s;
    if (!make_parent_dirs(picture, e) || !ours_render(&job, out, &cpu_s, e))
        return false;
    *seconds += cpu_s;
    unlink(picture);
    unlink(log);
    return true;
}

static json_t *judged(const struct suite_scene *s, double alpha, const struct consistency *c,
                      double seconds)
{
    return json_pack("{ss,ss,si,si,sf,sf,ss,sb,ss,sf,s[ff],sf,s[ff],sf}", "scene", s->name,
                     "engine", "pathtracer", "renders", s->consistency.renders, "spp",
                     s->consistency.spp, "alpha", alpha, "margin", s->consistency.margin, "verdict",
                     verdict_name(c->verdict), "passed", c->verdict == VERDICT_EQUIVALENT, "reason",
                     c->reason, "pixels", c->pixels, "pixels_ci", c->pixels_lo, c->pixels_hi,
                     "image", c->image, "image_range", c->image_lo, c->image_hi, "seconds",
                     seconds);
}

json_t *consistency_run(const struct validate_options *opt, const struct suite_scene *s,
                        double alpha, double deadline)
{
    int num = s->consistency.renders, done = 0;
    struct moments *render = calloc((size_t)num, sizeof *render);
    struct consistency c;
    struct err e = {""};
    double seconds = 0;
    bool ok = render != NULL || err_set(&e, "out of memory");
    for (; ok && done < num; done += ok)
        ok = render_one(opt, s, done, deadline, &render[done], &seconds, &e);
    ok = ok && consistency_judge(render, num, s->consistency.margin, alpha, &c, &e);
    for (int k = 0; k < done; k++)
        moments_free(&render[k]);
    free(render);
    if (!ok && now_seconds() >= deadline)
        return json_pack("{ss,ss,sb,ss,ss}", "scene", s->name, "engine", "pathtracer", "passed", 0,
                         "verdict", verdict_name(VERDICT_INCONCLUSIVE), "error",
                         "budget spent before its renders were done");
    return ok ? judged(s, alpha, &c, seconds)
              : json_pack("{ss,ss,sb,ss}", "scene", s->name, "engine", "pathtracer", "passed", 0,
                          "error", e.msg);
}

static bool is_interval(const json_t *v)
{
    return json_array_size(v) == 2 && json_is_number(json_array_get(v, 0)) &&
           json_is_number(json_array_get(v, 1));
}

/* Of a claim with an error. */
static bool only_time_missing(const json_t *c)
{
    const char *verdict = member_text(c, "verdict");
    return verdict == NULL || strcmp(verdict, verdict_name(VERDICT_INCONCLUSIVE)) == 0;
}

static bool check_one(const json_t *c, const char *where, struct err *e)
{
    static const char *const numbers[] = {"renders", "spp",   "alpha",  "margin",
                                          "pixels",  "image", "seconds"};
    bool passed = json_is_true(json_object_get(c, "passed"));
    if (member_text(c, "scene") == NULL || member_text(c, "engine") == NULL)
        return err_set(e, "%s: 'scene' or 'engine' is missing", where);
    if (member_text(c, "error") != NULL)
        return (!passed && only_time_missing(c)) ||
               err_set(e, "%s: has an 'error' and yet 'passed' or a 'verdict'", where);
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        if (!json_is_number(json_object_get(c, numbers[i])))
            return err_set(e, "%s: '%s' is not a number", where, numbers[i]);
    if (!is_interval(json_object_get(c, "pixels_ci")) ||
        !is_interval(json_object_get(c, "image_range")))
        return err_set(e, "%s: 'pixels_ci' or 'image_range' is not an interval", where);
    enum verdict v;
    const char *verdict = member_text(c, "verdict");
    if (verdict == NULL || !verdict_parse(verdict, &v) || member_text(c, "reason") == NULL)
        return err_set(e, "%s: 'verdict' or 'reason' is missing or unknown", where);
    return passed == (v == VERDICT_EQUIVALENT) ||
           err_set(e, "%s: 'passed' contradicts 'verdict'", where);
}

bool consistency_check(const json_t *consistency, const char *path, struct err *e)
{
    if (!json_is_array(consistency))
        return err_set(e, "%s: 'consistency' is not an array", path);
    for (size_t i = 0; i < json_array_size(consistency); i++) {
        char where[512];
        snprintf(where, sizeof where, "%.400s: consistency %zu", path, i + 1);
        if (!check_one(json_array_get(consistency, i), where, e))
            return false;
    }
    return true;
}

enum outcome consistency_outcome(const json_t *claim)
{
    enum verdict v;
    if (member_text(claim, "verdict") == NULL || !verdict_parse(member_text(claim, "verdict"), &v))
        return OUTCOME_NOT_JUDGED;
    switch (v) {
    case VERDICT_EQUIVALENT: return OUTCOME_AS_EXPECTED;
    case VERDICT_DIFFERENT: return OUTCOME_OPPOSITE;
    case VERDICT_INCONCLUSIVE: break;
    }
    return OUTCOME_UNDECIDED;
}

static double end_of(const json_t *c, const char *name, size_t end)
{
    return json_number_value(json_array_get(json_object_get(c, name), end));
}

void consistency_print(FILE *f, const json_t *consistency, bool markdown)
{
    if (json_array_size(consistency) == 0)
        return;
    fputs(markdown ? "\n| scene | renders | error squared, between renders / stated [interval] | "
                     "the same of the sum of all pixels | verdict |\n|---|--:|--:|--:|---|\n"
                   : "\nerror between renders / error that they state, squared; of pixels; of the "
                     "sum of all pixels\n",
          f);
    for (size_t i = 0; i < json_array_size(consistency); i++) {
        const json_t *c = json_array_get(consistency, i);
        if (member_text(c, "error") != NULL)
            fprintf(f, markdown ? "| %s | | | | %s: %s |\n" : "%s  %s: %s\n",
                    member_text(c, "scene"),
                    member_text(c, "verdict") != NULL ? member_text(c, "verdict") : "NOT JUDGED",
                    member_text(c, "error"));
        else
            fprintf(f,
                    markdown ? "| %s | %.0f x %.0f spp | %.3f [%.3f, %.3f] | %.2f | %s |\n"
                             : "%s  %.0f x %.0f spp  %.3f [%.3f, %.3f]  %.2f  %s\n",
                    member_text(c, "scene"), member_number(c, "renders"), member_number(c, "spp"),
                    member_number(c, "pixels"), end_of(c, "pixels_ci", 0),
                    end_of(c, "pixels_ci", 1), member_number(c, "image"),
                    member_text(c, "verdict"));
    }
}
