/* make_rubric_bugs BUILD PATCHES RUBRIC...: writes the catalogue of known bugs that the rubrics' line `bugs` names, beside them
 * (tools/grade/rubric_bugs.h): one for all, as they have images in common. Every bug of PATCHES has been built as BUILD/mutants/NAME/pathtracer (tests/mutants/mutants.sh --build-only),
 * the correct renderer is BUILD/pathtracer.
 *
 * The correct images are the references. Of each view, each bug and the correct renderer make BATCHES images of a
 * quarter of the samples asked for, with the same seeds, so that what a bug does not touch has no noise in the
 * difference; one image with all samples where their number is a fact. The effect is the mean of the differences; its variance that of
 * independent images times the level at which the batches scatter, and what one image with the bug has more noise than
 * one without. A bug that changes no pixel of an image of one sample (of four, where their number is a fact and the bug not in adaptive sampling itself) has no effect on it; an
 * effect within its noise is stored as none. Images are kept in BUILD/rubric-bugs: a run that was stopped goes on. */
#include "renderer/base/fs.h"
#include "tools/grade/rubric_bugs.h"
#include "tests/mutants/bug_effect.h"
#include "tests/studies/calibration/work.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { BATCHES = 2, SEED = 40260, LEAST_SPP = 4, MOST_RUBRICS = 8 };

struct course {
    struct rubric rubric;
    struct answer_key answers;
};

/* Of a view. */
struct source {
    const struct course *course;
    int image;
    struct signature batch[BATCHES]; /* the correct renderer's */
    struct moments few;              /* likewise, few_of() samples a pixel */
};

struct maker {
    char build[PATH_MAX];
    struct suite suite;
    struct course *course[MOST_RUBRICS];
    int num;
    struct catalogue made;
    struct source *of; /* as many as views */
};

/* Where a program's images are kept; hash tells its versions apart. */
static bool open_cache(const struct maker *m, const char *name, const char *hash,
                       const char *program, char cache[PATH_MAX], struct answer_options *opt,
                       struct err *e)
{
    char stage[PATH_MAX];
    snprintf(cache, PATH_MAX, "%.3900s/rubric-bugs/%s-%.8s", m->build, name, hash);
    snprintf(stage, sizeof stage, "%.4000s/scene", cache);
    *opt = (struct answer_options){.pathtracer = program,
                                   .golden_dir = "golden",
                                   .cache = cache,
                                   .threads = 1,
                                   .timeout_s = 3600};
    bool ok = fs_make_dirs(cache, e);
    for (int i = 0; ok && i < m->num; i++)
        ok = submission_stage(&m->course[i]->rubric, stage, e);
    return ok;
}

static bool render(const struct source *of, int batch, const struct answer_options *opt,
                   struct signature *out, struct err *e)
{
    const struct rubric *r = &of->course->rubric;
    int spp = r->image[of->image].spp;
    bool counts = rubric_sight_counts(r, of->image);
    char words[64];
    struct moments made;
    snprintf(words, sizeof words, "--seed %d", SEED + batch);
    spp = counts || spp / 4 < LEAST_SPP ? spp : spp / 4;
    if (!answer_key_render(r, of->image, counts, words, spp, opt, &made, e))
        return false;
    bool ok = rubric_sight_of_render(r, of->image, &made, out, e);
    moments_free(&made);
    return ok;
}

/* A few, where samples that depend on each other would show in their number. */
static int few_of(const struct source *of)
{
    return rubric_sight_counts(&of->course->rubric, of->image) ? 4 : 1;
}

/* Few samples a pixel, by the bug: as by the correct renderer? */
static bool is_same(const struct source *of, const struct answer_options *bug, bool *same,
                    struct err *e)
{
    struct moments a;
    const struct moments *b = &of->few;
    if (!answer_key_render(&of->course->rubric, of->image, false, "", few_of(of), bug, &a, e))
        return false;
    *same = a.width == b->width && a.height == b->height &&
            memcmp(a.mean, b->mean, 3 * (size_t)a.width * (size_t)a.height * sizeof *a.mean) == 0;
    moments_free(&a);
    return true;
}

/* For the variance of one image: c->n is to that of an image as the variances are. */
static double of_one(const struct rubric *r, int image, const struct signature *s, int i)
{
    return s->var[i] * s->n / ((double)r->image[image].spp * s->cell * s->cell);
}

static void set_effect(const struct source *of, const struct signature *bug, struct effect *out)
{
    const struct rubric *r = &of->course->rubric;
    const struct signature a =
        signature_average(bug, rubric_sight_counts(r, of->image) ? 1 : BATCHES);
    double more[SIGNATURE_VALUES] = {0};
    for (int i = 0; i < 3 * a.columns * a.rows; i++)
        more[i] =
            fmax(0, of_one(r, of->image, &bug[0], i) - of_one(r, of->image, &of->batch[0], i));
    if (rubric_sight_counts(r, of->image))
        bug_effect(bug, of->batch, 1, 1, more, bug, out);
    else
        bug_effect(bug, of->batch, BATCHES, 0, more, &a, out);
}

static bool is_needed(const struct effect *e, const struct signature *correct)
{
    double far = e->fact[FACT_SAMPLES] - correct->fact[FACT_SAMPLES]; /* NAN: not counted */
    return e->pixels || fabs(far) > 0.01;
}

static bool make_view(struct maker *m, int view, int b, const struct answer_options *bug,
                      struct err *e)
{
    struct signature s[BATCHES];
    struct view *v = &m->made.view[view];
    const struct source *of = &m->of[view];
    bool same = false, counts = rubric_sight_counts(&of->course->rubric, of->image),
         adaptive = strncmp(m->made.bug[b].where, "part 5", 6) == 0;
    if (!(counts && adaptive) && !is_same(of, bug, &same, e))
        return false;
    if (same)
        return true;
    for (int k = 0; k < (counts ? 1 : BATCHES); k++)
        if (!render(of, k, bug, &s[k], e))
            return false;
    struct effect *effect = calloc(1, sizeof *effect);
    if (effect == NULL)
        return err_set(e, "out of memory");
    set_effect(of, s, effect);
    if (is_needed(effect, &v->correct))
        v->effect[b] = effect;
    else
        free(effect);
    return true;
}

static bool make_bug(void *ctx, int b, struct err *e)
{
    struct maker *m = ctx;
    char cache[PATH_MAX], program[PATH_MAX];
    struct answer_options bug;
    const struct bug *what = &m->made.bug[b];
    int seen = 0;
    snprintf(program, sizeof program, "%.3900s/mutants/%s/pathtracer", m->build, what->name);
    if (!open_cache(m, what->name, what->patch_sha256, program, cache, &bug, e))
        return false;
    for (int v = 0; v < m->made.num_views; v++) {
        if (!make_view(m, v, b, &bug, e))
            return err_prefix(e, "%s", what->name);
        seen += m->made.view[v].effect[b] != NULL;
    }
    printf("%-36s changes %2d of %d views\n", what->name, seen, m->made.num_views);
    fflush(stdout);
    return true;
}

/* What is right: the reference; of adaptive sampling, whose mean it is not, the batches. */
static bool make_correct(struct source *of, const struct answer_options *ours, struct view *v,
                         struct err *e)
{
    const struct rubric *r = &of->course->rubric;
    for (int k = 0; k < BATCHES; k++)
        if (!render(of, k, ours, &of->batch[k], e))
            return false;
    if (!answer_key_render(r, of->image, false, "", few_of(of), ours, &of->few, e))
        return false;
    if (!rubric_sight_counts(r, of->image))
        return rubric_sight_of_render(r, of->image, &of->course->answers.of[0][of->image].m,
                                      &v->correct, e);
    v->correct = signature_average(of->batch, BATCHES);
    return true;
}

static bool add_view(struct maker *m, const struct course *course, int image,
                     const struct answer_options *ours, struct err *e)
{
    const struct rubric_image *p = &course->rubric.image[image];
    struct view *v = &m->made.view[m->made.num_views];
    struct source *of = &m->of[m->made.num_views];
    *v = (struct view){.width = p->width,
                       .height = p->height,
                       .spp = p->spp > 2 ? p->spp : 3,
                       .renders = 1,
                       .fixed_spp = true,
                       .seed = SEED};
    *of = (struct source){.course = course, .image = image};
    snprintf(v->name, sizeof v->name, "%s", p->name);
    if (!rubric_bugs_key(&course->rubric, image, v->scene_sha256, e))
        return false;
    const struct view *other = catalogue_view(&m->made, p->name);
    if (other != NULL)
        return strcmp(other->scene_sha256, v->scene_sha256) == 0 ||
               err_set(e, "%s:%d: another rubric has another image '%s'", course->rubric.path,
                       p->line, p->name);
    v->effect = calloc((size_t)m->made.num_bugs, sizeof(struct effect *));
    m->made.num_views++;
    return v->effect != NULL ? make_correct(of, ours, v, e) : err_set(e, "out of memory");
}

static bool add_views(struct maker *m, const struct answer_options *ours, struct err *e)
{
    const size_t most = MOST_RUBRICS * RUBRIC_IMAGES;
    m->made.view = calloc(most, sizeof *m->made.view);
    m->of = calloc(most, sizeof *m->of);
    if (m->made.view == NULL || m->of == NULL)
        return err_set(e, "out of memory");
    for (int k = 0; k < m->num; k++) {
        struct course *course = m->course[k];
        if (!answer_key_make(&course->rubric, ours, &course->answers, e))
            return false;
        for (int i = 0; i < course->rubric.num_images; i++)
            if (rubric_bugs_sees(&course->rubric, i) && !add_view(m, course, i, ours, e))
                return false;
    }
    return true;
}

static bool make(struct maker *m, const char *patches, struct err *e)
{
    char cache[PATH_MAX], ours[PATH_MAX], out[2 * PATH_MAX];
    struct answer_options opt;
    const struct rubric *r = &m->course[0]->rubric;
    snprintf(ours, sizeof ours, "%.4000s/pathtracer", m->build);
    if (!bug_list(patches, &m->made, e) ||
        !open_cache(m, "correct", "references", ours, cache, &opt, e) || !add_views(m, &opt, e))
        return false;
    snprintf(out, sizeof out, "%s/%s", r->dir, r->bugs);
    return work_run_all(m->made.num_bugs, make_bug, m, e) && catalogue_write(out, &m->made, e);
}

/* That the directory of the catalogue is not there is a mistake: it is made before. */
static bool read_course(struct maker *m, const char *path, struct err *e)
{
    struct rubric_mistakes mistakes = {0};
    char dir[2 * PATH_MAX];
    struct course *c = calloc(1, sizeof *c);
    if (c == NULL)
        return err_set(e, "out of memory");
    m->course[m->num++] = c;
    if (!rubric_read(path, &m->suite, &c->rubric, &mistakes, e))
        return false;
    if (c->rubric.bugs[0] == '\0')
        return err_set(e, "%s: no line 'bugs DIR'", path);
    snprintf(dir, sizeof dir, "%s/%s", c->rubric.dir, c->rubric.bugs);
    if (!fs_make_dirs(dir, e) || !rubric_read(path, &m->suite, &c->rubric, &mistakes, e))
        return false;
    return mistakes.num == 0 ||
           err_set(e, "%s:%d: %s", path, mistakes.at[0].line, mistakes.at[0].text);
}

int main(int argc, char **argv)
{
    struct err e = {""};
    static struct maker m;
    if (argc < 4 || argc > 3 + MOST_RUBRICS) {
        fprintf(stderr, "usage: make_rubric_bugs BUILD PATCHES RUBRIC...\n");
        return 3;
    }
    bool ok = realpath(argv[1], m.build) != NULL && suite_load("reference/scenes", &m.suite, &e);
    for (int i = 3; ok && i < argc; i++)
        ok = read_course(&m, argv[i], &e);
    ok = ok && make(&m, argv[2], &e);
    if (!ok)
        fprintf(stderr, "make_rubric_bugs: %s\n", e.msg);
    for (int v = 0; m.of != NULL && v < m.made.num_views; v++)
        moments_free(&m.of[v].few);
    catalogue_free(&m.made);
    for (int k = 0; k < m.num; k++) {
        answer_key_free(&m.course[k]->answers);
        free(m.course[k]);
    }
    suite_free(&m.suite);
    free(m.of);
    return ok ? 0 : 3;
}
