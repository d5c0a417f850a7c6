/* tools/stats/stated_error.c on renders whose law is known: exponential samples, as skewed as direct light,
 * 16 x 16 pixels, n = 32 a pixel, K = 8 renders. Seeds are fixed; nothing is retried. */
#include "renderer/math/sampler.h"
#include "tools/stats/stated_error.h"
#include "tools/results/stated_error_results.h"
#include "tools/report/report_internal.h"
#include "tests/support/test.h"

#include <gsl/gsl_cdf.h>

enum { SIDE = 16, PIXELS = SIDE * SIDE, SAMPLES = 32, RENDERS = 8 };

/* What a renderer may do wrong without a bias of its mean. */
enum fault { RIGHT, SAMPLES_REPEAT, PIXELS_SHARE, STRATIFIED, SEED_IGNORED, VARIANCE_HALVED };

/* The uniform number of dimension c of that sample, pixel and render (seed), drawn with the fault. */
static double uniform(enum fault fault, uint64_t seed, uint32_t pixel, uint32_t sample, uint32_t c)
{
    if (fault == SAMPLES_REPEAT)
        sample /= 2;
    if (fault == PIXELS_SHARE)
        pixel = 0;
    if (fault == SEED_IGNORED)
        seed = 1;
    double u = ((double)sampler_get(seed, pixel, sample, c, 0).u[0] + 0x1p-25);
    return fault == STRATIFIED ? (sample + u) / SAMPLES : u;
}

static struct moments render(enum fault fault, uint64_t seed)
{
    struct moments m;
    struct err e;
    assert_true(moments_alloc(&m, SIDE, SIDE, &e));
    for (uint32_t p = 0; p < PIXELS; p++)
        for (uint32_t s = 0; s < SAMPLES; s++) {
            double x[3];
            /* Red and green are the same, as of grey surfaces; blue is independent of them. */
            x[0] = x[1] = -log(uniform(fault, seed, p, s, 0));
            x[2] = -2 * log(uniform(fault, seed, p, s, 1));
            moments_add(&m, p, x);
        }
    for (size_t i = 0; fault == VARIANCE_HALVED && i < 3 * PIXELS; i++)
        m.m2[i] /= 2;
    return m;
}

static struct stated_error judge(enum fault fault, uint64_t trial, double margin, double alpha)
{
    struct moments m[RENDERS];
    struct stated_error c;
    struct err e;
    for (int k = 0; k < RENDERS; k++)
        m[k] = render(fault, 1000 * trial + (uint64_t)k);
    MUST(stated_error_judge(m, RENDERS, margin, alpha, &c, &e));
    for (int k = 0; k < RENDERS; k++)
        moments_free(&m[k]);
    return c;
}

/* H0: independent samples, so DIFFERENT is wrong; alpha = 5 %. n = 200 trials: more than 22 have a
 * probability of 2e-4 at a rate of 5 %. The margin of 50 % is far from R = 1, so `wrong` comes from the
 * image's test alone; the 95 % interval of R may miss 1 in at most 22 trials too. */
TEST(independent_samples_pass)
{
    int wrong = 0, outside = 0;
    double sum = 0;
    for (uint64_t trial = 0; trial < 200; trial++) {
        struct stated_error c = judge(RIGHT, trial, 0.5, 0.05);
        wrong += c.verdict == VERDICT_DIFFERENT;
        outside += c.pixels_lo > 1 || c.pixels_hi < 1;
        sum += c.pixels / 200;
    }
    assert_true(gsl_cdf_binomial_Q(21, 0.05, 200) < 1e-3);
    assert_true(wrong <= 22);
    assert_true(outside <= 22);
    /* The sd of R: sqrt(2 (1 + (6/32)/2) / (7 x 512)) = 2.5 % for 512 independent values of excess
     * kurtosis 6/32; of the mean over the trials 1/sqrt 200 of that. */
    assert_true(fabs(sum - 1) < 5 * 0.025 / sqrt(200));
}

/* R of each fault. Every sample twice: the mean has variance 2 s^2/n, and E[M2] = (n-2) s^2, so
 * R = 2 (n-1)/(n-2). Halved M2: R = 2. Random numbers shared by all pixels: R = 1, S = the number of
 * pixels. Stratified -ln u: Var(mean) << s^2/n, R << 1. */
TEST(faults_are_found)
{
    struct stated_error c = judge(SAMPLES_REPEAT, 301, 0.1, 1e-3);
    assert_int_equal(c.verdict, VERDICT_DIFFERENT);
    assert_true(c.pixels_lo < 2 * 31. / 30 && c.pixels_hi > 2 * 31. / 30);
    c = judge(VARIANCE_HALVED, 302, 0.1, 1e-3);
    assert_int_equal(c.verdict, VERDICT_DIFFERENT);
    assert_true(c.pixels_lo < 2 && c.pixels_hi > 2);
    c = judge(PIXELS_SHARE, 303, 5, 1e-3);
    assert_int_equal(c.verdict, VERDICT_DIFFERENT);
    assert_true(c.image > PIXELS / 10. && c.image < PIXELS * 10.);
    assert_non_null(strstr(c.reason, "depend on each other"));
    c = judge(STRATIFIED, 304, 0.1, 1e-3);
    assert_int_equal(c.verdict, VERDICT_DIFFERENT);
    assert_true(c.pixels_hi < 0.5);
    c = judge(SEED_IGNORED, 305, 0.1, 1e-3);
    assert_int_equal(c.verdict, VERDICT_DIFFERENT);
    assert_non_null(strstr(c.reason, "no effect"));
}

/* The interval of R has a half width of about t(7) x 2.5 % = 13 % at alpha = 1e-3: inside a margin of 25 %,
 * not inside one of 1 %. */
TEST(verdicts_follow_the_margin)
{
    assert_int_equal(judge(RIGHT, 401, 0.25, 1e-3).verdict, VERDICT_EQUIVALENT);
    assert_int_equal(judge(RIGHT, 402, 0.01, 1e-3).verdict, VERDICT_INCONCLUSIVE);
}

TEST(bad_input_is_named)
{
    struct moments m[4];
    struct stated_error c;
    struct err e;
    for (int k = 0; k < 4; k++)
        assert_true(moments_alloc(&m[k], 2, 2, &e));
    REFUSES(stated_error_judge(m, 4, 0.1, 0.01, &c, &e), "pixel 0 has 0 samples");
    for (int k = 0; k < 4; k++)
        for (size_t p = 0; p < 4; p++)
            for (int s = 0; s < 3; s++)
                moments_add(&m[k], p, (const double[]){1, 1, 1});
    assert_false(stated_error_judge(m, 4, 0.1, 0.01, &c, &e));
    assert_string_equal(e.msg, "no render has any noise");
    strcpy(m[2].unit, "replicate");
    REFUSES(stated_error_judge(m, 4, 0.1, 0.01, &c, &e), "not over its samples");
    for (int k = 0; k < 4; k++)
        moments_free(&m[k]);
}

static const char record[] =
    "[{\"scene\": \"12_<b>\", \"engine\": \"pathtracer\", \"renders\": 8, \"spp\": 32, \"alpha\": "
    "1e-5, \"margin\": 0.4, \"verdict\": \"EQUIVALENT\", \"passed\": true, \"reason\": \"why\", "
    "\"pixels\": 0.98, \"pixels_ci\": [0.8, 1.2], \"image\": 0.5, \"image_range\": [0.1, 5], "
    "\"seconds\": 2},"
    " {\"scene\": \"41\", \"engine\": \"pathtracer\", \"passed\": false, \"error\": \"no <file>\"}]";

/* Edits of the record above, and a part of the error line that each must give; NULL: accepted. */
TEST(records_are_checked)
{
    static const char *const cases[][3] = {
        {"why", "because", NULL},
        {"\"pixels\": 0.98", "\"pixels\": \"1\"",
         "results: consistency 1: 'pixels' is not a number"},
        {"[0.8, 1.2]", "[0.8]", "'pixels_ci' is neither an interval nor null"},
        {"EQUIVALENT", "EQUAL", "'verdict' is not a verdict"},
        {"\"seconds\": 2", "\"seconds\": 2, \"noise\": 1, \"noise_ci\": [0.9, 1.1]", NULL},
        {"\"seconds\": 2", "\"seconds\": 2, \"noise\": 1",
         "'noise_ci' is neither an interval nor null"},
        {"\"seconds\": 2", "\"seconds\": 2, \"too_early\": 1.5, \"too_late\": 0",
         "'too_early' is not a whole number"},
        {"EQUIVALENT", "DIFFERENT", "'passed' contradicts 'verdict'"},
        {"\"passed\": false", "\"passed\": true", "consistency 2: has an 'error' and yet 'passed'"},
        {"\"scene\": \"41\"", "\"seen\": 41", "'scene' is missing"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[2048];
        struct err e = {""};
        const char *at = strstr(record, cases[i][0]);
        assert_non_null(at);
        snprintf(text, sizeof text, "%.*s%s%s", (int)(at - record), record, cases[i][1],
                 at + strlen(cases[i][0]));
        json_auto_t *c = json_loads(text, 0, NULL);
        assert_non_null(c);
        bool ok = stated_error_check(c, "results", &e);
        if (ok != (cases[i][2] == NULL) || (!ok && strstr(e.msg, cases[i][2]) == NULL))
            fail_msg("case %zu: %s", i, e.msg);
    }
}

/* The printed table and the page; markup in names is escaped. */
TEST(records_are_shown)
{
    json_auto_t *c = json_loads(record, 0, NULL);
    assert_int_equal(results_row_outcome(json_array_get(c, 0)), OUTCOME_AS_EXPECTED);
    assert_int_equal(results_row_outcome(json_array_get(c, 1)), OUTCOME_NOT_JUDGED);
    char *text;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    assert_non_null(f);
    stated_error_print(f, c, false);
    stated_error_print(f, c, true);
    report_stated_error_headline(f, c);
    report_stated_error(f, c);
    fclose(f);
    assert_non_null(strstr(text, "8 x 32 spp  0.980 [0.800, 1.200]  0.50  EQUIVALENT"));
    assert_non_null(strstr(text, "41  NOT JUDGED: no <file>"));
    assert_non_null(strstr(text, "| 41 | | | | | | NOT JUDGED: no <file> |"));
    assert_non_null(strstr(text, "1 of 2 scenes"));
    assert_non_null(strstr(text, "12_&lt;b&gt;"));
    assert_non_null(strstr(text, "no &lt;file&gt;"));
    free(text);
}
