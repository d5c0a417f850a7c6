/* The test of replicates' independence: its false alarm rate, and that dependent replicates are found. The
 * replicates are drawn here, from the distributions of simulate.h. */
#include "reference/replicates/independence.h"
#include "reference/replicates/shared_noise.h"
#include "tests/support/simulate.h"
#include "tests/support/test.h"

#include <gsl/gsl_cdf.h>

enum { SIDE = 32, PIXELS = SIDE * SIDE };

/* `count` images of one distribution; with `blur` each pixel is the mean of its own draw and its left
 * neighbour's, which correlates pixels but not replicates. */
static struct replicates draw_all(enum law law, int count, bool blur, uint64_t *state)
{
    struct replicates r;
    struct err e;
    assert_true(replicates_alloc(&r, SIDE, SIDE, count, &e));
    float x[3 * PIXELS];
    for (int k = 0; k < count; k++) {
        double left = 0;
        for (int p = 0; p < PIXELS; p++) {
            double own = draw(law, state), v = blur ? (own + left) / 2 : own;
            left = own;
            /* Brightness and noise differ between pixels. */
            for (int c = 0; c < 3; c++)
                x[3 * p + c] = (float)(v * (1 + p % 7));
        }
        replicates_add(&r, x);
    }
    return r;
}

static struct independence test(const struct replicates *r, double alpha)
{
    struct independence out;
    struct shared_noise shared = {0};
    struct err e;
    assert_true(r->num < SHARED_NOISE_FEWEST || shared_noise_measure(r, &shared, &e));
    assert_true(independence_test(r, &shared, alpha, &out, &e));
    return out;
}

/* H0 true, alpha = 1 %; each row is n = 1000 sets of 8 or 32 replicates of 1024 pixels. Its number of failures
 * is stochastically at most Binomial(1000, 1 %): more than 29 have probability 2.1e-7. Under H0 each z of
 * neighbours and batches is standard normal: |z| > 1.96 in 5 %, so in 15 to 96 of 1000, except with
 * probability 1e-9 on each side. The lower bound and the next tests show that the test is not just silent. */
TEST(independent_replicates_pass)
{
    static const struct {
        enum law law;
        int count;
        bool blur;
    } rows[] = {{LAW_NORMAL, 8, false},
                {LAW_EXPONENTIAL, 8, false},
                {LAW_BLACK, 8, false},
                {LAW_NORMAL, 8, true},
                {LAW_EXPONENTIAL, 32, false}};
    uint64_t seed = 20261121;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        int failed = 0, neighbours = 0, batches = 0;
        for (int n = 0; n < 1000; n++) {
            struct replicates r = draw_all(rows[i].law, rows[i].count, rows[i].blur, &seed);
            struct independence t = test(&r, 0.01);
            assert_true(t.tested);
            /* Blurred pixels are correlated, so the test of pixels refuses them, as it should. Here
             * only the other three tests are counted. */
            failed += rows[i].blur
                          ? fabs(t.pair_z) > t.pair_limit || fabs(t.neighbours_z) > t.limit ||
                                fabs(t.batches_z) > t.limit
                          : !t.passed;
            neighbours += fabs(t.neighbours_z) > 1.959964;
            batches += fabs(t.batches_z) > 1.959964;
            replicates_free(&r);
        }
        printf(
            "law %d, %d replicates%s: %.1f %% fail at alpha 1 %%; beyond 1.96: %.1f %%, %.1f %%\n",
            rows[i].law, rows[i].count, rows[i].blur ? ", blurred" : "", failed / 10.0,
            neighbours / 10.0, batches / 10.0);
        assert_in_range(failed, 0, 29);
        assert_in_range(neighbours, 15, 96);
        assert_in_range(batches, 15, 96);
    }
}

TEST(fewer_than_it_takes_is_said)
{
    uint64_t seed = 5;
    struct replicates r = draw_all(LAW_NORMAL, 3, false, &seed);
    struct independence t = test(&r, 1e-6);
    assert_false(t.tested);
    replicates_free(&r);
    /* Of 1024 pixels the last 63 have noise. */
    r = draw_all(LAW_NORMAL, 8, false, &seed);
    for (int k = 1; k < 8; k++)
        memcpy(r.luminance + k * PIXELS, r.luminance, (PIXELS - 63) * sizeof(float));
    t = test(&r, 1e-6);
    assert_int_equal(t.pixels, 63);
    assert_false(t.tested);
    replicates_free(&r);
}

/* A scene with a black corner has 63 noisy blocks of 4 x 4, which are too few; of 2 x 2 it has 252. */
TEST(what_is_black_does_not_keep_the_rest_from_being_tested)
{
    uint64_t seed = 6;
    struct replicates r = draw_all(LAW_NORMAL, 8, false, &seed);
    for (int k = 1; k < 8; k++)
        for (int y = 0; y < 4; y++)
            memcpy(r.luminance + k * PIXELS + y * SIDE, r.luminance + y * SIDE, 4 * sizeof(float));
    struct independence t = test(&r, 1e-6);
    assert_int_equal(t.pixels, PIXELS - 16);
    assert_true(t.tested && t.passed);
    assert_int_equal(t.block, 2);
    memcpy(r.luminance + 7 * PIXELS, r.luminance + 1 * PIXELS, PIXELS * sizeof *r.luminance);
    t = test(&r, 1e-6);
    assert_false(t.passed);
    replicates_free(&r);
}

static void assert_refused(const struct replicates *r, const char *why)
{
    struct err e = {""};
    json_t *manifest = json_object();
    REFUSES(independence_check(r, manifest, &e), why);
    assert_true(
        json_is_false(json_object_get(json_object_get(manifest, "independence"), "passed")));
    json_decref(manifest);
}

TEST(a_copy_is_found)
{
    uint64_t seed = 1;
    struct replicates r = draw_all(LAW_EXPONENTIAL, 16, false, &seed);
    memcpy(r.luminance + 11 * PIXELS, r.luminance + 4 * PIXELS, PIXELS * sizeof *r.luminance);
    assert_refused(&r, "replicates 4 and 11 are not independent");
    replicates_free(&r);
}

/* The noise of replicate j becomes weight x noise of i + sqrt(1 - weight^2) x its own: the variance stays and the
 * correlation of j and i is `weight`. */
static void mix(struct replicates *r, int j, int i, double weight)
{
    float *to = r->luminance + j * PIXELS;
    const float *from = r->luminance + i * PIXELS;
    for (int p = 0; p < PIXELS; p++) {
        double m = 1 + p % 7;
        to[p] = (float)(m + weight * (from[p] - m) + sqrt(1 - weight * weight) * (to[p] - m));
    }
}

/* The standard deviation of a pair's correlation is 1/32 here and the limit 5.9 of them, 0.18, at alpha = 1e-6: a
 * pair of correlation 0.4 (z = 12) is found in 50 of 50 sets; each is missed with probability below 1e-9.
 * Likewise neighbours of correlation 0.1 (15 pairs: standard deviation 0.008, z = 12). */
TEST(correlated_replicates_are_found)
{
    uint64_t seed = 77;
    for (int n = 0; n < 50; n++) {
        struct replicates r = draw_all(LAW_NORMAL, 16, false, &seed);
        mix(&r, 9, 2, 0.4);
        assert_refused(&r, "replicates 2 and 9 are not independent");
        replicates_free(&r);
        r = draw_all(LAW_NORMAL, 16, false, &seed);
        for (int k = 1; k < 16; k++)
            mix(&r, k, k - 1, 0.1);
        assert_refused(&r, "successive replicates are not independent");
        replicates_free(&r);
    }
}

/* Four groups of four that share 8 % of their variance, as replicates of one machine might: no pair
 * (correlation 0.08, z = 2.6) is conspicuous; the means of groups vary 1 + 3 x 0.08 times too much. */
TEST(groups_are_found)
{
    uint64_t seed = 99;
    for (int n = 0; n < 50; n++) {
        struct replicates r = draw_all(LAW_NORMAL, 20, false, &seed);
        for (int k = 0; k < 16; k++)
            mix(&r, k, 16 + k / 4, sqrt(0.08));
        r.num = 16;
        struct independence t = test(&r, 1e-6);
        assert_true(fabs(t.pair_z) < t.pair_limit);
        assert_true(t.batches_z > t.limit);
        assert_false(t.passed);
        replicates_free(&r);
    }
}

/* The reported correlation of pixels, as it was built: neighbours in a row 1/2, so of the 6 pairs in a square of 2
 * two are correlated: 1/6 on average. One standard error at 32 replicates: 1/sqrt(1536 x 31) = 0.005. A row of n has
 * the variance 2n - 1 of n: in a square of 4, 7/4 = 1.75 times too much, refused (one standard error of that
 * is 15/sqrt(64 x 120 x 31) = 0.03, the limit 5 of them above 1.5). */
TEST(correlated_pixels_are_measured)
{
    uint64_t seed = 3;
    struct replicates r = draw_all(LAW_NORMAL, 32, true, &seed);
    struct independence t = test(&r, 1e-6);
    assert_false(t.passed);
    assert_true(t.square_failed >= 4);
    assert_float_equal(t.square_se[0], 1 / sqrt(1536 * 31.0), 1e-9);
    assert_float_equal(t.square_r[0], 1 / 6.0, 0.03);
    replicates_free(&r);
    r = draw_all(LAW_NORMAL, 32, false, &seed);
    t = test(&r, 1e-6);
    assert_true(t.passed);
    assert_float_equal(t.square_r[0], 0, 0.025);
    replicates_free(&r);
}

/* Adds one normal number per replicate to all of its pixels, scaled to `variance` times each pixel's
 * own variance. */
static void share(struct replicates *r, double variance, uint64_t *state)
{
    for (int k = 0; k < r->num; k++) {
        double g = sqrt(variance) * (draw(LAW_NORMAL, state) - 1);
        for (int p = 0; p < PIXELS; p++)
            r->luminance[k * PIXELS + p] += (float)(g * (1 + p % 7));
    }
}

/* One number added to all pixels of a replicate, with 2 % of the variance of each: no pair of
 * pixels is conspicuous, but sums over 16 x 16 vary 1 + 255 x 0.02 = 6 times too much (48
 * replicates, 4 squares of 256 pixels: one standard error of r is 1/sqrt(4 x 32640 x 47) = 0.0004).
 * Control: with 0.05 % the ratio is 1.13, allowed. */
TEST(pixels_that_share_noise_are_refused)
{
    uint64_t seed = 11;
    for (int n = 0; n < 20; n++) {
        struct replicates r = draw_all(LAW_NORMAL, 48, false, &seed);
        struct independence before = test(&r, 1e-6);
        assert_true(before.passed);
        share(&r, 0.0005, &seed);
        assert_true(test(&r, 1e-6).square_failed == 0);
        share(&r, 0.02, &seed);
        assert_true(test(&r, 1e-6).square_failed == 16);
        assert_refused(&r, "pixels share their noise: sums over 16 x 16 pixels");
        replicates_free(&r);
    }
}

/* Random numbers that rows have in common: one for each column, with 6 % of the variance of its pixels, so that two of
 * them have the correlation 0.06/1.06. Sums over columns vary 1 + 31 x 0.057 = 2.8 times too much (two columns, 48
 * replicates: one standard error is 2.8 sqrt(2/(16 x 47)) = 0.14), squares of 16 only 1 + 15 x 0.057 = 1.9 times, which is
 * not shown to be more than 1.5. The same for rows, and for each place in 16 tiles of 8 x 8, with 12 %: 1 + 15 x 0.107 = 2.6. */
TEST(lines_and_tiles_that_share_noise_are_refused)
{
    static const char *const said[3] = {"sums over two columns vary 2.",
                                        "sums over two rows vary 2.",
                                        "sums over one place in tiles of 8 vary 2."};
    uint64_t seed = 29;
    for (int kind = 0; kind < 3; kind++) {
        struct replicates r = draw_all(LAW_NORMAL, 48, false, &seed);
        for (int k = 0; k < r.num; k++) {
            double g[PIXELS];
            for (int i = 0; i < PIXELS; i++)
                g[i] = sqrt(kind < 2 ? 0.06 : 0.12) * (draw(LAW_NORMAL, &seed) - 1);
            for (int p = 0; p < PIXELS; p++) {
                const int x = p % SIDE, y = p / SIDE,
                          group = kind == 0   ? x
                                  : kind == 1 ? y
                                              : y % 8 * 8 + x % 8;
                r.luminance[k * PIXELS + p] += (float)(g[group] * (1 + p % 7));
            }
        }
        assert_int_equal(test(&r, 1e-6).square_failed, 0);
        assert_refused(&r, said[kind]);
        replicates_free(&r);
    }
}

/* Samples on a grid of 4 x 4 a pixel, each counted by all pixels whose tent of radius 1 reaches it,
 * as programs splat. */
static struct replicates splat_all(int count, double sharing, uint64_t *state)
{
    enum { FINE = 4, WIDE = FINE * (SIDE + 1) };
    static double sample[WIDE][WIDE];
    static float x[3 * PIXELS];
    struct replicates r;
    struct err e;
    assert_true(replicates_alloc(&r, SIDE, SIDE, count, &e));
    r.sharing = sharing;
    for (int k = 0; k < count; k++) {
        for (int i = 0; i < WIDE * WIDE; i++)
            sample[i / WIDE][i % WIDE] = draw(LAW_EXPONENTIAL, state);
        for (int p = 0; p < PIXELS; p++) {
            double sum = 0;
            for (int i = 0; i < 4 * FINE * FINE; i++) {
                int row = p / SIDE * FINE + i / (2 * FINE), col = p % SIDE * FINE + i % (2 * FINE);
                double v = fabs((i / (2 * FINE) + 0.5) / FINE - 1),
                       u = fabs((i % (2 * FINE) + 0.5) / FINE - 1);
                sum += (1 - u) * (1 - v) * sample[row][col];
            }
            x[3 * p] = x[3 * p + 1] = x[3 * p + 2] = (float)(sum / (FINE * FINE));
        }
        replicates_add(&r, x);
    }
    return r;
}

/* H0 with a known filter: the variance of a large square's sum is 2.25 times the sum of its pixels' variances
 * (test_camera.c), and replicates are independent; the limit is 1.5 times that. alpha
 * 1 %, n = 200 sets of 16: more than 10 failures have probability 7e-6. Control: with the filter
 * unknown all sets are refused. The measured ratio over squares of 16 must be 2.25 (1 - 1/48)^2 (the
 * border cuts the rest) within 10 %: its standard error, from 16 replicates of 4 squares in 200
 * sets, is 1.4 %. */
TEST(a_known_filter_is_allowed_for)
{
    uint64_t seed = 20261123;
    int failed = 0, refused = 0;
    double ratio = 0;
    for (int n = 0; n < 200; n++) {
        struct replicates r = splat_all(16, 2.25, &seed);
        struct independence t = test(&r, 0.01);
        failed += !t.passed;
        ratio += (1 + 255 * t.square_r[3]) / 200;
        r.sharing = 0;
        refused += test(&r, 0.01).square_failed > 0;
        replicates_free(&r);
    }
    printf("squares of 16 vary %.3f times as much; %d of 200 fail, %d where it is not known\n",
           ratio, failed, refused);
    assert_in_range(failed, 0, 10);
    assert_int_equal(refused, 200);
    assert_true(fabs(ratio / (2.25 * pow(1 - 1.0 / 48, 2)) - 1) < 0.1);
}

/* The factor of shared_noise_factor(), and whether there is one. */
static double factor_of(const struct replicates *r, double alpha, bool *limited)
{
    struct shared_noise s;
    struct err e;
    const struct square_noise *unlimited;
    MUST(shared_noise_measure(r, &s, &e));
    assert_int_equal(s.num, 5); /* sides 2 to 32 */
    double factor = shared_noise_factor(&s, alpha, &unlimited);
    *limited = unlimited == NULL;
    return factor;
}

/* H0: pixels are independent, alpha = 1 %, 400 sets a row: noise is said to be shared in at most Binomial(400, 1 %), more
 * than 14 with probability 2.5e-5. That it is found where it is shared: the next two tests. */
TEST(independent_pixels_share_no_noise)
{
    static const struct {
        enum law law;
        int count;
    } rows[] = {{LAW_NORMAL, 3}, {LAW_EXPONENTIAL, 3}, {LAW_RARE, 4}, {LAW_BLACK, 8}};
    uint64_t seed = 20261128;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        int found = 0;
        for (int n = 0; n < 400; n++) {
            bool limited;
            struct replicates r = draw_all(rows[i].law, rows[i].count, false, &seed);
            found += factor_of(&r, 0.01, &limited) > 1;
            replicates_free(&r);
        }
        printf("law %d, %d replicates: noise is shared in %d of 400\n", rows[i].law, rows[i].count,
               found);
        assert_in_range(found, 0, 14);
    }
}

/* The tent's factor is 2.25 (above). 8 replicates have 16 squares of 8 x 8, so 112 degrees of freedom: a standard error
 * of 13 % of the ratio there and, if the ratio of 4 x 4 were exact, twice that of the extrapolated one, to which three of
 * them are added: 1.5 of its own, so that 93 of 100 reach 2.25, fewer than 85 with probability 0.2 %. All stay
 * below 5.5, 4 standard errors above 2.25 + 3 x 0.3. */
TEST(the_factor_of_a_filter)
{
    uint64_t seed = 20261129;
    int enough = 0;
    for (int n = 0; n < 100; n++) {
        bool limited;
        struct replicates r = splat_all(8, 0, &seed);
        double factor = factor_of(&r, 1e-6, &limited);
        assert_true(limited && factor > 1 && factor < 5.5);
        enough += factor >= 2.25;
        replicates_free(&r);
    }
    printf("a factor of 2.25 is covered in %d of 100\n", enough);
    assert_true(enough >= 85);
}

/* Half of each pixel's variance is the same in the whole image: correlation 1/2, so sums over 8 x 8 vary 32.5 times as
 * much and over 4 x 4 8.5 times, and the next square would vary 1.74 times as much again. No factor is enough. */
TEST(noise_of_the_whole_image_has_no_factor)
{
    uint64_t seed = 20261130;
    for (int n = 0; n < 50; n++) {
        bool limited;
        struct replicates r = draw_all(LAW_NORMAL, 8, false, &seed);
        for (int k = 0; k < 8; k++) {
            double all = 0.3 * draw_normal(uniform(&seed), &seed);
            for (int p = 0; p < PIXELS; p++)
                r.luminance[k * PIXELS + p] += (float)(all * (1 + p % 7));
        }
        factor_of(&r, 1e-6, &limited);
        assert_false(limited);
        replicates_free(&r);
    }
}
