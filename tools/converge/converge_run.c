#include "converge_judge.h"

#include "reference/truth/truth.h"
#include "reference/base/json_node.h"
#include "renderer/base/fs.h"
#include "tools/results/claim_result.h"
#include "depth_ladder.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Our own reference has this many times the samples of the top rung. */
enum { OWN_FACTOR = 64 };

struct run {
    const struct converge_options *opt;
    struct suite suite;
    char dir[4200]; /* temporary */
    double alpha;   /* of one judgement */
};

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
    const bool truth = ref != NULL && strcmp(ref->engine, "truth") == 0,
               stored = ref != NULL && reference_is_rendered(ref);
    if (!truth && !stored) {
        shrink = 1;
        int spp = OWN_FACTOR * o->ladder[o->num_rungs - 1];
        snprintf(name, 64, "pathtracer, %d samples", spp);
        if (!converge_render_own(job, spp, &m, e))
            return false;
    } else {
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
                  const struct converge_reference *ref, struct converge_ladder *out)
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
    snprintf(what, sizeof what, "%s, %s", job->scene->name, converge_judge_name(o, engine));
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
    struct converge_ladder ladder[CONVERGE_MAX_ENGINES] = {0};
    for (int k = 0; k < o->num_engines; k++)
        climb(r, &job, o->engine[k], &ref, &ladder[k]);
    json_t *engines, *ratios;
    converge_judge(o, r->alpha, ladder, &ref, &engines, &ratios);
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

bool converge_run(const struct converge_options *opt, int argc, char **argv, json_t **results,
                  struct err *e)
{
    /* Bonferroni over all that is judged in this run. */
    struct run r = {.opt = opt,
                    .alpha = opt->alpha / (opt->num_scenes * converge_judge_count(opt))};
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
