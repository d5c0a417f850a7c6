#include "diagnose_gather.h"

#include "diagnose_render.h"
#include "reference/suite/engine_table.h"
#include "tools/results/results.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { MAX_PATH = 8192 };
static const char ours[] = "pathtracer";

bool diagnose_gather_program(const struct diagnose_gather_options *opt, const char *program,
                             struct observation *clue, int *num, struct err *e)
{
    const struct catalogue *c = opt->catalogue;
    for (int i = 0; i < c->num_views; i++) {
        const struct view *v = &c->view[i];
        /* A seed of its own for each view: the same one would make their noise alike. */
        struct diagnose_job job = {.program = program,
                                   .options = v->options[0] != NULL ? v->options : NULL,
                                   .columns = v->correct.columns,
                                   .width = v->width,
                                   .height = v->height,
                                   .spp = v->spp,
                                   .renders = v->renders,
                                   .seed = opt->seed * 1000 + (uint64_t)i,
                                   .threads = opt->threads,
                                   .timeout_s = opt->timeout_s,
                                   .work_dir = opt->work_dir};
        clue[i] = (struct observation){.view = v};
        if (!catalogue_view_scene(v, opt->suite, &job.scene, &job.variant, e) ||
            !diagnose_render(&job, opt->alpha / (2 * c->num_views), &clue[i].seen,
                             &clue[i].is_consistent, e))
            return false;
        signature_set_spread(&clue[i].seen, &v->correct);
    }
    *num = c->num_views;
    return true;
}

/* Another program may sample differently: only its means are compared with bugs, and the margin by which cells may be
 * off is added to their noise. */
static void allow_conventions(double margin, struct observation *clue)
{
    struct signature *s = &clue->seen;
    clue->margin = margin;
    for (int f = 0; f < NUM_FACTS; f++)
        s->fact[f] = s->fact_sd[f] = NAN;
    for (int i = 0; i < 3 * s->columns * s->rows; i++)
        s->var[i] += pow(margin * clue->view->correct.mean[i], 2);
}

/* asked: samples per pixel asked for, which matters only for adaptive sampling; 0: not known. */
static bool read_image(const struct view *v, const char *path, int asked, bool is_ours,
                       struct observation *clue, struct err *e)
{
    struct moments m;
    *clue = (struct observation){.view = v, .is_consistent = true};
    if (!moments_read(path, &m, NULL, e))
        return false;
    bool ok = signature_of(&m, v->correct.columns, v->fixed_spp ? asked : 0, &clue->seen, e) ||
              err_prefix(e, "%s", path);
    if (ok && !is_ours && m.spp > 0)
        clue->seen.n *= m.spp;
    moments_free(&m);
    if (ok && clue->seen.rows != v->correct.rows)
        ok = err_set(e, "%s: width by height is not %d by %d", path, v->width, v->height);
    if (ok)
        signature_set_spread(&clue->seen, &v->correct);
    return ok;
}

bool diagnose_gather_image(const struct diagnose_gather_options *opt, const char *view,
                           const char *path, struct observation *clue, struct err *e)
{
    const struct view *v = catalogue_view(opt->catalogue, view);
    const struct suite_scene *scene;
    const struct suite_variant *variant;
    if (v == NULL)
        return err_set(e, "--scene: the catalogue of bugs has no '%s' (see --help)", view);
    return catalogue_view_scene(v, opt->suite, &scene, &variant, e) &&
           read_image(v, path, v->spp, true, clue, e);
}

/* The program that a validation is about: that of --engine, which is neither ours nor a reference; else ours. */
static const char *subject_of(const json_t *results)
{
    static const char *const known[] = {ENGINES_WITH_GOLDENS(ENGINE_WORD) "truth"};
    json_each(claim, json_object_get(results, "claims")) {
        const char *a = member_text(claim, "a");
        bool is_known = results_is_variant_of(a, ours);
        for (size_t k = 0; k < sizeof known / sizeof *known; k++)
            is_known |= strcmp(a, known[k]) == 0;
        if (!is_known)
            return a;
    }
    return ours;
}

/* The path of a claim's file of one side, relative to the folder of results.json. False if there is none. */
static bool file_of(const json_t *claim, const char *side, const char *json_path, char *path)
{
    const char *file = member_text(json_object_get(claim, "files"), side);
    if (file == NULL)
        return false;
    const char *slash = strrchr(json_path, '/');
    int stem = file[0] == '/' || slash == NULL ? 0 : (int)(slash - json_path) + 1;
    return snprintf(path, MAX_PATH, "%.*s%s", stem, json_path, file) < MAX_PATH;
}

/* The files and the margin by which claims of this scene and engine were judged. */
struct judged_by {
    char image[MAX_PATH], of_ours[MAX_PATH]; /* "": none; ours has the engine's pixel filter */
    double margin;                           /* the widest */
};

static struct judged_by find_judged(const json_t *results, const char *json_path,
                                    const struct view *v, const char *subject)
{
    struct judged_by out = {0};
    const char *engine = v->variant[0] == '\0'        ? subject
                         : strcmp(subject, ours) == 0 ? v->variant
                                                      : "";
    json_each(claim, json_object_get(results, "claims")) {
        if (v->options[0] != NULL || strcmp(member_text(claim, "scene"), v->scene) != 0 ||
            strcmp(member_text(claim, "a"), engine) != 0 ||
            !file_of(claim, "a", json_path, out.image))
            continue;
        out.margin = fmax(out.margin, member_number(claim, "margin_global"));
        if (strcmp(member_text(claim, "b"), ours) == 0 &&
            !file_of(claim, "b", json_path, out.of_ours))
            out.of_ours[0] = '\0';
    }
    return out;
}

/* The catalogue has the box of one pixel: an image with another filter is replaced by the catalogue's correct image
 * plus the difference from our image with that filter. */
static bool take_filter_off(const char *of_ours, struct observation *clue, struct err *e)
{
    struct observation right;
    if (of_ours[0] == '\0')
        return err_set(e, "no image of ours with its pixel filter");
    if (!read_image(clue->view, of_ours, 0, false, &right, e))
        return false;
    for (int i = 0; i < 3 * clue->seen.columns * clue->seen.rows; i++) {
        clue->seen.mean[i] =
            fmax(0, clue->seen.mean[i] + clue->view->correct.mean[i] - right.seen.mean[i]);
        clue->seen.var[i] += right.seen.var[i];
    }
    return true;
}

static void add_consistency(const json_t *results, struct observation *clue)
{
    json_each(c, json_object_get(results, "consistency")) {
        if (strcmp(member_text(c, "scene"), clue->view->scene) != 0 ||
            member_text(c, "error") != NULL || clue->view->renders < 4)
            continue;
        const json_t *ci = json_object_get(c, "pixels_ci");
        signature_set_stated_error(
            &clue->seen, member_number(c, "pixels"), json_number_value(json_array_get(ci, 0)),
            json_number_value(json_array_get(ci, 1)), member_number(c, "image"),
            (int)member_number(c, "renders"), member_number(c, "alpha"));
        clue->is_consistent =
            strcmp(member_text(c, "verdict"), verdict_name(VERDICT_DIFFERENT)) != 0;
    }
}

static bool is_looked_at(const struct observation *clue, int num, const char *scene)
{
    for (int i = 0; i < num; i++)
        if (strcmp(clue[i].view->scene, scene) == 0)
            return true;
    return false;
}

/* What is DIFFERENT and not in the catalogue, or there with other options only: "nothing wrong found" does not speak of
 * it. */
static void add_scenes_without_view(const struct diagnose_gather_options *opt,
                                    const json_t *results, const char *subject,
                                    const struct observation *clue, int num, json_t *skipped)
{
    static const char different[] = "DIFFERENT";
    const char *last = "";
    json_each(claim, json_object_get(results, "claims")) {
        const char *scene = member_text(claim, "scene");
        const struct suite_scene *known = suite_find(opt->suite, scene);
        if (strcmp(member_text(claim, "a"), subject) != 0 || strcmp(scene, last) == 0 ||
            strcmp(member_text(claim, "verdict"), different) != 0 ||
            strcmp(member_text(claim, "expected"), different) == 0 ||
            is_looked_at(clue, num, scene) || (known != NULL && known->convention[0] != '\0'))
            continue;
        last = scene;
        json_array_append_new(
            skipped,
            json_pack("{ss,ss}", "view", scene, "reason",
                      "it is DIFFERENT, but the catalogue of bugs has no such view of it"));
    }
}

bool diagnose_gather_results(const struct diagnose_gather_options *opt, const char *path,
                             struct observation *clue, int *num, json_t *skipped, struct err *e)
{
    const struct catalogue *c = opt->catalogue;
    json_t *results;
    if (!results_read(path, &results, e))
        return false;
    *num = 0;
    bool ok = true;
    const char *subject = subject_of(results);
    const bool is_ours = strcmp(subject, ours) == 0;
    for (int i = 0; ok && i < c->num_views; i++) {
        const struct view *v = &c->view[i];
        const struct suite_scene *scene;
        const struct suite_variant *variant;
        struct err why = {""};
        ok = catalogue_view_scene(v, opt->suite, &scene, &variant, e);
        if (!ok)
            break;
        const struct judged_by judged = find_judged(results, path, v, subject);
        bool there = judged.image[0] != '\0' || err_set(&why, DIAGNOSE_NO_IMAGE);
        there = there && (is_ours || scene->convention[0] == '\0' ||
                          err_set(&why, "a convention may differ: %s", scene->convention));
        there =
            there && read_image(v, judged.image, is_ours ? v->spp : 0, is_ours, &clue[*num], &why);
        if (there && json_object_get(results, "engine_filter") != NULL)
            there = take_filter_off(judged.of_ours, &clue[*num], &why);
        if (there) {
            if (is_ours)
                add_consistency(results, &clue[*num]);
            else
                allow_conventions(judged.margin, &clue[*num]);
            ++*num;
        } else {
            json_array_append_new(skipped,
                                  json_pack("{ss,ss}", "view", v->name, "reason", why.msg));
        }
    }
    add_scenes_without_view(opt, results, subject, clue, *num, skipped);
    json_decref(results);
    return ok && (*num > 0 ||
                  err_set(e, "%s: none of the scenes that the catalogue of bugs knows", path));
}
