/* The statistics of tools/compare/compare.c besides those of single regions: dense, directed, noise. Their sizes,
 * their power against closed forms, what they name, and what is refused. Seeds were fixed before
 * the first run and nothing is retried. Designs that were changed after it: the image is averaged over
 * pixels (edges sampled at points do not shift); the dense test has n = 1024, so that single pixels are
 * testable; amounts are told with uniform noise and more contrast; the noise test has a larger image of normal noise
 * and asks that every claim that could be tested is found; two laws were left out of the sizes for time, both
 * within 1 % before. Sizes: see test_compare_rates.c for what "at most alpha" means. */
#include "tests/support/rates.h"

#include "renderer/base/fs.h"
#include "tools/compare/error_modes.h"
#include "tools/compare/hint.h"
#include "tools/compare/variance_ratio.h"
#include "tools/stats/distributions.h"
#include "compare_must.h"

#include <gsl/gsl_cdf.h>
#include <gsl/gsl_randist.h>
#include <sys/resource.h>

/* Coloured waves around 0.6 (times contrast), a bright disc of up to 1.2, nothing symmetric: averaged over
 * the pixel whose upper left corner is at x, y of an image of side x side pixels. */
static double scene(double x, double y, int side, int channel, double contrast)
{
    enum { SUB = 8 };
    double sum = 0;
    for (int i = 0; i < SUB * SUB; i++) {
        double u = (x + (i % SUB + 0.5) / SUB) / side, v = (y + (i / SUB + 0.5) / SUB) / side;
        double wave = 0.5 * sin(5 * u + channel) * cos(4 * v + 0.5 * channel);
        double disc = pow(u - 0.4, 2) + pow(v - 0.3, 2) < 0.05 ? 0.9 : 0;
        sum += 0.6 * (1 + contrast * (wave + disc)) / (SUB * SUB);
    }
    return sum;
}

static void fill_scene(double *truth, int side, double contrast)
{
    for (int p = 0; p < side * side; p++)
        for (int c = 0; c < 3; c++)
            truth[3 * p + c] = scene(p % side, p / side, side, c, contrast);
}

/* n observations of every pixel, of mean truth[]; n = 0: exactly that. */
static void render(struct moments *m, enum law law, const double *truth, int n, bool grey,
                   uint64_t *seed)
{
    if (n > 0)
        simulate(m, law, 1, n, grey, seed);
    else
        constant(m, 1, 1);
    for (int i = 0; i < 3 * m->width * m->height; i++) {
        m->mean[i] *= truth[i];
        m->m2[i] *= truth[i] * truth[i];
        m->m3[i] *= truth[i] * truth[i] * truth[i];
    }
}

struct size_case {
    const char *name;
    enum law law;
    int n_a, n_b;
    bool grey;
};

/* H0: equal means and equal variances. Each statistic's own p <= 1 % in at most 1 % of 2000 claims, on an
 * image with edges and colours, 16 x 16, in which the noise is proportional to radiance. The interval
 * of the variance ratio holds 1 in at least its 98 %. A row in which a statistic
 * tests nothing says nothing about its size: dense and directed must test in all rows but those named. */
TEST(test_sizes)
{
    enum { SIDE = 16, CLAIMS = 2000 };
    static const struct size_case cases[] = {
        {"normal, 64 and 64, grey", LAW_NORMAL, 64, 64, true},
        {"normal, 64 and 16, RGB", LAW_NORMAL, 64, 16, false},
        {"exponential, 64 and 64", LAW_EXPONENTIAL, 64, 64, true},
        {"exponential, 256 and exact", LAW_EXPONENTIAL, 256, 0, true},
        {"90 % black, 64 and 64", LAW_BLACK, 64, 64, true},
        {"fireflies, 128 and exact", LAW_FIREFLY, 128, 0, true},
    };
    static double truth[3 * SIDE * SIDE];
    fill_scene(truth, SIDE, 0.7);
    for (size_t i = 0; i < COUNT(cases); i++) {
        const struct size_case *k = &cases[i];
        OWN(moments) a = new_moments(SIDE, SIDE, "sample");
        OWN(moments) b = new_moments(SIDE, SIDE, k->n_b > 0 ? "sample" : "exact");
        int wrong[NUM_STATISTICS] = {0}, tested[NUM_STATISTICS] = {0}, known = 0, missed = 0;
        uint64_t seed = 4000 + i;
        for (int claim = 0; claim < CLAIMS; claim++) {
            render(&a, k->law, truth, k->n_a, k->grey, &seed);
            render(&b, k->law, truth, k->n_b, k->grey, &seed);
            const struct compare_options opt = {.alpha = 0.01, .tile = 4, .margin_variance = 1e-9};
            OWN(comparison) c = compare(&a, &b, opt);
            for (int s = 0; s < NUM_STATISTICS; s++) {
                tested[s] += c.statistic[s].num_tests > 0;
                wrong[s] += c.statistic[s].log10_p <= -2;
            }
            known += c.variance.valid;
            missed += c.variance.valid && !(c.variance.lo <= 1 && c.variance.hi >= 1);
        }
        print_message("%-28s", k->name);
        for (int s = 0; s < NUM_STATISTICS; s++) {
            print_message(" %s %.2f %% (of %3.0f %%)", statistic_name[s], 100.0 * wrong[s] / CLAIMS,
                          100.0 * tested[s] / CLAIMS);
            assert_true(lower_bound(wrong[s], CLAIMS) <= 0.01);
        }
        print_message("; ratio misses %.2f %% of %d\n", 100.0 * missed / (known ? known : 1),
                      known);
        assert_true(lower_bound(missed, known) <= 0.02);
    }
}

/* P(noncentral chi-square >= x): a Poisson mixture of central ones. */
static double noncentral_q(double x, double k, double lambda)
{
    double sum = 0;
    for (int i = 0; i < 2000; i++)
        sum += gsl_ran_poisson_pdf((unsigned)i, lambda / 2) * gsl_cdf_chisq_Q(x, k + 2 * i);
    return sum;
}

/* Every pixel off by 1.06 standard errors, up or down by the toss of a fixed coin: 64 squares, noncentrality
 * 64 1.06^2 = 72, and the chance to exceed the threshold of 1 % times the share over 6 tests from the
 * noncentral chi-square (grey: the channels are one test). n = 1024: single pixels are
 * testable. Normal law, sd 0.3. Measured in 400 claims, within Clopper-Pearson of it. No pixel and no
 * region of them stands out: the pyramid finds it in less than a quarter as many. Control: without the
 * errors dense finds at most 1 %. */
TEST(test_dense_power)
{
    enum { SIDE = 8, N = 1024, CLAIMS = 400 };
    OWN(moments) a = new_moments(SIDE, SIDE, "sample"), b = new_moments(SIDE, SIDE, "sample");
    const double size = 1.06, se = 0.3 * sqrt(2.0 / N);
    uint64_t seed = 51, coin = 7;
    int found[2] = {0}, pyramid = 0;
    double level = 0, sign[SIDE * SIDE];
    for (int p = 0; p < SIDE * SIDE; p++)
        sign[p] = uniform(&coin) < 0.5 ? -1 : 1;
    for (int off = 0; off < 2; off++)
        for (int i = 0; i < CLAIMS; i++) {
            simulate_pair(&a, &b, LAW_NORMAL, N, true, &seed);
            for (int p = 0; off && p < 3 * SIDE * SIDE; p++)
                a.mean[p] += sign[p / 3] * size * se;
            OWN(comparison) c = compare(&a, &b, (struct compare_options){.alpha = 0.01, .tile = 4});
            const struct statistic *s = &c.statistic[STATISTIC_CHI_SQUARE];
            level = 0.01 * s->share;
            assert_int_equal(s->num_tests, 6);
            if (off && s->log10_p <= -6)
                assert_non_null(strstr(s->what, "64 regions of 1 x 1"));
            found[off] += s->log10_p <= log10(level);
            s = &c.statistic[STATISTIC_PYRAMID];
            pyramid += off && s->log10_p <= log10(0.01 * s->share);
            if (off && found[1] == 1 && pyramid == 0) {
                assert_int_equal(c.verdict, VERDICT_DIFFERENT);
                assert_non_null(strstr(c.reason, "together"));
            }
        }
    double x = gsl_cdf_chisq_Qinv(level / 6, SIDE * SIDE);
    double expected = noncentral_q(x, SIDE * SIDE, SIDE * SIDE * size * size);
    print_message(
        "dense: found %.1f %%, expected %.1f %%; pyramid %.1f %%; without errors %.1f %%\n",
        100.0 * found[1] / CLAIMS, 100 * expected, 100.0 * pyramid / CLAIMS,
        100.0 * found[0] / CLAIMS);
    assert_true(lower_bound(found[1], CLAIMS) <= expected);
    assert_true(upper_bound(found[1], CLAIMS) >= expected);
    assert_true(lower_bound(found[0], CLAIMS) <= 0.01);
    assert_true(4 * pyramid < found[1]);
}

/* Every pixel may be off by the margin. With 5 % in each, up or down at random, and margins of 5 %, H0 holds for
 * pixels and tiles of 4, though not without margins. Dense rejects in at most 1 % of 500 claims. Control: with
 * margins of 1 % more than 98 % are found, as pixels exceed them by 0.04/0.0265 = 1.5 standard errors, with these signs
 * (others may cancel in more of the regions that are tested). */
TEST(test_dense_margin)
{
    enum { SIDE = 16, N = 256, CLAIMS = 500 };
    OWN(moments) a = new_moments(SIDE, SIDE, "sample"), b = new_moments(SIDE, SIDE, "sample");
    uint64_t seed = 61, coin = 7;
    int found[2] = {0};
    double sign[SIDE * SIDE];
    for (int p = 0; p < SIDE * SIDE; p++)
        sign[p] = uniform(&coin) < 0.5 ? -1 : 1;
    for (int i = 0; i < CLAIMS; i++) {
        simulate_pair(&a, &b, LAW_NORMAL, N, true, &seed);
        for (int p = 0; p < 3 * SIDE * SIDE; p++)
            a.mean[p] += 0.05 * sign[p / 3];
        for (int narrow = 0; narrow < 2; narrow++) {
            double margin = narrow ? 0.01 : 0.05;
            const struct compare_options opt = {
                .alpha = 0.01, .tile = 4, .margin_global = margin, .margin_tile = margin};
            OWN(comparison) c = compare(&a, &b, opt);
            const struct statistic *s = &c.statistic[STATISTIC_CHI_SQUARE];
            found[narrow] += s->num_tests > 0 && s->log10_p <= -2;
        }
    }
    assert_true(lower_bound(found[0], CLAIMS) <= 0.01);
    assert_true(found[1] > 0.98 * CLAIMS);
}

/* What each bug does to the image of fill_scene(). */
static double bugged(const double *truth, int side, int bug, int x, int y, int c)
{
    static const int swap[3][3] = {{2, 1, 0}, {1, 0, 2}, {0, 2, 1}};
    double own = truth[3 * (y * side + x) + c];
    switch (bug) {
    case 0: return 1.06 * own;
    case 1: return own + 0.04;
    case 2: return pow(own, 1.15);
    case 3: return scene(x - 0.4, y, side, c, 1);
    case 4: return scene(x, y - 0.4, side, c, 1);
    case 5: return truth[3 * (y * side + side - 1 - x) + c];
    case 6: return truth[3 * ((side - 1 - y) * side + x) + c];
    case 7: return truth[3 * ((side - 1 - y) * side + side - 1 - x) + c];
    case 8: return truth[3 * (x * side + y) + c];
    case 9:
    case 10:
    case 11: return truth[3 * (y * side + x) + swap[bug - 9][c]];
    case 12: return fmin(own, 1);
    default: return own;
    }
}

/* That comparison again on three threads: the same to the bit. */
static void check_threads(const struct moments *a, const struct moments *b,
                          const struct comparison *one)
{
    struct err e;
    OWN(comparison)
    c = compare(a, b, (struct compare_options){.alpha = 1e-3, .tile = 8, .threads = 3});
    MUST(hint_add(a, b, 3, &c, &e));
    const size_t tiles = (size_t)c.tiles_x * (size_t)c.tiles_y,
                 pixels = (size_t)a->width * (size_t)a->height;
    assert_string_equal(c.reason, one->reason);
    assert_memory_equal(&c.hint.removed, &one->hint.removed, sizeof c.hint.removed);
    assert_int_equal(c.num_tests, one->num_tests);
    for (int s = 0; s < NUM_STATISTICS; s++) {
        assert_memory_equal(&c.statistic[s].log10_p, &one->statistic[s].log10_p, sizeof(double));
        assert_string_equal(c.statistic[s].what, one->statistic[s].what);
    }
    for (int i = 0; i < 4; i++)
        assert_memory_equal(&c.global[i].mdb, &one->global[i].mdb, sizeof(double));
    assert_memory_equal(&c.rms_bias, &one->rms_bias, sizeof c.rms_bias);
    assert_memory_equal(c.tile_t, one->tile_t, tiles * sizeof *c.tile_t);
    assert_memory_equal(c.z.data, one->z.data, pixels * sizeof *c.z.data);
}

/* Thirteen bugs, each with a name; 32 x 32, 5 claims each at alpha = 1e-3: DIFFERENT, and the sentence says
 * what it looks like, in every one. The differences are of many standard errors. Controls: the same
 * image without a bug is not DIFFERENT; a hole in one tile is DIFFERENT and is called none of these, nor is a tint,
 * which an exchange of channels would make smaller, nor an image of which a quarter is upside down. */
TEST(test_names)
{
    struct err e;
    enum { SIDE = 32, N = 64, CLAIMS = 5 };
    /* clang-format off */
    static const char *const name[17] = {
        "scale", "offset", "gamma", "shift by x", "shift by y", "left and right exchanged",
        "top and bottom exchanged", "turned by 180 degrees", "rows and columns exchanged",
        "red and blue exchanged", "red and green exchanged", "green and blue exchanged",
        "clamped at 1", "none", "hole",
        "tint", "a quarter"};
    /* clang-format on */
    static double truth[3 * SIDE * SIDE], wrong[3 * SIDE * SIDE];
    OWN(moments) a = new_moments(SIDE, SIDE, "sample"), b = new_moments(SIDE, SIDE, "sample");
    uint64_t seed = 71;
    fill_scene(truth, SIDE, 1);
    for (int bug = 0; bug < 17; bug++) {
        for (int p = 0; p < SIDE * SIDE; p++)
            for (int c = 0; c < 3; c++)
                wrong[3 * p + c] = bugged(truth, SIDE, bug, p % SIDE, p / SIDE, c);
        for (int p = 0; bug == 14 && p < SIDE * SIDE; p++)
            for (int c = 0; p % SIDE >= 24 && p / SIDE >= 24 && c < 3; c++)
                wrong[3 * p + c] *= 0.2;
        for (int i = 0; bug == 15 && i < 3 * SIDE * SIDE; i++)
            wrong[i] *= i % 3 == 0 ? 1.2 : i % 3 == 2 ? 0.85 : 1;
        for (int p = 0; bug == 16 && p < SIDE * SIDE; p++)
            for (int c = 0; p % SIDE < SIDE / 4 && c < 3; c++)
                wrong[3 * p + c] = bugged(truth, SIDE, 6, p % SIDE, p / SIDE, c);
        for (int i = 0; i < CLAIMS; i++) {
            render(&a, LAW_NORMAL, wrong, N, true, &seed);
            render(&b, LAW_NORMAL, truth, N, true, &seed);
            OWN(comparison) c = compare(&a, &b, (struct compare_options){.alpha = 1e-3, .tile = 8});
            MUST(hint_add(&a, &b, 1, &c, &e));
            if (i == 0) {
                print_message("%-28s %s\n", name[bug], c.reason);
                check_threads(&a, &b, &c);
            }
            char wanted[96];
            snprintf(wanted, sizeof wanted, "looks like %s", name[bug]);
            assert_true((c.verdict == VERDICT_DIFFERENT) == (bug != 13));
            if (bug < 13)
                assert_non_null(strstr(c.reason, wanted));
            else
                assert_null(strstr(c.reason, "looks like"));
        }
    }
}

/* The three exchanges that a wide image can have, 32 x 24: each is named in 5 of 5 claims; the control, without any, is
 * not DIFFERENT. */
TEST(test_names_in_wide_images)
{
    struct err e;
    enum { WIDE = 32, HIGH = 24, N = 64, CLAIMS = 5 };
    static const char *const name[4] = {"looks like left and right exchanged",
                                        "looks like top and bottom exchanged",
                                        "looks like turned by 180 degrees", NULL};
    static double truth[3 * WIDE * WIDE], wrong[3 * WIDE * HIGH];
    OWN(moments) a = new_moments(WIDE, HIGH, "sample"), b = new_moments(WIDE, HIGH, "sample");
    uint64_t seed = 72;
    fill_scene(truth, WIDE, 1); /* its upper rows are taken */
    for (int kind = 0; kind < 4; kind++) {
        for (int i = 0; i < 3 * WIDE * HIGH; i++) {
            const int x = i / 3 % WIDE, y = i / 3 / WIDE;
            const int from_x = kind == 0 || kind == 2 ? WIDE - 1 - x : x;
            const int from_y = kind == 1 || kind == 2 ? HIGH - 1 - y : y;
            wrong[i] = truth[3 * (from_y * WIDE + from_x) + i % 3];
        }
        for (int i = 0; i < CLAIMS; i++) {
            render(&a, LAW_NORMAL, wrong, N, true, &seed);
            render(&b, LAW_NORMAL, truth, N, true, &seed);
            OWN(comparison) c = compare(&a, &b, (struct compare_options){.alpha = 1e-3, .tile = 8});
            MUST(hint_add(&a, &b, 1, &c, &e));
            assert_true((c.verdict == VERDICT_DIFFERENT) == (name[kind] != NULL));
            if (name[kind] != NULL)
                assert_non_null(strstr(c.reason, name[kind]));
        }
    }
}

/* What is not like any change gets no name: noise; 16 x 16 pixels 50 % too bright, where one pixel in 16 is black but for
 * noise that left 1e-12: the slope of a power is 1e8 there, and the noise that it would make of that pixel's explains any
 * difference; a factor of 20, beyond those tried (7.8), of which the last is not named in its place. Control: 5 is. */
TEST(test_hints_of_nothing)
{
    enum { SIDE = 32, N = 64 };
    static double truth[3 * SIDE * SIDE], wrong[3 * SIDE * SIDE];
    const struct {
        double factor;
        bool is_local;
        const char *name;
    } cases[] = {{1, false, NULL}, {1.5, true, NULL}, {20, false, NULL}, {5, false, "scale"}};
    for (int i = 0; i < 3 * SIDE * SIDE; i++)
        truth[i] = 0.5 + 0.01 * (i / 3 % SIDE);
    for (size_t k = 0; k < COUNT(cases); k++) {
        OWN(moments) a = new_moments(SIDE, SIDE, "sample"), b = new_moments(SIDE, SIDE, "sample");
        uint64_t seed = 1700 + k;
        for (int i = 0; i < 3 * SIDE * SIDE; i++)
            wrong[i] = truth[i] * (cases[k].is_local && (i / 3 % SIDE >= 16 || i >= 3 * SIDE * 16)
                                       ? 1
                                       : cases[k].factor);
        render(&a, LAW_NORMAL, wrong, N, true, &seed);
        render(&b, LAW_NORMAL, truth, N, true, &seed);
        for (int i = 0; i < 3 * SIDE * SIDE && cases[k].is_local; i += 3 * 16)
            b.mean[i] = 1e-12;
        OWN(comparison) c = compare(&a, &b, (struct compare_options){.alpha = 1e-3, .tile = 8});
        struct err e;
        MUST(hint_add(&a, &b, 1, &c, &e));
        print_message("case %zu: %s: %s\n", k, verdict_name(c.verdict), c.reason);
        assert_int_equal(c.verdict,
                         cases[k].factor > 1 ? VERDICT_DIFFERENT : VERDICT_NOTHING_FOUND);
        assert_int_equal(c.hint.name != NULL, cases[k].name != NULL);
        if (c.hint.name != NULL)
            assert_string_equal(c.hint.name, cases[k].name);
    }
}

/* Columns 1 + 0.8 sin(k x), k = 2 pi/16, moved by half a pixel: halfway between two pixels of B, which lie as far from
 * it on either side, so that by symmetry half a pixel is what leaves least. Scale: 3 % is 3 %, and so for an offset of
 * 3 % of the mean. In 400 claims each has its name in 95 % at least, and the mean of its amounts is that within 4
 * standard errors. */
TEST(test_amounts)
{
    struct err e;
    enum { SIDE = 16, N = 64, CLAIMS = 400 };
    const double k = 2 * M_PI / SIDE, s = 0.5;
    const double expected[3] = {s, 3, 3};
    static const char *const name[3] = {"shift by x", "scale", "offset"};
    static double truth[3 * SIDE * SIDE], moved[3 * SIDE * SIDE];
    OWN(moments) a = new_moments(SIDE, SIDE, "sample"), b = new_moments(SIDE, SIDE, "sample");
    uint64_t seed = 81;
    for (int kind = 0; kind < 3; kind++) {
        for (int i = 0; i < 3 * SIDE * SIDE; i++) {
            double x = i / 3 % SIDE + 0.5;
            truth[i] = 1 + 0.8 * sin(k * x);
            moved[i] = kind == 0   ? 1 + 0.8 * sin(k * (x - s))
                       : kind == 1 ? 1.03 * truth[i]
                                   : truth[i] + 0.03;
        }
        double sum = 0, squares = 0;
        int named = 0;
        for (int i = 0; i < CLAIMS; i++) {
            simulate_pair(&a, &b, LAW_NORMAL, N, true, &seed);
            for (int p = 0; p < 3 * SIDE * SIDE; p++) {
                a.mean[p] += moved[p] - 1;
                b.mean[p] += truth[p] - 1;
            }
            OWN(comparison) c = compare(&a, &b, (struct compare_options){.alpha = 0.01, .tile = 8});
            MUST(hint_add(&a, &b, 1, &c, &e));
            if (c.hint.name != NULL && strcmp(c.hint.name, name[kind]) == 0) {
                named++;
                sum += c.hint.amount;
                squares += c.hint.amount * c.hint.amount;
            }
        }
        double mean = sum / named, sd = sqrt(squares / named - mean * mean);
        print_message("%s: %.4f +- %.4f, expected %.4f, named %d of %d\n", name[kind], mean, sd,
                      expected[kind], named, CLAIMS);
        assert_true(named > 0.95 * CLAIMS);
        assert_near(mean, expected[kind], 4 * sd / sqrt(named));
    }
}

/* Power: the shift statistic's T is normal with mean sqrt(sum D^2/v) up to the noise in the direction. The
 * columns of test_amounts, with 0.5 for 0.8, moved by 0.1 pixels: D = 0.5 k 0.1 cos(..), v = (0.3 B)^2 2/64; the sum over
 * 14 x 14 inner pixels, computed below. Of 400 claims the statistic finds what that predicts at
 * alpha share / NUM_ERROR_MODES tests, less what 5 % of noise in the direction may cost: within Clopper-Pearson of
 * the interval [power at 0.93 T, power at T]. Control: a shift by 0 pixels, at most alpha. */
TEST(test_directed_power)
{
    enum { SIDE = 16, N = 64, CLAIMS = 400 };
    const double k = 2 * M_PI / SIDE, s = 0.1;
    static double truth[3 * SIDE * SIDE], moved[3 * SIDE * SIDE];
    OWN(moments) a = new_moments(SIDE, SIDE, "sample"), b = new_moments(SIDE, SIDE, "sample");
    uint64_t seed = 91;
    int found[2] = {0};
    double share = 0, t2 = 0;
    int tests = 0;
    for (int off = 0; off < 2; off++) {
        t2 = 0;
        for (int i = 0; i < 3 * SIDE * SIDE; i++) {
            int p = i / 3, x = p % SIDE, y = p / SIDE;
            truth[i] = 1 + 0.5 * sin(k * (x + 0.5));
            moved[i] = 1 + 0.5 * sin(k * (x + 0.5 - (off ? s : 0)));
            if (i % 3 == 0 && x > 0 && y > 0 && x < SIDE - 1 && y < SIDE - 1)
                t2 += pow((moved[i] - truth[i]) / (0.3 * truth[i]), 2) * N / 2;
        }
        for (int i = 0; i < CLAIMS; i++) {
            render(&a, LAW_NORMAL, moved, N, true, &seed);
            render(&b, LAW_NORMAL, truth, N, true, &seed);
            OWN(comparison) c = compare(&a, &b, (struct compare_options){.alpha = 0.01, .tile = 8});
            const struct statistic *d = &c.statistic[STATISTIC_MATCHED_FILTER];
            share = d->share;
            tests = d->num_tests;
            assert_int_equal(tests, NUM_ERROR_MODES);
            found[off] += d->log10_p <= log10(0.01 * share);
        }
    }
    double x = gsl_cdf_ugaussian_Qinv(0.01 * share / tests / 2), t = sqrt(t2);
    double hi = gsl_cdf_ugaussian_P(t - x), lo = gsl_cdf_ugaussian_P(0.93 * t - x);
    print_message(
        "shift by %.2f: T = %.2f, found %.1f %%, expected %.1f to %.1f %%; none: %.1f %%\n", s, t,
        100.0 * found[1] / CLAIMS, 100 * lo, 100 * hi, 100.0 * found[0] / CLAIMS);
    assert_true(lower_bound(found[1], CLAIMS) <= hi);
    assert_true(upper_bound(found[1], CLAIMS) >= lo);
    assert_true(lower_bound(found[0], CLAIMS) <= 0.01);
}

/* A bias of exactly the margin, upward in every pixel, is within the margins and lies in the direction "scale".
 * It is DIFFERENT in at most alpha = 1 % of 500 claims; twice the margin is found by that statistic in all. */
TEST(test_directed_margin)
{
    enum { SIDE = 16, N = 64, CLAIMS = 500 };
    static double truth[3 * SIDE * SIDE], wrong[3 * SIDE * SIDE];
    OWN(moments) a = new_moments(SIDE, SIDE, "sample"), b = new_moments(SIDE, SIDE, "sample");
    struct compare_options opt = {
        .alpha = 0.01, .tile = 4, .margin_global = 0.05, .margin_tile = 0.05};
    uint64_t seed = 101;
    int found[2] = {0};
    fill_scene(truth, SIDE, 0.7);
    for (int twice = 0; twice < 2; twice++)
        for (int i = 0; i < CLAIMS; i++) {
            for (int p = 0; p < 3 * SIDE * SIDE; p++)
                wrong[p] = (twice ? 1.1 : 1.05) * truth[p];
            render(&a, LAW_NORMAL, wrong, N, true, &seed);
            render(&b, LAW_NORMAL, truth, N, true, &seed);
            OWN(comparison) c = compare(&a, &b, opt);
            found[twice] += c.statistic[STATISTIC_MATCHED_FILTER].log10_p <= -2;
        }
    print_message("scale at the margin: found %d of %d, at twice %d\n", found[0], CLAIMS, found[1]);
    assert_true(lower_bound(found[0], CLAIMS) <= 0.01);
    assert_int_equal(found[1], CLAIMS);
}

/* Variance doubled by halving what an observation is: B's observations are means of 2 of A's. As "sample" on
 * both sides the ratio is 2; as replicates of 2 paths it is 1. 1000 claims: the interval misses at most 2 %.
 * Tested against a margin of 100 %, a true ratio of 2 is within it: at most alpha; against one of 50 % it
 * is found: ln(2/1.5) = 0.29, and the standard error of ln R for 1024 normal pixels of n = 16 and 32 is
 * about sqrt(2 (1/15 + 1/31)/1024) = 0.014, times 1.2 as not all pixels weigh the same. Without a margin nothing is tested and all shares add to 1. */
TEST(test_variance_ratio)
{
    enum { SIDE = 32, N = 16, CLAIMS = 1000 };
    OWN(moments) a = new_moments(SIDE, SIDE, "sample"), b = new_moments(SIDE, SIDE, "sample");
    static double truth[3 * SIDE * SIDE];
    uint64_t seed = 111;
    int known = 0, missed = 0, edge = 0, found = 0, level = 0, tested = 0;
    fill_scene(truth, SIDE, 0.7);
    for (int i = 0; i < CLAIMS; i++) {
        render(&a, LAW_NORMAL, truth, N, true, &seed);
        render(&b, LAW_NORMAL, truth, 2 * N, true, &seed);
        /* Pairs: n halves; of the sum of squares about half is left, exactly that here. */
        for (int p = 0; p < SIDE * SIDE; p++) {
            b.n[p] = N;
            for (int c = 0; c < 3; c++) {
                b.m2[3 * p + c] *= (N - 1) / (2.0 * N - 1) / 2;
                b.m3[3 * p + c] /= 8;
            }
        }
        struct compare_options opt = {.alpha = 0.01, .tile = 4};
        OWN(comparison) c = compare(&a, &b, opt);
        assert_true(c.statistic[STATISTIC_VARIANCE].share == 0);
        assert_int_equal(c.statistic[STATISTIC_VARIANCE].num_tests, 0);
        double sum = 0;
        for (int s = 0; s < NUM_STATISTICS; s++)
            sum += c.statistic[s].share;
        assert_near(sum, 1, 1e-12);
        known += c.variance.valid;
        missed += c.variance.valid && !(c.variance.lo <= 2 && c.variance.hi >= 2);
        for (int k = 0; k < 2; k++) {
            opt.margin_variance = k == 0 ? 1 : 0.5;
            OWN(comparison) tested_too = compare(&a, &b, opt);
            const struct statistic *s = &tested_too.statistic[STATISTIC_VARIANCE];
            assert_near(s->share, 0.1, 1e-12);
            *(k == 0 ? &edge : &found) += s->log10_p <= log10(0.01 * s->share);
            tested += k == 1 && s->num_tests > 0;
            level += k == 0 && s->log10_p <= -2;
        }
        if (i == 0) {
            strcpy(a.unit, "replicate");
            strcpy(b.unit, "replicate");
            b.spp = 2;
            OWN(comparison) paths = compare(&a, &b, opt);
            assert_near(paths.variance.ratio, 1, 0.2);
            b.spp = 0; /* unknown paths: nothing to compare */
            OWN(comparison) unknown = compare(&a, &b, opt);
            assert_false(unknown.variance.valid);
            strcpy(a.unit, "sample");
            strcpy(b.unit, "sample");
            b.spp = 1;
        }
    }
    print_message(
        "ratio 2: interval misses %.2f %%; at the margin p <= 1 %% in %.2f %%; beyond it found %d of %d\n",
        100.0 * missed / CLAIMS, 100.0 * level / CLAIMS, found, tested);
    assert_true(known > 0.95 * CLAIMS);
    assert_true(lower_bound(missed, known) <= 0.02);
    assert_true(lower_bound(level, CLAIMS) <= 0.01);
    assert_true(edge <= level);
    assert_true(tested >
                0.99 * CLAIMS); /* else INCONCLUSIVE, 20 standard errors beyond the margin */
    assert_int_equal(found, tested);
}

/* Independent sides, of any law and with few samples, are never said to share noise; sides that share 90 % of it, or
 * all but a factor of 1.001, are: at 90 % E (A - B)^2 is 2 (1 - .9) of the variance of one side. */
TEST(test_noise_shared)
{
    enum { SIDE = 24 };
    static const enum law law[] = {LAW_NORMAL,  LAW_EXPONENTIAL, LAW_BLACK, LAW_RARE,
                                   LAW_FIREFLY, LAW_LOGNORMAL,   LAW_PARETO};
    OWN(moments) a = new_moments(SIDE, SIDE, "sample"), b = new_moments(SIDE, SIDE, "sample");
    OWN(moments) own = new_moments(SIDE, SIDE, "sample");
    uint64_t seed = 77;
    for (size_t l = 0; l < COUNT(law); l++)
        for (int n = 3; n <= 48; n *= 4)
            for (int i = 0; i < 20; i++) {
                simulate_pair(&a, &b, law[l], n, false, &seed);
                assert_true(variance_ratio_of_difference(&a, &b) == 1);
            }
    simulate(&a, LAW_NORMAL, 1, 16, false, &seed);
    simulate(&own, LAW_NORMAL, 1, 16, false, &seed);
    for (int i = 0; i < 3 * SIDE * SIDE; i++) {
        b.m2[i] = a.m2[i];
        b.mean[i] = 1 + 0.9 * (a.mean[i] - 1) + sqrt(1 - 0.81) * (own.mean[i] - 1);
    }
    for (int i = 0; i < SIDE * SIDE; i++)
        b.n[i] = a.n[i];
    double ratio = variance_ratio_of_difference(&a, &b);
    assert_true(ratio > 0.08 && ratio < 0.16);
    for (int i = 0; i < 3 * SIDE * SIDE; i++)
        b.mean[i] = 1.001 * a.mean[i];
    assert_true(variance_ratio_of_difference(&a, &b) < 1e-3);
}

/* The same seeds on both sides are refused, as a whole and in three quarters of the pixels. Controls: other
 * seeds; an exact image compared with itself; and laws of two values, in which independent pixels can
 * agree in every moment: 500 claims of the rare and of the firefly law, none refused (each has less than
 * 1e-6 of it). */
TEST(test_shared_seeds)
{
    enum { SIDE = 8, N = 16 };
    OWN(moments) a = new_moments(SIDE, SIDE, "sample"), b = new_moments(SIDE, SIDE, "sample");
    struct compare_options opt = {.alpha = 1e-3, .tile = 4};
    struct comparison c;
    struct err e;
    for (int part = 0; part < 3; part++) {
        uint64_t seed = 5, other = 6;
        simulate(&a, LAW_EXPONENTIAL, 1, N, false, &seed);
        seed = 5;
        simulate(&b, LAW_EXPONENTIAL, 1, N, false, part == 2 ? &other : &seed);
        for (int p = 0; part == 1 && p < SIDE * SIDE / 4; p++)
            b.m2[3 * p] *= 1.1;
        bool judged = compare_moments(&a, &b, &opt, &c, &e);
        assert_true(judged == (part == 2));
        if (judged)
            comparison_free(&c);
        else
            assert_string_equal(
                e.msg,
                fs_path("A and B hold the same observations in %d of 64 pixels: rendered with "
                        "the same seed, or copied?",
                        part == 0 ? 64 : 48)
                    .s);
    }
    uint64_t seed = 121;
    for (int i = 0; i < 1000; i++) {
        enum law law = i % 2 ? LAW_RARE : LAW_FIREFLY;
        simulate_pair(&a, &b, law, i % 2 ? 3 : 128, true, &seed);
        struct comparison judged = compare(&a, &b, opt);
        comparison_free(&judged);
    }
    constant(&a, 1, 1);
    constant(&b, 1, 1);
    strcpy(a.unit, "exact");
    strcpy(b.unit, "exact");
    c = compare(&a, &b, opt);
    assert_int_equal(c.verdict, VERDICT_NOTHING_FOUND);
    comparison_free(&c);
}

/* alpha = 1e-9: a bias of the printed MDB is found by the image's test in 95 % of 500 claims, as at 1e-2,
 * and half of it in less than 5 %. And p has no floor: a bias of 1000 standard errors has log10 p = -217147
 * by the normal law, and about -38000 by Student's with nu = 61440, to whose leading order it is compared,
 * within 3 %. */
TEST(test_small_alpha)
{
    enum { SIDE = 16, N = 121, CLAIMS = 500 };
    OWN(moments) a = new_moments(SIDE, SIDE, "sample"), b = new_moments(SIDE, SIDE, "sample");
    struct compare_options opt = {.alpha = 1e-9, .tile = 4};
    uint64_t seed = 131;
    simulate_pair(&a, &b, LAW_NORMAL, N, true, &seed);
    OWN(comparison) first = compare(&a, &b, opt);
    double mdb = first.mdb_global;
    int found[2] = {0};
    for (int half = 0; half < 2; half++)
        for (int i = 0; i < CLAIMS; i++) {
            simulate_pair(&a, &b, LAW_NORMAL, N, true, &seed);
            for (int p = 0; p < 3 * SIDE * SIDE; p++)
                a.mean[p] += half ? mdb / 2 : mdb;
            OWN(comparison) c = compare(&a, &b, opt);
            const struct statistic *s = &c.statistic[STATISTIC_IMAGE];
            found[half] += s->log10_p <= log10(1e-9 * s->share);
        }
    print_message("alpha 1e-9: the MDB of %.2f %% is found in %.1f %%, half of it in %.1f %%\n",
                  100 * mdb, 100.0 * found[0] / CLAIMS, 100.0 * found[1] / CLAIMS);
    assert_true(lower_bound(found[0], CLAIMS) <= 0.95 && upper_bound(found[0], CLAIMS) >= 0.95);
    assert_true(upper_bound(found[1], CLAIMS) < 0.05);

    /* Student's tail, ln p = -(nu + 1)/2 ln(1 + t^2/nu) to leading order; t = 1000, nu = 2 x 120 x 256. */
    double se = 0.3 * sqrt(2.0 / N / (SIDE * SIDE)), nu = 2.0 * (N - 1) * SIDE * SIDE;
    for (int p = 0; p < 3 * SIDE * SIDE; p++)
        a.mean[p] = b.mean[p] + 1000 * se;
    OWN(comparison) c = compare(&a, &b, opt);
    double tail = -(nu + 1) / 2 * log10(1 + 1e6 / nu);
    print_message("1000 standard errors: log10 p = %.0f, to leading order %.0f\n",
                  c.statistic[STATISTIC_IMAGE].log10_p, tail);
    assert_near(c.statistic[STATISTIC_IMAGE].log10_p / tail, 1, 0.03);
    assert_true(c.statistic[STATISTIC_CHI_SQUARE].log10_p < -1000);
}

/* 512 x 512, 8 replicates a side: below 0.5 s and 200 MiB on an idle core. The bounds below allow for a busy
 * machine, or for a sanitizer. */
TEST(test_cost)
{
#ifdef __SANITIZE_ADDRESS__
    const double seconds = 30, mib = 1000;
#else
    const double seconds = 2, mib = 200;
#endif
    OWN(moments) a = new_moments(512, 512, "replicate"), b = new_moments(512, 512, "replicate");
    uint64_t seed = 141;
    simulate_pair(&a, &b, LAW_EXPONENTIAL, 8, true, &seed);
    struct rusage before, after;
    getrusage(RUSAGE_SELF, &before);
    struct comparison c = compare(&a, &b, (struct compare_options){.alpha = 1e-3, .tile = 16});
    getrusage(RUSAGE_SELF, &after);
    comparison_free(&c);
    double cpu = (double)(after.ru_utime.tv_sec - before.ru_utime.tv_sec) +
                 1e-6 * (double)(after.ru_utime.tv_usec - before.ru_utime.tv_usec);
    double more = (double)(after.ru_maxrss - before.ru_maxrss) / 1024;
    print_message("512 x 512: %.2f s of CPU, %.0f MiB more\n", cpu, more);
    assert_true(cpu < seconds);
    assert_true(more < mib);
}
