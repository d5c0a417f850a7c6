/* make_rubric_bugs BUILD PATCHES [--variant N] RUBRIC... [--plain RUBRIC...]: writes the catalogue of known bugs that the rubrics' line `bugs` names, beside them
 * (tools/grade/rubric_bugs.h): one for all, as they have images in common. Every bug of PATCHES, and of `bugs` beside this file, has been built as BUILD/mutants/NAME/pathtracer
 * (tests/mutants/mutants.sh --build-only), the correct renderer is BUILD/pathtracer. --variant: of rubrics that have several. The latter are mistakes as they stand in
 * the assignment's code, which has a function for each way to sample light and gives direct light whatever the depth.
 *
 * The correct images are the references, without deviations and with each of those accepted by words (after --plain: without). Of each view, each bug and
 * the correct renderer make BATCHES images of a quarter of the samples asked for, LEAST_SPP at least, with the same seeds, so that what a bug does not touch has no noise in the
 * difference. The effect is the mean of the differences; its variance that of
 * independent images times the level at which the batches scatter, and what one image with the bug has more noise than
 * one without. Bugs of Part 5 depend on the number of samples: all are taken, and of adaptive images one as it is asked for; other bugs do to such an
 * image what they do to one without adaptive sampling. A bug that changes no pixel of an image of one sample has no effect on it; an
 * effect within its noise is stored as none. Images are kept in BUILD/rubric-bugs: a run that was stopped goes on; effects that
 * the catalogue has of a bug that has not changed, on an image that has not, are kept: remove it to make all anew. */
#include "renderer/base/cli.h"
#include "renderer/base/fs.h"
#include "tools/grade/rubric_bugs.h"
#include "tests/mutants/bug_effect.h"
#include "tests/tools/diagnose/catalogue_write.h"
#include "tests/studies/calibration/work.h"

#include <limits.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { BATCHES = 2, SEED = 40260, LEAST_SPP = 32, MOST_RUBRICS = 8 };

struct course {
    bool plain;
    struct rubric rubric;
    struct answer_key answers;
};

enum depth { QUARTER, ALL, AS_ASKED, NUM_DEPTHS };

/* Of a view. */
struct source {
    const struct course *course;
    int image, set, plain;                       /* plain: number of the view without deviations */
    struct signature batch[NUM_DEPTHS][BATCHES]; /* the correct renderer's */
    bool made[NUM_DEPTHS];
    struct moments one; /* likewise, one sample a pixel */
};

struct maker {
    char build[PATH_MAX];
    struct suite suite;
    struct course *course[MOST_RUBRICS];
    int num;
    struct catalogue made, old;
    struct source *of; /* as many as views */
    struct answer_options correct;
    pthread_mutex_t lock;
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

static bool is_adaptive(const struct source *of)
{
    return rubric_is_adaptive(&of->course->rubric.image[of->image]);
}

/* Samples a pixel: those asked for; at QUARTER a quarter of them, or a 16th of an adaptive image's, and LEAST_SPP at
 * least. */
static int samples_of(const struct source *of, enum depth depth)
{
    int spp = of->course->rubric.image[of->image].spp, quarter = spp / (is_adaptive(of) ? 16 : 4);
    return depth != QUARTER ? spp : quarter < LEAST_SPP ? LEAST_SPP : quarter;
}

static bool render(const struct source *of, enum depth depth, int batch,
                   const struct answer_options *opt, struct signature *out, struct err *e)
{
    const struct rubric *r = &of->course->rubric;
    char words[1024];
    struct moments made;
    snprintf(words, sizeof words, "%s --seed %d", r->set[of->set].words, SEED + batch);
    if (!answer_key_render(r, of->image, depth == AS_ASKED, words, samples_of(of, depth), opt,
                           &made, e))
        return false;
    bool ok = rubric_sight_of_render(r, of->image, depth == AS_ASKED, &made, out, e);
    moments_free(&made);
    return ok;
}

static int batches_of(enum depth depth)
{
    return depth == AS_ASKED ? 1 : BATCHES;
}

/* The correct renderer's, when the first bug needs them. */
static bool make_batches(struct maker *m, struct source *of, enum depth depth, struct err *e)
{
    bool ok = true;
    pthread_mutex_lock(&m->lock);
    for (int k = 0; ok && !of->made[depth] && k < batches_of(depth); k++)
        ok = render(of, depth, k, &m->correct, &of->batch[depth][k], e);
    of->made[depth] = ok;
    pthread_mutex_unlock(&m->lock);
    return ok;
}

/* One sample a pixel, by the bug: as by the correct renderer? */
static bool is_same(const struct source *of, const struct answer_options *bug, bool *same,
                    struct err *e)
{
    struct moments a;
    const struct moments *b = &of->one;
    const struct rubric *r = &of->course->rubric;
    if (!answer_key_render(r, of->image, false, r->set[of->set].words, 1, bug, &a, e))
        return false;
    *same = a.width == b->width && a.height == b->height &&
            memcmp(a.mean, b->mean, 3 * (size_t)a.width * (size_t)a.height * sizeof *a.mean) == 0;
    moments_free(&a);
    return true;
}

/* The variance of a cell's mean in one image of the spp asked for: scaled by the ratio of sample counts. */
static double of_one(const struct rubric *r, int image, const struct signature *s, int i)
{
    return s->var[i] * s->n / ((double)r->image[image].spp * s->cell * s->cell);
}

static void set_effect(const struct source *of, enum depth depth, const struct signature *bug,
                       struct effect *out)
{
    const struct rubric *r = &of->course->rubric;
    const struct signature a = signature_average(bug, batches_of(depth)), *right = of->batch[depth];
    double more[SIGNATURE_VALUES] = {0};
    for (int i = 0; i < 3 * a.columns * a.rows; i++)
        more[i] = fmax(0, of_one(r, of->image, &bug[0], i) - of_one(r, of->image, right, i));
    if (depth == AS_ASKED)
        bug_effect(bug, right, 1, 1, more, bug, out);
    else
        bug_effect(bug, right, BATCHES, 0, more, &a, out);
}

static bool is_needed(const struct effect *e, const struct signature *correct)
{
    double far = e->fact[FACT_SAMPLES] - correct->fact[FACT_SAMPLES]; /* NAN: not counted */
    return e->pixels || fabs(far) > 0.01;
}

/* What the catalogue has of it already. */
static bool keep_effect(struct maker *m, struct view *v, int b, bool *kept, struct err *e)
{
    const struct view *old = catalogue_view(&m->old, v->name);
    int number = catalogue_bug(&m->old, m->made.bug[b].name);
    if (old == NULL || number < 0 || strcmp(old->scene_sha256, v->scene_sha256) != 0 ||
        strcmp(m->old.bug[number].patch_sha256, m->made.bug[b].patch_sha256) != 0)
        return true;
    *kept = true;
    if (old->effect[number] == NULL)
        return true;
    v->effect[b] = malloc(sizeof *v->effect[b]);
    if (v->effect[b] == NULL)
        return err_set(e, "out of memory");
    *v->effect[b] = *old->effect[number];
    return true;
}

/* same: of each view so far, whether the bug leaves it alone. */
static bool make_view(struct maker *m, int view, int b, const struct answer_options *bug,
                      bool *same, struct err *e)
{
    struct signature s[BATCHES];
    struct view *v = &m->made.view[view];
    struct source *of = &m->of[view];
    bool kept = false;
    if (!keep_effect(m, v, b, &kept, e) || kept)
        return kept;
    bool adaptive = strncmp(m->made.bug[b].where, "part 5", 6) == 0;
    enum depth depth = !adaptive ? QUARTER : is_adaptive(of) ? AS_ASKED : ALL;
    if (of->plain != view && depth != AS_ASKED && same[of->plain])
        same[view] = true;
    else if (depth != AS_ASKED && !is_same(of, bug, &same[view], e))
        return false;
    if (same[view])
        return true;
    if (!make_batches(m, of, depth, e))
        return false;
    for (int k = 0; k < batches_of(depth); k++)
        if (!render(of, depth, k, bug, &s[k], e))
            return false;
    struct effect *effect = calloc(1, sizeof *effect);
    if (effect == NULL)
        return err_set(e, "out of memory");
    set_effect(of, depth, s, effect);
    if (is_needed(effect, &v->correct))
        v->effect[b] = effect;
    else
        free(effect);
    return true;
}

static bool make_bug(void *ctx, int b, struct err *e)
{
    struct maker *m = ctx;
    char cache[PATH_MAX];
    struct answer_options bug;
    const struct bug *what = &m->made.bug[b];
    int seen = 0;
    bool same[MOST_RUBRICS * RUBRIC_IMAGES * 2] = {false};
    const struct path program = fs_path("%.3900s/mutants/%s/pathtracer", m->build, what->name);
    if (!open_cache(m, what->name, what->patch_sha256, program.s, cache, &bug, e))
        return false;
    for (int v = 0; v < m->made.num_views; v++) {
        if (!make_view(m, v, b, &bug, same, e))
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
    struct signature batch[BATCHES];
    if (!answer_key_render(r, of->image, false, r->set[of->set].words, 1, ours, &of->one, e))
        return false;
    if (!rubric_sight_counts(r, of->image))
        return rubric_sight_of_render(
            r, of->image, false, &of->course->answers.of[of->set][of->image].m, &v->correct, e);
    for (int k = 0; k < BATCHES; k++)
        if (!render(of, AS_ASKED, k, ours, &batch[k], e))
            return false;
    v->correct = signature_average(batch, BATCHES);
    return true;
}

static bool add_view(struct maker *m, const struct course *course, int set, int image,
                     const struct answer_options *ours, struct err *e)
{
    char key[65];
    const struct rubric_image *p = &course->rubric.image[image];
    struct view *v = &m->made.view[m->made.num_views];
    struct source *of = &m->of[m->made.num_views];
    *v = (struct view){.width = p->width,
                       .height = p->height,
                       .spp = p->spp > 2 ? p->spp : 3,
                       .renders = 1,
                       .fixed_spp = true,
                       .seed = SEED};
    *of = (struct source){.course = course, .image = image, .set = set};
    if (!rubric_bugs_key(&course->rubric, set, image, v->name, key, e))
        return false;
    const struct view *other = catalogue_view(&m->made, v->name),
                      *plain = catalogue_view(&m->made, p->name);
    snprintf(v->scene_sha256, sizeof v->scene_sha256, "%s", key);
    of->plain = set > 0 ? (int)(plain - m->made.view) : m->made.num_views;
    if (other != NULL)
        return strcmp(other->scene_sha256, key) == 0 ||
               err_set(e, "%s:%d: another rubric has another image '%s'", course->rubric.path,
                       p->line, v->name);
    v->effect = calloc((size_t)m->made.num_bugs, sizeof(struct effect *));
    m->made.num_views++;
    return v->effect != NULL ? make_correct(of, ours, v, e) : err_set(e, "out of memory");
}

static bool add_views(struct maker *m, const struct answer_options *ours, struct err *e)
{
    const size_t most = MOST_RUBRICS * RUBRIC_IMAGES * 2;
    m->made.view = calloc(most, sizeof *m->made.view);
    m->of = calloc(most, sizeof *m->of);
    if (m->made.view == NULL || m->of == NULL)
        return err_set(e, "out of memory");
    for (int k = 0; k < m->num; k++) {
        struct course *course = m->course[k];
        if (!answer_key_make(&course->rubric, ours, &course->answers, e))
            return false;
        for (int s = 0; s < course->rubric.num_sets; s++)
            for (int i = 0; i < course->rubric.num_images; i++)
                if ((s == 0 || !course->plain) && rubric_bugs_measures(&course->rubric, s) &&
                    rubric_bugs_sees(&course->rubric, i) &&
                    rubric_bugs_set(&course->answers, s, i) == s &&
                    !add_view(m, course, s, i, ours, e))
                    return false;
    }
    return true;
}

static bool make(struct maker *m, const char *patches, struct err *e)
{
    static char cache[PATH_MAX];
    char ours[PATH_MAX];
    const struct rubric *r = &m->course[0]->rubric;
    snprintf(ours, sizeof ours, "%.4000s/pathtracer", m->build);
    if (!bug_list(patches, &m->made, e) || !bug_list("tests/studies/grading/bugs", &m->made, e) ||
        !open_cache(m, "correct", "references", ours, cache, &m->correct, e) ||
        !add_views(m, &m->correct, e))
        return false;
    const struct path out = fs_path("%s/%s", r->dir, r->bugs);
    struct err none;
    if (!catalogue_read(out.s, &m->old, &none))
        m->old = (struct catalogue){0};
    return work_run_all(NULL, m->made.num_bugs, make_bug, m, e) &&
           catalogue_write(out.s, &m->made, e);
}

/* A missing catalogue directory would be a mistake of the rubric, so it is made before. */
static bool read_course(struct maker *m, const char *path, int variant, bool plain, struct err *e)
{
    struct rubric_mistakes mistakes = {0};
    struct course *c = calloc(1, sizeof *c);
    if (c == NULL)
        return err_set(e, "out of memory");
    m->course[m->num++] = c;
    c->plain = plain;
    if (!rubric_read(path, &m->suite, variant, &c->rubric, &mistakes, e))
        return false;
    if (c->rubric.bugs[0] == '\0')
        return err_set(e, "%s: no line 'bugs DIR'", path);
    if (!fs_make_dirs(fs_path("%s/%s", c->rubric.dir, c->rubric.bugs).s, e) ||
        !rubric_read(path, &m->suite, variant, &c->rubric, &mistakes, e))
        return false;
    return mistakes.num == 0 ||
           err_set(e, "%s:%d: %s", path, mistakes.at[0].line, mistakes.at[0].text);
}

int main(int argc, char **argv)
{
    struct err e = {""};
    static struct maker m = {.lock = PTHREAD_MUTEX_INITIALIZER};
    if (argc < 4 || argc > 6 + MOST_RUBRICS) {
        fprintf(
            stderr,
            "usage: make_rubric_bugs BUILD PATCHES [--variant N] RUBRIC... [--plain RUBRIC...]\n");
        return 3;
    }
    bool ok = realpath(argv[1], m.build) != NULL && suite_load("reference/scenes", &m.suite, &e);
    bool plain = false;
    int variant = 0;
    for (int i = 3; ok && i < argc; i++)
        if (strcmp(argv[i], "--plain") == 0)
            plain = true;
        else if (strcmp(argv[i], "--variant") == 0 && i + 1 < argc)
            ok = cli_int("--variant", argv[++i], 1, 99, &variant, &e);
        else
            ok = read_course(&m, argv[i], variant, plain, &e);
    ok = ok && make(&m, argv[2], &e);
    if (!ok)
        fprintf(stderr, "make_rubric_bugs: %s\n", e.msg);
    for (int v = 0; m.of != NULL && v < m.made.num_views; v++)
        moments_free(&m.of[v].one);
    catalogue_free(&m.made);
    catalogue_free(&m.old);
    for (int k = 0; k < m.num; k++) {
        answer_key_free(&m.course[k]->answers);
        free(m.course[k]);
    }
    suite_free(&m.suite);
    free(m.of);
    return ok ? 0 : 3;
}
