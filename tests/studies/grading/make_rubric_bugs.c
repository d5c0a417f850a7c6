/* make_rubric_bugs BUILD PATCHES RUBRIC: writes the catalogue of known bugs that the rubric's line `bugs` names, beside the rubric
 * (tools/grade/rubric_bugs.h). Every bug of PATCHES has been built as BUILD/mutants/NAME/pathtracer (tests/mutants/mutants.sh --build-only),
 * the correct renderer is BUILD/pathtracer.
 *
 * The correct images are the references. Of each view, each bug and the correct renderer make BATCHES images of a
 * quarter of the samples asked for, with the same seeds, so that what a bug does not touch has no noise in the
 * difference; with all samples where their number is a fact. The effect is the mean of the differences; its variance that of
 * independent images times the level at which the batches scatter, and what one image with the bug has more noise than
 * one without. A bug that changes no pixel of an image of one sample has no effect on it, nor on it with deviations; an
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

enum { BATCHES = 2, SEED = 40260, LEAST_SPP = 4 };

struct maker {
    char build[PATH_MAX];
    struct suite suite;
    struct rubric *rubric;
    struct answer_key *answers;
    struct catalogue made;
    int image[RUBRIC_SETS * RUBRIC_IMAGES], set[RUBRIC_SETS * RUBRIC_IMAGES]; /* of a view */
    struct signature (*batch)[BATCHES]; /* of a view: the correct renderer's */
    struct moments *one; /* likewise, one sample a pixel; of views without deviations */
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
    return fs_make_dirs(cache, e) && submission_stage(m->rubric, stage, e);
}

static bool render(const struct maker *m, int view, int batch, const struct answer_options *opt,
                   struct signature *out, struct err *e)
{
    const struct rubric *r = m->rubric;
    int image = m->image[view], spp = r->image[image].spp;
    bool counts = rubric_bugs_counts(r, image);
    char words[1024];
    struct moments made;
    snprintf(words, sizeof words, "--seed %d %s", SEED + batch, r->set[m->set[view]].words);
    spp = counts || spp / 4 < LEAST_SPP ? spp : spp / 4;
    if (!answer_key_render(r, image, counts, words, spp, opt, &made, e))
        return false;
    bool ok = rubric_bugs_sight(r, image, &made, out, e);
    moments_free(&made);
    return ok;
}

/* One sample a pixel, by the bug: as by the correct renderer? */
static bool is_same(const struct maker *m, int view, const struct answer_options *bug, bool *same,
                    struct err *e)
{
    struct moments a;
    const struct moments *b = &m->one[view];
    if (!answer_key_render(m->rubric, m->image[view], false, "", 1, bug, &a, e))
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

static void set_effect(const struct maker *m, int view, const struct signature *bug,
                       struct effect *out)
{
    const struct signature *correct = m->batch[view], a = signature_average(bug, BATCHES);
    double more[SIGNATURE_VALUES] = {0};
    for (int i = 0; i < 3 * a.columns * a.rows; i++)
        more[i] = fmax(0, of_one(m->rubric, m->image[view], &bug[0], i) -
                              of_one(m->rubric, m->image[view], &correct[0], i));
    bug_effect(bug, correct, BATCHES, 0, more, &a, out);
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
    const struct view *plain = &m->made.view[0];
    bool same = false, counts = rubric_bugs_counts(m->rubric, m->image[view]);
    for (int k = 0; k < view; k++)
        if (m->image[k] == m->image[view] && m->set[k] == 0)
            plain = &m->made.view[k];
    if (m->set[view] > 0 && plain->effect[b] == NULL)
        return true;
    if (m->set[view] == 0 && !counts && !is_same(m, view, bug, &same, e))
        return false;
    if (same)
        return true;
    for (int k = 0; k < BATCHES; k++)
        if (!render(m, view, k, bug, &s[k], e))
            return false;
    struct effect *effect = calloc(1, sizeof *effect);
    if (effect == NULL)
        return err_set(e, "out of memory");
    set_effect(m, view, s, effect);
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
static bool make_correct(struct maker *m, int view, const struct answer_options *ours,
                         struct err *e)
{
    struct view *v = &m->made.view[view];
    int image = m->image[view];
    for (int k = 0; k < BATCHES; k++)
        if (!render(m, view, k, ours, &m->batch[view][k], e))
            return false;
    if (m->set[view] == 0 &&
        !answer_key_render(m->rubric, image, false, "", 1, ours, &m->one[view], e))
        return false;
    if (!rubric_bugs_counts(m->rubric, image))
        return rubric_bugs_sight(m->rubric, image, &m->answers->of[m->set[view]][image].m,
                                 &v->correct, e);
    v->correct = signature_average(m->batch[view], BATCHES);
    return true;
}

static bool add_views(struct maker *m, const struct answer_options *ours, struct err *e)
{
    const struct rubric *r = m->rubric;
    size_t most = (size_t)r->num_sets * (size_t)r->num_images;
    m->made.view = calloc(most, sizeof *m->made.view);
    m->batch = calloc(most, sizeof *m->batch);
    m->one = calloc(most, sizeof *m->one);
    if (m->made.view == NULL || m->batch == NULL || m->one == NULL)
        return err_set(e, "out of memory");
    for (int k = 0; k < r->num_sets; k++)
        for (int i = 0; i < r->num_images; i++) {
            if (!rubric_bugs_sees(r, i) || rubric_bugs_set(m->answers, k, i) != k ||
                (k > 0 && r->set[k].words[0] == '\0'))
                continue;
            int at = m->made.num_views++;
            struct view *v = &m->made.view[at];
            *v = (struct view){.width = r->image[i].width,
                               .height = r->image[i].height,
                               .spp = r->image[i].spp > 2 ? r->image[i].spp : 3,
                               .renders = 1,
                               .fixed_spp = true,
                               .seed = SEED,
                               .effect = calloc((size_t)m->made.num_bugs, sizeof(struct effect *))};
            m->image[at] = i;
            m->set[at] = k;
            if (v->effect == NULL)
                return err_set(e, "out of memory");
            if (!rubric_bugs_key(r, i, k, v->name, v->scene_sha256, e) ||
                !make_correct(m, at, ours, e))
                return false;
        }
    return true;
}

static bool make(struct maker *m, const char *patches, struct err *e)
{
    char cache[PATH_MAX], ours[PATH_MAX], out[2 * PATH_MAX];
    struct answer_options opt;
    snprintf(ours, sizeof ours, "%.4000s/pathtracer", m->build);
    if (!bug_list(patches, &m->made, e) ||
        !open_cache(m, "correct", "references", ours, cache, &opt, e) ||
        !answer_key_make(m->rubric, &opt, m->answers, e) || !add_views(m, &opt, e))
        return false;
    snprintf(out, sizeof out, "%s/%s", m->rubric->dir, m->rubric->bugs);
    return work_run_all(m->made.num_bugs, make_bug, m, e) && catalogue_write(out, &m->made, e);
}

int main(int argc, char **argv)
{
    struct err e = {""};
    struct rubric_mistakes mistakes = {0};
    static struct maker m;
    if (argc != 4) {
        fprintf(stderr, "usage: make_rubric_bugs BUILD PATCHES RUBRIC\n");
        return 3;
    }
    m.rubric = calloc(1, sizeof *m.rubric);
    m.answers = calloc(1, sizeof *m.answers);
    char dir[2 * PATH_MAX];
    bool ok = m.rubric != NULL && m.answers != NULL && realpath(argv[1], m.build) != NULL &&
              suite_load("reference/scenes", &m.suite, &e) &&
              rubric_read(argv[3], &m.suite, m.rubric, &mistakes, &e);
    if (ok && m.rubric->bugs[0] != '\0') { /* that it is not there is a mistake */
        snprintf(dir, sizeof dir, "%s/%s", m.rubric->dir, m.rubric->bugs);
        ok = fs_make_dirs(dir, &e) && rubric_read(argv[3], &m.suite, m.rubric, &mistakes, &e);
    }
    if (ok && mistakes.num > 0)
        ok = err_set(&e, "%s:%d: %s", argv[3], mistakes.at[0].line, mistakes.at[0].text);
    if (ok && m.rubric->bugs[0] == '\0')
        ok = err_set(&e, "%s: no line 'bugs DIR'", argv[3]);
    ok = ok && make(&m, argv[2], &e);
    if (!ok)
        fprintf(stderr, "make_rubric_bugs: %s\n", e.msg);
    for (int v = 0; m.one != NULL && v < m.made.num_views; v++)
        moments_free(&m.one[v]);
    catalogue_free(&m.made);
    if (m.answers != NULL)
        answer_key_free(m.answers);
    suite_free(&m.suite);
    free(m.one);
    free(m.batch);
    free(m.answers);
    free(m.rubric);
    return ok ? 0 : 3;
}
