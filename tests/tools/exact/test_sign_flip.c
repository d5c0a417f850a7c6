/* tools/exact/sign_flip.c: the bound against all flips there are and against the binomial law, the scores' symmetry, the
 * level and power of the whole, by laws without a third moment and by images of few codes. */
#include "tests/support/rates.h"
#include "tests/support/simulate.h"

#include "tools/compare/region.h"
#include "tools/exact/sign_flip_score.h"
#include "tools/exact/same_program.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <gsl/gsl_cdf.h>

enum { SIDE = 32, VALUES = 3 * SIDE * SIDE };

/* P(|sum of s e| >= |sum of s|) by all 2^num flips. */
static double enumerated(const double *s, int num)
{
    double observed = 0;
    int reach = 0;
    for (int k = 0; k < num; k++)
        observed += s[k];
    for (unsigned flip = 0; flip < 1u << num; flip++) {
        double sum = 0;
        for (int k = 0; k < num; k++)
            sum += flip >> k & 1 ? -s[k] : s[k];
        reach += fabs(sum) >= fabs(observed) * (1 - 1e-12);
    }
    return reach / pow(2, num);
}

static double root_of_squares(const double *s, int num)
{
    double squares = 0;
    for (int k = 0; k < num; k++)
        squares += s[k] * s[k];
    return sqrt(squares);
}

/* 400 sums of 1 to 12 numbers: equal, geometric, one that rules, Cauchy. Negative control: the normal tail without its factor
 * is no bound. */
TEST(test_bound_of_all_flips)
{
    uint64_t seed = 4;
    int beyond = 0;
    for (int run = 0; run < 400; run++) {
        int num = 1 + run % 12;
        double s[12], sum = 0;
        for (int k = 0; k < num; k++) {
            double size[] = {1, pow(2, -k), k == 0 ? 10 : 1, tan(1.5 * uniform(&seed))};
            s[k] = uniform(&seed) < 0.25 ? -size[run / 12 % 4] : size[run / 12 % 4];
            sum += s[k];
        }
        double exact = enumerated(s, num), bound = pow(10, sign_flip_log10_p(s, (size_t)num));
        if (exact > bound * (1 + 1e-9))
            fail_msg("run %d: %d signs, P = %.9g, bound %.9g", run, num, exact, bound);
        beyond += exact > 2 * gsl_cdf_ugaussian_Q(fabs(sum) / root_of_squares(s, num));
    }
    assert_in_range(beyond, 50, 400);
}

/* n equal numbers of which k are negative: P = 2 P(Binomial(n, 1/2) <= k). The bound lies above it, but not far:
 * Chernoff's by at most a factor of sqrt(2 pi) t [BahadurRao60], and by none where all signs agree; the saddle
 * point's by less than a factor of 2 for n = 1000. */
TEST(test_bound_of_equal_numbers)
{
    static const int n[] = {20, 64, 300, 1000}, negative[] = {5, 20, 120, 450};
    for (size_t i = 0; i < COUNT(n); i++)
        for (int k = 0; k <= negative[i]; k++) {
            double s[1000], t = (n[i] - 2 * k) / sqrt(n[i]);
            for (int j = 0; j < n[i]; j++)
                s[j] = j < k ? -0.3 : 0.3;
            double exact = log10(2 * gsl_cdf_binomial_P((unsigned)k, 0.5, (unsigned)n[i]));
            double bound = sign_flip_log10_p(s, (size_t)n[i]);
            assert_true(bound >= exact - 1e-9);
            assert_true(bound <= exact + log10(1 + 2.6 * t));
            if (n[i] == 1000 && t > 4 && t < 9)
                assert_true(bound <= exact + log10(2));
            if (k == 0)
                assert_near(bound, exact, 1e-6);
        }
}

struct pair {
    float a[VALUES], b[VALUES];
    float *rows[2];
};

/* Pixels are means of n_a or n_b draws, equal in all channels; inside `where` A is multiplied by 1 + more. */
static void draw_pair(struct pair *p, enum law law, int n_a, int n_b, double more,
                      struct rect where, uint64_t *seed)
{
    for (int i = 0; i < VALUES; i += 3) {
        double a = 0, b = 0;
        for (int k = 0; k < n_a; k++)
            a += draw(law, seed) / n_a;
        for (int k = 0; k < n_b; k++)
            b += draw(law, seed) / n_b;
        int x = i / 3 % SIDE, y = i / 3 / SIDE;
        if (x >= where.x && x < where.x + where.width && y >= where.y && y < where.y + where.height)
            a *= 1 + more;
        for (int c = 0; c < 3; c++) {
            p->a[i + c] = (float)a;
            p->b[i + c] = (float)b;
        }
    }
    p->rows[0] = p->a;
    p->rows[1] = p->b;
}

static struct sign_flip flip_pair(struct pair *p, double alpha, int filter_width)
{
    struct sign_flip_images in = {1, SIDE, SIDE, &p->rows[0], &p->rows[1], NULL};
    struct sign_flip_options opt = {alpha, filter_width, 16};
    struct sign_flip out;
    struct err e;
    MUST(sign_flip_test(&in, &opt, &out, &e));
    return out;
}

static const struct rect everywhere = {0, 0, SIDE, SIDE};

/* The premise of the proof: exchanging A and B in some pixels flips the signs of their scores and changes nothing
 * else. */
TEST(test_scores_are_odd)
{
    struct pair p, q;
    uint64_t seed = 11;
    float error[VALUES];
    draw_pair(&p, LAW_PARETO, 4, 4, 0, everywhere, &seed);
    for (int i = 0; i < VALUES; i++) {
        p.a[i] *= 1 + (float)(i % 3);
        error[i] = (float)uniform(&seed);
    }
    q = p;
    bool swapped[SIDE * SIDE];
    for (int i = 0; i < SIDE * SIDE; i++) {
        swapped[i] = uniform(&seed) < 0.5;
        for (int c = 0; swapped[i] && c < 3; c++) {
            q.a[3 * i + c] = p.b[3 * i + c];
            q.b[3 * i + c] = p.a[3 * i + c];
        }
    }
    OWN(sheet) s = {.width = SIDE, .height = SIDE, .num = 1}, t = s;
    struct err e;
    MUST(sheet_alloc(&s, &e) && sheet_alloc(&t, &e));
    for (int with_error = 0; with_error < 2; with_error++)
        for (int score = 0; score < NUM_SIGN_FLIP_SCORES; score++)
            for (int channel = 0; channel < NUM_CHANNELS; channel++) {
                float *rows[] = {p.a, p.b, q.a, q.b};
                const float *stated = with_error ? error : NULL;
                struct sign_flip_images one = {1, SIDE, SIDE, &rows[0], &rows[1], stated},
                                        two = {1, SIDE, SIDE, &rows[2], &rows[3], stated};
                sheet_load(&s, &one, 1, channel);
                sheet_load(&t, &two, 1, channel);
                sheet_score(&s, score);
                sheet_score(&t, score);
                for (int i = 0; i < SIDE * SIDE; i++)
                    assert_true(t.score[i] == (swapped[i] ? -1 : 1) * s.score[i]);
            }
}

/* H0 holds: 200 pairs of each law, of 1 and of 4 draws, at 5 %, against the one-sided bound at 99.9 %. At 1 draw most of the black
 * pixels tie. */
TEST(test_level)
{
    static const enum law laws[] = {LAW_EXPONENTIAL, LAW_BLACK, LAW_RARE, LAW_PARETO};
    uint64_t seed = 21;
    for (size_t l = 0; l < COUNT(laws); l++)
        for (int n = 1; n <= 4; n += 3) {
            int rejected = 0;
            for (int i = 0; i < 200; i++) {
                struct pair p;
                draw_pair(&p, laws[l], n, n, 0, everywhere, &seed);
                rejected += flip_pair(&p, 0.05, 1).log10_p <= log10(0.05);
            }
            assert_true(lower_bound(rejected, 200) <= 0.05);
        }
}

/* Each pixel the mean of 3 x 3, as by a box filter of 3 pixels. */
static void smooth(float *pixel)
{
    float out[VALUES];
    for (int i = 0; i < VALUES; i++) {
        float sum = 0;
        for (int j = 0; j < 9; j++) {
            int x = i / 3 % SIDE + j % 3 - 1, y = i / 3 / SIDE + j / 3 - 1;
            sum += pixel[3 * ((y + SIDE) % SIDE * SIDE + (x + SIDE) % SIDE) + i % 3];
        }
        out[i] = sum / 9;
    }
    memcpy(pixel, out, sizeof out);
}

/* Adds to each row a normal number of standard deviation `sd`. */
static void shake_rows(float *pixel, double sd, uint64_t *seed)
{
    double shift = 0;
    for (int i = 0; i < VALUES; i++) {
        if (i % (3 * SIDE) == 0)
            shift = sd * draw_normal(uniform(seed), seed);
        pixel[i] += (float)shift;
    }
}

/* Adds to every row the same normal numbers, of standard deviation `sd` where rows begin and less further on: one stream of
 * random numbers, begun anew in each row. */
static void begin_rows(float *pixel, double sd, uint64_t *seed)
{
    double shift[SIDE];
    for (int x = 0; x < SIDE; x++)
        shift[x] = sd * exp(-x / 16.0) * draw_normal(uniform(seed), seed);
    for (int i = 0; i < VALUES; i++)
        pixel[i] += (float)shift[i / 3 % SIDE];
}

/* Filtered pixels share noise. Judged as independent, equal laws are DIFFERENT in most pairs (the control); with one
 * pixel of each 3 x 3 the level holds. The shared noise is detected where no filter was declared, as is that of rows with
 * the standard deviation of a pixel's own, and, in most of 100 pairs of so few pixels, of rows that begin alike; it is not
 * detected in unfiltered images, with or without a difference, of all pixels or of the left ones. */
TEST(test_filtered_pixels)
{
    uint64_t seed = 31;
    int wrong = 0, rejected = 0, seen = 0, rows = 0, begun = 0;
    const struct rect left = {0, 0, SIDE / 4, SIDE};
    for (int i = 0; i < 100; i++) {
        struct pair p;
        draw_pair(&p, LAW_EXPONENTIAL, 4, 4, 0.2, left, &seed);
        assert_false(flip_pair(&p, 0.05, 0).shares_noise);
        begin_rows(p.a, 0.5, &seed);
        begin_rows(p.b, 0.5, &seed);
        begun += flip_pair(&p, 0.05, 0).shares_noise;
        draw_pair(&p, LAW_EXPONENTIAL, 4, 4, i % 4 * 0.1, everywhere, &seed);
        assert_false(flip_pair(&p, 0.05, 0).shares_noise);
        shake_rows(p.a, 0.5, &seed);
        shake_rows(p.b, 0.5, &seed);
        rows += flip_pair(&p, 0.05, 0).shares_noise;
        draw_pair(&p, LAW_EXPONENTIAL, 4, 4, 0, everywhere, &seed);
        smooth(p.a);
        smooth(p.b);
        wrong += flip_pair(&p, 0.05, 1).log10_p <= log10(0.05);
        seen += flip_pair(&p, 0.05, 0).shares_noise;
        rejected += flip_pair(&p, 0.05, 3).log10_p <= log10(0.05);
    }
    assert_true(lower_bound(wrong, 100) > 0.3);
    assert_int_equal(seen, 100);
    assert_true(rows >= 95);
    assert_true(lower_bound(begun, 100) > 0.5);
    assert_true(lower_bound(rejected, 100) <= 0.05);
}

TEST(test_decision)
{
    struct comparison r = {0};
    struct sign_flip f = {.log10_p = -9,
                          .mdb_global = 0.01,
                          .mdb_tile = 0.1,
                          .t = -7,
                          .larger = 0.4,
                          .width = 8,
                          .height = 8,
                          .rect = {0, 0, 4, 4}};
    same_program_decide(&f, 1e-6, &r);
    assert_int_equal(r.verdict, VERDICT_DIFFERENT);
    assert_non_null(strstr(r.reason, "4 x 4 pixels at 0,0 (red): A is darker in 60 %"));
    same_program_decide(&f, 1e-10, &r);
    assert_int_equal(r.verdict, VERDICT_NOTHING_FOUND);
    f.shares_noise = true;
    same_program_decide(&f, 1e-6, &r);
    assert_int_equal(r.verdict, VERDICT_INCONCLUSIVE);
    f = (struct sign_flip){.mdb_global = region_mdb_none, .num_pixels = 16};
    same_program_decide(&f, 1e-6, &r);
    assert_int_equal(r.verdict, VERDICT_INCONCLUSIVE);
    assert_non_null(strstr(r.reason, "16 pixels"));
}

/* 20 pairs with A brighter by 40 % in 16 x 16 pixels at 5,9, on no grid, 16 draws of an exponential law. There a
 * pixel's difference has mean 0.4, sd sqrt((1.4^2 + 1)/16) = 0.43 and root mean square 0.59, so T (of the difference
 * itself) is about 0.4 sqrt(256)/0.59 = 11, where 7 is needed at 1e-6. */
TEST(test_region)
{
    uint64_t seed = 41;
    for (int i = 0; i < 20; i++) {
        struct pair p;
        draw_pair(&p, LAW_EXPONENTIAL, 16, 16, 0.4, (struct rect){5, 9, 16, 16}, &seed);
        struct sign_flip f = flip_pair(&p, 1e-6, 1);
        assert_true(f.log10_p <= -6);
        assert_true(f.t > 0 && f.larger > 0.5 && f.difference > 0.2);
        assert_in_range(f.rect.x + f.rect.width / 2, 10, 16);
        assert_in_range(f.rect.y + f.rect.height / 2, 14, 20);
    }
}

/* Fireflies: 0.5, and 500 more in 0.1 % of the draws, 4 draws a pixel: the mean of all 1024 differences has a
 * standard error of 35 %. The level scores still find 10 % at 1e-6, in 8-bit codes too. */
TEST(test_fireflies)
{
    uint64_t seed = 51;
    for (int i = 0; i < 40; i++) {
        struct pair p;
        draw_pair(&p, LAW_FIREFLY, 4, 4, 0.1, everywhere, &seed);
        for (int k = 0; i % 2 && k < VALUES; k++) {
            p.a[k] = fminf(255, roundf(255 * p.a[k])) / 255;
            p.b[k] = fminf(255, roundf(255 * p.b[k])) / 255;
        }
        assert_true(flip_pair(&p, 1e-6, 1).log10_p <= -6);
    }
}

/* Four times the samples with the same mean is another law, and is found; with the sides exchanged too. */
TEST(test_spread)
{
    uint64_t seed = 61;
    for (int i = 0; i < 20; i++) {
        struct pair p;
        bool first = i % 2;
        draw_pair(&p, LAW_NORMAL, first ? 4 : 16, first ? 16 : 4, 0, everywhere, &seed);
        struct sign_flip f = flip_pair(&p, 1e-6, 1);
        assert_true(f.log10_p <= -6);
        assert_int_equal(f.score, SIGN_FLIP_SPREAD);
        assert_true((f.t > 0) == first);
    }
}

/* A change of the printed MDB is found with 95 %: 100 pairs, of which fewer than 87 have a probability of 5e-4. A
 * third of it is hardly ever found: T has a mean of (5.4 + 1.6)/3 = 2.3 where 5.4 is needed. */
TEST(test_smallest_detectable)
{
    uint64_t seed = 71;
    struct pair p;
    draw_pair(&p, LAW_EXPONENTIAL, 16, 16, 0, everywhere, &seed);
    double mdb = flip_pair(&p, 1e-3, 1).mdb_global;
    int found = 0, of_a_third = 0;
    for (int i = 0; i < 100; i++) {
        draw_pair(&p, LAW_EXPONENTIAL, 16, 16, mdb, everywhere, &seed);
        found += flip_pair(&p, 1e-3, 1).log10_p <= -3;
        draw_pair(&p, LAW_EXPONENTIAL, 16, 16, mdb / 3, everywhere, &seed);
        of_a_third += flip_pair(&p, 1e-3, 1).log10_p <= -3;
    }
    assert_true(upper_bound(found, 100) >= 0.95);
    assert_true(of_a_third < 20);
}

TEST(test_refuses)
{
    static float grey[3 * 4 * 4], other[3 * 4 * 4];
    float *rows[] = {grey, other};
    struct sign_flip_images in = {1, 4, 4, &rows[0], &rows[1], NULL};
    struct sign_flip out;
    struct err e;
    REFUSES(sign_flip_test(&in, &(struct sign_flip_options){1e-3, 1, 16}, &out, &e), "one seed");
    REFUSES(sign_flip_test(&in, &(struct sign_flip_options){1e-3, 9, 16}, &out, &e), "filter");
    other[5] = 1;
    MUST(sign_flip_test(&in, &(struct sign_flip_options){1e-3, 1, 16}, &out, &e));
    assert_near(out.log10_p, 0, 0);
    assert_true(out.mdb_tile >= 1e6); /* 2^-15 is the least of 16 coins */
}
