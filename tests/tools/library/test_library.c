/* tools/library/assay.h: one comparison by every way in (pixels, running moments, moments given, files) gives one result,
 * which a closed form knows; what cannot be judged gets a line; threads do not meet. */
#include "tools/library/assay.h"

#include "renderer/image/moments.h"
#include "tests/support/simulate.h"
#include "tests/support/test.h"

#include <pthread.h>

enum { W = 40, H = 32, K = 8, VALUES = 3 * W * H };

/* K replicates of 1 + noise in 0 to 1, by `factor`. */
static void make_replicates(float *out, uint64_t seed, double factor)
{
    for (size_t i = 0; i < (size_t)K * VALUES; i++)
        out[i] = (float)(factor * (0.5 + uniform(&seed)));
}

static struct assay_side pixels(const void *p, int num)
{
    return (struct assay_side){.num = num, .width = W, .height = H, .channels = 3, .pixels = p};
}

static struct assay_options with_margin(double margin)
{
    struct assay_options o;
    assay_options_init(&o, sizeof o);
    o.margin = margin;
    return o;
}

static struct assay_comparison *judge(const struct assay_side *a, const struct assay_side *b,
                                      const struct assay_options *o)
{
    char error[ASSAY_ERROR_SIZE];
    struct assay_comparison *c;
    if (!assay_compare(a, b, o, &c, error))
        fail_msg("%s", error);
    return c;
}

static void refuses(const struct assay_side *a, const struct assay_side *b,
                    const struct assay_options *o, const char *part)
{
    char error[ASSAY_ERROR_SIZE];
    struct assay_comparison *c;
    if (assay_compare(a, b, o, &c, error))
        fail_msg("judged what '%s' should refuse", part);
    assert_null(c);
    if (strstr(error, part) == NULL)
        fail_msg("'%s' lacks '%s'", error, part);
    assert_false(assay_compare(a, b, o, &c, NULL));
}

/* A closed form on both sides, 1.03 against 1: the image differs by 3 % exactly, and no noise is there. */
TEST(test_exact)
{
    static double n[W * H], a[W * H], b[W * H], zero[W * H];
    for (size_t p = 0; p < (size_t)W * H; p++) {
        n[p] = 1;
        a[p] = 1.03;
        b[p] = 1;
    }
    struct assay_side side[2] = {{.name = "mine"}, {.name = "truth"}};
    for (int i = 0; i < 2; i++) {
        side[i].width = W;
        side[i].height = H;
        side[i].channels = 1;
        side[i].n = n;
        side[i].mean = i == 0 ? a : b;
        side[i].m2 = zero;
        side[i].unit = "exact";
    }
    static const struct {
        double margin;
        enum assay_verdict verdict;
    } cases[] = {{0.01, ASSAY_DIFFERENT}, {0.05, ASSAY_EQUIVALENT}};
    for (size_t i = 0; i < COUNT(cases); i++) {
        struct assay_options o = with_margin(cases[i].margin);
        struct assay_comparison *c = judge(&side[0], &side[1], &o);
        const struct assay_result *r = assay_result_of(c);
        assert_int_equal(r->verdict, cases[i].verdict);
        assert_int_equal(r->passes, cases[i].verdict == ASSAY_EQUIVALENT);
        assert_near(r->image.difference, 0.03, 1e-12);
        assert_near(r->image.mean_a, 1.03, 1e-12);
        int width, height;
        const float *map = assay_relative_map(c, &width, &height);
        assert_int_equal(width, W);
        assert_int_equal(height, H);
        assert_near((double)map[W * H - 1], 0.03, 1e-6);
        assay_free(c);
    }
    side[1].unit = "sample"; /* one sample has no variance */
    struct assay_options o = with_margin(0.01);
    refuses(&side[0], &side[1], &o, "at least 3 are needed");
}

static void assert_same(const struct assay_result *r, const struct assay_result *s,
                        double tolerance)
{
    assert_int_equal(r->verdict, s->verdict);
    assert_near(r->image.difference, s->image.difference, tolerance);
    assert_near(r->image.ci_lo, s->image.ci_lo, tolerance);
    assert_near(r->mdb, s->mdb, tolerance);
    assert_near(r->mdb_tile, s->mdb_tile, tolerance);
    assert_near(r->variance_ratio, s->variance_ratio, 1e4 * tolerance);
    assert_int_equal(r->num_tests, s->num_tests);
}

/* The same replicates as pixels, added to running moments in two parts that are merged, and as a file of moments, whose 32-bit
 * floats are good to 6e-8: one result. */
TEST(test_ways_in)
{
    static float a[K * VALUES], b[K * VALUES];
    struct assay_moments *part[2] = {assay_moments_new(W, H, "replicate", 0),
                                     assay_moments_new(W, H, "replicate", 0)};
    char error[ASSAY_ERROR_SIZE];
    make_replicates(a, 1, 1.02);
    make_replicates(b, 2, 1);
    for (int k = 0; k < K; k++)
        assert_true(assay_moments_add_image(part[k < 3], a + (size_t)k * VALUES));
    if (!assay_moments_merge(part[0], part[1], error))
        fail_msg("%s", error);
    const char *path = test_path("a.exr");
    if (!assay_moments_write(part[0], path, error))
        fail_msg("%s", error);
    struct assay_side side[3] = {pixels(a, K), assay_moments_side(part[0]), {.path = path}},
                      reference = pixels(b, K);
    reference.name = "gold";
    struct assay_options o = with_margin(0.1);
    struct assay_comparison *c[3];
    for (int i = 0; i < 3; i++)
        c[i] = judge(&side[i], &reference, &o);
    assert_same(assay_result_of(c[0]), assay_result_of(c[1]), 1e-9);
    assert_same(assay_result_of(c[0]), assay_result_of(c[2]), 2e-6);
    /* the mean of all of a, over that of b: what `difference` is of, weighted as luminance */
    double sum[2] = {0};
    static const double weight[3] = {.2126, .7152, .0722};
    for (size_t i = 0; i < (size_t)K * VALUES; i++) {
        sum[0] += weight[i % 3] * (double)a[i];
        sum[1] += weight[i % 3] * (double)b[i];
    }
    assert_near(assay_result_of(c[0])->image.difference, sum[0] / sum[1] - 1, 1e-9);
    assert_true(strstr(assay_result_of(c[0])->notes[1], "gold: 8 replicates") != NULL);
    for (int i = 0; i < 3; i++) {
        const char *json = test_path("results.json"), *page = test_path("page.html");
        assert_true(assay_write_json(c[i], json, error));
        if (!assay_write_report(c[i], page, error))
            fail_msg("%s", error);
        assay_free(c[i]);
    }
    assay_moments_free(part[0]);
    assay_moments_free(part[1]);
}

/* By samples of single pixels: two of the values 1 and 3 have mean 2, M2 = 2, M3 = 0; 0, 0, 3: mean 1, M2 = 6, M3 = 6. */
TEST(test_moments)
{
    struct assay_moments *m = assay_moments_new(2, 1, NULL, 0),
                         *other = assay_moments_new(1, 2, NULL, 0);
    char error[ASSAY_ERROR_SIZE];
    assert_true(assay_moments_add(m, 0, 0, (double[]){1, 1, 1}));
    assert_true(assay_moments_add(m, 0, 0, (double[]){3, 3, 3}));
    for (int i = 0; i < 3; i++)
        assert_true(assay_moments_add(m, 1, 0, (double[]){0, i == 2 ? 3 : 0, 0}));
    assert_false(assay_moments_add(m, 2, 0, (double[]){1, 1, 1}));
    assert_false(assay_moments_add(m, 0, -1, (double[]){1, 1, 1}));
    assert_false(assay_moments_add(m, 0, 0, (double[]){1, NAN, 1}));
    struct assay_side s = assay_moments_side(m);
    assert_near(s.n[0], 2, 0);
    assert_near(s.mean[0], 2, 1e-15);
    assert_near(s.m2[0], 2, 1e-15);
    assert_near(s.n[1], 3, 0);
    assert_near(s.mean[4], 1, 1e-15);
    assert_near(s.m2[4], 6, 1e-15);
    assert_near(s.m3[4], 6, 1e-14);
    assert_false(assay_moments_merge(m, other, error));
    assert_true(strstr(error, "2 x 1") != NULL || strstr(error, "2x1") != NULL);
    assert_null(assay_moments_new(0, 4, NULL, 0));
    assert_null(assay_moments_new(4, 4, "exact", 0));
    assay_moments_free(m);
    assay_moments_free(other);
    assay_moments_free(NULL);
    assay_free(NULL);
}

/* Codes are what the curve says: 128/255 linear against 0.5 in floats, 0.39 % apart, half a code of which is allowed for. */
TEST(test_codes)
{
    static uint8_t a[VALUES];
    static float b[VALUES];
    uint64_t seed = 3;
    for (size_t i = 0; i < VALUES; i++) {
        a[i] = (uint8_t)(118 + 21 * uniform(&seed));
        b[i] = (float)(0.46 + 0.08 * uniform(&seed));
    }
    struct assay_side side[2] = {pixels(a, 1), pixels(b, 1)};
    side[0].type = ASSAY_UINT8;
    struct assay_options o = with_margin(0.05);
    refuses(&side[0], &side[1], &o, "what light is a code?");
    o.curve = "linear";
    struct assay_comparison *c = judge(&side[0], &side[1], &o);
    double mean = 0;
    for (size_t i = 0; i < VALUES; i++)
        mean += i % 3 == 1 ? a[i] / 255.0 / (W * H) : 0;
    assert_near(assay_result_of(c)->image.mean_a, mean, 0.01);
    assay_free(c);
    side[0].num = 3;
    refuses(&side[0], &side[1], &o, "replicates need 32-bit floats");
}

TEST(test_refusals)
{
    static float a[K * VALUES], b[K * VALUES];
    make_replicates(a, 4, 1);
    make_replicates(b, 5, 1);
    struct assay_side good = pixels(b, K), s = pixels(a, K);
    struct assay_options o = with_margin(0.1);
    s.channels = 2;
    refuses(&s, &good, &o, "2 channels");
    s = pixels(a, K);
    s.height = 0;
    refuses(&s, &good, &o, "40 x 0 pixels");
    s = pixels(a, K - 1);
    s.height = H - 1;
    refuses(&s, &good, &o, "40 x 31");
    s = pixels(a, 2);
    refuses(&s, &good, &o, "at least 3 replicates");
    s = pixels(NULL, K);
    refuses(&s, &good, &o, "neither a path nor pixels");
    s = pixels(a, K);
    s.path = "a.exr";
    refuses(&s, &good, &o, "which of them");
    s.pixels = NULL;
    s.path = "/nowhere/a.exr";
    refuses(&s, &good, &o, "/nowhere/a.exr");
    s = pixels(a, K);
    s.name = "nightly";
    a[VALUES + 7] = NAN;
    refuses(&s, &good, &o, "nightly: pixel 2,0 of image 1 is not a number");
    for (size_t i = 0; i < VALUES; i++)
        a[VALUES + i] = a[i];
    refuses(&s, &good, &o, "images 0 and 1 are the same");
    make_replicates(a, 4, 1);
    o.margin = NAN;
    refuses(&s, &good, &o, "margin: ");
    o = with_margin(0.1);
    o.alpha = 0.5;
    refuses(&s, &good, &o, "alpha: 0.5 is not within");
    o = with_margin(0.1);
    o.exchangeable = true;
    refuses(&s, &good, &o, "--exchangeable asks if anything differs");
    o = with_margin(0.1);
    o.size = sizeof o + 8;
    refuses(&s, &good, &o, "newer library");
    /* an older caller knows fewer options: what comes after stays as it is by default */
    o = with_margin(0);
    o.size = offsetof(struct assay_options, tile);
    o.tile = -5;
    struct assay_comparison *c = judge(&s, &good, &o);
    assert_int_equal(assay_result_of(c)->verdict, ASSAY_NOTHING_FOUND);
    assert_false(assay_result_of(c)->passes);
    assay_free(c);
}

/* H0: equal laws, 40 pairs at alpha 0.01: more than 4 DIFFERENT have a probability below 1e-4. Power: 20 % more
 * light, with a standard error of 0.3 %, is found in all of five pairs. The same for permutations and for sign
 * flips. */
TEST(test_verdicts)
{
    static float a[K * VALUES], b[K * VALUES], bright[K * VALUES];
    int alarms[3] = {0};
    for (uint64_t i = 0; i < 40; i++) {
        make_replicates(a, 100 + 3 * i, 1);
        make_replicates(b, 101 + 3 * i, 1);
        make_replicates(bright, 102 + 3 * i, 1.2);
        for (int way = 0; way < 3; way++) {
            struct assay_options o = with_margin(0);
            o.alpha = 0.01;
            o.exchangeable = way == 1;
            o.same_program = way == 2;
            const struct assay_side side[3] = {pixels(a, K), pixels(b, K), pixels(bright, K)};
            struct assay_comparison *c = judge(&side[0], &side[1], &o);
            alarms[way] += assay_result_of(c)->verdict == ASSAY_DIFFERENT;
            assert_int_equal(isnan(assay_result_of(c)->exact_p), way == 0);
            assay_free(c);
            if (i > 4)
                continue;
            c = judge(&side[2], &side[1], &o);
            assert_int_equal(assay_result_of(c)->verdict, ASSAY_DIFFERENT);
            assay_free(c);
            if (way != 0)
                continue;
            static float a2[K * VALUES], b2[K * VALUES];
            make_replicates(a2, 1000 + 2 * i, 1);
            make_replicates(b2, 1001 + 2 * i, 1);
            const struct assay_side fresh[2] = {pixels(a2, K), pixels(b2, K)};
            assert_true(
                assay_compare_again(&side[2], &side[1], &fresh[0], &fresh[1], &o, &c, NULL));
            assert_int_equal(assay_result_of(c)->verdict, ASSAY_NOTHING_FOUND); /* not confirmed */
            assay_free(c);
        }
    }
    for (int way = 0; way < 3; way++)
        assert_in_range(alarms[way], 0, 4);
}

struct caller {
    const struct assay_side *a, *b;
    double mdb;
};

static void *call(void *arg)
{
    struct caller *caller = arg;
    struct assay_options o = with_margin(0.1);
    struct assay_comparison *c;
    caller->mdb = -1;
    if (assay_compare(caller->a, caller->b, &o, &c, NULL)) {
        caller->mdb = assay_result_of(c)->mdb;
        assay_free(c);
    }
    return NULL;
}

TEST(test_threads)
{
    static float a[K * VALUES], b[K * VALUES];
    make_replicates(a, 8, 1);
    make_replicates(b, 9, 1);
    const struct assay_side side[2] = {pixels(a, K), pixels(b, K)};
    struct caller caller[4];
    pthread_t thread[4];
    for (int i = 0; i < 4; i++) {
        caller[i] = (struct caller){&side[0], &side[1], 0};
        assert_int_equal(pthread_create(&thread[i], NULL, call, &caller[i]), 0);
    }
    for (int i = 0; i < 4; i++)
        pthread_join(thread[i], NULL);
    assert_true(caller[0].mdb > 0);
    for (int i = 1; i < 4; i++)
        assert_near(caller[i].mdb, caller[0].mdb, 0);
}
