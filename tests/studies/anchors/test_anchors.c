/* The rules of tests/studies/anchors/anchor_rules.c on images small enough for a pencil, at their boundaries, and
 * against GSL and the program idiff; the images of tests/studies/anchors/anchor_images.c; and that the page of `make
 * anchors` is what its record says, with the settings that the code has. */
#include "anchors.h"

#include "reference/base/process.h"
#include "renderer/image/image_oiio.h"
#include "renderer/base/fs.h"
#include "tests/support/rates.h"
#include "tests/support/simulate.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <gsl/gsl_cdf.h>
#include <gsl/gsl_randist.h>

enum { SIDE = 64, PIXELS = SIDE * SIDE };

/* XYZ of the primaries is their chromaticity times a weight; the weights make white (1, 1, 1) the
 * chromaticity of D65 with Y = 1. All four pairs are those of BT.709. */
TEST(test_xyz)
{
    static const double xy[4][2] = {{.64, .33}, {.30, .60}, {.15, .06}, {.3127, .3290}};
    double weight[3] = {0};
    for (int c = 0; c < 3; c++) {
        double got[3], light[3] = {0};
        light[c] = 1;
        anchor_xyz(light, got);
        weight[c] = got[0] + got[1] + got[2];
        assert_near(got[0] / weight[c], xy[c][0], 1e-5);
        assert_near(got[1] / weight[c], xy[c][1], 1e-5);
    }
    double white[3], all[3] = {1, 1, 1};
    anchor_xyz(all, white);
    assert_near(white[1], 1, 1e-5);
    assert_near(white[0], xy[3][0] / xy[3][1], 1e-5);
    assert_near(white[2], (1 - xy[3][0] - xy[3][1]) / xy[3][1], 1e-5);
}

static double z[3 * PIXELS];

/* Black; static. */
static struct mitsuba_reference black_reference(double var)
{
    static double mean[3 * PIXELS], variance[3 * PIXELS];
    for (size_t i = 0; i < 3 * PIXELS; i++)
        variance[i] = var;
    return (struct mitsuba_reference){.width = SIDE, .height = SIDE, .mean = mean, .var = variance};
}

/* 64 samples of variance 0, floor 1e-4: z = difference sqrt(64/1e-4) = 800 difference. Blue of 0.0075
 * has Z = 0.0071, z 5.7, over the critical 4.71; X = 0.00135 and Y = 0.00054, z 1.1 and 0.4, are not.
 * So each blue pixel is one failing channel. 12288 channels, 4096 pixels: (12288 - k)/3 >= 4085.76 as
 * long as k <= 30.72. */
TEST(test_mitsuba_boundary)
{
    struct mitsuba_reference r = black_reference(0);
    OWN(moments) a = new_moments(SIDE, SIDE, "sample");
    double critical = mitsuba_critical_z(MITSUBA_LEVEL, PIXELS);
    constant(&a, 0, 64);
    assert_int_equal(mitsuba_allowed(MITSUBA_SHARE, PIXELS), 30);
    for (size_t blue = 0; blue <= 31; blue++) {
        mitsuba_z(&a, &r, z);
        assert_int_equal(mitsuba_failures(z, PIXELS, critical), blue);
        assert_int_equal(mitsuba_score(z, PIXELS, 30) >= critical, blue > 30);
        a.mean[3 * (blue * 97) + 2] = 0.0075;
    }
}

/* Variance 4 and 64 samples: the standard error is 1/4. A grey of 1 has Y = 1: z = 4. The critical z
 * has the two-sided normal p 1 - 0.99^(1/4096) (GSL). */
TEST(test_mitsuba_z)
{
    struct mitsuba_reference r = black_reference(4);
    OWN(moments) a = new_moments(SIDE, SIDE, "sample");
    constant(&a, 1, 64);
    mitsuba_z(&a, &r, z);
    assert_near(z[1], 4, 1e-4);
    assert_near(z[3 * PIXELS - 2], 4, 1e-4);
    assert_near(2 * gsl_cdf_ugaussian_Q(mitsuba_critical_z(0.01, PIXELS)),
                1 - pow(0.99, 1.0 / PIXELS), 1e-14);
    /* the (k+1)-th largest of a shuffled 0, 1, 2, .. */
    for (size_t i = 0; i < 3 * PIXELS; i++)
        z[i] = (double)(i * 7919 % (3 * PIXELS));
    for (size_t k = 0; k < 3 * PIXELS; k += 1111)
        assert_near(mitsuba_score(z, PIXELS, k), (double)(3 * PIXELS - 1 - k), 0);
}

/* n = 4 and M2 = 12 on both sides: the means have variance 1 each, so a difference of d has
 * t = d/sqrt 2 with 6 degrees of freedom. k such values and the rest without noise: the family p is
 * 1 - (1-p)^k with p from GSL. */
TEST(test_welch)
{
    OWN(moments) a = new_moments(SIDE, SIDE, "sample"), b = new_moments(SIDE, SIDE, "sample");
    constant(&a, 5, 4);
    constant(&b, 5, 4);
    assert_near(welch_log10_p(&a, &b), 0, 0); /* nothing to test */
    for (size_t k = 1; k <= 3; k++) {
        a.m2[40 * k] = b.m2[40 * k] = 12;
        a.mean[40 * k] = 5 + (k == 1 ? 30 : -2); /* the first stays the smallest p */
        double p = 2 * gsl_cdf_tdist_Q(30 / sqrt(2), 6);
        assert_near(welch_log10_p(&a, &b), log10(1 - pow(1 - p, (double)k)), 1e-9);
    }
    a.m2[120] = b.m2[120] = 12e-20; /* and far out, where 1 - (1-p)^3 = 3 p */
    double p = 2 * gsl_cdf_tdist_Q(2e10 / sqrt(2), 6);
    assert_true(p < 1e-50);
    assert_near(welch_log10_p(&a, &b), log10(3 * p), 1e-6);
}

/* Values with variance of the mean 1 on both sides. In the second tile of 16 x 16 green of A is larger by 1/2 in
 * every pixel: sum 128, variance 512, z = 5.657, and p its normal tail (GSL) times 48 tiles and channels. Shifted by
 * half a tile the same sum is spread over four. The borders: a tile of 48 cuts 64 x 64 into 48 and 16, so that one
 * corner of 16 x 16 has all of it. Without noise nothing is tested. */
TEST(test_tiles)
{
    OWN(moments) a = new_moments(SIDE, SIDE, "sample"), b = new_moments(SIDE, SIDE, "sample");
    constant(&a, 5, 4);
    constant(&b, 5, 4);
    a.mean[7] = 6;
    assert_near(tiles_log10_p(&a, &b, 16), 0, 0);
    a.mean[7] = 5;
    for (size_t i = 0; i < 3 * PIXELS; i++)
        a.m2[i] = b.m2[i] = 12;
    assert_near(tiles_log10_p(&a, &b, 16), 0, 0);
    for (int y = 0; y < 16; y++)
        for (int x = 16; x < 32; x++)
            a.mean[3 * (y * SIDE + x) + 1] = 5.5;
    double zt = 128 / sqrt(512);
    assert_near(tiles_log10_p(&a, &b, 16), log10(48 * 2 * gsl_cdf_ugaussian_Q(zt)), 1e-9);
    assert_near(tiles_log10_p(&b, &a, 16), log10(48 * 2 * gsl_cdf_ugaussian_Q(zt)), 1e-9);
    assert_near(tiles_log10_p(&a, &b, 8), log10(192 * 2 * gsl_cdf_ugaussian_Q(zt / 2)), 1e-9);
    constant(&a, 5, 4);
    for (size_t i = 0; i < 3 * PIXELS; i++)
        a.m2[i] = 12;
    for (int y = 48; y < 64; y++)
        for (int x = 48; x < 64; x++)
            a.mean[3 * (y * SIDE + x)] = 4;
    assert_near(tiles_log10_p(&a, &b, 48), log10(12 * 2 * gsl_cdf_ugaussian_Q(256 / sqrt(512))),
                1e-9);
}

/* 256 of 12288 values differ by 1 of 5: sqrt(1/48)/5. */
TEST(test_rmse)
{
    OWN(moments) a = new_moments(SIDE, SIDE, "sample"), b = new_moments(SIDE, SIDE, "sample");
    constant(&a, 5, 4);
    constant(&b, 5, 4);
    assert_near(relative_rmse(&a, &b), 0, 0);
    for (size_t i = 0; i < 256; i++)
        a.mean[7 * i] += i % 2 == 0 ? 1 : -1;
    assert_near(relative_rmse(&a, &b), sqrt(1.0 / 48) / 5, 1e-12);
}

/* sRGB of 0.5 is 1.055 0.5^(1/2.4) - 0.055 = 0.73536, times 255 is 187.5; of 0.002 12.92 0.002 =
 * 0.02584, 6.6. 4/255 = 0.01569 is not over 0.016, 5/255 is. 1 % of 4096 is 40.96: 40 may fail. */
TEST(test_idiff_boundary)
{
    OWN(moments) m = new_moments(2, 1, "sample");
    const double light[6] = {0, 1, 3, 0.5, 0.002, -1};
    memcpy(m.mean, light, sizeof light);
    uint8_t got[6];
    static const uint8_t want[6] = {0, 255, 255, 188, 7, 0};
    idiff_quantise(&m, 1, got);
    assert_memory_equal(got, want, 6);

    static uint8_t a[3 * PIXELS], b[3 * PIXELS];
    size_t count[256];
    for (size_t p = 0; p < PIXELS; p++)
        b[3 * p + p % 3] = 4;
    for (size_t failing = 0; failing <= 41; failing++) {
        idiff_histogram(a, b, PIXELS, count);
        assert_int_equal(idiff_differs(count, PIXELS, BLENDER_FAIL, BLENDER_PERCENT), failing > 40);
        assert_int_equal(idiff_fail_score(count, PIXELS, BLENDER_PERCENT), failing > 40 ? 5 : 4);
        assert_near(idiff_percent_score(count, PIXELS, BLENDER_FAIL), 100.0 * failing / PIXELS, 0);
        a[3 * (failing * 50)] = 5;
        a[3 * (failing * 50) + 1] = 5; /* two channels, still one pixel */
        b[3 * (failing * 50)] = b[3 * (failing * 50) + 1] = 0;
    }
}

/* What the program says of two PNG files: exit status 2 is a failure, 0 and 1 (a warning) are not. */
static bool real_idiff(const char *program, const char *a, const char *b)
{
    struct err e = {""};
    const char *const argv[] = {program, "-fail", "0.016", "-failpercent", "1", a, b, NULL};
    const struct process p = {.argv = argv, .timeout_s = 60};
    if (process_run(&p, NULL, &e) || strstr(e.msg, "exit status 1") != NULL)
        return false;
    if (strstr(e.msg, "exit status 2") == NULL)
        fail_msg("%s", e.msg);
    return true;
}

/* Images with a few differences around the threshold, in a number of pixels around what is allowed,
 * 40 of 4096, and noise: differences of 5 in about 1 - (5/6)^3 = 42 % of the pixels fail, of 3 do not. */
TEST(test_idiff_program)
{
    char program[4096];
    const char *const path[2] = {test_path("0.png"), test_path("1.png")};
    struct err e = {""};
    if (!process_find("idiff", program, sizeof program)) {
        print_message("SKIPPED: no idiff (package openimageio-tools): its rule is not checked\n");
        skip();
    }
    static uint8_t image[2][3 * PIXELS];
    size_t count[256];
    uint64_t seed = 5;
    static const struct {
        int pixels, step, noise; /* differences of 0 .. noise-1 everywhere */
        bool fails;
    } cases[] = {{0, 0, 0, false},    {40, 5, 0, false},  {41, 5, 0, true},    {41, 4, 0, false},
                 {40, 250, 0, false}, {41, 250, 0, true}, {4000, 4, 0, false}, {40, 9, 4, false},
                 {41, 9, 4, true},    {0, 0, 6, true}};
    for (size_t i = 0; i < COUNT(cases); i++) {
        for (size_t v = 0; v < 3 * PIXELS; v++) {
            image[0][v] = (uint8_t)(250 * uniform(&seed)) / 2;
            image[1][v] = (uint8_t)(image[0][v] + cases[i].noise * uniform(&seed));
        }
        for (int k = 0; k < cases[i].pixels; k++) {
            size_t at = 3 * (size_t)k + (size_t)k % 3;
            image[k % 2][at] = 0;
            image[1 - k % 2][at] = (uint8_t)cases[i].step;
        }
        for (int k = 0; k < 2; k++)
            MUST(image_write_png(path[k], SIDE, SIDE, image[k], &e));
        idiff_histogram(image[0], image[1], PIXELS, count);
        bool ours = idiff_differs(count, PIXELS, BLENDER_FAIL, BLENDER_PERCENT);
        if (ours != real_idiff(program, path[0], path[1]))
            fail_msg("picture %zu: ours says %s, idiff the opposite", i, ours ? "fail" : "pass");
        assert_int_equal(ours, cases[i].fails);
    }
}

/* Sums of binomial probabilities (GSL's), by brute force, against the two searches of anchors.c. */
static double at_most(int k, int n, double p)
{
    double sum = 0;
    for (int i = 0; i <= k; i++)
        sum += gsl_ran_binomial_pdf((unsigned)i, p, (unsigned)n);
    return sum;
}

TEST(test_intervals)
{
    assert_near(rate_upper(0, 200, 0.025), 1 - pow(0.025, 1 / 200.0), 1e-12); /* (1-hi)^200 */
    assert_near(rate_lower(200, 200, 0.025), pow(0.025, 1 / 200.0), 1e-12);
    assert_near(1 - at_most(6, 200, rate_lower(7, 200, 0.025)), 0.025, 1e-9);
    assert_near(at_most(7, 200, rate_upper(7, 200, 0.025)), 0.025, 1e-9);
    assert_true(rate_lower(0, 200, 0.025) == 0 && rate_upper(200, 200, 0.025) == 1);

    int at, low, high;
    anchors_quantile_ranks(200, 0.95, &at, &low, &high);
    assert_int_equal(at, 189); /* 190 of 200 at or below it */
    /* The low one is too high where no more than `low` values lie at or below the quantile; the next
     * would be so too often. The high one is too low where more than `high` lie below. */
    assert_true(at_most(low, 200, 0.95) <= 0.025);
    assert_true(at_most(low + 1, 200, 0.95) > 0.025);
    assert_true(1 - at_most(high, 200, 0.95) <= 0.025);
    assert_true(1 - at_most(high - 1, 200, 0.95) > 0.025);
    anchors_quantile_ranks(20, 0.95, &at, &low, &high);
    assert_int_equal(high, 20); /* the largest of 20 is below it too often: 0.95^20 = 0.36 */
}

/* Every kind of error on a made-up pool, value by value. */
TEST(test_make_wrong)
{
    struct anchor_pool p = {.side = SIDE, .num_places = 2, .place = {{4, 24}, {44, 4}}};
    OWN(moments) in = new_moments(SIDE, SIDE, "sample"), out = new_moments(SIDE, SIDE, "sample");
    p.bounced = calloc(3 * PIXELS, sizeof *p.bounced);
    assert_non_null(p.bounced);
    for (size_t i = 0; i < 3 * PIXELS; i++) {
        in.mean[i] = 2;
        in.m2[i] = 3;
        in.m3[i] = 5;
        p.bounced[i] = (double)(i % 4) / 4;
    }
    for (int kind = 0; kind < NUM_ANCHOR_ERRORS; kind++) {
        anchor_make_wrong(&p, &in, kind, 0.5, 3, &out);
        for (size_t i = 0; i < 3 * PIXELS; i++) {
            size_t x = i / 3 % SIDE, y = i / 3 / SIDE;
            bool inside = x >= 44 && x < 60 && y >= 4 && y < 20;
            double share = kind == ANCHOR_GLOBAL              ? 1
                           : kind == ANCHOR_REGION && !inside ? 0
                                                              : p.bounced[i];
            assert_near(out.mean[i], 2 + share, 1e-12);
            assert_near(out.m2[i], 3 * pow(1 + share / 2, 2), 1e-12);
            assert_near(out.m3[i], 5 * pow(1 + share / 2, 3), 1e-12);
        }
    }
    free(p.bounced);
}

/* Real renders of a sphere lamp over a plane, 24 x 24 pixels, 64 samples. H0: A and B have the same
 * mean; Welch at 1e-6 must not reject it, and the mean of the long reference must be that of the pool
 * (|z| < 4.89 of the whole image's luminance, alpha 1e-6). Power: an image twice as bright is
 * rejected by every rule (its z per pixel is about 1/0.31 sqrt(64/2) = 18). */
TEST(test_real_renders)
{
    enum { SMALL = 24, N = 4, CELLS = SMALL * SMALL };
    OWN(anchor_pool) p;
    struct err e = {""};
    struct anchor_job job = {.scene = "33_sphere_light",
                             .side = SMALL,
                             .spp = 64,
                             .num_renders = N,
                             .reference_spp = 256,
                             .seed = 77};
    MUST(anchor_render(&job, &p, &e));
    double difference = 0, var = 0;
    for (size_t i = 0; i < CELLS; i++) {
        for (int r = 0; r < N; r++) {
            double xyz[3];
            anchor_xyz(&p.render[r].mean[3 * i], xyz);
            difference += xyz[1] / N - p.reference.mean[3 * i + 1] / N;
        }
        var += p.reference.var[3 * i + 1] * (1.0 / (64 * N) + 1.0 / 256);
    }
    assert_true(fabs(difference) < 4.89 * sqrt(var));
    assert_int_equal(p.num_places, 1);
    assert_true(anchor_noise(&p) > 0.1 && anchor_noise(&p) < 1);
    assert_true(welch_log10_p(&p.render[0], &p.render[1]) > -6);

    OWN(moments) wrong = new_moments(SMALL, SMALL, "sample");
    anchor_make_wrong(&p, &p.render[0], ANCHOR_GLOBAL, 1, 0, &wrong);
    assert_true(welch_log10_p(&wrong, &p.render[1]) < -6);
    mitsuba_z(&wrong, &p.reference, z);
    assert_true(mitsuba_failures(z, CELLS, mitsuba_critical_z(MITSUBA_LEVEL, CELLS)) >
                mitsuba_allowed(MITSUBA_SHARE, CELLS));
    uint8_t a[3 * CELLS], b[3 * CELLS];
    size_t count[256];
    idiff_quantise(&wrong, 1, a);
    idiff_quantise(&p.render[1], 1, b);
    idiff_histogram(a, b, CELLS, count);
    assert_true(idiff_differs(count, CELLS, BLENDER_FAIL, BLENDER_PERCENT));
}

/* The page in the repository is what its record gives, byte for byte; the record was made with the
 * settings, scenes and rules of the code; and its figures can be: intervals hold their estimate, and
 * each bias is found in 95 % of the 200 pairs when a rule is asked again. */
TEST(test_page)
{
    static struct anchor_results r;
    struct err e = {""};
    MUST(anchors_load("tests/studies/anchors/results.json", &r, &e));
    const struct anchor_settings *got = &r.settings, *want = &anchor_settings;
    assert_int_equal(got->side, want->side);
    assert_int_equal(got->spp, want->spp);
    assert_int_equal(got->reference_spp, want->reference_spp);
    assert_int_equal(got->num_tune, want->num_tune);
    assert_int_equal(got->num_pairs, want->num_pairs);
    assert_int_equal(got->seed, want->seed);
    assert_near(got->tuned, want->tuned, 0);
    assert_near(got->power, want->power, 0);
    assert_int_equal(r.num_scenes, NUM_ANCHOR_SCENES);
    for (int s = 0; s < r.num_scenes; s++) {
        assert_string_equal(r.scene[s].scene, anchor_scenes[s]);
        for (int k = 0; k < NUM_ANCHOR_RULES; k++)
            for (int i = 0; i < NUM_ANCHOR_ERRORS; i++) {
                const struct anchor_bias *b = &r.scene[s].rule[k].bias[i];
                assert_true(b->lo <= b->b && b->b <= b->hi);
                if (isfinite(b->b) && b->found < 190)
                    fail_msg("%s, %s: %s is found in %d pairs only", anchor_scenes[s],
                             anchor_rules[k].id, anchor_error_id[i], b->found);
            }
    }
    assert_true(fs_make_dirs(test_path("page"), &e));
    MUST(anchors_write_page(test_path("page"), &r, &e));
    static const char *const files[] = {"README.md", "global.svg", "bounced.svg", "region.svg"};
    for (size_t i = 0; i < COUNT(files); i++) {
        OWN_TEXT a = test_read(fs_path("%s/%s", test_path("page"), files[i]).s);
        OWN_TEXT b = test_read(fs_path("tests/studies/anchors/%s", files[i]).s);
        if (strcmp(a, b) != 0)
            fail_msg("%s is not what results.json gives: make_anchors --page tests/studies/anchors",
                     files[i]);
    }
}

/* A damaged record gives an error line, not a page. */
TEST(test_damaged_record)
{
    static struct anchor_results r;
    struct err e = {""};
    const char *path = test_path("results.json");
    static const char *const bad[] = {"", "{", "{\"settings\": {}}", "[]"};
    for (size_t i = 0; i < COUNT(bad); i++) {
        test_write(path, bad[i], strlen(bad[i]));
        REFUSES(anchors_load(path, &r, &e), path);
    }
    assert_int_equal(unlink(path), 0);
    assert_false(anchors_load(path, &r, &e));
}
