/* make_anchors DIR WORK | --page DIR | --quick DIR WORK: what our gate and the rules of other renderers'
 * tests find on the same images. Writes DIR/results.json, README.md and plots; --page makes the last
 * two again; --quick measures two scenes with few pairs, to see that it runs. The images are kept in
 * WORK (900 MB). For `make anchors`. */
#include "anchors.h"

#include "tests/support/rates.h"
#include "renderer/base/progress.h"
#include "renderer/base/version.h"
#include "tools/compare/compare.h"
#include "tools/exact/sign_flip.h"
#include "tools/images/flip.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

/* What one thread judges with. */
struct bench {
    struct moments a; /* the wrong image */
    double *z;
    uint8_t *a8, *b8;
    const struct moments *in_b8; /* whose image b8 is */
    float *a32, *b32, *error;
};

struct measurement {
    const struct anchor_settings *set;
    struct anchor_pool pool;
    double threshold[NUM_ANCHOR_RULES];
    double guess[NUM_ANCHOR_RULES][NUM_ANCHOR_ERRORS];
    bool *alarm;      /* num_pairs x NUM_ANCHOR_RULES */
    double *smallest; /* num_pairs x NUM_ANCHOR_RULES x NUM_ANCHOR_ERRORS */
    double bias[NUM_ANCHOR_RULES][NUM_ANCHOR_ERRORS];
    bool *found; /* as `smallest`, of `bias` */
    double *tune[NUM_ANCHOR_RULES];
    struct bench *bench; /* one a thread */
    const char *stage;
};

enum { TUNE_PARTNERS = 3 }; /* renders for thresholds make so many pairs each, overlapping */
static const double smallest_tried = 1e-5, largest_tried = 100;

static void die(const char *what, const struct err *e)
{
    fprintf(stderr, "\nmake_anchors: %s: %s\n", what, e->msg);
    exit(3);
}

static void show(const char *scene, const char *stage, double share)
{
    static double last;
    double now = now_seconds();
    if (share < 1 && now - last < (isatty(STDERR_FILENO) ? 0.3 : 20))
        return;
    last = now;
    fprintf(stderr, isatty(STDERR_FILENO) ? "\r%s: %s %3.0f %%   " : "%s: %s %.0f %%\n", scene,
            stage, 100 * share);
}

static const char *scene_shown;
static void show_render(double share)
{
    show(scene_shown, "rendering", share);
}

/* -log10 of the smallest alpha at which the gate's p-values, got with `alpha`, are DIFFERENT. */
static double gate(const struct moments *a, const struct moments *b, double alpha)
{
    struct comparison c;
    struct err e;
    double score = 0;
    const struct compare_options opt = {.alpha = alpha, .tile = 16};
    if (!compare_moments(a, b, &opt, &c, &e))
        die("the gate cannot judge", &e);
    for (int i = 0; i < NUM_STATISTICS; i++)
        if (c.statistic[i].share > 0 && c.statistic[i].num_tests > 0)
            score = fmax(score, log10(c.statistic[i].share) - c.statistic[i].log10_p);
    if ((c.verdict == VERDICT_DIFFERENT) != (score >= -log10(alpha) * (1 - 1e-12))) {
        err_set(&e, "verdict %s, but the statistics say alpha 1e-%.9g", verdict_name(c.verdict),
                score);
        die("the gate contradicts itself", &e);
    }
    comparison_free(&c);
    return score;
}

/* -log10 p of flips, as `assay compare --same-program` has it: nothing where it declines. */
static double same_program(struct bench *t, const struct moments *a, const struct moments *b,
                           double alpha)
{
    size_t values = 3 * (size_t)a->width * (size_t)a->height;
    for (size_t i = 0; i < values; i++) {
        t->a32[i] = (float)a->mean[i];
        t->b32[i] = (float)b->mean[i];
        t->error[i] = (float)sqrt(moments_var_of_mean(a, i / 3, (int)(i % 3)) +
                                  moments_var_of_mean(b, i / 3, (int)(i % 3)));
    }
    const struct sign_flip_images in = {1, a->width, a->height, &t->a32, &t->b32, t->error};
    const struct sign_flip_options opt = {.alpha = alpha, .filter_width = 0, .tile = 16};
    struct sign_flip out;
    struct err e;
    if (!sign_flip_test(&in, &opt, &out, &e))
        die("flips cannot judge", &e);
    return out.shares_noise ? 0 : -out.log10_p;
}

static double flip(struct bench *t, const struct moments *a, const struct moments *b)
{
    struct err e;
    if (!flip_ldr(b->mean, a->mean, a->width, a->height, FLIP_PPD, t->error, &e))
        die("FLIP cannot judge", &e);
    return flip_mean(t->error, (size_t)a->width * (size_t)a->height);
}

static double score(const struct measurement *m, struct bench *t, enum anchor_rule rule,
                    const struct moments *a, const struct moments *b)
{
    size_t pixels = (size_t)a->width * (size_t)a->height, count[256];
    switch (rule) {
    case RULE_GATE_STRICT: return gate(a, b, 1e-6);
    case RULE_GATE: return gate(a, b, 1e-3);
    case RULE_GATE_TUNED: return gate(a, b, m->set->tuned);
    case RULE_SAME_STRICT: return same_program(t, a, b, 1e-6);
    case RULE_SAME_TUNED: return same_program(t, a, b, m->set->tuned);
    case RULE_TILES:
    case RULE_TILES_TUNED: return -tiles_log10_p(a, b, 16);
    case RULE_RMSE_TUNED: return relative_rmse(a, b);
    case RULE_FLIP_TUNED: return flip(t, a, b);
    case RULE_MITSUBA:
    case RULE_MITSUBA_SHARE_TUNED:
        mitsuba_z(a, &m->pool.reference, t->z);
        return (double)mitsuba_failures(t->z, pixels, mitsuba_critical_z(MITSUBA_LEVEL, pixels));
    case RULE_MITSUBA_LEVEL_TUNED:
        mitsuba_z(a, &m->pool.reference, t->z);
        return mitsuba_score(t->z, pixels, mitsuba_allowed(MITSUBA_SHARE, pixels));
    case RULE_WELCH:
    case RULE_WELCH_STRICT:
    case RULE_WELCH_TUNED: return -welch_log10_p(a, b);
    case RULE_IDIFF:
    case RULE_IDIFF_FAIL_TUNED:
    case RULE_IDIFF_PERCENT_TUNED:
        idiff_quantise(a, 1, t->a8);
        if (t->in_b8 != b)
            idiff_quantise(b, 1, t->b8);
        t->in_b8 = b;
        idiff_histogram(t->a8, t->b8, pixels, count);
        return rule == RULE_IDIFF_FAIL_TUNED ? idiff_fail_score(count, pixels, BLENDER_PERCENT)
                                             : idiff_percent_score(count, pixels, BLENDER_FAIL);
    case NUM_ANCHOR_RULES: break;
    }
    abort();
}

/* Thresholds as published, and which rules have one to set. */
static bool published_threshold(enum anchor_rule rule, size_t pixels, double *threshold)
{
    switch (rule) {
    case RULE_GATE_STRICT: *threshold = 6; return true;
    case RULE_GATE: *threshold = 3; return true;
    case RULE_MITSUBA: *threshold = (double)mitsuba_allowed(MITSUBA_SHARE, pixels); return true;
    case RULE_WELCH: *threshold = -log10(WELCH_LEVEL); return true;
    case RULE_SAME_STRICT:
    case RULE_TILES:
    case RULE_WELCH_STRICT: *threshold = 6; return true;
    case RULE_IDIFF: *threshold = BLENDER_PERCENT; return true;
    case RULE_GATE_TUNED:
    case RULE_SAME_TUNED:
    case RULE_MITSUBA_LEVEL_TUNED:
    case RULE_MITSUBA_SHARE_TUNED:
    case RULE_WELCH_TUNED:
    case RULE_TILES_TUNED:
    case RULE_RMSE_TUNED:
    case RULE_FLIP_TUNED:
    case RULE_IDIFF_FAIL_TUNED:
    case RULE_IDIFF_PERCENT_TUNED:
    case NUM_ANCHOR_RULES: break;
    }
    return false;
}

static bool one_sided(enum anchor_rule rule) /* judges A against the long reference */
{
    return rule == RULE_MITSUBA_LEVEL_TUNED || rule == RULE_MITSUBA_SHARE_TUNED;
}

static void tune_one(void *arg, int i, int thread)
{
    struct measurement *m = arg;
    int n = m->set->num_tune;
    const struct moments *a = &m->pool.render[i];
    for (int r = 0; r < NUM_ANCHOR_RULES; r++)
        for (int k = 0; m->tune[r] != NULL && k < (one_sided(r) ? 1 : TUNE_PARTNERS); k++)
            m->tune[r][k * n + i] =
                score(m, &m->bench[thread], r, a, &m->pool.render[(i + k + 1) % n]);
    if (thread == 0)
        show(scene_shown, "thresholds", (double)(i + 1) / n);
}

/* The smallest score that at most the share `tuned` of the null scores exceeds. */
static void set_thresholds(struct measurement *m, int threads)
{
    size_t pixels = (size_t)m->pool.side * (size_t)m->pool.side;
    int n = m->set->num_tune;
    for (int r = 0; r < NUM_ANCHOR_RULES; r++)
        if (!published_threshold(r, pixels, &m->threshold[r]))
            m->tune[r] = calloc((size_t)(n * TUNE_PARTNERS), sizeof(double));
    anchor_parallel(n, threads, tune_one, m);
    for (int r = 0; r < NUM_ANCHOR_RULES; r++)
        if (m->tune[r] != NULL) {
            int scores = one_sided(r) ? n : n * TUNE_PARTNERS;
            sort_numbers(m->tune[r], (size_t)scores);
            m->threshold[r] = m->tune[r][scores - 1 - (int)(m->set->tuned * scores)];
            free(m->tune[r]);
            m->tune[r] = NULL;
        }
}

static const struct moments *side_of(const struct measurement *m, int pair, int b)
{
    return &m->pool.render[m->set->num_tune + 2 * pair + b];
}

/* How far the score is above the threshold (positive: the rule rejects), in roots: a score that is
 * -log10 p grows with the square of the error. */
static double excess(const struct measurement *m, struct bench *t, enum anchor_rule rule, int pair,
                     enum anchor_error kind, double b)
{
    double threshold = m->threshold[rule];
    anchor_make_wrong(&m->pool, side_of(m, pair, 0), kind, b, pair, &t->a);
    double s = score(m, t, rule, &t->a, side_of(m, pair, 1));
    if (rule == RULE_GATE_STRICT || rule == RULE_GATE) /* its own verdict includes equality */
        threshold *= 1 - 1e-12;
    double root = sqrt(fmax(0, s)) - sqrt(fmax(0, threshold));
    return s > threshold ? fmax(root, 1e-9) : fmin(root, -1e-9);
}

/* The smallest error that the rule finds in this pair, to 1 %, from a guess: out from it by growing
 * steps, then in by halving and interpolation in turn. */
static double smallest_found(const struct measurement *m, struct bench *t, enum anchor_rule rule,
                             int pair, enum anchor_error kind, double guess)
{
    double lo = guess, hi = guess, step = 1.1, f = excess(m, t, rule, pair, kind, guess);
    double f_lo = f, f_hi = f;
    while (f_lo > 0) {
        hi = lo;
        f_hi = f_lo;
        lo /= step;
        step *= step;
        if (lo < smallest_tried)
            return smallest_tried;
        f_lo = excess(m, t, rule, pair, kind, lo);
    }
    while (f_hi <= 0) {
        if (hi >= largest_tried)
            return INFINITY;
        lo = hi;
        f_lo = f_hi;
        hi = fmin(hi * step, largest_tried);
        step *= step;
        f_hi = excess(m, t, rule, pair, kind, hi);
    }
    for (int i = 0; hi > 1.01 * lo; i++) {
        double b = sqrt(lo * hi), root = lo + (hi - lo) * -f_lo / (f_hi - f_lo);
        if (i % 3 != 2) /* just beyond the root, then just before it, then halving */
            b = fmin(hi / 1.002, fmax(lo * 1.002, root * (i % 3 == 0 ? 1.004 : 0.996)));
        f = excess(m, t, rule, pair, kind, b);
        *(f > 0 ? &hi : &lo) = b;
        *(f > 0 ? &f_hi : &f_lo) = f;
    }
    return hi;
}

static void measure_pair(void *arg, int pair, int thread)
{
    struct measurement *m = arg;
    struct bench *t = &m->bench[thread];
    for (int r = 0; r < NUM_ANCHOR_RULES; r++) {
        m->alarm[pair * NUM_ANCHOR_RULES + r] = excess(m, t, r, pair, ANCHOR_GLOBAL, 0) > 0;
        for (int k = 0; k < NUM_ANCHOR_ERRORS; k++) {
            double *out = &m->smallest[(pair * NUM_ANCHOR_RULES + r) * NUM_ANCHOR_ERRORS + k];
            *out = smallest_found(m, t, r, pair, k, m->guess[r][k]);
        }
    }
    if (thread == 0)
        show(scene_shown, "judging", (double)(pair + 1) / m->set->num_pairs);
}

struct question {
    struct measurement *m;
    bool open[NUM_ANCHOR_RULES][NUM_ANCHOR_ERRORS]; /* asked this time */
};

static void ask_again(void *arg, int pair, int thread)
{
    const struct question *q = arg;
    struct measurement *m = q->m;
    for (int r = 0; r < NUM_ANCHOR_RULES; r++)
        for (int k = 0; k < NUM_ANCHOR_ERRORS; k++)
            if (q->open[r][k])
                m->found[(pair * NUM_ANCHOR_RULES + r) * NUM_ANCHOR_ERRORS + k] =
                    excess(m, &m->bench[thread], r, pair, k, m->bias[r][k]) > 0;
}

static int times_found(const struct measurement *m, int rule, int kind)
{
    int found = 0;
    for (int i = 0; i < m->set->num_pairs; i++)
        found += m->found[(i * NUM_ANCHOR_RULES + rule) * NUM_ANCHOR_ERRORS + kind];
    return found;
}

/* Is the bias really found with the power asked for? Not always: a rule may find a small error in a pair
 * and miss a larger one, as ours does where a larger error makes a region too skewed to be tested. Then
 * the bias is raised by 5 % at a time until it is. */
static void confirm(struct measurement *m, int threads)
{
    int enough = (int)ceil(m->set->power * m->set->num_pairs - 1e-9);
    struct question q = {.m = m};
    bool any = true;
    for (int r = 0; r < NUM_ANCHOR_RULES; r++)
        for (int k = 0; k < NUM_ANCHOR_ERRORS; k++)
            q.open[r][k] = isfinite(m->bias[r][k]);
    while (any) {
        anchor_parallel(m->set->num_pairs, threads, ask_again, &q);
        any = false;
        for (int r = 0; r < NUM_ANCHOR_RULES; r++)
            for (int k = 0; k < NUM_ANCHOR_ERRORS; k++) {
                if (!q.open[r][k])
                    continue;
                q.open[r][k] = times_found(m, r, k) < enough;
                if (q.open[r][k])
                    m->bias[r][k] *= 1.05;
                if (m->bias[r][k] > largest_tried) {
                    m->bias[r][k] = INFINITY;
                    q.open[r][k] = false;
                }
                any = any || q.open[r][k];
            }
    }
}

/* Pair 0 alone first: its answers are where the search starts in all others, so that the record does
 * not depend on which thread comes when. */
static void measure_pairs(struct measurement *m, int threads, struct anchor_scene_result *out)
{
    int n = m->set->num_pairs, at, lo, hi;
    for (int r = 0; r < NUM_ANCHOR_RULES; r++)
        for (int k = 0; k < NUM_ANCHOR_ERRORS; k++)
            m->guess[r][k] = 0.1;
    measure_pair(m, 0, 0);
    for (int r = 0; r < NUM_ANCHOR_RULES; r++)
        for (int k = 0; k < NUM_ANCHOR_ERRORS; k++)
            m->guess[r][k] = fmin(m->smallest[r * NUM_ANCHOR_ERRORS + k], largest_tried);
    anchor_parallel(n, threads, measure_pair, m);
    anchors_quantile_ranks(n, m->set->power, &at, &lo, &hi);
    double *sorted = calloc((size_t)n, sizeof *sorted);
    for (int r = 0; r < NUM_ANCHOR_RULES; r++)
        for (int k = 0; k < NUM_ANCHOR_ERRORS; k++) {
            for (int i = 0; i < n; i++)
                sorted[i] = m->smallest[(i * NUM_ANCHOR_RULES + r) * NUM_ANCHOR_ERRORS + k];
            sort_numbers(sorted, (size_t)n);
            m->bias[r][k] = sorted[at];
            out->rule[r].bias[k] = (struct anchor_bias){
                .b = sorted[at], .lo = sorted[lo], .hi = hi < n ? sorted[hi] : INFINITY};
        }
    free(sorted);
    confirm(m, threads);
    for (int r = 0; r < NUM_ANCHOR_RULES; r++) {
        out->rule[r].threshold = m->threshold[r];
        for (int i = 0; i < n; i++)
            out->rule[r].false_alarms += m->alarm[i * NUM_ANCHOR_RULES + r];
        for (int k = 0; k < NUM_ANCHOR_ERRORS; k++) {
            struct anchor_bias *bias = &out->rule[r].bias[k];
            bias->b = m->bias[r][k];
            bias->hi = fmax(bias->hi, bias->b);
            bias->found = times_found(m, r, k);
        }
    }
}

static void measure_scene(const struct anchor_settings *set, int scene, const char *work,
                          int threads, struct anchor_scene_result *out)
{
    struct err e = {""};
    struct measurement m = {.set = set};
    size_t values = 3 * (size_t)set->side * (size_t)set->side;
    size_t cells = (size_t)set->num_pairs * NUM_ANCHOR_RULES;
    scene_shown = anchor_scenes[scene];
    char kept[4096];
    snprintf(kept, sizeof kept, "%s/%s.renders", work, anchor_scenes[scene]);
    const struct anchor_job job = {.scene = anchor_scenes[scene],
                                   .side = set->side,
                                   .spp = set->spp,
                                   .num_renders = set->num_tune + 2 * set->num_pairs,
                                   .reference_spp = set->reference_spp,
                                   .seed = set->seed + 100000 * (uint64_t)scene,
                                   .threads = threads,
                                   .kept = kept,
                                   .progress = show_render};
    if (!anchor_render(&job, &m.pool, &e))
        die(anchor_scenes[scene], &e);
    m.alarm = calloc(cells, sizeof *m.alarm);
    m.smallest = calloc(cells * NUM_ANCHOR_ERRORS, sizeof *m.smallest);
    m.found = calloc(cells * NUM_ANCHOR_ERRORS, sizeof *m.found);
    m.bench = calloc((size_t)threads, sizeof *m.bench);
    for (int t = 0; t < threads; t++) {
        if (!moments_alloc(&m.bench[t].a, set->side, set->side, &e))
            die("no memory", &e);
        m.bench[t].z = calloc(values, sizeof(double));
        m.bench[t].a8 = calloc(values, 1);
        m.bench[t].b8 = calloc(values, 1);
        m.bench[t].a32 = calloc(values, sizeof(float));
        m.bench[t].b32 = calloc(values, sizeof(float));
        m.bench[t].error = calloc(values, sizeof(float));
    }
    snprintf(out->scene, sizeof out->scene, "%s", anchor_scenes[scene]);
    snprintf(out->title, sizeof out->title, "%s", m.pool.title);
    out->noise = anchor_noise(&m.pool);
    out->num_places = m.pool.num_places;
    set_thresholds(&m, threads);
    measure_pairs(&m, threads, out);
    for (int t = 0; t < threads; t++) {
        moments_free(&m.bench[t].a);
        free(m.bench[t].z);
        free(m.bench[t].a8);
        free(m.bench[t].b8);
        free(m.bench[t].a32);
        free(m.bench[t].b32);
        free(m.bench[t].error);
    }
    free(m.bench);
    free(m.alarm);
    free(m.smallest);
    free(m.found);
    anchor_pool_free(&m.pool);
}

static void measure(const struct anchor_settings *set, int num_scenes, const char *work,
                    const char *path, struct anchor_results *out)
{
    int threads = (int)fmin(16, fmax(1, (double)sysconf(_SC_NPROCESSORS_ONLN)));
    time_t now = time(NULL);
    struct tm day;
    *out = (struct anchor_results){.settings = *set};
    snprintf(out->version, sizeof out->version, "%s", assay_version);
    strftime(out->date, sizeof out->date, "%Y-%m-%d", gmtime_r(&now, &day));
    for (int s = 0; s < num_scenes; s++) {
        struct err e = {""};
        measure_scene(set, s, work, threads, &out->scene[s]);
        out->num_scenes = s + 1; /* a record after each scene: the rest may be interrupted */
        if (!anchors_save(path, out, &e))
            die(path, &e);
    }
    fputc('\n', stderr);
}

int main(int argc, char **argv)
{
    struct anchor_results *r = calloc(1, sizeof *r);
    struct err e = {""};
    char path[4096];
    bool page = argc == 3 && strcmp(argv[1], "--page") == 0;
    bool quick = argc == 4 && strcmp(argv[1], "--quick") == 0;
    if (r == NULL || (argc != 3 && !quick) || (!page && !quick && argv[1][0] == '-')) {
        fputs("usage: make_anchors [--quick] DIRECTORY WORK | --page DIRECTORY\n", stderr);
        return 3;
    }
    const char *dir = argv[page || quick ? 2 : 1], *work = argv[argc - 1];
    snprintf(path, sizeof path, "%s/results.json", dir);
    if (!page) {
        struct anchor_settings set = anchor_settings;
        if (quick) {
            set.num_tune = 20;
            set.num_pairs = 20;
            set.reference_spp = 640;
        }
        measure(&set, quick ? 2 : NUM_ANCHOR_SCENES, work, path, r);
    }
    if (!anchors_load(path, r, &e) || !anchors_write_page(dir, r, &e))
        die(dir, &e);
    free(r);
    return 0;
}
