/* make_catalogue BUILD PATCHES CATALOGUE: brings the catalogue of known bugs (tools/diagnose/catalogue.h) up to date.
 * Every bug of PATCHES has to be built as BUILD/mutants/NAME/pathtracer (tests/mutants/mutants.sh --build-only); the
 * correct renderer is BUILD/pathtracer.
 *
 * For each view: BATCHES batches of renders by the correct renderer, and by each bug with the same seeds,
 * so that what a bug does not touch has no noise in the difference. The effect is the mean over batches of
 * bug minus correct. Its variance per cell is lambda (var bug + var correct), as of independent renders,
 * with lambda from the scatter of the differences over the batches. A bug whose first batch is bit for bit the
 * correct one has no effect; an effect within its noise (chi^2 less than 6 standard deviations above its mean)
 * is stored as none, as it would only add noise. The correct mean has LONG further renders of LONG_FACTOR
 * times the samples.
 *
 * What is there and up to date (the scene's and the patch's hash, the view's settings) is kept. */
#include "renderer/base/fs.h"
#include "tools/diagnose/diagnose_render.h"
#include "bug_effect.h"
#include "tests/tools/diagnose/catalogue_write.h"
#include "tests/studies/calibration/work.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { BATCHES = 2, LONG = 4, LONG_FACTOR = 8, SEED = 20260, LONG_SEED = 30260 };

/* Few and cheap views that tell the bugs apart; spp and renders are those of a diagnosis, whose
 * time they decide. */
static const struct {
    const char *scene, *variant, *options, *name; /* name: what is added to the scene's */
    int width, height, columns, spp, renders;
    bool fixed_spp;
} views[] = {
    {"12_point_plane", "", "", "", 64, 64, 16, 6, 12, false},
    {"15_square_overhead", "pathtracer-hemisphere", "", "-hemisphere", 32, 32, 16, 64, 1, false},
    {"16_snell_window", "", "", "", 32, 32, 16, 48, 1, false},
    {"17_lens_step", "", "", "", 32, 32, 16, 64, 1, false},
    {"22_glass_sphere", "", "", "", 32, 32, 16, 64, 1, false},
    {"24_beckmann", "", "", "", 32, 32, 16, 48, 1, false},
    {"25_ggx_metal", "", "", "", 32, 32, 16, 48, 1, false},
    {"27_smooth_normals", "", "", "", 32, 32, 16, 48, 1, false},
    {"32_sun_plane", "", "", "", 32, 32, 16, 24, 1, false},
    {"33_sphere_light", "", "-a 32 0.05", "-adaptive", 32, 32, 16, 192, 1, true},
    {"36_mesh_lamp", "", "", "", 32, 32, 16, 48, 1, false},
    {"38_spot_edge", "", "", "", 32, 32, 16, 24, 1, false},
    {"39_three_lamps", "pathtracer-four_light_samples", "", "-four_light_samples", 48, 32, 12, 48,
     1, false},
    {"41_cornell", "", "--roulette 0.7", "-roulette", 32, 32, 16, 48, 1, false},
    {"41_cornell", "", "-b 0.15 -d 3", "-lens", 32, 32, 16, 48, 1, false},
    {"44_mesh", "", "", "", 32, 32, 16, 32, 1, false},
    {"45_many_lights", "", "", "", 32, 32, 16, 48, 1, false},
    {"46_sky", "", "", "", 32, 32, 16, 48, 1, false},
    {"43_cornell_metal", "", "", "", 32, 32, 16, 48, 1, false},
    {"28_beckmann_furnace", "", "", "", 32, 32, 16, 32, 1, false},
};
enum { NUM_VIEWS = sizeof views / sizeof views[0] };

struct maker {
    const char *build;
    char work[256];
    struct suite suite;
    struct catalogue old, made;
};

/* The correct renderer's batches, kept while a view's bugs are rendered. */
struct base {
    struct diagnose_job job;
    struct signature batch[BATCHES];
};

static bool set_view(struct maker *m, int i, struct view *v, struct err *e)
{
    *v = (struct view){.width = views[i].width,
                       .height = views[i].height,
                       .spp = views[i].spp,
                       .renders = views[i].renders,
                       .fixed_spp = views[i].fixed_spp,
                       .seed = SEED};
    snprintf(v->scene, sizeof v->scene, "%s", views[i].scene);
    snprintf(v->variant, sizeof v->variant, "%s", views[i].variant);
    snprintf(v->name, sizeof v->name, "%s%s", v->scene, views[i].name);
    const char *rest = views[i].options;
    for (int k = 0; *rest != '\0'; k++) {
        snprintf(v->option[k], sizeof v->option[k], "%.*s", (int)strcspn(rest, " "), rest);
        v->options[k] = v->option[k];
        rest += strcspn(rest, " ");
        rest += strspn(rest, " ");
    }
    const struct suite_scene *s = suite_find(&m->suite, v->scene);
    if (s == NULL)
        return err_set(e, "no scene %s", v->scene);
    snprintf(v->scene_sha256, sizeof v->scene_sha256, "%s", s->sha256);
    v->effect = calloc((size_t)m->made.num_bugs, sizeof *v->effect);
    return v->effect != NULL || err_set(e, "out of memory");
}

static bool is_same_view(const struct view *a, const struct view *b)
{
    return strcmp(a->scene_sha256, b->scene_sha256) == 0 && strcmp(a->variant, b->variant) == 0 &&
           memcmp(a->option, b->option, sizeof a->option) == 0 && a->width == b->width &&
           a->height == b->height && a->spp == b->spp && a->renders == b->renders &&
           a->seed == b->seed;
}

static bool render(const struct base *base, const char *program, int batch, struct signature *out,
                   struct err *e)
{
    struct diagnose_job job = base->job;
    job.program = program;
    job.seed += (uint64_t)batch;
    return diagnose_render(&job, 1e-3, out, NULL, e);
}

static bool same_values(const struct signature *a, const struct signature *b)
{
    return memcmp(a->mean, b->mean, sizeof a->mean) == 0 &&
           memcmp(a->var, b->var, sizeof a->var) == 0 && a->n == b->n;
}

/* Splits a long render into `times` images of a batch's samples, with the same average; returns
 * times. */
static int repeat(const struct signature *s, int times, struct signature *all)
{
    for (int i = 0; i < times; i++) {
        all[i] = *s;
        all[i].n /= times;
        for (int j = 0; j < SIGNATURE_VALUES; j++) {
            all[i].var[j] *= times;
            all[i].k3[j] *= times * times;
        }
    }
    return times;
}

static bool make_batches(struct base *base, const char *program, struct err *e)
{
    for (int k = 0; k < BATCHES; k++)
        if (!render(base, program, k, &base->batch[k], e))
            return false;
    return true;
}

/* Where the mean depends on the samples asked for (fixed_spp), more renders are made instead of
 * longer ones. */
static bool make_correct(struct base *base, const char *program, struct view *v, struct err *e)
{
    struct signature all[BATCHES + LONG_FACTOR * LONG], s;
    int num = BATCHES, times = v->fixed_spp ? 1 : LONG_FACTOR;
    memcpy(all, base->batch, sizeof base->batch);
    struct diagnose_job job = base->job;
    job.program = program;
    job.spp *= times * job.renders;
    job.renders = 1;
    for (int k = 0; k < LONG * LONG_FACTOR / times; k++) {
        job.seed = base->job.seed + LONG_SEED + (uint64_t)k;
        if (!diagnose_render(&job, 1e-3, &s, NULL, e))
            return false;
        num += repeat(&s, times, &all[num]);
    }
    v->correct = signature_average(all, num);
    /* The facts have the values that a correct renderer should have, not those of these few images; how
     * many samples an adaptive render takes is measured. */
    struct signature batches = signature_average(base->batch, BATCHES);
    for (int f = 0; f < NUM_FACTS; f++)
        v->correct.fact[f] = v->correct.fact_sd[f] = f >= FACT_PIXELS && v->renders < 4 ? NAN : 0;
    v->correct.fact[FACT_SAMPLES] = batches.fact[FACT_SAMPLES];
    v->correct.fact_sd[FACT_SAMPLES] = batches.fact_sd[FACT_SAMPLES];
    return true;
}

static bool make_effect(const struct maker *m, const struct base *base, struct view *v, int b,
                        struct err *e)
{
    struct signature bug[BATCHES];
    const struct path program = fs_path("%s/mutants/%s/pathtracer", m->build, m->made.bug[b].name);
    if (!render(base, program.s, 0, &bug[0], e))
        return err_prefix(e, "%s", m->made.bug[b].name);
    if (same_values(&bug[0], &base->batch[0]))
        return true;
    for (int k = 1; k < BATCHES; k++)
        if (!render(base, program.s, k, &bug[k], e))
            return err_prefix(e, "%s", m->made.bug[b].name);
    v->effect[b] = calloc(1, sizeof *v->effect[b]);
    if (v->effect[b] == NULL)
        return err_set(e, "out of memory");
    struct signature a = signature_average(bug, BATCHES),
                     c = signature_average(base->batch, BATCHES);
    signature_set_spread(&a, &c);
    /* Where the seed is ignored nothing scatters. */
    bug_effect(bug, base->batch, BATCHES, same_values(&bug[0], &bug[1]) ? BATCHES : 0, NULL, &a,
               v->effect[b]);
    return true;
}

/* Takes over what an earlier catalogue has of this view; sets *missing where a bug has to be rendered. */
static void take_over(struct maker *m, struct view *v, bool *missing)
{
    const struct view *found = catalogue_view(&m->old, v->name);
    struct view *old = found != NULL && is_same_view(found, v) ? (struct view *)found : NULL;
    if (old != NULL)
        v->correct = old->correct;
    for (int b = 0; b < m->made.num_bugs; b++) {
        int at = old != NULL ? catalogue_bug(&m->old, m->made.bug[b].name) : -1;
        missing[b] =
            at < 0 || strcmp(m->old.bug[at].patch_sha256, m->made.bug[b].patch_sha256) != 0;
        if (!missing[b]) {
            v->effect[b] = old->effect[at];
            old->effect[at] = NULL;
        }
    }
}

/* Bugs of one view that are missing. */
struct effects {
    const struct maker *m;
    const struct base *base;
    struct view *view;
    const bool *missing;
};

static bool make_missing(void *arg, int b, struct err *e)
{
    const struct effects *x = arg;
    struct base base = *x->base;
    const struct path dir = fs_path("%s/%d", x->m->work, b);
    base.job.work_dir = dir.s;
    return !x->missing[b] || (fs_make_dirs(dir.s, e) && make_effect(x->m, &base, x->view, b, e));
}

static bool make_view(struct maker *m, int i, struct err *e)
{
    struct view *v = &m->made.view[m->made.num_views];
    struct base *base = calloc(1, sizeof *base);
    bool *missing = calloc((size_t)m->made.num_bugs, sizeof *missing), any = false;
    bool ok = (base != NULL && missing != NULL) || err_set(e, "out of memory");
    ok = ok && set_view(m, i, v, e);
    if (ok) {
        m->made.num_views++;
        take_over(m, v, missing);
        base->job = (struct diagnose_job){.options = v->options[0] != NULL ? v->options : NULL,
                                          .columns = views[i].columns,
                                          .width = v->width,
                                          .height = v->height,
                                          .spp = v->spp,
                                          .renders = v->renders,
                                          .seed = v->seed + 100 * (uint64_t)i,
                                          .threads = 1,
                                          .timeout_s = 600,
                                          .work_dir = m->work};
        ok = catalogue_view_scene(v, &m->suite, &base->job.scene, &base->job.variant, e);
    }
    for (int b = 0; ok && b < m->made.num_bugs; b++)
        any = any || missing[b];
    const struct path program = fs_path("%s/pathtracer", m->build);
    if (ok && any)
        ok = make_batches(base, program.s, e) &&
             (v->correct.columns > 0 || make_correct(base, program.s, v, e));
    struct effects effects = {m, base, v, missing};
    ok = ok && work_run_all(NULL, m->made.num_bugs, make_missing, &effects, e);
    int seen = 0;
    for (int b = 0; ok && b < m->made.num_bugs; b++)
        seen += v->effect[b] != NULL;
    if (ok)
        printf("%-36s %3d of %d bugs change it\n", v->name, seen, m->made.num_bugs);
    fflush(stdout);
    free(base);
    free(missing);
    return ok;
}

static void report_blind(const struct catalogue *c)
{
    for (int b = 0; b < c->num_bugs; b++) {
        bool seen = false;
        for (int v = 0; v < c->num_views; v++)
            seen = seen || c->view[v].effect[b] != NULL;
        if (!seen)
            printf("no view shows %s\n", c->bug[b].name);
    }
}

int main(int argc, char **argv)
{
    struct err e = {""};
    struct maker m = {0};
    if (argc != 4) {
        fprintf(stderr, "usage: make_catalogue BUILD PATCHES CATALOGUE\n");
        return 3;
    }
    m.build = argv[1];
    snprintf(m.work, sizeof m.work, "%s/catalogue", m.build);
    bool ok = suite_load("reference/scenes", &m.suite, &e) && fs_make_dirs(m.work, &e) &&
              bug_list(argv[2], &m.made, &e);
    struct err none;
    if (ok && !catalogue_read(argv[3], &m.old, &none))
        printf("a new catalogue: %s\n", none.msg);
    m.made.view = calloc(NUM_VIEWS, sizeof *m.made.view);
    ok = ok && (m.made.view != NULL || err_set(&e, "out of memory"));
    for (int i = 0; ok && i < NUM_VIEWS; i++)
        ok = make_view(&m, i, &e) && catalogue_write(m.work, &m.made, &e);
    ok = ok && fs_make_dirs(argv[3], &e) && catalogue_write(argv[3], &m.made, &e);
    if (ok)
        report_blind(&m.made);
    else
        fprintf(stderr, "make_catalogue: %s\n", e.msg);
    catalogue_free(&m.old);
    catalogue_free(&m.made);
    suite_free(&m.suite);
    return ok ? 0 : 3;
}
