#include "grade_diagnose.h"

#include "renderer/base/fs.h"
#include "tools/base/text.h"
#include "tools/diagnose/diagnose_gather.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void join(const char *const *words, char *out, size_t size)
{
    for (out[0] = '\0'; words != NULL && *words != NULL; words++)
        text_append(out, size, "%s ", *words);
}

static bool add_view(const struct view *v, const struct suite *suite, struct rubric *r,
                     struct err *e)
{
    const struct suite_scene *scene;
    const struct suite_variant *variant;
    if (r->num_images == RUBRIC_IMAGES)
        return err_set(e, "more than %d views to diagnose by", RUBRIC_IMAGES);
    if (!catalogue_view_scene(v, suite, &scene, &variant, e))
        return false;
    struct rubric_image *p = &r->image[r->num_images++];
    *p = (struct rubric_image){.suite = scene,
                               .width = v->width,
                               .height = v->height,
                               .spp = v->spp,
                               .lights = 1,
                               .bounces = scene->depth};
    snprintf(p->name, sizeof p->name, "view%d", r->num_images);
    snprintf(p->scene, sizeof p->scene, "%s", scene->name);
    join(v->options[0] != NULL ? v->options
         : variant != NULL     ? variant->options
                               : NULL,
         p->options, sizeof p->options);
    return true;
}

bool grade_diagnose_open(const struct rubric *r, const char *catalogue_dir,
                         const struct suite *suite, const char *stage, struct grade_diagnosis *out,
                         struct err *e)
{
    *out = (struct grade_diagnosis){.suite = suite, .rubric = calloc(1, sizeof *out->rubric)};
    snprintf(out->stage, sizeof out->stage, "%s", stage);
    bool ok = (out->rubric != NULL || err_set(e, "out of memory")) &&
              catalogue_read(catalogue_dir, &out->catalogue, e);
    if (ok) {
        out->rubric->limit = r->limit;
        snprintf(out->rubric->path, sizeof out->rubric->path, "%s", r->path);
        snprintf(out->rubric->dir, sizeof out->rubric->dir, "%s", r->dir);
        snprintf(out->rubric->command, sizeof out->rubric->command, "%s", r->diagnose);
        snprintf(out->rubric->output, sizeof out->rubric->output, "diagnose.exr");
    }
    for (int i = 0; ok && i < out->catalogue.num_views; i++)
        ok = add_view(&out->catalogue.view[i], suite, out->rubric, e);
    ok = ok && submission_stage(out->rubric, stage, e);
    if (!ok)
        grade_diagnose_close(out);
    return ok;
}

void grade_diagnose_close(struct grade_diagnosis *d)
{
    catalogue_free(&d->catalogue);
    free(d->rubric);
    *d = (struct grade_diagnosis){0};
}

/* One view rendered by the submission; the image goes away again. */
static bool look(const struct grade_diagnosis *d, const struct sandbox *box,
                 const struct submission *s, int view, const char *work, uint64_t seed, int threads,
                 double alpha, struct observation *clue, struct err *e)
{
    struct made made;
    const struct diagnose_gather_options opt = {
        .catalogue = &d->catalogue, .suite = d->suite, .alpha = alpha};
    const struct path out = fs_path("%s/diagnose", work);
    if (!fs_make_dirs(out.s, e) ||
        !submission_image(d->rubric, box, s, &d->rubric->image[view], d->stage, work, out.s,
                          seed * 1000u + (uint64_t)view, threads, &made, e))
        return false;
    bool ok = made.why[0] == '\0'
                  ? diagnose_gather_image(&opt, d->catalogue.view[view].name, made.path, clue, e)
                  : err_set(e, "%.500s", made.why);
    struct err ignored;
    return fs_remove_tree(out.s, ok ? e : &ignored) && ok;
}

static json_t *finding_json(const struct catalogue *c, const struct diagnosis *found)
{
    static const char *const names[] = {
        [FINDING_CORRECT] = "correct", [FINDING_BUG] = "bug", [FINDING_UNKNOWN] = "unknown"};
    json_t *named = json_array();
    for (int i = 0; i < found->num_named; i++) {
        const struct candidate *one = &found->candidate[i];
        const struct bug *b = &c->bug[one->bug],
                         *other = one->second >= 0 ? &c->bug[one->second] : NULL;
        char name[64];
        catalogue_mistake(b, name);
        json_t *explained = isnan(one->explained) ? json_null() : json_real(one->explained);
        json_t *entry = json_pack("{ss, ss, ss, so}", "name", name, "bug", b->what, "where",
                                  b->where, "explained", explained);
        if (other != NULL) {
            catalogue_mistake(other, name);
            json_object_update_new(entry, json_pack("{ss, ss, ss}", "and", name, "and_bug",
                                                    other->what, "and_where", other->where));
        }
        json_array_append_new(named, entry);
    }
    return json_pack("{ss, ss, so}", "finding", names[found->finding], "gate", found->gate, "named",
                     named);
}

json_t *grade_diagnose_by_images(const struct rubric_bugs *b, const struct rubric *r,
                                 const struct mistake *m)
{
    if (!m->looked)
        return m->why[0] != '\0' ? json_pack("{ss}", "error", m->why) : json_null();
    json_t *json = finding_json(&b->catalogue, &m->found);
    json_object_set_new(json, "with", json_string(r->set[m->with].name));
    return json;
}

json_t *grade_diagnose_of(const struct grade_diagnosis *d, const struct sandbox *box,
                          const struct submission *s, const char *work, uint64_t seed, int threads,
                          double alpha)
{
    const struct catalogue *c = &d->catalogue;
    const struct diagnose_options opt = {.alpha = alpha};
    struct observation *clue = calloc((size_t)c->num_views, sizeof *clue);
    struct diagnosis found;
    struct err e = {""};
    bool ok = clue != NULL || err_set(&e, "out of memory");
    for (int i = 0; ok && i < c->num_views; i++)
        ok = look(d, box, s, i, work, seed, threads, alpha, &clue[i], &e) ||
             err_prefix(&e, "%s", c->view[i].name);
    ok = ok && diagnose(c, clue, c->num_views, &opt, &found, &e);
    free(clue);
    return ok ? finding_json(c, &found) : json_pack("{ss}", "error", e.msg);
}
