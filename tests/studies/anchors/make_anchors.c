/* make_anchors DIR | --page DIR | --quick DIR: what our gate and the rules of other renderers'
 * tests find on the same images. Writes DIR/results.json, README.md and plots; --page makes the last
 * two again; --quick measures two scenes with few pairs, to see that it runs. For `make
 * anchors`. */
#include "anchors.h"

#include "renderer/base/fs.h"
#include "tests/studies/calibration/work.h"
#include "tests/support/rates.h"
#include "renderer/base/version.h"
#include "tools/compare/compare.h"
#include "tools/exact/sign_flip.h"
#include "tools/images/flip.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* What one job judges with. */
struct bench {
    struct moments a; /* the wrong image */
    double *z;
    uint8_t *a8, *b8;
    const struct moments *in_b8; /* whose image b8 is */
    float *a32, *b32, *error;
};

struct measurement {
    const char *scene;
    const struct anchor_settings *set;
    struct anchor_pool pool;
    double threshold[NUM_ANCHOR_RULES];
    double guess[NUM_ANCHOR_RULES][NUM_ANCHOR_ERRORS];
    /* Of each pair: */
    bool (*alarm)[NUM_ANCHOR_RULES];
    double (*smallest)[NUM_ANCHOR_RULES][NUM_ANCHOR_ERRORS];
    bool (*found)[NUM_ANCHOR_RULES][NUM_ANCHOR_ERRORS]; /* when asked again for `bias` */
    double bias[NUM_ANCHOR_RULES][NUM_ANCHOR_ERRORS];
    double *tune[NUM_ANCHOR_RULES];
};

enum { TUNE_PARTNERS = 3 }; /* renders for thresholds make so many pairs each, overlapping */
static const double smallest_tried = 1e-5, largest_tried = 100;

static void die(const char *what, const struct err *e)
{
    fprintf(stderr, "make_anchors: %s: %s\n", what, e->msg);
    exit(3);
}

/* Jobs on all processors, with a line that says which and how far. */
static void run_all(const struct measurement *m, const char *stage, int num, work_job *job,
                    void *arg)
{
    char what[128];
    struct err e;
    snprintf(what, sizeof what, "%s: %s", m->scene, stage);
    if (!work_run_all(what, num, job, arg, &e))
        die(what, &e);
}

static struct bench bench_open(int side)
{
    struct err e;
    struct bench t = {.in_b8 = NULL};
    size_t values = 3 * (size_t)side * (size_t)side;
    if (!moments_alloc(&t.a, side, side, &e))
        die("no memory", &e);
    t.z = calloc(values, sizeof *t.z);
    t.a8 = calloc(values, 1);
    t.b8 = calloc(values, 1);
    t.a32 = calloc(values, sizeof *t.a32);
    t.b32 = calloc(values, sizeof *t.b32);
    t.error = calloc(values, sizeof *t.error);
    return t;
}

static void bench_close(struct bench *t)
{
    moments_free(&t->a);
    free(t->z);
    free(t->a8);
    free(t->b8);
    free(t->a32);
    free(t->b32);
    free(t->error);
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

/* -log10 p of the sign-flip test of `assay compare --same-program`; 0 where it declines to judge. */
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
    *threshold = rule == RULE_MITSUBA ? (double)mitsuba_allowed(MITSUBA_SHARE, pixels)
                                      : anchor_rules[rule].published;
    return rule < RULE_GATE_TUNED;
}

static bool one_sided(enum anchor_rule rule) /* judges A against the long reference */
{
    return rule == RULE_MITSUBA_LEVEL_TUNED || rule == RULE_MITSUBA_SHARE_TUNED;
}

static bool tune_one(void *arg, int i, struct err *e)
{
    (void)e;
    struct measurement *m = arg;
    int n = m->set->num_tune;
    struct bench t = bench_open(m->set->side);
    for (int r = 0; r < NUM_ANCHOR_RULES; r++)
        for (int k = 0; m->tune[r] != NULL && k < (one_sided(r) ? 1 : TUNE_PARTNERS); k++)
            m->tune[r][k * n + i] =
                score(m, &t, r, &m->pool.render[i], &m->pool.render[(i + k + 1) % n]);
    bench_close(&t);
    return true;
}

/* The smallest score that at most the share `tuned` of the null scores exceeds. */
static void set_thresholds(struct measurement *m)
{
    size_t pixels = (size_t)m->pool.side * (size_t)m->pool.side;
    int n = m->set->num_tune;
    for (int r = 0; r < NUM_ANCHOR_RULES; r++)
        if (!published_threshold(r, pixels, &m->threshold[r]))
            m->tune[r] = calloc((size_t)(n * TUNE_PARTNERS), sizeof(double));
    run_all(m, "thresholds", n, tune_one, m);
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

/* sqrt(score) - sqrt(threshold), positive where the rule rejects: the root, as a score of -log10 p grows with the
 * square of the error. */
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

/* The smallest error that the rule finds in this pair, to 1 %: brackets it from the guess by growing steps,
 * then alternates interpolation and bisection. */
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

static bool measure_pair(void *arg, int pair, struct err *e)
{
    (void)e;
    struct measurement *m = arg;
    struct bench t = bench_open(m->set->side);
    for (int r = 0; r < NUM_ANCHOR_RULES; r++) {
        m->alarm[pair][r] = excess(m, &t, r, pair, ANCHOR_GLOBAL, 0) > 0;
        for (int k = 0; k < NUM_ANCHOR_ERRORS; k++)
            m->smallest[pair][r][k] = smallest_found(m, &t, r, pair, k, m->guess[r][k]);
    }
    bench_close(&t);
    return true;
}

struct question {
    struct measurement *m;
    bool open[NUM_ANCHOR_RULES][NUM_ANCHOR_ERRORS]; /* asked this time */
};

static bool ask_again(void *arg, int pair, struct err *e)
{
    (void)e;
    const struct question *q = arg;
    struct measurement *m = q->m;
    struct bench t = bench_open(m->set->side);
    for (int r = 0; r < NUM_ANCHOR_RULES; r++)
        for (int k = 0; k < NUM_ANCHOR_ERRORS; k++)
            if (q->open[r][k])
                m->found[pair][r][k] = excess(m, &t, r, pair, k, m->bias[r][k]) > 0;
    bench_close(&t);
    return true;
}

static int times_found(const struct measurement *m, int rule, int kind)
{
    int found = 0;
    for (int i = 0; i < m->set->num_pairs; i++)
        found += m->found[i][rule][kind];
    return found;
}

/* Is the bias really found with the power asked for? Not always: a rule may find a small error in a pair
 * and miss a larger one, as ours does where a larger error makes a region too skewed to be tested. Then
 * the bias is raised by 5 % at a time until it is. */
static void confirm(struct measurement *m)
{
    int enough = (int)ceil(m->set->power * m->set->num_pairs - 1e-9);
    struct question q = {.m = m};
    bool any = true;
    for (int r = 0; r < NUM_ANCHOR_RULES; r++)
        for (int k = 0; k < NUM_ANCHOR_ERRORS; k++)
            q.open[r][k] = isfinite(m->bias[r][k]);
    while (any) {
        run_all(m, "asking again", m->set->num_pairs, ask_again, &q);
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

/* Pair 0 is measured first, alone: the searches of all others start from its answers, so that the record does
 * not depend on thread scheduling. */
static void measure_pairs(struct measurement *m, struct anchor_scene_result *out)
{
    int n = m->set->num_pairs, at, lo, hi;
    for (int r = 0; r < NUM_ANCHOR_RULES; r++)
        for (int k = 0; k < NUM_ANCHOR_ERRORS; k++)
            m->guess[r][k] = 0.1;
    run_all(m, "the first pair", 1, measure_pair, m);
    for (int r = 0; r < NUM_ANCHOR_RULES; r++)
        for (int k = 0; k < NUM_ANCHOR_ERRORS; k++)
            m->guess[r][k] = fmin(m->smallest[0][r][k], largest_tried);
    run_all(m, "judging", n, measure_pair, m);
    anchors_quantile_ranks(n, m->set->power, &at, &lo, &hi);
    double *sorted = calloc((size_t)n, sizeof *sorted);
    for (int r = 0; r < NUM_ANCHOR_RULES; r++)
        for (int k = 0; k < NUM_ANCHOR_ERRORS; k++) {
            for (int i = 0; i < n; i++)
                sorted[i] = m->smallest[i][r][k];
            sort_numbers(sorted, (size_t)n);
            m->bias[r][k] = sorted[at];
            out->rule[r].bias[k] = (struct anchor_bias){
                .b = sorted[at], .lo = sorted[lo], .hi = hi < n ? sorted[hi] : INFINITY};
        }
    free(sorted);
    confirm(m);
    for (int r = 0; r < NUM_ANCHOR_RULES; r++) {
        out->rule[r].threshold = m->threshold[r];
        for (int i = 0; i < n; i++)
            out->rule[r].false_alarms += m->alarm[i][r];
        for (int k = 0; k < NUM_ANCHOR_ERRORS; k++) {
            struct anchor_bias *bias = &out->rule[r].bias[k];
            bias->b = m->bias[r][k];
            bias->hi = fmax(bias->hi, bias->b);
            bias->found = times_found(m, r, k);
        }
    }
}

static void measure_scene(const struct anchor_settings *set, int scene,
                          struct anchor_scene_result *out)
{
    struct err e = {""};
    char what[128];
    struct measurement m = {.set = set, .scene = anchor_scenes[scene]};
    snprintf(what, sizeof what, "%s: rendering", m.scene);
    const struct anchor_job job = {.scene = m.scene,
                                   .side = set->side,
                                   .spp = set->spp,
                                   .num_renders = set->num_tune + 2 * set->num_pairs,
                                   .reference_spp = set->reference_spp,
                                   .seed = set->seed + 100000 * (uint64_t)scene,
                                   .what = what};
    if (!anchor_render(&job, &m.pool, &e))
        die(m.scene, &e);
    m.alarm = calloc((size_t)set->num_pairs, sizeof *m.alarm);
    m.smallest = calloc((size_t)set->num_pairs, sizeof *m.smallest);
    m.found = calloc((size_t)set->num_pairs, sizeof *m.found);
    snprintf(out->scene, sizeof out->scene, "%s", m.scene);
    snprintf(out->title, sizeof out->title, "%s", m.pool.title);
    out->noise = anchor_noise(&m.pool);
    out->num_places = m.pool.num_places;
    set_thresholds(&m);
    measure_pairs(&m, out);
    free(m.alarm);
    free(m.smallest);
    free(m.found);
    anchor_pool_free(&m.pool);
}

static void measure(const struct anchor_settings *set, int num_scenes, const char *path,
                    struct anchor_results *out)
{
    time_t now = time(NULL);
    struct tm day;
    *out = (struct anchor_results){.settings = *set};
    snprintf(out->version, sizeof out->version, "%s", assay_version);
    strftime(out->date, sizeof out->date, "%Y-%m-%d", gmtime_r(&now, &day));
    for (int s = 0; s < num_scenes; s++) {
        struct err e = {""};
        measure_scene(set, s, &out->scene[s]);
        out->num_scenes = s + 1; /* a record after each scene: the rest may be interrupted */
        if (!anchors_save(path, out, &e))
            die(path, &e);
    }
}

int main(int argc, char **argv)
{
    struct anchor_results *r = calloc(1, sizeof *r);
    struct err e = {""};
    bool page = argc == 3 && strcmp(argv[1], "--page") == 0;
    bool quick = argc == 3 && strcmp(argv[1], "--quick") == 0;
    if (r == NULL || (!page && !quick && (argc != 2 || argv[1][0] == '-'))) {
        fputs("usage: make_anchors [--quick | --page] DIRECTORY\n", stderr);
        return 3;
    }
    const char *dir = argv[argc - 1];
    const struct path path = fs_path("%s/results.json", dir);
    if (!page) {
        struct anchor_settings set = anchor_settings;
        if (quick) {
            set.num_tune = 20;
            set.num_pairs = 20;
            set.reference_spp = 640;
        }
        measure(&set, quick ? 2 : NUM_ANCHOR_SCENES, path.s, r);
    }
    if (!anchors_load(path.s, r, &e) || !anchors_write_page(dir, r, &e))
        die(dir, &e);
    free(r);
    return 0;
}
