/* The calibration itself: its mathematics against known values, the short version on the tester as it
 * is and on testers weakened on purpose, each of which must be rejected, and the published page.
 * Seeds and numbers of pairs (calibrate.c) were fixed beforehand, nothing is retried. A line
 * fails by chance with at most 5e-4, where a rate is exactly at its limit; most are far below, so that
 * the short version fails a right tester with about 1 % over all its lines. Its power is shown by the
 * weakened testers. */
#include "calibrate.h"
#include "tests/support/rates.h"

#include "renderer/base/sha256.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

/* Critical values from the tables: Kolmogorov 1.3581 (5 %), 1.6276 (1 %) over sqrt n for large n;
 * Anderson-Darling 2.492 (5 %), 3.878 (1 %) [Stephens74]. The statistics of three numbers by hand (KS)
 * and by quadrature of their definitions: n integral (F_n - x)^2 / (x (1 - x)) dx. */
TEST(test_uniformity)
{
    assert_near(ks_p(1.3581e-3, 1000000), 0.05, 5e-5);
    assert_near(ks_p(1.6276e-3, 1000000), 0.01, 5e-5);
    assert_near(ad_p(2.492), 0.05, 2e-4);
    assert_near(ad_p(3.878), 0.01, 1e-4);
    const double x[3] = {0.2, 0.3, 0.9};
    assert_near(ks_above(x, 3), 2 / 3.0 - 0.3, 1e-15);
    assert_near(ks_distance(x, 3), 2 / 3.0 - 0.3, 1e-15);
    double sum = 0;
    const int steps = 2000000;
    for (int i = 0; i < steps; i++) {
        double u = (i + 0.5) / steps, below = 0;
        for (int k = 0; k < 3; k++)
            below += x[k] <= u;
        double d = below / 3 - u;
        sum += 3 * d * d / (u * (1 - u)) / steps;
    }
    assert_near(ad_statistic(x, 3), sum, 1e-5);
}

/* H0: pixels of a library have the moments of their law. Exponential, n = 64 by blocks of 16: mean 1,
 * E[M2/(n-1)] = 1, E[n M3/((n-1)(n-2))] = 2, the channels equal or independent. 4 images of 64 x 64,
 * blocks renewed in between. Each pixel's variance: 1/n; about (mu4 - 1)/n = 8/n; for the third the
 * sample's own. |z| < 5 on each (the blocks are used twice, so that a z has the spread 1.4 at most;
 * 4e-4 in all). Control: the law has not the mean 1.02. */
TEST(test_library)
{
    enum { SIDE = 64, IMAGES = 4 };
    OWN(library) l;
    struct err e;
    assert_true(library_init(&l, LAW_EXPONENTIAL, 16, 65536, 5, &e));
    OWN(moments) m = new_moments(SIDE, SIDE, "sample");
    double sum[3] = {0}, square[3] = {0}, cross = 0, num = 0;
    for (int image = 0; image < IMAGES; image++) {
        library_image(&l, 4, false, NULL, &m);
        library_renew(&l, 16384);
        for (size_t p = 0; p < SIDE * SIDE; p++) {
            double n = m.n[p];
            assert_true(n == 64);
            cross += (m.mean[3 * p] - 1) * (m.mean[3 * p + 1] - 1) * n;
            for (size_t i = 3 * p; i < 3 * p + 3; i++, num++) {
                double x[3] = {m.mean[i], m.m2[i] / (n - 1), n * m.m3[i] / ((n - 1) * (n - 2))};
                for (int k = 0; k < 3; k++) {
                    sum[k] += x[k];
                    square[k] += x[k] * x[k];
                }
            }
        }
    }
    static const double expected[3] = {1, 1, 2};
    for (int k = 0; k < 3; k++) {
        double mean = sum[k] / num, se = sqrt((square[k] / num - mean * mean) / num);
        assert_true(fabs(mean - expected[k]) < 5 * se);
        if (k == 0)
            assert_true(fabs(mean - 1.02) > 5 * se);
    }
    assert_true(fabs(cross / sqrt(num / 3)) < 5);
    library_image(&l, 4, true, NULL, &m);
    for (size_t i = 0; i < 3 * SIDE * SIDE; i += 3)
        assert_true(m.mean[i] == m.mean[i + 1] && m.m3[i] == m.m3[i + 2]);
}

static void run_short(enum weakness weakness, int threads, struct results *r, struct checks *c)
{
    struct settings s = settings_short();
    struct work w = {.threads = threads, .total = calibrate_cost(&s)};
    struct err e;
    progress_start(&w.progress, "calibrating", NULL, true);
    if (!calibrate(&w, &s, "reference/scenes", weakness, r, &e))
        fail_msg("%s: %s", weakness_name[weakness], e.msg);
    *c = (struct checks){0};
    calibrate_check(&s, r, c);
}

/* The tester as it is: every line holds. The results do not depend on the number of threads. */
TEST(test_short_calibration)
{
    static struct results r, again;
    static struct checks c;
    run_short(WEAK_NOT, 1, &r, &c);
    for (int i = 0; i < c.num; i++)
        if (!c.item[i].holds)
            print_message("does not hold: %s\n", c.item[i].what);
    print_message("%d lines, %d do not hold\n", c.num, c.failed);
    assert_true(c.num > 40);
    assert_int_equal(c.failed, 0);
    run_short(WEAK_NOT, 2, &again, &c);
    for (int i = 0; i < MAX_SYNTHETIC; i++)
        assert_memory_equal(r.synthetic[i].rejected, again.synthetic[i].rejected,
                            sizeof r.synthetic[i].rejected);
    assert_true(r.synthetic[0].ks == again.synthetic[0].ks && r.synthetic[0].ks > 0);
    assert_memory_equal(r.render[0].curve, again.render[0].curve, sizeof r.render[0].curve);
    assert_memory_equal(r.power[0].found, again.power[0].found, sizeof r.power[0].found);
    assert_memory_equal(r.tail[0].rejected, again.tail[0].rejected, sizeof r.tail[0].rejected);
    assert_memory_equal(r.cover[0].missed, again.cover[0].missed, sizeof r.cover[0].missed);
    assert_memory_equal(r.margin[0].equivalent, again.margin[0].equivalent,
                        sizeof r.margin[0].equivalent);
}

/* Negative controls: the lines that fail must include the one that this weakness violates. */
static void expect_caught(enum weakness weakness, const char *line)
{
    static struct results r;
    static struct checks c;
    bool found = false;
    run_short(weakness, 1, &r, &c);
    print_message("%s: %d of %d lines do not hold\n", weakness_name[weakness], c.failed, c.num);
    for (int i = 0; i < c.num; i++)
        if (!c.item[i].holds) {
            print_message("  %s\n", c.item[i].what);
            found = found || strstr(c.item[i].what, line) != NULL;
        }
    assert_true(found);
}

TEST(test_weakened_testers_are_caught)
{
    expect_caught(WEAK_LENIENT, "gate at 0.01");    /* ten times alpha */
    expect_caught(WEAK_STRICT, "found at the MDB"); /* a tenth of alpha */
    expect_caught(WEAK_COPIED, "gate at 0.01");
    expect_caught(WEAK_ONE_SIDED, "gate at 0.01");
    /* Squares darker than an exact side are guarded by the chance of missed light as well; the image is not. */
    expect_caught(WEAK_NO_SKEW, "fireflies, 64 and exact: image at 0.01");
}

/* The page in the repository: made by the settings of this source, and every line of it holds. */
TEST(test_published_page)
{
    char hex[65], line[96];
    struct settings s = settings_published(1);
    OWN_TEXT text = test_read("tests/studies/calibration/README.md");
    settings_hash(&s, hex);
    snprintf(line, sizeof line, "Settings: `%s`.", hex);
    if (strstr(text, line) == NULL)
        fail_msg("the page was made by other settings than %s: make calibrate", hex);
    assert_non_null(strstr(text, "Written by `make calibrate`;"));
    const char *all = strstr(text, "**All ");
    if (all == NULL)
        fail_msg("some of the page's lines do not hold");
    assert_true(strtol(all + 6, NULL, 10) > 1000);
    assert_null(strstr(text, "does not hold"));
    static const char *const plots[] = {"false_alarms", "statistics", "tail", "power"};
    for (size_t i = 0; i < COUNT(plots); i++) {
        snprintf(line, sizeof line, "tests/studies/calibration/%s.svg", plots[i]);
        assert_int_equal(access(line, R_OK), 0);
        snprintf(line, sizeof line, "(%s.svg)", plots[i]);
        assert_non_null(strstr(text, line));
    }
}
