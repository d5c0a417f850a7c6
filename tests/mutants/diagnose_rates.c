/* diagnose_rates BUILD [PART]: how often `assay diagnose` is right, as a Markdown page on standard output (make
 * diagnose-rates). Renders all bugs and the correct renderer with other seeds than the catalogue's and, but for part
 * "same", at other sizes and numbers of samples; the correct renderer also in TRIES synthetic looks.
 *
 * A synthetic look: each cell of each view is that of a real correct render drawn from POOL, moved so that the pool's
 * mean is the catalogue's mean plus a normal error of the catalogue's own variance; its scatter is scaled by
 * sqrt(POOL/(POOL - 1)), as the pool's own mean was subtracted. Where a view asks for consistency, its renders are
 * drawn from POOL real ones without replacement, and judged; each such draw serves for TRIES / CONSISTENT_DRAWS
 * tries. PART (same, large, small, few, correct) measures only that part. */
#include "renderer/base/fs.h"
#include "tools/diagnose/diagnose.h"
#include "tools/diagnose/diagnose_render.h"
#include "tools/validate/run_pathtracer.h"
#include "tests/tools/diagnose/catalogue_write.h"
#include "tests/support/simulate.h"
#include "tests/studies/calibration/work.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { POOL = 200, TRIES = 10000, CONSISTENT_DRAWS = 1000 };
static const double alpha = 1e-6;

struct rate_image {
    const char *build;
    struct suite suite;
    struct catalogue c;
};

/* How a renderer is looked at: width and height, and samples, in per cent of the catalogue's. */
struct look {
    const char *program;
    int scale_percent, spp_percent;
    uint64_t seed;
};

static bool look_at(const struct rate_image *r, const struct look *look, const char *work,
                    struct observation *clue, struct err *e)
{
    for (int i = 0; i < r->c.num_views; i++) {
        const struct view *v = &r->c.view[i];
        struct diagnose_job job = {.program = look->program,
                                   .options = v->options[0] != NULL ? v->options : NULL,
                                   .columns = v->correct.columns,
                                   .width = v->width * look->scale_percent / 100,
                                   .height = v->height * look->scale_percent / 100,
                                   .spp = v->fixed_spp ? v->spp : v->spp * look->spp_percent / 100,
                                   .renders = v->renders,
                                   .seed = look->seed * 1000 + (uint64_t)i,
                                   .threads = 1,
                                   .timeout_s = 600,
                                   .work_dir = work};
        clue[i] = (struct observation){.view = v};
        if (!catalogue_view_scene(v, &r->suite, &job.scene, &job.variant, e) ||
            !diagnose_render(&job, alpha / (2 * r->c.num_views), &clue[i].seen,
                             &clue[i].is_consistent, e))
            return false;
        signature_set_spread(&clue[i].seen, &v->correct);
    }
    return true;
}

/* ---- many looks by several threads */

struct claim_run {
    struct look look;
    char program[4400];
    struct observation *clue;
};

struct looks {
    const struct rate_image *r;
    struct claim_run *task;
};

/* The directory in which look i is rendered. */
static void work_dir(const struct rate_image *r, int i, char dir[4400])
{
    snprintf(dir, 4400, "%s/diagnose_rates/%d.%d", r->build, (int)getpid(), i);
}

static bool look_once(void *arg, int i, struct err *e)
{
    const struct looks *l = arg;
    struct claim_run *t = &l->task[i];
    char dir[4400];
    work_dir(l->r, i, dir);
    t->clue = calloc((size_t)l->r->c.num_views, sizeof *t->clue);
    return (t->clue != NULL || err_set(e, "out of memory")) && fs_make_dirs(dir, e) &&
           look_at(l->r, &t->look, dir, t->clue, e);
}

static bool look_at_all(const struct rate_image *r, struct claim_run *task, int num, struct err *e)
{
    struct looks looks = {r, task};
    return work_run_all(NULL, num, look_once, &looks, e);
}

static void free_tasks(struct claim_run *task, int num)
{
    for (int i = 0; i < num; i++)
        free(task[i].clue);
    free(task);
}

/* ---- bugs */

static void print_named(const struct rate_image *r, const struct diagnosis *d)
{
    if (d->finding != FINDING_BUG)
        printf("%s", d->finding == FINDING_CORRECT ? "nothing wrong found" : "none of the known");
    for (int i = 0; i < d->num_named; i++) {
        printf("%s%s", i > 0 ? ", " : "", r->c.bug[d->candidate[i].bug].name);
        if (d->candidate[i].amplitude != 1)
            printf(" x %.2f", d->candidate[i].amplitude);
    }
}

struct score {
    int first, group, unknown, missed, wrong;
};

static bool judge_bug(const struct rate_image *r, const struct claim_run *t, int bug,
                      struct score *s, struct score *without, struct err *e)
{
    struct diagnose_options opt = {.alpha = alpha};
    struct diagnosis d;
    if (!diagnose(&r->c, t->clue, r->c.num_views, &opt, &d, e))
        return false;
    bool in_group = false;
    for (int i = 0; i < d.num_named; i++)
        in_group = in_group || d.candidate[i].bug == bug;
    bool first = in_group && d.candidate[0].bug == bug;
    s->first += first;
    s->group += in_group;
    s->unknown += d.finding == FINDING_UNKNOWN;
    s->missed += d.finding == FINDING_CORRECT;
    s->wrong += d.finding == FINDING_BUG && !in_group;
    opt.without = r->c.bug[bug].name;
    struct diagnosis w;
    if (!diagnose(&r->c, t->clue, r->c.num_views, &opt, &w, e))
        return false;
    without->unknown += w.finding == FINDING_UNKNOWN;
    without->missed += w.finding == FINDING_CORRECT;
    without->wrong += w.finding == FINDING_BUG;
    if (first && d.num_named == 1 && w.finding != FINDING_BUG)
        return true;
    printf("| %s | ", r->c.bug[bug].name);
    print_named(r, &d);
    if (d.finding == FINDING_UNKNOWN && d.num_candidates > 0)
        printf(" (best: %s, %.0f %%, %.1f sd)", r->c.bug[d.candidate[0].bug].name,
               100 * fmax(0, d.candidate[0].explained), d.candidate[0].excess);
    printf(" | ");
    print_named(r, &w);
    if (w.finding == FINDING_BUG)
        printf(" (%.1f %%)", 100 * fmax(0, w.candidate[0].explained));
    puts(" |");
    return true;
}

static bool rate_bugs(const struct rate_image *r, int scale_percent, int spp_percent, uint64_t seed,
                      struct err *e)
{
    int num = r->c.num_bugs;
    struct claim_run *task = calloc((size_t)num, sizeof *task);
    if (task == NULL)
        return err_set(e, "out of memory");
    for (int b = 0; b < num; b++) {
        snprintf(task[b].program, sizeof task[b].program, "%s/mutants/%s/pathtracer", r->build,
                 r->c.bug[b].name);
        task[b].look = (struct look){.program = task[b].program,
                                     .scale_percent = scale_percent,
                                     .spp_percent = spp_percent,
                                     .seed = seed};
    }
    printf(
        "\n## Bugs, %d %% of the catalogue's width and height, %d %% of its samples per pixel, seed %d\n\n"
        "Listed where the bug was not named first and alone, or where without it in the catalogue another "
        "was named.\n\n| bug | named | without it in the catalogue |\n|---|---|---|\n",
        scale_percent, spp_percent, (int)seed);
    struct score s = {0}, without = {0};
    bool ok = look_at_all(r, task, num, e);
    for (int b = 0; ok && b < num; b++)
        ok = judge_bug(r, &task[b], b, &s, &without, e);
    if (ok)
        printf(
            "\nOf %d bugs: named first %d (%.1f %%), among those named %d, another named %d, \"none of the "
            "known\" %d, nothing wrong found %d. Left out of the catalogue: \"none of the known\" %d, another "
            "named %d, nothing wrong found %d.\n",
            num, s.first, 100.0 * s.first / num, s.group, s.wrong, s.unknown, s.missed,
            without.unknown, without.wrong, without.missed);
    fflush(stdout);
    free_tasks(task, num);
    return ok;
}

/* ---- the correct renderer */

static double normal(uint64_t *state)
{
    return sqrt(-2 * log(uniform(state))) * cos(6.283185307179586 * uniform(state));
}

/* POOL real renders of the correct renderer, and their means per view. */
struct pool {
    const struct claim_run *task;
    double (*mean)[SIGNATURE_VALUES];
    struct moments *single; /* POOL of the view that asks for consistency */
    int consistent_view;    /* -1: none */
};

/* Do all samples of a cell have one value? Such a cell stays as it was rendered: a rare event in
 * one render of the pool would move the pool's mean, and with it all other renders off that
 * value. */
static bool is_still(const struct signature *s, int value)
{
    return sqrt(s->var[value]) <= 1e-5 * s->mean[value];
}

static void draw_cells(const struct rate_image *r, const struct pool *p, int view, uint64_t *state,
                       struct observation *out)
{
    const struct signature *c = &r->c.view[view].correct;
    *out = p->task[(int)(uniform(state) * POOL)].clue[view];
    for (int i = 0; i < c->columns * c->rows; i++) {
        const struct signature *from = &p->task[(int)(uniform(state) * POOL)].clue[view].seen;
        for (int j = 3 * i; j < 3 * i + 3; j++) {
            double noise = (from->mean[j] - p->mean[view][j]) * sqrt(POOL / (POOL - 1.0));
            double moved = fmax(0, c->mean[j] + noise + sqrt(c->var[j]) * normal(state));
            out->seen.mean[j] = is_still(from, j) && is_still(c, j) ? from->mean[j] : moved;
            out->seen.var[j] = from->var[j];
            out->seen.k3[j] = from->k3[j];
        }
    }
}

static bool draw_consistent(const struct rate_image *r, const struct pool *p, uint64_t *state,
                            struct observation *out, struct err *e)
{
    enum { MOST_RENDERS = 32 };
    const struct view *v = &r->c.view[p->consistent_view];
    struct moments chosen[MOST_RENDERS];
    struct signature s[MOST_RENDERS];
    struct stated_error c;
    bool taken[POOL] = {false};
    for (int k = 0; k < v->renders; k++) {
        int i;
        do
            i = (int)(uniform(state) * POOL);
        while (taken[i]);
        taken[i] = true;
        chosen[k] = p->single[i];
        if (!signature_of(&chosen[k], v->correct.columns, v->spp, &s[k], e))
            return false;
    }
    double share = alpha / (2 * r->c.num_views);
    if (!stated_error_judge(chosen, v->renders, 0.02, share, &c, e))
        return false;
    *out = (struct observation){.view = v,
                                .seen = signature_average(s, v->renders),
                                .is_consistent = c.verdict != VERDICT_DIFFERENT};
    signature_set_stated_error(&out->seen, c.pixels, c.pixels_lo, c.pixels_hi, c.image, v->renders,
                               share);
    signature_set_spread(&out->seen, &v->correct);
    return true;
}

static bool fill_pool(const struct rate_image *r, struct pool *p, struct err *e)
{
    p->mean = calloc((size_t)r->c.num_views, sizeof *p->mean);
    p->single = calloc(POOL, sizeof *p->single);
    p->consistent_view = -1;
    if (p->mean == NULL || p->single == NULL)
        return err_set(e, "out of memory");
    for (int v = 0; v < r->c.num_views; v++) {
        if (r->c.view[v].renders >= 4)
            p->consistent_view = v;
        for (int k = 0; k < POOL; k++)
            for (int i = 0; i < SIGNATURE_VALUES; i++)
                p->mean[v][i] += p->task[k].clue[v].seen.mean[i] / POOL;
    }
    return true;
}

/* The pool's renders of the view that asks for consistency, one by one. */
static bool render_singles(const struct rate_image *r, struct pool *p, const char *program,
                           struct err *e)
{
    if (p->consistent_view < 0)
        return true;
    const struct view *v = &r->c.view[p->consistent_view];
    char dir[4400];
    const struct suite_scene *found;
    const struct suite_variant *variant;
    work_dir(r, 0, dir);
    const struct path files = fs_path("%s/single", dir);
    if (!catalogue_view_scene(v, &r->suite, &found, &variant, e))
        return false;
    struct suite_scene scene = *found;
    scene.width = v->width;
    scene.height = v->height;
    for (int k = 0; k < POOL; k++) {
        const struct pathtracer_job job = {.program = program,
                                           .scene = &scene,
                                           .spp = v->spp,
                                           .seed = 900000 + (uint64_t)k,
                                           .threads = 1,
                                           .timeout_s = 600,
                                           .files = files.s};
        double cpu_s;
        if (!run_pathtracer(&job, &p->single[k], &cpu_s, NULL, e))
            return false;
    }
    return true;
}

static bool rate_synthetic(const struct rate_image *r, struct pool *p, struct err *e)
{
    struct observation *clue = calloc((size_t)r->c.num_views, sizeof *clue);
    struct diagnose_options opt = {.alpha = alpha};
    uint64_t state = 9;
    int accused = 0;
    double lead = -INFINITY, log10_p = 0;
    bool ok = clue != NULL || err_set(e, "out of memory");
    for (int t = 0; ok && t < TRIES; t++) {
        struct diagnosis d;
        for (int v = 0; ok && v < r->c.num_views; v++)
            if (v != p->consistent_view)
                draw_cells(r, p, v, &state, &clue[v]);
            else if (t % (TRIES / CONSISTENT_DRAWS) == 0)
                ok = draw_consistent(r, p, &state, &clue[v], e);
        ok = ok && diagnose(&r->c, clue, r->c.num_views, &opt, &d, e);
        if (!ok)
            break;
        accused += d.finding != FINDING_CORRECT;
        log10_p = fmin(log10_p, d.log10_p);
        lead = fmax(lead, d.largest_lead);
    }
    if (ok)
        printf("| synthetic | %d | %d | %.2f | %.1f (bound %.1f) |\n", TRIES, accused, log10_p,
               lead / log(10), diagnose_bound(&r->c, alpha) / log(10));
    free(clue);
    return ok;
}

static bool rate_correct(const struct rate_image *r, struct err *e)
{
    struct claim_run *task = calloc(POOL, sizeof *task);
    struct pool p = {.task = task};
    struct diagnose_options opt = {.alpha = alpha};
    int accused = 0;
    double lead = -INFINITY, log10_p = 0;
    if (task == NULL)
        return err_set(e, "out of memory");
    const struct path program = fs_path("%s/pathtracer", r->build);
    for (int k = 0; k < POOL; k++)
        task[k].look = (struct look){.program = program.s,
                                     .scale_percent = 100,
                                     .spp_percent = 50,
                                     .seed = 5000 + (uint64_t)k};
    bool ok = look_at_all(r, task, POOL, e);
    for (int k = 0; ok && k < POOL; k++) {
        struct diagnosis d;
        ok = diagnose(&r->c, task[k].clue, r->c.num_views, &opt, &d, e);
        if (ok) {
            accused += d.finding != FINDING_CORRECT;
            log10_p = fmin(log10_p, d.log10_p);
            lead = fmax(lead, d.largest_lead);
            if (d.finding != FINDING_CORRECT)
                fprintf(stderr, "correct render %d accused: %s\n", k, d.gate);
        }
    }
    if (ok)
        printf(
            "\n## The correct renderer\n\nalpha %g. The last two columns are the smallest p of any look, "
            "times its tests, and the largest lead of any bug over \"correct\" (log10).\n\n"
            "| looks | number | accused | log10 p | lead |\n|---|--:|--:|--:|--:|\n"
            "| real, 50 %% of the samples | %d | %d | %.2f | %.1f (bound %.1f) |\n",
            alpha, POOL, accused, log10_p, lead / log(10), diagnose_bound(&r->c, alpha) / log(10));
    fflush(stdout);
    ok = ok && fill_pool(r, &p, e) && render_singles(r, &p, program.s, e) &&
         rate_synthetic(r, &p, e);
    for (int k = 0; p.single != NULL && k < POOL; k++)
        moments_free(&p.single[k]);
    free(p.single);
    free(p.mean);
    free_tasks(task, POOL);
    return ok;
}

int main(int argc, char **argv)
{
    struct err e = {""};
    struct rate_image r = {0};
    const char *part = argc == 3 ? argv[2] : "";
    if (argc != 2 && argc != 3) {
        fprintf(stderr, "usage: diagnose_rates BUILD [same|large|small|few|correct]\n");
        return 3;
    }
    r.build = argv[1];
    bool ok = suite_load("reference/scenes", &r.suite, &e) &&
              catalogue_read("golden/diagnose", &r.c, &e) &&
              catalogue_current(&r.c, "tests/mutants", NULL, &e);
    if (ok)
        printf(
            "# How often a bug is named rightly\n\nWritten by `make diagnose-rates` (`tests/mutants/diagnose_rates.c`); "
            "%d bugs, %d views. How: tools/docs/background/diagnosis.md.\n",
            r.c.num_bugs, r.c.num_views);
    /* small, few: as many samples in all as the catalogue has, and half as many. */
    static const struct {
        const char *part;
        int scale_percent, spp_percent, seed;
    } bugs[] = {{"same", 100, 100, 74},
                {"large", 150, 75, 71},
                {"small", 50, 400, 73},
                {"few", 50, 200, 72}};
    for (size_t i = 0; ok && i < sizeof bugs / sizeof *bugs; i++)
        if (*part == '\0' || strcmp(part, bugs[i].part) == 0)
            ok = rate_bugs(&r, bugs[i].scale_percent, bugs[i].spp_percent, (uint64_t)bugs[i].seed,
                           &e);
    if (ok && (*part == '\0' || strcmp(part, "correct") == 0))
        ok = rate_correct(&r, &e);
    if (!ok)
        fprintf(stderr, "diagnose_rates: %s\n", e.msg);
    catalogue_free(&r.c);
    suite_free(&r.suite);
    return ok ? 0 : 3;
}
