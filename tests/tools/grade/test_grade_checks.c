/* From images to points, with images whose truth is known: drawn here from gamma laws, written as 8-bit PNG by
 * the assignment's curve, and read back as a submission is.
 *
 * The scene: a gradient of mean .02 to .4, a lamp of radiance 8 in a corner. A sample is exponential (a pixel of spp of
 * them is gamma), one draw for all three channels. The reference has 4096 samples; noise is known from it alone. */

#include "renderer/image/tone.h"
#include "tools/grade/grade_checks.h"
#include "tools/submission/rate_image.h"
#include "tools/grade/stopping_rule.h"
#include "submit_codes.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <gsl/gsl_randist.h>

enum { WIDTH = 64, HEIGHT = 48, PIXELS = WIDTH * HEIGHT, SPP = 256, REFERENCE = 4096 };

static gsl_rng *rng;
static struct moments reference;

static bool is_lamp(size_t p)
{
    return p % WIDTH >= 8 && p % WIDTH < 16 && p / WIDTH < 8;
}

static double truth(size_t p, size_t c)
{
    if (is_lamp(p))
        return 8;
    return (0.02 + 0.38 * (double)(p / WIDTH) / HEIGHT) * (c == 0 ? 1.2 : c == 1 ? 1 : 0.7);
}

/* What a program does to the right image. */
struct bug {
    double scale;  /* of everything */
    double square; /* of the 8 x 8 pixels at 32,24 */
    double noise;  /* samples for one */
    int shift;     /* pixels to the right */
    bool white, lamp_black;
    bool mark; /* 48 x 5 pixels at the bottom left are of radiance 10 */
};
static const struct bug none = {.scale = 1, .square = 1, .noise = 1};

static double with_bug(const struct bug *b, size_t p, size_t c)
{
    size_t x = p % WIDTH, y = p / WIDTH;
    size_t from = b->shift > 0 && x >= (size_t)b->shift ? p - (size_t)b->shift : p;
    double v = truth(from, c) * b->scale;
    if (x >= 32 && x < 40 && y >= 24 && y < 32)
        v *= b->square;
    if (b->lamp_black && is_lamp(p))
        v = 0;
    if (b->mark && x < 48 && y >= HEIGHT - 5)
        return 10;
    return b->white ? 9 : v;
}

/* A render of spp samples, written to a file and read back. The lamp has no noise. */
static struct submitted_image submit_render(const struct bug *b, double spp)
{
    static uint8_t rgb8[3 * PIXELS];
    for (size_t p = 0; p < PIXELS; p++) {
        double g = gsl_ran_gamma(rng, spp * b->noise, 1 / (spp * b->noise));
        for (size_t c = 0; c < 3; c++)
            rgb8[3 * p + c] = tone_map(TONE_CGL, with_bug(b, p, c) * (is_lamp(p) ? 1 : g));
    }
    return submit_codes(rgb8, WIDTH, HEIGHT);
}

/* M2 and M3 of an exponential law of the mean that was found: n mean^2, 2 n mean^3. */
static void make_reference(struct moments *m)
{
    struct err e;
    assert_true(moments_alloc(m, WIDTH, HEIGHT, &e));
    for (size_t p = 0; p < PIXELS; p++) {
        double g = gsl_ran_gamma(rng, REFERENCE, 1.0 / REFERENCE);
        m->n[p] = REFERENCE;
        for (size_t i = 3 * p; i < 3 * p + 3; i++) {
            m->mean[i] = truth(p, i - 3 * p) * (is_lamp(p) ? 1 : g);
            m->m2[i] = is_lamp(p) ? 0 : REFERENCE * pow(m->mean[i], 2);
            m->m3[i] = is_lamp(p) ? 0 : 2 * REFERENCE * pow(m->mean[i], 3);
        }
    }
}

static int set_up(void **state)
{
    (void)state;
    rng = gsl_rng_alloc(gsl_rng_mt19937);
    gsl_rng_set(rng, 20240607);
    make_reference(&reference);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    gsl_rng_free(rng);
    moments_free(&reference);
    return 0;
}

/* A rubric of one check, its answers, and what is submitted. */
struct task {
    struct rubric r;
    struct answer_key a;
    struct submitted_images h;
    struct grading g;
};

static struct task *start(enum check_kind kind, int images, double alpha)
{
    struct task *t = calloc(1, sizeof *t);
    assert_non_null(t);
    t->g = (struct grading){&t->r, &t->a, &t->h, alpha, NULL};
    t->r.num_checks = t->r.num_parts = 1;
    t->r.num_images = images;
    struct rubric_check *c = &t->r.check[0];
    c->kind = kind;
    c->num_images = images;
    c->points = 10;
    c->image = (struct margin){0.01, 0.05, true};
    c->tile = (struct margin){0.04, 0.2, true};
    c->log_ratio = (struct margin){0.3, 1, true};
    c->share = (struct margin){0.01, 0.2, true};
    for (int i = 0; i < images; i++) {
        c->images[i] = i;
        t->a.of[0][i].m = t->a.of[0][i].noise = reference;
        t->r.image[i] = (struct rubric_image){
            .width = WIDTH, .height = HEIGHT, .spp = SPP, .reference = REFERENCE_OURS};
        snprintf(t->r.image[i].name, sizeof t->r.image[i].name, "p%d", i);
    }
    return t;
}

static void end(struct task *t)
{
    for (int i = 0; i < t->r.num_images; i++)
        submitted_image_free(&t->h.image[i]);
    free(t);
}

/* Its one check, after which it ends. */
static struct result run_check(struct task *t)
{
    struct result out;
    struct err e;
    MUST(grade_checks_run(&t->g, &t->r.check[0], 0, &out, &e));
    end(t);
    return out;
}

/* One check on images with these bugs, of spp[] samples (what the rubric asks for: SPP, or asked[]). */
static struct result check(enum check_kind kind, int num, const struct bug *const *bug,
                           const double *spp, const int *asked, double alpha)
{
    struct task *t = start(kind, num, alpha);
    for (int i = 0; i < num; i++) {
        t->h.image[i] = submit_render(bug[i], spp[i]);
        if (asked != NULL)
            t->r.image[i].spp = asked[i];
    }
    return run_check(t);
}

/* It gives a share of the points from least to most, and is freed. */
static void expect_share(struct result r, double least, double most)
{
    if (r.share < least || r.share > most)
        fail_msg("%g of the points: %s", r.share, r.seen);
    result_free(&r);
}

static struct result equal(const struct bug *bug, double spp, double alpha)
{
    return check(CHECK_EQUAL, 1, &bug, &spp, NULL, alpha);
}

/* A program whose images have these bugs, asked for further runs until the check is decided, each of 1.5 times the samples of
 * the last; *runs: how many it took. noise: variance over ours. */
static struct result buy(const struct bug *bug, double noise, int *runs)
{
    struct task *t = start(CHECK_EQUAL, 1, 1e-5);
    struct bug noisy = *bug;
    struct result out;
    struct err e;
    noisy.noise /= noise;
    t->h.can_buy = true;
    t->h.image[0] = submit_render(&noisy, SPP);
    double spp = t->h.image[0].spp = SPP;
    for (*runs = 1;; ++*runs) {
        MUST(grade_checks_run(&t->g, &t->r.check[0], 0, &out, &e));
        if (out.more == 0 || *runs == 20)
            break;
        result_free(&out);
        spp *= 1.5;
        struct submitted_image more = submit_render(&noisy, spp);
        more.spp = spp;
        MUST(submitted_image_add_run(&t->h.image[0], &more, &e));
    }
    end(t);
    return out;
}

/* By hand: distance 0 inside, linear between, the width of the interval counted. */
TEST(points_follow_the_interval)
{
    const struct margin m = {0.02, 0.06, true};
    const struct {
        double lo, hi, share;
    } cases[] = {
        {-0.01, 0.01, 1},    {0.02, 0.03, 1}, {0.04, 0.05, 0.5},  {0.06, 0.07, 0},
        {-0.05, -0.04, 0.5}, {-0.9, -0.8, 0}, {-0.06, 0.06, 1},   {-0.09, 0.09, 0.5},
        {-0.12, 0.12, 0},    {-5, 5, 0},      {0.05, 0.05, 0.25},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        const struct interval v = {(cases[i].lo + cases[i].hi) / 2, cases[i].lo, cases[i].hi, 0.01};
        assert_true(fabs(fmin(score_share(&m, &v), score_width(&m, &v)) - cases[i].share) < 1e-9);
    }
    /* Continuous: no step of the ends by 1e-4 changes it by more than 1e-4 over the narrower slope. */
    for (double v = -0.2; v < 0.2; v += 1e-4) {
        const struct interval a = {v, v - 0.01, v + 0.01, 0.002},
                              b = {v + 1e-4, v - 0.01 + 1e-4, v + 0.01 + 1e-4, 0.002};
        assert_true(fabs(score_share(&m, &a) - score_share(&m, &b)) <= 1e-4 / 0.04 + 1e-12);
    }
    /* 5 sd to the loss of points on one side, 15 on the other: Q(5) = 2.87e-7. */
    const struct interval at = {0.02, 0.01, 0.03, 0.002};
    const struct margin wide = {0.02, 0.06, true};
    assert_true(fabs(score_chance(&wide, &at) / 2.866516e-7 - 1) < 1e-3);
    const struct interval between = {0.05, 0.04, 0.06, 0.002};
    assert_true(score_chance(&wide, &between) == 1);
    /* To a hundredth of a point, by hand: 8 points less 0.004, less 0.006; all and none stay so, whatever it is
     * worth. */
    assert_true(score_round(0.9995, 8) == 1);
    assert_true(fabs(8 * score_round(0.99925, 8) - 7.99) < 1e-12);
    assert_true(score_round(1, 1.155) == 1 && score_round(0, 1.155) == 0);
    assert_true(score_round(0.9999, 0) == 0.9999);
}

/* The printed chance is that of different points in another run: 20 000 further runs, normal around the estimate,
 * for each of 60 values of it. H0: the points change as often as printed; 5 binomial standard deviations, alpha
 * below 1e-4 in all. */
TEST(the_chance_is_that_of_another_run)
{
    enum { RUNS = 20000 };
    const struct margin m = {0.02, 0.06, true};
    int places = 0, likely = 0;
    for (double at = 0; at < 0.12; at += 0.002) {
        const double sd = 0.004, half = 0.01;
        const struct interval i = {at, at - half, at + half, sd};
        double share = score_share(&m, &i), chance = score_chance(&m, &i);
        if (share > 0 && share < 1)
            continue; /* where every run has others */
        int other = 0;
        for (int k = 0; k < RUNS; k++) {
            double v = at + gsl_ran_gaussian(rng, sd);
            const struct interval again = {v, v - half, v + half, sd};
            other += score_share(&m, &again) != share;
        }
        if (fabs(other - RUNS * chance) > 5 * sqrt(RUNS * chance * (1 - chance)) + 1)
            fail_msg("at %g: %d of %d runs have other points, %g is said", at, other, RUNS, chance);
        places++;
        likely += chance > 0.1;
    }
    assert_true(places >= 30 && likely >= 3);
}

/* Of a right program: below 1e-4, printed, and no point is lost. Control: one that is off by as much as costs nothing. */
TEST(a_right_program_keeps_its_score)
{
    enum { RUNS = 100 };
    double most = 0;
    for (int k = 0; k < RUNS; k++) {
        OWN(result) r = equal(&none, SPP, 1e-5);
        assert_true(r.share == 1);
        most = fmax(most, r.chance);
    }
    printf("largest chance of other points, of %d right images: %.2g\n", RUNS, most);
    assert_true(most < 1e-4);
    const struct bug near = {.scale = 1.03, .square = 1, .noise = 1};
    OWN(result) r = equal(&near, SPP, 1e-5);
    assert_true(r.chance > 1e-4);
}

/* H0: the interval of a check misses a true 0 with at most alpha, here 5 %, over all channels and tiles. 400 images:
 * more than 34 misses have a probability of 1.1e-3 (binomial). Control: 3 % too bright. */
TEST(a_right_image_keeps_its_points)
{
    enum { RUNS = 400 };
    int misses = 0, lost = 0, found = 0;
    for (int k = 0; k < RUNS; k++) {
        OWN(result) r = equal(&none, SPP, 0.05);
        bool miss = false;
        for (int c = 0; c < NUM_CHANNELS; c++)
            miss |= interval_distance(&r.agreement.image[c]) > 0;
        miss |= interval_distance(&r.agreement.tile) > 0;
        misses += miss;
        lost += r.share < 1;
        assert_true(r.agreement.tiles >= 40);
    }
    if (misses > 34)
        fail_msg("%d of %d intervals miss the truth", misses, RUNS);
    printf("intervals that miss the truth at 5 %%: %d of %d; less than full points: %d\n", misses,
           RUNS, lost);
    assert_int_equal(lost, 0);
    const struct bug bright = {.scale = 1.03, .square = 1, .noise = 1};
    for (int k = 0; k < 40; k++) {
        OWN(result) r = equal(&bright, SPP, 0.05);
        found += interval_distance(&r.agreement.image[CHANNEL_LUMINANCE]) > 0;
    }
    assert_int_equal(found, 40);
}

/* Noisier than ours by 4, or by a quarter: known from the image, still right. By 100: too noisy to be worth points. */
TEST(noise_is_not_bias)
{
    static const double samples[] = {0.25, 1, 4};
    for (int i = 0; i < 3; i++) {
        struct bug b = none;
        b.noise = samples[i];
        OWN(result) r = equal(&b, SPP, 1e-5);
        if (r.share < 1)
            fail_msg("samples x %g: %g points, %s", samples[i], r.share, r.seen);
        assert_true(fabs(log(r.agreement.kappa * samples[i])) < 0.3);
    }
    struct bug b = none;
    b.noise = 1.0 / 64;
    OWN(result) r = equal(&b, SPP, 1e-5);
    assert_true(r.share < 1);
}

/* Rare bright samples, 200 times the third moment of an exponential law: g = 200 * 2/sqrt(64 * 256) = 3.1 of a tile's mean, and Bernstein's half
 * width (sqrt(2 t) + g/2 t) sd with t = ln(2 * 52/1e-5) = 16 is (5.7 + 25)/128 = 24 % of it: 95 % darker is not noise. Control: 15 % darker
 * may be, and all is kept; so are the points of right images. */
TEST(tiles_of_rare_bright_samples_are_judged)
{
    const struct bug dark = {.scale = 1, .square = 0.05, .noise = 1},
                     dim = {.scale = 1, .square = 0.85, .noise = 1};
    for (size_t i = 0; i < 3 * PIXELS; i++)
        reference.m3[i] *= 200;
    struct result wrong = equal(&dark, SPP, 1e-5), unsure = equal(&dim, SPP, 1e-5),
                  right = equal(&none, SPP, 1e-5);
    for (size_t i = 0; i < 3 * PIXELS; i++)
        reference.m3[i] /= 200;
    if (wrong.share > 0 || unsure.share < 1 || right.share < 1)
        fail_msg("dark %g (%s), dim %g (%s), right %g (%s)", wrong.share, wrong.seen, unsure.share,
                 unsure.seen, right.share, right.seen);
    result_free(&wrong);
    result_free(&unsure);
    result_free(&right);
}

/* Points follow bias: variance 0.1 to 100 times ours costs nothing and hides nothing. H0: a right program loses points with at most
 * 1e-5 a check; 48 programs, none may (chance of one below 5e-4). Control: 2.5 times the margin off, or a dark square, all
 * lost; no more runs for programs as noisy as ours. At 100 times the variance a dark square may look as if it had missed
 * rare bright samples: found 19 times of 20 (95 of 100 seeds), so of 12 at least 8 (fewer have a chance of 2e-4). */
TEST(points_follow_bias_not_variance)
{
    static const double noise[] = {0.1, 1, 10, 100};
    const struct bug bright = {.scale = 1.125, .square = 1, .noise = 1},
                     dark = {.scale = 1, .square = 0.4, .noise = 1};
    for (size_t i = 0; i < COUNT(noise); i++) {
        int runs, most = 0;
        for (int k = 0; k < 12; k++) {
            OWN(result) r = buy(&none, noise[i], &runs);
            if (r.share < 1 || r.more > 0)
                fail_msg("variance x %g, %d runs: %g of the points, %s", noise[i], runs, r.share,
                         r.seen);
            most = runs > most ? runs : most;
        }
        printf("variance x %g: at most %d runs\n", noise[i], most);
        assert_true(noise[i] > 1 || most == 1);
        for (int k = 0; k < 2; k++) {
            const int programs = k == 1 && noise[i] == 100 ? 12 : 1;
            int found = 0;
            for (int program = 0; program < programs; program++) {
                OWN(result) r = buy(k == 0 ? &bright : &dark, noise[i], &runs);
                found += r.share == 0 && r.more == 0;
            }
            if (found < (programs > 1 ? 8 : 1))
                fail_msg("variance x %g, bug %d: found in %d of %d", noise[i], k, found, programs);
        }
    }
}

/* A run of 2 S samples whose first S are those of another run has a correlation of sqrt(1/2) with it. H0: runs are
 * independent; they are reported beyond 6 standard deviations, which none of 100 may reach. A common bias of a
 * tenth, coarser than a pixel, is no correlation. */
TEST(runs_that_share_samples_are_seen)
{
    static uint8_t rgb8[2][3 * PIXELS];
    static unsigned char use[PIXELS];
    memset(use, 1, sizeof use);
    for (int k = 0; k < 110; k++) {
        const bool shared = k >= 100;
        double scale = k % 2 == 0 ? 1 : 0.9;
        for (size_t p = 0; p < PIXELS; p++) {
            double a = gsl_ran_gamma(rng, SPP, 1.0 / SPP), b = gsl_ran_gamma(rng, SPP, 1.0 / SPP),
                   c = gsl_ran_gamma(rng, SPP, 1.0 / SPP);
            for (size_t i = 3 * p; i < 3 * p + 3; i++) {
                double v = scale * truth(p, i - 3 * p);
                rgb8[0][i] = tone_map(TONE_CGL, v * a);
                rgb8[1][i] = tone_map(TONE_CGL, v * (shared ? (a + b) / 2 : (b + c) / 2));
            }
        }
        OWN(submitted_image)
        one = submit_codes(rgb8[0], WIDTH, HEIGHT),
        two = submit_codes(rgb8[1], WIDTH, HEIGHT), right;
        struct err e;
        MUST(submitted_image_from(&reference, &one, &right, &e));
        submitted_image_expect(&one, &reference, SPP);
        submitted_image_expect(&two, &reference, 2 * SPP);
        assert_true(difference_correlated(&one, &two, &right, use) == shared);
        assert_true(submitted_image_same(&one, &one) && !submitted_image_same(&one, &two));
    }
}

/* By hand: codes of 1, 2 and 4 times S samples; the mean is weighted, and so small a run as S of 4 S is no part of it. */
TEST(runs_are_weighted_by_their_samples)
{
    static const double value[] = {0.1, 0.2, 0.3}, spp[] = {1, 2, 4};
    struct submitted_image run[3];
    struct err e;
    for (int k = 0; k < 3; k++) {
        static uint8_t rgb8[3 * PIXELS];
        memset(rgb8, tone_map(TONE_CGL, value[k]), sizeof rgb8);
        run[k] = submit_codes(rgb8, WIDTH, HEIGHT);
        run[k].spp = spp[k];
    }
    double first = run[0].mean[0], second = run[1].mean[0], third = run[2].mean[0];
    MUST(submitted_image_add_run(&run[0], &run[1], &e));
    double mean = (first + 2 * second) / 3;
    assert_true(run[0].spp == 3 && fabs(run[0].mean[7] - mean) < 1e-12);
    /* One degree of freedom: (1/3)(x1 - mean)^2 + (2/3)(x2 - mean)^2. */
    assert_true(run[0].runs_dof == 1 &&
                fabs(run[0].measured[5] - (pow(first - mean, 2) + 2 * pow(second - mean, 2)) / 3) <
                    1e-12);
    MUST(submitted_image_add_run(&run[0], &run[2], &e));
    assert_true(run[0].num_runs == 2 && run[0].spp == 6 &&
                fabs(run[0].mean[7] - (second + 2 * third) / 3) < 1e-12);
    submitted_image_free(&run[0]);
}

TEST(bugs_cost_points)
{
    static const struct {
        const char *name;
        struct bug bug;
        double most; /* share of the points that may be left */
    } bugs[] = {
        {"20 % too bright", {.scale = 1.2, .square = 1, .noise = 1}, 0},
        {"a dark square", {.scale = 1, .square = 0.5, .noise = 1}, 0},
        {"black", {.scale = 0, .square = 1, .noise = 1}, 0},
        {"white", {.scale = 1, .square = 1, .noise = 1, .white = true}, 0},
        {"no lamp", {.scale = 1, .square = 1, .noise = 1, .lamp_black = true}, 0},
        {"shifted by 8", {.scale = 1, .square = 1, .noise = 1, .shift = 8}, 0},
        {"4 % too bright", {.scale = 1.04, .square = 1, .noise = 1}, 0.9},
    };
    for (size_t i = 0; i < COUNT(bugs); i++) {
        OWN(result) r = equal(&bugs[i].bug, SPP, 1e-5);
        if (r.share > bugs[i].most)
            fail_msg("%s: %g of the points are left: %s", bugs[i].name, r.share, r.seen);
    }
}

/* The reference as a file, with the noise that it has and no other. */
TEST(a_copy_of_the_reference_is_seen)
{
    static uint8_t rgb8[3 * PIXELS];
    for (size_t i = 0; i < 3 * PIXELS; i++)
        rgb8[i] = tone_map(TONE_CGL, reference.mean[i]);
    struct task *t = start(CHECK_EQUAL, 1, 1e-5);
    t->h.image[0] = submit_codes(rgb8, WIDTH, HEIGHT);
    OWN(result) out = run_check(t);
    assert_true(out.share == 0);
    assert_non_null(strstr(out.flag, "copy"));
}

/* What is accepted: everything 1.2 times as bright. A program that does that loses nothing, one that has a dark square besides
 * does, one that is right or 1.5 times too bright is not said to have it. */
TEST(what_is_accepted_costs_nothing_and_hides_nothing)
{
    static const struct {
        struct bug bug;
        int set;
        double share;
    } cases[] = {{{.scale = 1.2, .square = 1, .noise = 1}, 1, 1},
                 {{.scale = 1.2, .square = 0.5, .noise = 1}, 0, 0},
                 {{.scale = 1, .square = 1, .noise = 1}, 0, 1},
                 {{.scale = 1.5, .square = 1, .noise = 1}, 0, 0}};
    struct task *t = start(CHECK_EQUAL, 1, 1e-5);
    struct moments *m = &t->a.of[1][0].m;
    struct err e;
    MUST(moments_alloc(m, WIDTH, HEIGHT, &e));
    t->r.num_sets = 2;
    strcpy(t->r.set[1].name, "bright");
    for (size_t i = 0; i < 3 * PIXELS; i++) {
        m->n[i / 3] = REFERENCE;
        m->mean[i] = 1.2 * reference.mean[i];
        m->m2[i] = 1.2 * 1.2 * reference.m2[i];
        m->m3[i] = 1.2 * 1.2 * 1.2 * reference.m3[i];
    }
    for (size_t k = 0; k < COUNT(cases); k++) {
        OWN(result) out;
        int set = -1;
        submitted_image_free(&t->h.image[0]);
        t->h.image[0] = submit_render(&cases[k].bug, SPP);
        MUST(grade_all_checks(&t->g, &out, &set, &e));
        if (set != cases[k].set || out.share != cases[k].share)
            fail_msg("case %zu: set %d, %g of the points: %s", k, set, out.share, out.seen);
        assert_string_equal(out.accepted, set == 1 ? "bright" : "");
    }
    moments_free(m);
    end(t);
}

/* Of two deviations only the one that changes the image is told, in the rubric's words where it has some. */
TEST(only_what_changes_the_image_is_told)
{
    struct task *t = start(CHECK_EQUAL, 1, 1e-5);
    struct rubric *r = &t->r;
    struct moments *m = &t->a.of[1][0].m;
    struct result out;
    struct err e;
    MUST(moments_alloc(m, WIDTH, HEIGHT, &e));
    r->num_accepted = 2;
    r->num_sets = 4;
    strcpy(r->accept[0].name, "bright");
    strcpy(r->accept[1].name, "rough");
    strcpy(r->set[2].name, "rough");
    grade_checks_accept(&t->g, &r->check[0], 3, &out);
    assert_string_equal(out.accepted, "bright");
    strcpy(r->accept[0].words, "the lamp is too bright");
    grade_checks_accept(&t->g, &r->check[0], 3, &out);
    assert_string_equal(out.accepted, "the lamp is too bright");
    grade_checks_accept(&t->g, &r->check[0], 2, &out);
    assert_string_equal(out.accepted, "rough");
    moments_free(m);
    end(t);
}

/* The mark of the staff's library: masked, it costs nothing; one pixel of the mask too few, or a bug beside it, does. */
TEST(a_watermark_is_masked)
{
    static const struct {
        int mask[4];
        struct bug bug;
        bool all;
    } cases[] = {{{0, 0, 48, 5}, {.scale = 1, .square = 1, .noise = 1, .mark = true}, true},
                 {{0, 0, 0, 0}, {.scale = 1, .square = 1, .noise = 1, .mark = true}, false},
                 {{0, 1, 48, 5}, {.scale = 1, .square = 1, .noise = 1, .mark = true}, false},
                 {{0, 0, 48, 5}, {.scale = 1, .square = 0.5, .noise = 1, .mark = true}, false}};
    for (int kind = 0; kind < 2; kind++)
        for (size_t k = 0; k < COUNT(cases); k++) {
            struct task *t = start(kind == 0 ? CHECK_EQUAL : CHECK_EXACT, 1, 1e-5);
            memcpy(t->r.mask, cases[k].mask, sizeof t->r.mask);
            t->h.image[0] = submit_render(&cases[k].bug, SPP);
            OWN(result) out = run_check(t);
            if ((out.share == 1) != cases[k].all)
                fail_msg("case %zu: %g of the points: %s", k, out.share, out.seen);
        }
}

TEST(two_estimators_agree_or_not)
{
    const struct bug bright = {.scale = 1.2, .square = 1, .noise = 1},
                     noisy = {.scale = 1, .square = 1, .noise = 0.3};
    /* At 4 times the samples no interval is as long as the margins, which would cost points, too. */
    const double spp[] = {SPP, SPP}, many[] = {4 * SPP, 4 * SPP};
    expect_share(
        check(CHECK_AGREE, 2, (const struct bug *const[]){&none, &noisy}, many, NULL, 1e-5), 1, 1);
    expect_share(
        check(CHECK_AGREE, 2, (const struct bug *const[]){&none, &bright}, spp, NULL, 1e-5), 0, 0);
    /* Of two black images, which are the same file, no option is to blame. */
    const struct bug black = {.scale = 0, .square = 1, .noise = 1};
    struct result r =
        check(CHECK_AGREE, 2, (const struct bug *const[]){&black, &black}, spp, NULL, 1e-5);
    assert_string_equal(r.seen, "both images are black");
    expect_share(r, 0, 0);
}

/* A third and two thirds; the lamp in all of them is saturated and says nothing. */
TEST(parts_add_up_or_not)
{
    const struct bug third = {.scale = 1.0 / 3, .square = 1, .noise = 1},
                     rest = {.scale = 2.0 / 3, .square = 1, .noise = 1};
    const double spp[] = {4 * SPP, 4 * SPP, 4 * SPP};
    expect_share(
        check(CHECK_SUM, 3, (const struct bug *const[]){&none, &third, &rest}, spp, NULL, 1e-5), 1,
        1);
    expect_share(
        check(CHECK_SUM, 3, (const struct bug *const[]){&none, &rest, &rest}, spp, NULL, 1e-5), 0,
        0);
}

/* The second image is asked for with 16 times the samples, and has them; or as many as the first; or 256 times as many, as if they were
 * stratified. */
TEST(noise_falls_or_not)
{
    const struct bug *const two[] = {&none, &none};
    const int asked[] = {SPP / 4, 4 * SPP};
    expect_share(check(CHECK_NOISE, 2, two, (const double[]){SPP / 4, 4 * SPP}, asked, 1e-5), 1, 1);
    expect_share(check(CHECK_NOISE, 2, two, (const double[]){SPP / 4, SPP / 4}, asked, 1e-5), 0, 0);
    expect_share(check(CHECK_NOISE, 2, two, (const double[]){SPP / 4, 64 * SPP}, asked, 1e-5), 1,
                 1);
}

/* The same of a program by another method than ours, which has a 400th of its variance in the left half: there our noise, but not
 * the program's, is below the codes' rounding in the second image alone. H0: it falls by the factor asked for, 16; alpha 0.01 (two-sided).
 * The standard error of the ratio's logarithm is 0.43, so that noise which does not fall is missed with 1e-4: (ln 16 - 1.1)/0.43 = 3.9. */
TEST(noise_of_another_method_falls_or_not)
{
    static const int asked[] = {SPP / 4, 4 * SPP};
    OWN(moments) ours;
    make_reference(&ours);
    for (size_t i = 0; i < 3 * PIXELS; i++)
        ours.m2[i] /= i / 3 % WIDTH < WIDTH / 2 ? 400 : 1;
    for (int falls = 0; falls < 2; falls++) {
        struct task *t = start(CHECK_NOISE, 2, 0.01);
        t->r.check[0].log_ratio = (struct margin){0, 6, true};
        for (int k = 0; k < 2; k++) {
            t->a.of[0][k].m = t->a.of[0][k].noise = ours;
            t->r.image[k].spp = asked[k];
            t->h.image[k] = submit_render(&none, falls ? asked[k] : asked[0]);
        }
        OWN(result) r = run_check(t);
        if ((r.share == 1) != falls)
            fail_msg("%d: %g of the points: %s", falls, r.share, r.seen);
    }
}

TEST(pixels_are_exact_or_not)
{
    const struct bug *right = &none;
    const struct bug square = {.scale = 1, .square = 0.2, .noise = 1};
    const struct bug *wrong = &square;
    const double spp = SPP;
    expect_share(check(CHECK_EXACT, 1, &right, &spp, NULL, 1e-5), 1, 1);
    OWN(result) r = check(CHECK_EXACT, 1, &wrong, &spp, NULL, 1e-5);
    assert_true(r.share < 1);
    assert_non_null(strstr(r.seen, "64 of 3072 pixels differ (2.08 %), the first at 32,24"));
}

/* Of exponential samples the variance is the squared mean, so a pixel stops after (1.96 / tolerance)^2 of them, however bright it is;
 * the lamp, 64 of 3072 pixels, after the first batch. */
TEST(samples_go_by_the_rule_of_stopping)
{
    static const struct rubric_image image = {
        .width = WIDTH, .height = HEIGHT, .spp = SPP, .options = "-a 16 0.15"};
    const double lamp = 64.0 / PIXELS, right = (1 - lamp) * 176 + lamp * 16,
                 one_sigma = (1 - lamp) * 48 + lamp * 16;
    for (int k = 0; k < 2; k++) {
        struct bug darker = none;
        struct stopping by[NUM_STOPPING_KINDS];
        struct err e;
        darker.scale = k == 0 ? 1 : 0.5;
        OWN(submitted_image) s = submit_render(&darker, SPP);
        submitted_image_expect(&s, &reference, SPP);
        MUST(stopping_rule_samples(&image, &s, &reference, by, &e));
        assert_true(by[STOPS_RIGHTLY].least <= right && right <= by[STOPS_RIGHTLY].most);
        /* The two rules' intervals may each reach half way to the other's, by factors. */
        assert_true(by[STOPS_RIGHTLY].most < sqrt(right / one_sigma) * by[STOPS_RIGHTLY].least);
        assert_true(by[STOPS_BY_ONE_SIGMA].least <= one_sigma &&
                    one_sigma <= by[STOPS_BY_ONE_SIGMA].most);
        assert_true(by[STOPS_BY_ONE_SIGMA].most < by[STOPS_RIGHTLY].least);
        assert_true(by[STOPS_BY_N].most < by[STOPS_BY_ONE_SIGMA].least);
        assert_true(by[STOPS_BY_SIGMA].least > by[STOPS_RIGHTLY].most);
        assert_float_equal(by[STOPS_NEVER].least, SPP, 1e-9);
        assert_float_equal(by[STOPS_AT_ONCE].least, 16, 1e-9);
        assert_float_equal(by[STOPS_AT_ONCE].most, 16, 1e-9);
    }
    assert_int_equal(stopping_rule_of("adaptive_absolute"), STOPS_BY_ABSOLUTE);
    assert_int_equal(stopping_rule_of("cosine_missing"), STOPS_RIGHTLY);
}

/* Blue 0 to red 1 through green, as the assignment has it: 16 is a quarter of 64, halfway from blue to green. */
TEST(rates_are_whole_batches_or_not)
{
    static uint8_t rgb8[3 * PIXELS];
    const char *path = test_path("rate.png");
    struct rate_image r;
    struct err e;
    static double n[PIXELS];
    const struct moments ours = {.n = n};
    struct rubric_image image = {.width = WIDTH, .height = HEIGHT, .spp = 64};
    for (size_t p = 0; p < PIXELS; p++) {
        const uint8_t quarter[3] = {0, 127, 127}, all[3] = {255, 0, 0}, odd[3] = {0, 60, 195};
        n[p] = p < 1024 ? 16 : 64;
        memcpy(rgb8 + 3 * p, p < 1024 ? quarter : p < 3000 ? all : odd, 3);
    }
    assert_true(image_write_png(path, WIDTH, HEIGHT, rgb8, &e));
    assert_true(rate_image_read(path, &image, 16, &ours, &r, &e));
    assert_true(r.odd == PIXELS - 3000);
    assert_true(r.early == 1024 + PIXELS - 3000);
    /* The odd ones (rate .118 of 64 is 7.5) are nearest to 16: 72 pixels have 48 too few. */
    double mean = (1024.0 * 16 + 1976.0 * 64 + 72.0 * 16) / PIXELS,
           right = (1024.0 * 16 + 2048.0 * 64) / PIXELS;
    assert_true(fabs(r.mean - mean) < 1e-9 && fabs(r.more - (mean / right - 1)) < 1e-9);
    assert_true(fabs(r.sd * right - 48 * sqrt(72.0 / PIXELS * (1 - 72.0 / PIXELS) / PIXELS)) <
                1e-9);
    image.spp = 64000;
    assert_false(rate_image_read(path, &image, 16, &ours, &r, &e));
    image = (struct rubric_image){.width = 32, .height = 32, .spp = 64};
    assert_false(rate_image_read(path, &image, 16, &ours, &r, &e));
}

/* A pixel of relative variance v stops after (1.96/0.2)^2 v samples, 96 v: as noisy as ours it does, 4 times as noisy it takes all
 * 256, with 0.6 times the light as well. */
TEST(all_samples_are_right_for_a_noisy_image)
{
    static uint8_t red[3 * PIXELS];
    for (int i = 0; i < PIXELS; i++)
        red[3 * i] = 255;
    for (int noisy = 0; noisy < 2; noisy++) {
        struct task *t = start(CHECK_RATES, 1, 1e-5);
        struct result out = {0};
        struct err e;
        snprintf(t->r.image[0].options, sizeof t->r.image[0].options, "-a 24 0.2");
        t->r.check[0].batch = 24;
        t->r.check[0].count = (struct margin){0.03, 0.2, true};
        t->h.image[0] =
            submit_render(&(struct bug){.scale = 0.6, .square = 1, .noise = noisy ? 0.25 : 1}, SPP);
        t->a.of[0][0].as_asked = reference;
        /* Whatever it was last held against. */
        submitted_image_expect(&t->h.image[0], &reference, SPP / 16.0);
        snprintf(t->h.made[0].rates, sizeof t->h.made[0].rates, "%s", test_path("all.png"));
        MUST(image_write_png(t->h.made[0].rates, WIDTH, HEIGHT, red, &e));
        assert_true(grade_checks_rates(&t->g, 0, &t->r.check[0], &out, &e));
        assert_true(out.share == (noisy ? 1 : 0));
        end(t);
    }
}

/* An image of one radiance without noise, of which every pixel takes a batch or all samples, decides whether a right image that
 * took all of its own has points for having been stopped; a noisy one cannot tell. */
TEST(what_never_stops_is_not_adaptive)
{
    static uint8_t rate[3 * PIXELS];
    struct err e;
    OWN(moments) flat = {0};
    MUST(moments_alloc(&flat, WIDTH, HEIGHT, &e));
    for (size_t i = 0; i < 3 * PIXELS; i++) {
        flat.n[i / 3] = 24;
        flat.mean[i] = 0.5;
    }
    static const struct {
        bool early, noisy;
        double share;
    } cases[] = {{true, false, 1}, {false, false, 0}, {false, true, 1}};
    for (size_t k = 0; k < COUNT(cases); k++) {
        struct task *t = start(CHECK_EQUAL, 2, 1e-5);
        for (size_t p = 0; p < PIXELS; p++) { /* 24 of 256, or all */
            rate[3 * p] = cases[k].early ? 0 : 255;
            rate[3 * p + 1] = cases[k].early ? 48 : 0;
            rate[3 * p + 2] = cases[k].early ? 207 : 0;
        }
        t->r.num_checks = 2;
        t->r.check[1] = t->r.check[0];
        t->r.check[1].kind = CHECK_RATES;
        t->r.check[1].images[0] = 1;
        t->r.check[0].num_images = t->r.check[1].num_images = 1;
        t->r.check[1].batch = 24;
        for (int i = 0; i < 2; i++) {
            snprintf(t->r.image[i].options, sizeof t->r.image[i].options, "-a 24 0.2");
            t->h.image[i] = submit_render(&none, SPP);
        }
        t->a.of[0][1].noise = cases[k].noisy ? reference : flat;
        t->a.of[0][1].as_asked = flat;
        snprintf(t->h.made[1].rates, sizeof t->h.made[1].rates, "%s", test_path("stops.png"));
        MUST(image_write_png(t->h.made[1].rates, WIDTH, HEIGHT, rate, &e));
        OWN(result) out = run_check(t);
        if (out.share != cases[k].share ||
            (out.share == 0 && strstr(out.seen, "adaptive sampling is missing") == NULL))
            fail_msg("case %zu: %g of the points: %s", k, out.share, out.seen);
    }
}

/* All samples of a noisy image, where ours takes a quarter of them, are right for a program that stops where there is no noise; for one
 * whose rate images always show all they say nothing. */
TEST(all_samples_are_not_right_for_what_never_stops)
{
    static uint8_t all[3 * PIXELS], few[3 * PIXELS];
    struct err e;
    OWN(moments) flat = {0}, ours = {0};
    MUST(moments_alloc(&flat, WIDTH, HEIGHT, &e) && moments_alloc(&ours, WIDTH, HEIGHT, &e));
    for (size_t p = 0; p < PIXELS; p++) {
        flat.n[p] = 24;
        ours.n[p] = 64;
        all[3 * p] = 255;
        few[3 * p + 1] = 48;
        few[3 * p + 2] = 207;
    }
    for (size_t i = 0; i < 3 * PIXELS; i++)
        flat.mean[i] = 0.5;
    for (int never = 0; never < 2; never++) {
        struct task *t = start(CHECK_RATES, 2, 1e-5);
        t->r.num_checks = 2;
        t->r.check[0].num_images = 1;
        t->r.check[0].batch = 24;
        t->r.check[0].share = (struct margin){0.01, 0.3, true};
        t->r.check[0].count = (struct margin){0.1, 0.2, true};
        t->r.check[1] = t->r.check[0];
        t->r.check[1].images[0] = 1;
        for (int i = 0; i < 2; i++) {
            snprintf(t->r.image[i].options, sizeof t->r.image[i].options, "-a 24 0.1");
            snprintf(t->h.made[i].rates, sizeof t->h.made[i].rates, "%s",
                     test_path(i == 0 ? "noisy.png" : "flat.png"));
            MUST(image_write_png(t->h.made[i].rates, WIDTH, HEIGHT, i == 0 || never ? all : few,
                                 &e));
            t->h.image[i] =
                submit_render(&(struct bug){.scale = 1, .square = 1, .noise = 0.25}, SPP);
        }
        t->a.of[0][0].as_asked = ours;
        t->a.of[0][1].as_asked = t->a.of[0][1].noise = flat;
        OWN(result) out = run_check(t);
        if (out.share != (never ? 0 : 1))
            fail_msg("%s: %g of the points: %s", never ? "never" : "stops", out.share, out.seen);
    }
}

/* 64 times the triangles, 0.1 s and 2 s to read them: logarithms of 6 and 12, or all of them for every ray. */
TEST(growth_is_that_of_samples_alone)
{
    static const struct {
        double cpu_s[4];
        struct bug bug;
        double least, most;
        const char *seen;
    } cases[] = {
        {{2.6, 2.01, 0.4, 0.105}, {.scale = 1, .square = 1, .noise = 1}, 1, 1, "times as long"},
        {{21, 2.3, 0.4, 0.105}, {.scale = 1, .square = 1, .noise = 1}, 0, 0, "times as long"},
        {{7.0, 2.0, 0.4, 0.105}, {.scale = 1, .square = 1, .noise = 1}, 0.3, 0.95, "times as long"},
        /* So fast that only noise is measured; either sign of it. */
        {{0.02, 0.03, 0.03, 0.02}, {.scale = 1, .square = 1, .noise = 1}, 1, 1, "times as long"},
        {{0.03, 0.02, 0.02, 0.03}, {.scale = 1, .square = 1, .noise = 1}, 1, 1, "times as long"},
        {{0}, {.scale = 1, .square = 1, .noise = 1}, 0, 0, "no program ran"},
        {{0.02, 0.01, 0.02, 0.01}, {.scale = 0, .square = 1, .noise = 1}, 0, 0, "differs too much"},
        {{0.02, 0.01, 0.02, 0.01},
         {.scale = 1, .white = true, .noise = 1},
         0,
         0,
         "differs too much"},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        struct task *t = start(CHECK_GROWTH, 4, 1e-5);
        t->r.check[0].log_ratio = (struct margin){2.1, 3.2, true};
        for (int k = 0; k < 4; k++) {
            t->h.image[k] = submit_render(&cases[i].bug, SPP);
            t->h.made[k].cpu_s = cases[i].cpu_s[k];
        }
        OWN(result) out = run_check(t);
        if (out.share < cases[i].least || out.share > cases[i].most || out.more > 0 ||
            strstr(out.seen, cases[i].seen) == NULL)
            fail_msg("case %zu: %g of the points: %s", i, out.share, out.seen);
    }
}

/* Files that are not images, and one whose header claims a huge size: only the header is read. */
TEST(bad_images_get_a_line)
{
    static const unsigned char bomb[] = {
        0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49,
        0x48, 0x44, 0x52, 0x00, 0x01, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00, 0x08, 0x02,
        0x00, 0x00, 0x00, 0xe3, 0xe6, 0xa7, 0xb4, 0,    0,    0,    16,   'I',  'D',
        'A',  'T',  0x78, 0x9c, 0,    0,    0,    0,    0,    0,    0,    0,    0,
        0,    0,    0,    0,    0,    0,    0,    0,    0};
    static const struct {
        const char *name;
        const void *bytes;
        size_t size;
    } files[] = {{"empty", "", 0},
                 {"text", "not an image", 13},
                 {"short", "\x89PNG", 4},
                 {"bomb", bomb, sizeof bomb},
                 {"pfm", "PF\n100000 100000\n-1.0\n", 22},
                 {"nan", "PF\n64 48\n-1.0\n", 14},
                 {"svg", "<svg></svg>", 11}};
    for (size_t i = 0; i < COUNT(files); i++) {
        const char *path = test_path(files[i].name);
        struct submitted_image s;
        struct err e = {""};
        FILE *f = fopen(path, "wb");
        assert_non_null(f);
        fwrite(files[i].bytes, 1, files[i].size, f);
        for (int k = 0; k < 3 * PIXELS && strcmp(files[i].name, "nan") == 0; k++)
            fwrite(&(float){(float)NAN}, sizeof(float), 1, f);
        fclose(f);
        assert_false(submitted_image_read(path, "cgl", WIDTH, HEIGHT, &s, &e));
        assert_true(e.msg[0] != '\0' && strchr(e.msg, '\n') == NULL);
        if (strcmp(files[i].name, "bomb") == 0)
            assert_non_null(strstr(e.msg, "65536 x 65536"));
    }
    struct submitted_image s = submit_render(&none, SPP);
    struct err e;
    submitted_image_free(&s);
    assert_false(submitted_image_read(test_path("submitted.png"), "cgl", WIDTH, WIDTH, &s, &e));
    assert_string_equal(e.msg, "the image is 64 x 48 pixels, not 64 x 64");
}

TEST_GROUP(set_up, tear_down)
