/* Variances of image regions with their intervals: against brute force; error rates on noise whose law is known;
 * negative controls that must be found. Seeds and counts were fixed beforehand; nothing is retried. */
#include "stats_own.h"
#include "tools/stats/variance_ladder.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <gsl/gsl_cdf.h>
#include <gsl/gsl_randist.h>

/* 3 x 2 tiles of 8: the remainder of 5 columns is a tile of its own, that of 3 rows joins the tile above. */
enum { WIDTH = 21, HEIGHT = 19, TILE = 8, SIZE = 3 * WIDTH * HEIGHT, K = 8, SPP = 16 };

enum law { EXPONENTIAL, BLACK /* 90 % are 0, the rest exponential of mean 10 */ };

/* Of mean 1. Variances: 1, and 0.1 * 2 * 100 - 1 = 19. */
static double draw(gsl_rng *rng, enum law law)
{
    if (law == EXPONENTIAL)
        return gsl_ran_exponential(rng, 1);
    return gsl_ran_bernoulli(rng, 0.1) ? gsl_ran_exponential(rng, 10) : 0;
}

static const double variance_of[] = {1, 19};

static double truth(size_t i)
{
    return 0.5 + (double)(i / 3) / (SIZE / 3);
}

static struct converge_reference make_unit(void)
{
    OWN(moments) m;
    struct converge_reference r;
    struct err e;
    MUST(moments_alloc(&m, WIDTH, HEIGHT, &e));
    strcpy(m.unit, "exact");
    for (size_t i = 0; i < SIZE; i++) {
        m.mean[i] = truth(i);
        m.n[i / 3] = 1;
    }
    MUST(convergence_rate_reference_init(&r, &m, 1, &e));
    return r;
}

/* One render of SPP samples, each multiplied by scale. All channels are equal, the worst case for the interval. */
static void render(gsl_rng *rng, enum law law, double scale, struct moments *m)
{
    struct err e;
    MUST(moments_alloc(m, WIDTH, HEIGHT, &e));
    for (size_t p = 0; p < SIZE / 3; p++)
        for (int s = 0; s < SPP; s++) {
            double x = truth(3 * p) * scale * draw(rng, law);
            moments_add(m, p, (double[]){x, x, x});
        }
}

/* K renders, their moments and their means. */
struct renders {
    struct moments m[K];
    float images[K * SIZE];
};

static void render_all(gsl_rng *rng, enum law law, double scale, struct renders *r)
{
    for (int k = 0; k < K; k++) {
        render(rng, law, scale, &r->m[k]);
        for (size_t i = 0; i < SIZE; i++)
            r->images[(size_t)k * SIZE + i] = (float)r->m[k].mean[i];
    }
}

static void renders_free(struct renders *r)
{
    for (int k = 0; k < K; k++)
        moments_free(&r->m[k]);
}

/* The header's definitions, with the jackknife computed by really leaving out each replicate. */
TEST(estimates_are_their_definitions)
{
    RNG *rng = new_rng(1);
    REFERENCE unit = make_unit();
    static struct renders r;
    OWN(variance_map) between, within;
    struct err e;
    render_all(rng, EXPONENTIAL, 1, &r);
    MUST(variance_ladder_between(r.images, K, &unit, WIDTH, TILE, &between, &e));
    MUST(variance_ladder_within(r.m, K, &unit, TILE, &within, &e));
    assert_int_equal(between.tiles_x, 3);
    assert_int_equal(between.tiles_y, 2);
    double v = 0, w = 0, inside = 0;
    int pixels = 0;
    for (size_t p = 0; p < SIZE / 3; p++) {
        size_t x = p % WIDTH, y = p / WIDTH;
        if (x < 16 || y < 8)
            continue; /* the tile at 16,8 */
        double without[K] = {0}, mean = 0, squares = 0, all = 0;
        for (int out = 0; out <= K; out++) {
            double sum = 0, m = 0;
            int kept = out < K ? K - 1 : K;
            for (int k = 0; k < K; k++)
                m += k == out ? 0 : (double)r.images[(size_t)k * SIZE + 3 * p] / kept;
            for (int k = 0; k < K; k++)
                sum +=
                    k == out
                        ? 0
                        : pow(((double)r.images[(size_t)k * SIZE + 3 * p] - m) / truth(3 * p), 2);
            sum /= kept - 1;
            if (out == K) {
                all = sum;
            } else {
                without[out] = sum;
                mean += sum / K;
            }
        }
        for (int k = 0; k < K; k++)
            squares += pow(without[k] - mean, 2);
        v += all;
        w += squares * (K - 1) / K;
        for (int k = 0; k < K; k++)
            inside += r.m[k].m2[3 * p] / (SPP - 1) / pow(truth(3 * p), 2) / K;
        pixels++;
    }
    assert_int_equal(pixels, 5 * 11);
    assert_near(between.tile[5].value, v / pixels, 1e-6);
    assert_near(between.tile[5].se, sqrt(w) / pixels, 1e-6);
    assert_near(within.tile[5].value, inside / pixels, 1e-6);
    renders_free(&r);
}

/* H0: of claims whose variance lies exactly at the margin at most alpha come out DIFFERENT, and at most alpha
 * EQUIVALENT. 600 runs against 600 records at alpha 5 %; rejected where a count of this size or more has a
 * probability below 1e-4, from 53 on. Power: a rate of 11 % is rejected with 96 %. The hard case is 90 % black: few
 * samples in each interval are lit. */
static void check_rates(enum law law, unsigned long seed)
{
    enum { RUNS = 600 };
    const double alpha = 0.05, margin = 0.1;
    RNG *rng = new_rng(seed);
    REFERENCE unit = make_unit();
    static struct renders r, s;
    struct err e;
    int different = 0, equivalent = 0, missed[2] = {0, 0};
    for (int i = 0; i < RUNS; i++) {
        OWN(variance_map) run, record, between;
        render_all(rng, law, sqrt(1 + margin), &r);
        render_all(rng, law, 1, &s);
        MUST(variance_ladder_within(r.m, K, &unit, TILE, &run, &e));
        MUST(variance_ladder_within(s.m, K, &unit, TILE, &record, &e));
        MUST(variance_ladder_between(s.images, K, &unit, WIDTH, TILE, &between, &e));
        enum verdict v = variance_ladder_judge(variance_ladder_expect(run.image, record.image, 1),
                                               record.image, margin, false, alpha)
                             .verdict;
        different += v == VERDICT_DIFFERENT;
        equivalent += v == VERDICT_EQUIVALENT;
        struct interval one = estimate_interval(variance_ladder_log(record.image), alpha),
                        two = estimate_interval(variance_ladder_log(between.image), alpha);
        double is = log(variance_of[law]);
        missed[0] += one.lo > is || one.hi < is;
        missed[1] += two.lo > is - log(SPP) || two.hi < is - log(SPP);
        renders_free(&r);
        renders_free(&s);
    }
    const struct {
        const char *what;
        int wrong;
    } all[] = {{"DIFFERENT", different},
               {"EQUIVALENT", equivalent},
               {"interval within", missed[0]},
               {"interval between", missed[1]}};
    for (size_t i = 0; i < COUNT(all); i++) {
        printf("%s: %d of %d wrong at 5 %%\n", all[i].what, all[i].wrong, RUNS);
        if (all[i].wrong > 0)
            assert_true(gsl_cdf_binomial_Q((unsigned)all[i].wrong - 1, alpha, RUNS) >= 1e-4);
    }
}

TEST(rates_of_exponential_noise)
{
    check_rates(EXPONENTIAL, 2);
}
TEST(rates_of_mostly_black_noise)
{
    check_rates(BLACK, 3);
}

/* H0: with independent samples the interval of the slope misses -1/2 in at most alpha of 600 ladders; degrees of
 * freedom as in validate. Control: where noise falls with slope -0.45 the interval excludes -1/2 in more than half
 * of them. */
TEST(slopes_of_mostly_black_noise)
{
    enum { RUNS = 600, RUNGS = 4 };
    const double alpha = 0.05;
    static const int spp[RUNGS] = {1, 4, 16, 64};
    static float images[K * SIZE];
    RNG *rng = new_rng(6);
    REFERENCE unit = make_unit();
    struct err e;
    int wrong[2] = {0, 0};
    for (int run = 0; run < 2 * RUNS; run++) {
        bool control = run >= RUNS;
        struct rung rung[RUNGS];
        for (int i = 0; i < RUNGS; i++) {
            double scale = control ? pow(spp[i], 0.05) : 1;
            for (size_t k = 0; k < K; k++)
                for (size_t p = 0; p < SIZE / 3; p++) {
                    unsigned lit = gsl_ran_binomial(rng, 0.1, (unsigned)spp[i]);
                    double x = lit > 0 ? 10 * gsl_ran_gamma(rng, lit, 1) / spp[i] : 0;
                    for (size_t c = 3 * p; c < 3 * p + 3; c++)
                        images[k * SIZE + c] = (float)(truth(c) * (1 + scale * (x - 1)));
                }
            OWN(variance_map) map;
            MUST(variance_ladder_between(images, K, &unit, WIDTH, TILE, &map, &e));
            rung[i] = (struct rung){.spp = spp[i], .log_mse = variance_ladder_log(map.image)};
        }
        struct estimate slope = convergence_rate_slope(rung, RUNGS);
        slope.dof = convergence_rate_slope_dof(rung, RUNGS);
        struct interval i = estimate_interval(slope, alpha);
        wrong[control] += i.lo > -0.5 || i.hi < -0.5;
    }
    printf("slope: %d of %d wrong at 5 %%, control %d\n", wrong[0], RUNS, wrong[1]);
    assert_true(gsl_cdf_binomial_Q((unsigned)wrong[0], alpha, RUNS) >= 1e-4);
    assert_true(wrong[1] > RUNS / 2);
}

/* 3.1 times the variance is DIFFERENT at alpha 1e-6; 1/3.1 of it is EQUIVALENT, unless the claim is two-sided. */
TEST(more_noise_is_found_and_less_is_not_an_error)
{
    RNG *rng = new_rng(4);
    REFERENCE unit = make_unit();
    static struct renders r;
    struct variance_map map[3];
    struct err e;
    const double scale[3] = {1, 3.1, 1 / 3.1};
    for (int i = 0; i < 3; i++) {
        render_all(rng, EXPONENTIAL, sqrt(scale[i]), &r);
        MUST(variance_ladder_within(r.m, K, &unit, TILE, &map[i], &e));
        renders_free(&r);
    }
    double margin = variance_ladder_margin(map[0].image, 1, 0.1);
    assert_in_range(1000 * margin, 100, 1000);
    assert_int_equal(variance_ladder_judge(map[1].image, map[0].image, margin, false, 1e-6).verdict,
                     VERDICT_DIFFERENT);
    assert_int_equal(variance_ladder_judge(map[2].image, map[0].image, margin, false, 1e-6).verdict,
                     VERDICT_EQUIVALENT);
    assert_int_equal(variance_ladder_judge(map[2].image, map[0].image, margin, true, 1e-6).verdict,
                     VERDICT_DIFFERENT);
    for (int i = 0; i < 3; i++)
        variance_map_free(&map[i]);
}

/* What was free of noise must stay so; noise that has gone is no increase, so DIFFERENT only if two-sided. */
TEST(no_noise_is_asserted)
{
    const struct estimate none = {0, 0, 1}, rounding = {1e-12, 1e-13, 10}, some = {1e-2, 1e-4, 100};
    assert_int_equal(variance_ladder_judge(none, none, 0, false, 1e-6).verdict, VERDICT_EQUIVALENT);
    assert_int_equal(variance_ladder_judge(rounding, none, 0, false, 1e-6).verdict,
                     VERDICT_EQUIVALENT);
    assert_int_equal(variance_ladder_judge(some, none, 0, false, 1e-6).verdict, VERDICT_DIFFERENT);
    assert_int_equal(variance_ladder_judge(none, some, 0.1, false, 1e-6).verdict,
                     VERDICT_EQUIVALENT);
    assert_int_equal(variance_ladder_judge(none, some, 0.1, true, 1e-6).verdict, VERDICT_DIFFERENT);
}

/* Mostly black noise, skewness 6.5, with the sign of M3 flipped, and with M3 halved. */
TEST(third_moments_that_cannot_be_are_an_error)
{
    RNG *rng = new_rng(7);
    REFERENCE unit = make_unit();
    static struct renders r;
    OWN(variance_map) map;
    struct err e;
    render_all(rng, BLACK, 1, &r);
    for (size_t i = 0; i < SIZE; i++)
        r.m[3].m3[i] *= -1;
    REFUSES(variance_ladder_within(r.m, K, &unit, TILE, &map, &e), "no samples of radiance have");
    for (size_t i = 0; i < SIZE; i++)
        r.m[3].m3[i] *= -0.5;
    REFUSES(variance_ladder_within(r.m, K, &unit, TILE, &map, &e), "no samples of radiance have");
    renders_free(&r);
    /* One sample of 1e-21, the rest 0: its cube underflows to 0 in a file's 32-bit floats, its square does not. */
    render_all(rng, BLACK, 1, &r);
    for (int k = 0; k < K; k++) {
        double n = r.m[k].n[0], x = 1e-21;
        r.m[k].mean[0] = x / n;
        r.m[k].m2[0] = x * x * (1 - 1 / n);
        r.m[k].m3[0] = 0;
    }
    MUST(variance_ladder_within(r.m, K, &unit, TILE, &map, &e));
    renders_free(&r);
}

/* Two of the replicates are the same image, the others are not. */
TEST(a_seed_without_effect_is_an_error)
{
    RNG *rng = new_rng(5);
    REFERENCE unit = make_unit();
    static struct renders r;
    struct variance_map map;
    struct err e;
    render_all(rng, EXPONENTIAL, 1, &r);
    for (size_t i = 0; i < SIZE; i++)
        r.images[SIZE + i] = r.images[i];
    assert_false(variance_ladder_between(r.images, K, &unit, WIDTH, TILE, &map, &e));
    assert_string_equal(e.msg, "replicates with seeds of their own are the same image");
    renders_free(&r);
}
