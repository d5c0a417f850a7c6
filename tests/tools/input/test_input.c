/* tools/input/input.c and what reads for it: each kind of side against numbers worked by hand, and what must
 * be refused. What the spatial variance is worth: test_noise_estimate.c. */
#include "odd_images.h"
#include "tests/support/simulate.h"

#include "renderer/image/image_oiio.h"
#include "renderer/base/fs.h"
#include "tools/images/tone_curve.h"
#include "tools/input/input_pairs.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

static void write_floats(const char *path, int width, int height, int channels,
                         const char *const *names, const float *v)
{
    OWN(image) im;
    struct err e;
    MUST(image_alloc(&im, width, height, channels, names, &e));
    memcpy(im.data, v, (size_t)(width * height * channels) * sizeof *v);
    MUST(image_write_exr(path, &im, &e));
}

static const char *const rgb_names[3] = {"R", "G", "B"};

static struct input read_side(const char *path, struct input_options opt, struct notes *notes)
{
    struct input in;
    struct err e;
    MUST(input_read(path, 'a', &opt, &in, notes, &e));
    return in;
}

static void assert_refused(const char *path, struct input_options opt, const char *part)
{
    struct input in;
    struct notes notes = {0};
    struct err e;
    REFUSES(input_read(path, 'a', &opt, &in, &notes, &e), part);
}

static bool has_note(const struct notes *notes, const char *part)
{
    for (int i = 0; i < notes->num; i++)
        if (strstr(notes->line[i], part) != NULL)
            return true;
    return false;
}

/* Three replicates of 2 x 1 pixels. First pixel: red 1, 2, 6: mean 3, M2 = 4 + 1 + 9 = 14, M3 = -8 -
 * 1 + 27 = 18; green always 5; blue 0, 0, 3: mean 1, M2 = 6, M3 = -1 - 1 + 8 = 6. */
TEST(test_directory)
{
    struct err e;
    struct notes notes = {0};
    static const float v[3][6] = {{1, 5, 0, 7, 7, 7}, {2, 5, 0, 7, 7, 7}, {6, 5, 3, 7, 7, 7}};
    assert_true(fs_make_dirs(test_path("runs"), &e));
    write_floats(test_path("runs/s1.exr"), 2, 1, 3, rgb_names, v[0]);
    odd_pfm(test_path("runs/s2.pfm"), 2, 1, v[1]);
    odd_file(test_path("runs/.hidden"), "not looked at");
    assert_refused(test_path("runs"), (struct input_options){0}, "at least 3");
    write_floats(test_path("runs/s3.exr"), 2, 1, 3, rgb_names, v[2]);
    OWN(input) in = read_side(test_path("runs"), (struct input_options){0}, &notes);
    assert_int_equal(in.kind, INPUT_REPLICATES);
    assert_string_equal(in.m.unit, "replicate");
    assert_true(has_note(&notes, "3 replicates"));
    static const double mean[3] = {3, 5, 1}, m2[3] = {14, 0, 6}, m3[3] = {18, 0, 6};
    for (int c = 0; c < 3; c++) {
        assert_near(in.m.mean[c], mean[c], 1e-12);
        assert_near(in.m.m2[c], m2[c], 1e-12);
        assert_near(in.m.m3[c], m3[c], 1e-12);
    }
    assert_near(in.m.n[0], 3, 0);

    write_floats(test_path("runs/s4.exr"), 2, 1, 3, rgb_names, v[0]);
    assert_refused(test_path("runs"), (struct input_options){0},
                   "s1.exr and s4.exr are the same image: the seed was ignored");
    write_floats(test_path("runs/s4.exr"), 1, 2, 3, rgb_names, v[0]);
    assert_refused(test_path("runs"), (struct input_options){0},
                   "is 1 x 2 pixels, s1.exr is 2 x 1");
    odd_exr(test_path("runs/s4.exr"), 2, 1, "BGR", true, v[0]);
    assert_refused(test_path("runs"), (struct input_options){0}, "32-bit floats");
    odd_png(test_path("runs/s4.exr"), 2, 1, 3, 8, (uint16_t[6]){1, 2, 3, 4, 5, 6});
    assert_refused(test_path("runs"), (struct input_options){0}, "32-bit floats");
    odd_file(test_path("runs/s4.exr"), "no image");
    assert_refused(test_path("runs"), (struct input_options){0}, "s4.exr: cannot read");
    assert_int_equal(unlink(test_path("runs/s4.exr")), 0);
    input_free(&in);
    in = read_side(test_path("runs"), (struct input_options){.spp = 4}, &notes);
    assert_true(in.m.spp == 4);
}

/* A is 1, 2, 6 and B 1, 3, 2 in one channel, so A - B is 0, -1, 4, and B's mean 2: the pairs are 2, 1, 6, of mean 3, M2 =
 * 1 + 4 + 9 and M3 = -1 - 8 + 27. In the others both sides are the same; of the same renders nothing has noise. */
TEST(pairs_of_renders)
{
    enum { PIXELS = 64 * 64 };
    static const float a[3][3] = {{1, 5, 0.5f}, {2, 5, 0.25f}, {6, 5, 3}},
                       b[3][3] = {{1, 5, 0.5f}, {3, 5, 0.25f}, {2, 5, 3}};
    static float pixels[2][3][3 * PIXELS];
    static const char *const path[2] = {"new", "old"};
    char *name[2][3] = {{"1.exr", "2.exr", "3.exr"}, {"1.exr", "2.exr", "3.exr"}};
    float *image[2][3];
    struct replicate_dir r[2];
    for (int i = 0; i < 2; i++) {
        for (int k = 0; k < 3; k++) {
            image[i][k] = pixels[i][k];
            for (int p = 0; p < 3 * PIXELS; p++)
                pixels[i][k][p] = (i ? b : a)[k][p % 3];
        }
        r[i] = (struct replicate_dir){
            .num = 3, .width = 64, .height = 64, .rgb = image[i], .name = name[i]};
    }
    struct err e;
    for (int same = 0; same < 2; same++) {
        struct input in[2];
        struct notes notes = {0};
        MUST(input_pairs_of_renders(path, same ? (struct replicate_dir[2]){r[1], r[1]} : r, in,
                                    &notes, &e));
        assert_true(has_note(&notes, same ? "the same to the bit" : "3 renders, each compared"));
        assert_string_equal(in[1].m.unit, "exact");
        assert_string_equal(in[0].m.unit, same ? "exact" : "replicate");
        static const double mean[2][3] = {{3, 5, 1.25}, {2, 5, 1.25}};
        for (int i = 0; i < 3 * PIXELS; i++) {
            assert_near(in[0].m.mean[i], mean[same][i % 3], 1e-12);
            assert_near(in[1].m.mean[i], mean[1][i % 3], 1e-12);
            assert_near(in[0].m.m2[i], i % 3 == 0 && !same ? 14 : 0, 1e-12);
            assert_near(in[0].m.m3[i], i % 3 == 0 && !same ? 18 : 0, 1e-12);
            assert_true(in[1].m.m2[i] == 0);
        }
        input_free(&in[0]);
        input_free(&in[1]);
    }
    struct input in[2];
    struct notes notes = {0};
    name[1][2] = "4.exr";
    REFUSES(input_pairs_of_renders(path, r, in, &notes, &e), "new/3.exr and old/4.exr");
    r[1].num = 2;
    REFUSES(input_pairs_of_renders(path, r, in, &notes, &e), "new has 3 renders, old has 2");
}

/* Renders that are moments EXR say how many paths they have: here 5 samples of a path each, and 7 in the last. */
TEST(renders_state_their_paths)
{
    struct err e;
    struct notes notes = {0};
    assert_true(fs_make_dirs(test_path("own"), &e));
    for (int k = 0; k < 3; k++) {
        OWN(moments) m = new_moments(2, 1, "sample");
        for (int i = 0; i < (k < 2 ? 5 : 7); i++)
            for (size_t p = 0; p < 2; p++)
                moments_add(&m, p, (double[]){1 + k + i, 2, 3});
        const char name[] = {'o', 'w', 'n', '/', (char)('0' + k), '.', 'e', 'x', 'r', '\0'};
        MUST(moments_write(test_path(name), &m, NULL, 0, &e));
    }
    OWN(input) in = read_side(test_path("own"), (struct input_options){0}, &notes);
    assert_near(in.m.spp, 17.0 / 3, 1e-6);
    assert_refused(test_path("own"), (struct input_options){.spp = 4},
                   "--spp-a: its renders say themselves");
}

enum { ROWS = 0, TILES = -8 };
/* `count` renders of 32 x 32 pixels, each the mean of `side` x `side` normal draws of mean 1 that it shares with its
 * neighbours; ROWS: one of its own, and half of one of its row; TILES: one that every eighth pixel has, too. */
static struct replicate_dir shared_renders(int count, int side, uint64_t *seed)
{
    enum { SIDE = 32, MOST = 16 };
    struct replicate_dir r = {.num = count, .width = SIDE, .height = SIDE};
    r.rgb = calloc((size_t)count, sizeof *r.rgb);
    r.name = calloc((size_t)count, sizeof *r.name);
    for (int k = 0; k < count; k++) {
        static double fine[SIDE + MOST][SIDE + MOST];
        for (int i = 0; i < (SIDE + MOST) * (SIDE + MOST); i++)
            fine[i / (SIDE + MOST)][i % (SIDE + MOST)] = 1 + 0.3 * draw_normal(uniform(seed), seed);
        r.rgb[k] = calloc(3 * SIDE * SIDE, sizeof **r.rgb);
        for (int p = 0; p < SIDE * SIDE; p++)
            for (int c = 0; c < 3; c++) {
                float *value = &r.rgb[k][3 * p + c];
                for (int i = 0; i < side * side && side > 0; i++)
                    *value +=
                        (float)(fine[p / SIDE + i / side][p % SIDE + i % side] / (side * side));
                if (side == ROWS)
                    *value = (float)(fine[p / SIDE][p % SIDE] + fine[p / SIDE][SIDE] / 2);
                else if (side == TILES)
                    *value = (float)fine[p / SIDE % 8][p % SIDE % 8];
            }
    }
    return r;
}

/* Compares two such folders, if they can be; with `naive` as if pixels were independent. */
static bool compare_shared(int side, bool naive, uint64_t *seed, enum verdict *verdict,
                           struct err *why)
{
    struct notes notes = {0};
    struct err e;
    struct input in[2];
    for (int i = 0; i < 2; i++) {
        struct replicate_dir r = shared_renders(8, side, seed);
        const struct input_memory memory = {.renders = r, .type = IMAGE_FLOAT};
        MUST(input_take(
            &memory, "renders", "ab" [i], &(struct input_options) { 0 }, &in[i], &notes, &e));
        if (naive)
            in[i].sharing = 0;
        replicate_dir_free(&r);
    }
    struct comparison c;
    const struct compare_options opt = {.alpha = 0.05, .tile = 16, .threads = 1};
    bool ok = input_pair(&in[0], &in[1], false, &notes, why) &&
              compare_moments(&in[0].m, &in[1].m, &opt, &c, why);
    if (ok) {
        assert_int_equal(has_note(&notes, "share noise, as by a pixel filter or"), !naive);
        /* What takes neighbours for independent is left out. */
        assert_int_equal(c.statistic[STATISTIC_MATCHED_FILTER].share > 0, naive);
        assert_int_equal(c.variance.valid, naive);
        *verdict = c.verdict;
        comparison_free(&c);
    }
    input_free(&in[0]);
    input_free(&in[1]);
    return ok;
}

/* H0: two folders of 8 equal renders under a box filter of two pixels, or whose noise rows or tiles share, alpha 5 %: at most
 * Binomial(60, 5 %) are DIFFERENT, more than 10 with a probability of 2e-4. Control: with pixels taken for independent, sums
 * have at most half their standard error, and more than half of 20 pairs are. Renders smoothed over a quarter of the
 * image are refused. */
TEST(replicates_that_share_noise)
{
    static const int kinds[] = {2, ROWS, TILES};
    uint64_t seed = 41;
    struct err e;
    for (size_t kind = 0; kind < sizeof kinds / sizeof *kinds; kind++) {
        int different[2] = {0};
        for (int naive = 0; naive < 2; naive++)
            for (int i = 0; i < (naive ? 20 : 60); i++) {
                enum verdict v = VERDICT_INCONCLUSIVE;
                MUST(compare_shared(kinds[kind], naive, &seed, &v, &e));
                different[naive] += v == VERDICT_DIFFERENT;
            }
        printf("shared noise %d: DIFFERENT in %d of 60, and in %d of 20 as if independent\n",
               kinds[kind], different[0], different[1]);
        assert_in_range(different[0], 0, 10);
        assert_in_range(different[1], 11, 20);
    }
    enum verdict v = VERDICT_INCONCLUSIVE;
    REFUSES(compare_shared(16, false, &seed, &v, &e), "--exchangeable compares whole images");
}

/* A render that is nearly another one, or that holds half of its samples, is refused; so is a folder in which each goes on
 * from the one before. (Folders of independent renders are taken: the test before.) */
TEST(replicates_that_share_samples)
{
    enum { COUNT = 8, VALUES = 3 * 32 * 32 };
    static const struct {
        double share;
        bool all;
    } cases[] = {{0.999999, false}, {0.5, false}, {0.5, true}};
    uint64_t seed = 43;
    struct notes notes = {0};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct replicate_dir r = shared_renders(COUNT, 1, &seed);
        for (int j = cases[k].all ? 1 : 5; j < (cases[k].all ? COUNT : 6); j++)
            for (int i = 0; i < VALUES; i++)
                r.rgb[j][i] =
                    (float)(cases[k].share * r.rgb[j - 1][i] + (1 - cases[k].share) * r.rgb[j][i]);
        const struct input_memory memory = {.renders = r, .type = IMAGE_FLOAT};
        struct input in;
        struct err e;
        REFUSES(input_take(&memory, "renders", 'a', &(struct input_options){0}, &in, &notes, &e),
                cases[k].all ? "share noise" : "renders 5 and 6 share noise (correlation");
        replicate_dir_free(&r);
    }
}

/* 1 x 1 pixel, n = 100. X: E[x] = 2, E[x^2] = 5: variance 1 of one sample with n below, M2 = 100.
 * Y: 1, 1: none. Z: 3, 13: 4, M2 = 400. v = 1/99 and 4/99. One pixel tells nothing of skewness: the bound is
 * V^1.5 (third_moment.h). */
TEST(test_mitsuba_integrator)
{
    static const char *const names[9] = {"R",      "G",         "B",         "path.X",   "path.Y",
                                         "path.Z", "m2_path.X", "m2_path.Y", "m2_path.Z"};
    static const float v[9] = {1, 1, 1, 2, 1, 3, 5, 1, 13};
    struct notes notes = {0};
    struct err e;
    write_floats(test_path("moment.exr"), 1, 1, 9, names, v);
    OWN(input) in = read_side(test_path("moment.exr"), (struct input_options){.spp = 100}, &notes);
    assert_int_equal(in.kind, INPUT_VARIANCE);
    assert_true(in.is_xyz && has_note(&notes, "no skewness") && has_note(&notes, "box filter"));
    static const double mean[3] = {2, 1, 3}, m2[3] = {100, 0, 400};
    for (int c = 0; c < 3; c++) {
        assert_near(in.m.mean[c], mean[c], 1e-6);
        assert_near(in.m.m2[c], m2[c], 1e-3);
    }
    /* Paired with moments: k3 = B's and the bound. B becomes XYZ: red 1, M2 4: X = .412453, M2 = .412453^2 4, so
     * v = M2/90, k3 = M3/720. */
    struct input b = {.kind = INPUT_MOMENTS, .m = new_moments(1, 1, "sample")};
    b.m.n[0] = 10;
    b.m.mean[0] = 1;
    b.m.m2[0] = 4;
    b.m.m3[0] = 8;
    assert_true(input_pair(&in, &b, false, &notes, &e));
    assert_true(has_note(&notes, "X, Y and Z"));
    double moved = pow(0.412453, 2) * 4 / 90, per_k3 = 100 * 99 * 98;
    assert_near(in.m.m3[0] / per_k3, pow(0.412453, 3) * 8 / 720 + pow(1.0 / 99 + moved, 1.5), 1e-8);
    assert_near(b.m.mean[0], 0.412453, 1e-12);
    assert_near(b.m.m2[0], 0.412453 * 0.412453 * 4, 1e-12);
    assert_near(b.m.m3[0], pow(0.412453, 3) * 8, 1e-12);
    input_free(&b);
    /* Two of a kind, V = 2 v: k3A - k3B = V^1.5, and as R = 1, k3A^2 + k3B^2 = V^2 v: half of it each. */
    b = read_side(test_path("moment.exr"), (struct input_options){.spp = 100}, &notes);
    assert_true(input_pair(&in, &b, false, &notes, &e));
    assert_near(in.m.m3[0] / per_k3, pow(2.0 / 99, 1.5) / 2, 1e-8);
    assert_near(b.m.m3[0] / per_k3, -pow(2.0 / 99, 1.5) / 2, 1e-8);
    input_free(&b);

    assert_refused(test_path("moment.exr"), (struct input_options){0}, "--spp-a");
    static const char *const two[6] = {"a.X", "m2_a.X", "b.X", "m2_b.X", "R", "G"};
    write_floats(test_path("two.exr"), 1, 1, 6, two, v);
    assert_refused(test_path("two.exr"), (struct input_options){.spp = 9}, "several integrators");
    write_floats(test_path("less.exr"), 1, 1, 8, names, v);
    assert_refused(test_path("less.exr"), (struct input_options){.spp = 9}, "not m2_path.Z");
    static const float negative[9] = {1, 1, 1, 2, 1, 3, 3, 1, 13};
    write_floats(test_path("neg.exr"), 1, 1, 9, names, negative);
    assert_refused(test_path("neg.exr"), (struct input_options){.spp = 9}, "negative variance");
    static const char *const pbrt[4] = {"R", "G", "B", "Variance.R"};
    write_floats(test_path("pbrt.exr"), 1, 1, 4, pbrt, v);
    assert_refused(test_path("pbrt.exr"), (struct input_options){.spp = 9}, "pbrt");
}

/* Exponential samples, mean `scale` against 1, in the first `pixels` of 32 x 32; in the others none varies. M3 is forgotten. */
static enum verdict compare_without_skewness(int n, double scale, int pixels, uint64_t *state)
{
    OWN(input) a = {.kind = INPUT_VARIANCE, .is_xyz = true, .m = new_moments(32, 32, "sample")};
    OWN(input) b = {.kind = INPUT_VARIANCE, .is_xyz = true, .m = new_moments(32, 32, "sample")};
    struct notes notes = {0};
    OWN(comparison) c;
    struct compare_options opt = {.alpha = 0.05, .tile = 32};
    struct err e;
    simulate(&a.m, LAW_EXPONENTIAL, scale, n, true, state);
    simulate(&b.m, LAW_EXPONENTIAL, 1, n, true, state);
    for (int i = 0; i < 3 * 32 * 32; i++)
        a.m.m3[i] = b.m.m3[i] = 0;
    for (int i = 3 * pixels; i < 3 * 32 * 32; i++) {
        a.m.mean[i] = b.m.mean[i] = 1;
        a.m.m2[i] = b.m.m2[i] = 0;
    }
    if (!input_pair(&a, &b, false, &notes, &e) || !compare_moments(&a.m, &b.m, &opt, &c, &e))
        fail_msg("%s", e.msg);
    return c.verdict;
}

/* With 15 noisy pixels the skewness is unknown: |g| = 1/sqrt 15, far above 0.2 x 3/x^3 = 0.02 (x about 3.3 at 5 %
 * over four tests), so 50 % more light is not found. With all 1024, n = 128, 3 % is: sd sqrt(2/131072) = 0.4 %. H0,
 * equal means: at most 9 of 60 DIFFERENT (more have a probability of about 1e-3 at a true 5 %). */
TEST(test_unknown_skewness)
{
    uint64_t seed = 12;
    int different = 0;
    assert_int_equal(compare_without_skewness(8, 1.5, 15, &seed), VERDICT_INCONCLUSIVE);
    for (int i = 0; i < 60; i++)
        different += compare_without_skewness(128, 1, 1024, &seed) == VERDICT_DIFFERENT;
    assert_true(different <= 9);
    for (int i = 0; i < 10; i++)
        assert_int_equal(compare_without_skewness(128, 1.03, 1024, &seed), VERDICT_DIFFERENT);
}

/* A reference and its variance: R, G, B of the variance are the matrix' inverse times Var X, Y, Z. With
 * red alone 1 in both: mean and variance (.412453, .212671, .019334); n = 50. */
TEST(test_mitsuba_reference)
{
    static const float red[3] = {1, 0, 0};
    struct notes notes = {0};
    write_floats(test_path("ref.exr"), 1, 1, 3, rgb_names, red);
    write_floats(test_path("ref_var.exr"), 1, 1, 3, rgb_names, red);
    struct input in = read_side(test_path("ref.exr"), (struct input_options){.spp = 50}, &notes);
    static const double xyz[3] = {0.412453, 0.212671, 0.019334};
    assert_int_equal(in.kind, INPUT_VARIANCE);
    assert_true(has_note(&notes, "ref_var.exr"));
    for (int c = 0; c < 3; c++) {
        assert_near(in.m.mean[c], xyz[c], 1e-6);
        assert_near(in.m.m2[c], 50 * xyz[c], 1e-4);
    }
    input_free(&in);
    assert_refused(test_path("ref.exr"), (struct input_options){0}, "--spp-a");
    write_floats(test_path("ref_var.exr"), 1, 2, 3, rgb_names, (float[6]){1, 0, 0, 1, 0, 0});
    assert_refused(test_path("ref.exr"), (struct input_options){.spp = 9}, "is 1 x 2 pixels");
    /* A bright constant: squares of 100 have float32 steps of 8e-6 and sums of them lose more. */
    write_floats(test_path("ref.exr"), 1, 1, 3, rgb_names, (float[3]){10, 10, 10});
    write_floats(test_path("ref_var.exr"), 1, 1, 3, rgb_names, (float[3]){-6e-5f, -6e-5f, -6e-5f});
    in = read_side(test_path("ref.exr"), (struct input_options){.spp = 50}, &notes);
    assert_true(in.m.m2[0] == 0 && has_note(&notes, "3 variances are below 0 by rounding"));
    input_free(&in);
    write_floats(test_path("ref_var.exr"), 1, 1, 3, rgb_names, (float[3]){-0.1f, -0.1f, -0.1f});
    assert_refused(test_path("ref.exr"), (struct input_options){.spp = 50}, "negative variance");
    assert_int_equal(unlink(test_path("ref_var.exr")), 0);
}

/* Codes and what they stand for, by the curves' definitions. sRGB: code 255 x 0.5 = 127.5 is 0.214041
 * (IEC 61966-2-1). */
TEST(test_curves)
{
    struct curve c;
    struct err e;
    double lo, hi;
    assert_true(tone_curve_parse("srgb", &c, &e));
    assert_near(tone_curve_decode(&c, 0.5), 0.21404114, 1e-8);
    assert_near(tone_curve_decode(&c, 0.04), 0.04 / 12.92, 1e-15);
    assert_near(tone_curve_decode(&c, 1), 1, 1e-15);
    assert_true(tone_curve_parse("linear", &c, &e));
    tone_curve_bin(&c, 100, 255, &lo, &hi);
    assert_near(lo, 99.5 / 255, 1e-15);
    assert_near(hi, 100.5 / 255, 1e-15);
    assert_true(tone_curve_parse("gamma=2", &c, &e));
    tone_curve_bin(&c, 10, 65535, &lo, &hi);
    assert_near(hi - lo, (10.5 * 10.5 - 9.5 * 9.5) / 65535.0 / 65535.0, 1e-18);
    assert_true(tone_curve_parse("cgl", &c, &e)); /* cut off: code 51 is all of (51..52)/255 */
    tone_curve_bin(&c, 51, 255, &lo, &hi);
    assert_near(lo, pow(0.2, 2.2) / sqrt(2), 1e-15);
    assert_near(hi, pow(52.0 / 255, 2.2) / sqrt(2), 1e-15);
    /* Scotty3D's: L = ln(2)/2 at an exposure of 2 is 1 - 1/2, the sRGB code of which is 0.735357 (IEC 61966-2-1); of the
     * last code nothing is known but that it is bright: (254.5/255 as radiance) 0.9955 leaves 0.0045. */
    assert_true(tone_curve_parse("exposure=2", &c, &e));
    assert_near(tone_curve_decode(&c, 0.735356983052449), log(2) / 2, 1e-12);
    assert_near(tone_curve_decode(&c, 0), 0, 1e-15);
    tone_curve_bin(&c, 255, 255, &lo, &hi);
    assert_near(lo, -log(1 - pow((254.5 / 255 + 0.055) / 1.055, 2.4)) / 2, 1e-12);
    assert_true(isinf(hi));
    static const char *const bad[] = {"",        "rec709",   "gamma",     "gamma=",    "gamma=0",
                                      "gamma=x", "exposure", "exposure=", "exposure=0"};
    for (size_t i = 0; i < COUNT(bad); i++)
        assert_false(tone_curve_parse(bad[i], &c, &e));
}

/* Linear, 16 bits, code 1000: mean 1000/65535, +- half a step, step^2/12. A grey PNG is all three. */
TEST(test_codes)
{
    struct notes notes = {0};
    struct input_options opt = {.curve = "linear"};
    odd_png(test_path("deep.png"), 2, 1, 3, 16, (uint16_t[6]){1000, 1, 65534, 0, 5, 5});
    struct input in = read_side(test_path("deep.png"), opt, &notes);
    double step = 1 / 65535.0;
    assert_int_equal(in.kind, INPUT_IMAGE);
    assert_near(in.m.mean[0], 1000 * step, 1e-9);
    assert_near(in.m.tolerance[0], step / 2, 1e-12);
    assert_near(in.rounding[0], step * step / 12, 1e-18);
    assert_true(!in.censored[0] && !in.censored[1]);
    assert_near(in.m.mean[3], step / 4, 1e-12); /* code 0: from 0 to half a code */
    assert_near(in.m.tolerance[3], step / 4, 1e-12);
    input_free(&in);
    odd_png(test_path("grey.png"), 3, 1, 1, 8, (uint16_t[3]){51, 255, 254});
    in = read_side(test_path("grey.png"), opt, &notes);
    for (int c = 0; c < 3; c++)
        assert_near(in.m.mean[c], 0.2, 1e-12);
    assert_true(!in.censored[0] && in.censored[1] && !in.censored[2]);
    assert_true(has_note(&notes, "half a code"));
    input_free(&in);
    assert_refused(test_path("grey.png"), (struct input_options){0}, "--curve");
    assert_refused(test_path("grey.png"), (struct input_options){.curve = "film"}, "none of");
    odd_png(test_path("clear.png"), 1, 1, 4, 8, (uint16_t[4]){9, 9, 9, 128});
    assert_refused(test_path("clear.png"), opt, "not opaque");
    odd_png(test_path("opaque.png"), 1, 1, 4, 8, (uint16_t[4]){9, 9, 9, 255});
    in = read_side(test_path("opaque.png"), opt, &notes);
    input_free(&in);
    /* PPM, as text and as bytes ("3f" is 51, 102, 153), from the top down; coarser codes are refused. */
    static const char *const ppm[] = {"P3\n# by a tracer\n1 2 255\n51 102 153\n255 254 0\n",
                                      "P6 1 2\n#\n255\n3f\x99\xff\xfe\x01"};
    for (int i = 0; i < 2; i++) {
        odd_file(test_path("two.ppm"), ppm[i]);
        in = read_side(test_path("two.ppm"), opt, &notes);
        for (int c = 0; c < 3; c++)
            assert_near(in.m.mean[c], 0.2 * (c + 1), 1e-7);
        assert_true(!in.censored[0] && in.censored[1]);
        input_free(&in);
    }
    odd_file(test_path("coarse.ppm"), "P3 1 1 31\n1 2 31\n");
    assert_refused(test_path("coarse.ppm"), opt, "brightest code of a PPM must be 255 or 65535");
    odd_file(test_path("short.ppm"), "P3 1 1");
    assert_refused(test_path("short.ppm"), opt, "short.ppm: ");
}

/* Half floats: 1.5 has 10 binary digits behind the point, so that half a step is 2^-11 of 2^0 <= v < 2^1;
 * at most 2^-11 v is said. RGBE (128, 64, 0, 129) is (1, 1/2, 0), steps of 2^-7. */
TEST(test_rounded_floats)
{
    struct notes notes = {0};
    odd_exr(test_path("half.exr"), 1, 1, "BGR", true, (float[3]){0, 2.5, 1.5});
    struct input in = read_side(test_path("half.exr"), (struct input_options){0}, &notes);
    assert_near(in.m.mean[0], 1.5, 0);
    assert_near(in.m.mean[1], 2.5, 0);
    assert_near(in.m.tolerance[0], 1.5 / 2048, 1e-15);
    assert_near(in.rounding[0], pow(1.5 / 1024, 2) / 12, 1e-15);
    assert_true(has_note(&notes, "half floats") && in.censored == NULL);
    input_free(&in);
    odd_hdr(test_path("one.hdr"), 1, 1, (const uint8_t[1][4]){{128, 64, 0, 129}});
    in = read_side(test_path("one.hdr"), (struct input_options){0}, &notes);
    assert_near(in.m.mean[0], 1, 1e-6);
    assert_near(in.m.mean[1], 0.5, 1e-6);
    for (int c = 0; c < 3; c++)
        assert_near(in.m.tolerance[c], 1.0 / 128, 1e-9);
    assert_true(has_note(&notes, "RGBE"));
    input_free(&in);
    /* PFM is stored from the bottom up. */
    odd_pfm(test_path("two.pfm"), 1, 2, (float[6]){1, 2, 3, 4, 5, 6});
    in = read_side(test_path("two.pfm"), (struct input_options){0}, &notes);
    assert_near(in.m.mean[0], 1, 0);
    assert_near(in.m.mean[5], 6, 0);
    assert_null(in.m.tolerance);
    input_free(&in);
}

/* The display window is the image: pixels outside the data window are 0 and need not be opaque, data outside the
 * display window is ignored. Data 3 x 2 from (9, 21), shown 4 x 3 from (10, 20): data columns 1 and 2 land in rows 1
 * and 2. */
TEST(test_cropped)
{
    struct notes notes = {0};
    float v[6][4];
    for (int p = 0; p < 6; p++)
        for (int c = 0; c < 4; c++)
            v[p][c] = c == 0 ? 1 : (float)(10 * p + c); /* A B G R */
    odd_exr_cropped(test_path("crop.exr"), (struct odd_window){9, 21, 3, 2},
                    (struct odd_window){10, 20, 4, 3}, "ABGR", false, v[0]);
    OWN(input) in = read_side(test_path("crop.exr"), (struct input_options){0}, &notes);
    assert_true(in.m.width == 4 && in.m.height == 3);
    for (int y = 0; y < 3; y++)
        for (int x = 0; x < 4; x++)
            for (int c = 0; c < 3; c++) {
                int p = 3 * (y - 1) + x + 1;
                assert_near(in.m.mean[3 * (4 * y + x) + c], y > 0 && x < 2 ? 10 * p + 3 - c : 0, 0);
            }
    assert_true(has_note(&notes, "stores 3 x 2 pixels at -1,1 of an image of 4 x 3"));
    odd_exr_cropped(test_path("crop.exr"), (struct odd_window){0, 0, 1, 1},
                    (struct odd_window){0, 0, 60000, 60000}, "ABGR", false, v[0]);
    assert_refused(test_path("crop.exr"), (struct input_options){0},
                   "more than this program takes");
}

TEST(test_hygiene)
{
    struct input_options none = {0};
    static const struct {
        const char *names;
        float v[4];
        const char *line;
    } cases[] = {
        {"ABGR", {.5f, 1, 1, 1}, "not opaque (alpha 0.5)"},
        {"BGR", {1, NAN, 1}, "pixel 0,0 is not a number"},
        {"BGR", {1, 1, INFINITY}, "infinite"},
        {"XYZ", {1, 1, 1}, "no channels R, G, B"},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        odd_exr(test_path("odd.exr"), 1, 1, cases[i].names, false, cases[i].v);
        assert_refused(test_path("odd.exr"), none, cases[i].line);
    }
    odd_exr(test_path("ok.exr"), 1, 1, "ABGR", false, (float[4]){1, 1, 1, 1});
    assert_refused(test_path("ok.exr"), (struct input_options){.spp = 4}, "--spp-a");
    struct notes notes = {0};
    struct input in = read_side(test_path("ok.exr"), none, &notes);
    input_free(&in);
    odd_file(test_path("words.exr"), "no image");
    assert_refused(test_path("words.exr"), none, "cannot read");
    assert_refused(test_path("gone.exr"), none, "gone.exr: cannot read");
    assert_refused(test_path("gone.exr"), none, "No such file");
}

/* 64 x 64 linear codes: noise of a few codes about 100 on both sides, but in a square of 12 x 12 A is
 * saturated at 255 and B is 30: a gross difference that can be neither found nor called equal. 144 of 4096
 * pixels are 3.5 %, less than 5 %, but 56 % of the tile of 16 x 16 at 0,0. */
static void fill_codes(uint16_t *code, int side, uint64_t *state)
{
    for (int i = 0; i < 3 * side * side; i++)
        code[i] = (uint16_t)lround(97 + 6 * uniform(state));
}

static enum verdict compare_files(const char *a, const char *b, struct compare_options opt,
                                  struct notes *notes, size_t *censored)
{
    struct input in[2];
    struct err e;
    OWN(comparison) c;
    struct input_options io = {.curve = "linear"};
    for (int i = 0; i < 2; i++)
        MUST(input_read(i ? b : a, "ab"[i], &io, &in[i], notes, &e));
    if (!input_pair(&in[0], &in[1], false, notes, &e) ||
        !compare_moments(&in[0].m, &in[1].m, &opt, &c, &e))
        fail_msg("%s", e.msg);
    input_limit(&in[0], opt.tile, &c);
    enum verdict v = c.verdict;
    *censored = in[0].num_censored;
    input_free(&in[0]);
    input_free(&in[1]);
    return v;
}

TEST(test_censored)
{
    static uint16_t a[3 * 64 * 64], b[3 * 64 * 64];
    const struct compare_options opt = {
        .alpha = 1e-3, .tile = 16, .margin_global = 0.05, .margin_tile = 0.2};
    uint64_t seed = 7;
    size_t censored;
    struct notes notes = {0};
    fill_codes(a, 64, &seed);
    fill_codes(b, 64, &seed);
    const char *pa = test_path("a.png"), *pb = test_path("b.png");
    odd_png(pa, 64, 64, 3, 8, a);
    odd_png(pb, 64, 64, 3, 8, b);
    assert_int_equal(compare_files(pa, pb, opt, &notes, &censored), VERDICT_EQUIVALENT);
    assert_int_equal(censored, 0);
    /* A black background is known as well as anything else: up to half a code. */
    const struct compare_options no_margin = {.alpha = 1e-3, .tile = 16};
    for (int i = 3 * 64 * 32; i < 3 * 64 * 64; i++)
        a[i] = b[i] = 0;
    odd_png(pa, 64, 64, 3, 8, a);
    odd_png(pb, 64, 64, 3, 8, b);
    assert_int_equal(compare_files(pa, pb, no_margin, &notes, &censored), VERDICT_NOTHING_FOUND);
    assert_int_equal(censored, 0);
    fill_codes(a + 3 * 64 * 32, 32, &seed);
    fill_codes(b + 3 * 64 * 32, 32, &seed);
    fill_codes(a + 3 * 64 * 48, 32, &seed);
    fill_codes(b + 3 * 64 * 48, 32, &seed);
    for (int y = 0; y < 12; y++)
        for (int x = 0; x < 12; x++)
            for (int c = 0; c < 3; c++) {
                a[3 * (64 * y + x) + c] = 255;
                b[3 * (64 * y + x) + c] = 30;
            }
    odd_png(pa, 64, 64, 3, 8, a);
    odd_png(pb, 64, 64, 3, 8, b);
    assert_int_equal(compare_files(pa, pb, opt, &notes, &censored), VERDICT_INCONCLUSIVE);
    assert_int_equal(censored, 144);
    assert_true(has_note(&notes, "144 of 4096"));
    /* A white background of both, here of the lower half, is equal as far as codes go and stops no verdict; a background of
     * which one channel is white does, and so does the square again. */
    static uint16_t white_a[3 * 64 * 64], white_b[3 * 64 * 64];
    for (int i = 0; i < 3 * 64 * 64; i++) {
        const bool square = i / 3 % 64 < 12 && i / 3 / 64 < 12;
        white_a[i] = square ? 100 + i % 2 : i < 3 * 64 * 32 ? a[i] : 255;
        white_b[i] = square ? 100 + i / 2 % 2 : i < 3 * 64 * 32 ? b[i] : 255;
    }
    odd_png(pa, 64, 64, 3, 8, white_a);
    odd_png(pb, 64, 64, 3, 8, white_b);
    assert_int_equal(compare_files(pa, pb, opt, &notes, &censored), VERDICT_EQUIVALENT);
    assert_int_equal(censored, 64 * 32);
    assert_int_equal(compare_files(pa, pb, no_margin, &notes, &censored), VERDICT_NOTHING_FOUND);
    for (int i = 3 * 64 * 32; i < 3 * 64 * 64; i += 3)
        white_b[i] = 200;
    odd_png(pb, 64, 64, 3, 8, white_b);
    assert_int_equal(compare_files(pa, pb, opt, &notes, &censored), VERDICT_INCONCLUSIVE);
    assert_int_equal(censored, 64 * 32);
    odd_png(pa, 64, 64, 3, 8, a);
    odd_png(pb, 64, 64, 3, 8, b);
    /* Spread over the tiles: 128 more, 272 are 6.6 %. */
    for (int i = 0; i < 128; i++)
        b[3 * (64 * 20 + 17 * i % (64 * 40)) + 1] = 255;
    odd_png(pb, 64, 64, 3, 8, b);
    assert_int_equal(compare_files(pa, pb, opt, &notes, &censored), VERDICT_INCONCLUSIVE);
    assert_int_equal(censored, 144 + 128);
    /* A difference outside is found all the same: 97 .. 103 codes and now 127 .. 133. */
    for (int i = 3 * 64 * 32; i < 3 * 64 * 64; i++)
        a[i] = (uint16_t)(a[i] + 30);
    odd_png(pa, 64, 64, 3, 8, a);
    assert_int_equal(compare_files(pa, pb, opt, &notes, &censored), VERDICT_DIFFERENT);
}

/* Rounding of half a code a side is allowed for: images one code apart show no difference, two codes apart
 * they do. Codes 100, 101, 102 of 255, margins of 0. Noise: one pixel in 16 is one code higher in A, other
 * pixels in B. */
TEST(test_rounding_is_no_difference)
{
    static uint16_t a[3 * 64 * 64], b[3 * 64 * 64];
    for (int step = 1; step <= 2; step++) {
        uint64_t seed = 11;
        for (int i = 0; i < 3 * 64 * 64; i++) {
            a[i] = (uint16_t)(100 + (uniform(&seed) < 1.0 / 16));
            b[i] = (uint16_t)(100 + step + (uniform(&seed) < 1.0 / 16));
        }
        odd_png(test_path("a.png"), 64, 64, 3, 8, a);
        odd_png(test_path("b.png"), 64, 64, 3, 8, b);
        struct notes notes = {0};
        size_t censored;
        const struct compare_options opt = {.alpha = 1e-3, .tile = 16};
        assert_int_equal(
            compare_files(test_path("a.png"), test_path("b.png"), opt, &notes, &censored),
            step == 1 ? VERDICT_NOTHING_FOUND : VERDICT_DIFFERENT);
    }
}
