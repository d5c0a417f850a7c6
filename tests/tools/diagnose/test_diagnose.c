/* The catalogue of bugs and the diagnosis, on looks drawn from the catalogue itself: the correct mean (plus a bug's
 * effect), each moved by a normal error of the stored variance, and noise of a gamma law with the variance that the
 * correct renderer has at the view's number of samples. Real renders: tests/end_to_end/end_to_end.sh and make diagnose-rates. */
#include "renderer/base/fs.h"
#include "tools/diagnose/diagnose.h"
#include "catalogue_write.h"
#include "tests/support/simulate.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <gsl/gsl_randist.h>
#include <gsl/gsl_rng.h>

#define CATALOGUE "golden/diagnose"
#define PATCHES   "tests/mutants"

static const double alpha = 1e-6;

struct fixture {
    struct catalogue c;
    struct observation *clue;
    gsl_rng *rng;
};

static int setup(void **state)
{
    static struct fixture f;
    struct err e;
    if (!catalogue_read(CATALOGUE, &f.c, &e)) {
        print_error("%s\n", e.msg);
        return -1;
    }
    f.clue = calloc((size_t)f.c.num_views, sizeof *f.clue);
    f.rng = gsl_rng_alloc(gsl_rng_mt19937);
    *state = &f;
    return f.clue != NULL && f.rng != NULL ? 0 : -1;
}

static int teardown(void **state)
{
    struct fixture *f = *state;
    catalogue_free(&f->c);
    free(f->clue);
    gsl_rng_free(f->rng);
    return 0;
}

/* ---- files */

static void copy(const char *from_dir, const char *name, const char *to_dir, long changed_byte)
{
    const struct path to = fs_path("%s/%s", to_dir, name);
    struct err e;
    MUST(fs_copy(fs_path("%s/%s", from_dir, name).s, to.s, &e));
    if (changed_byte < 0)
        return;
    FILE *f = fopen(to.s, "r+b");
    assert_true(f != NULL && fseek(f, changed_byte, SEEK_SET) == 0);
    int byte = fgetc(f);
    assert_true(fseek(f, changed_byte, SEEK_SET) == 0 && fputc(byte ^ 1, f) != EOF);
    assert_int_equal(fclose(f), 0);
}

static void copy_patches(const struct fixture *f, const char *to, const char *changed,
                         const char *left_out)
{
    struct err e;
    assert_true(fs_make_dirs(to, &e));
    for (int b = 0; b < f->c.num_bugs; b++) {
        const char *bug = f->c.bug[b].name;
        if (strcmp(bug, left_out) != 0)
            copy(PATCHES, fs_path("%s.patch", bug).s, to, strcmp(bug, changed) == 0 ? 5 : -1);
    }
}

TEST(test_every_patch_is_in_the_catalogue)
{
    struct fixture *f = *state;
    struct err e = {""};
    MUST(catalogue_current(&f->c, PATCHES, NULL, &e));
}

TEST(test_what_a_patch_is_by)
{
    static const char head[] = "Bug: b\nWhere: w\n\n--- a/x.c\n+++ b/x.c\n";
    static const struct {
        const char *text;
        bool same;
    } cases[] = {
        {"@@ -1,3 +1,3 @@\n one;\n-two;\n+three;\n four;\n", true},
        {"@@ -9,2 +9,2 @@\n other;\n\n-two;\n+three;\n", true},
        {"@@ -1,3 +1,3 @@\n one;\n-two;\n+thre;\n four;\n", false},
        {"@@ -1,3 +1,3 @@\n one;\n-too;\n+three;\n four;\n", false},
        {"@@ -1,3 +1,4 @@\n one;\n-two;\n+three;\n+\n four;\n", false},
    };
    struct bug first, bug;
    struct err e = {""};
    for (size_t i = 0; i < COUNT(cases); i++) {
        char text[200];
        int n = snprintf(text, sizeof text, "%s%s", head, cases[i].text);
        test_write(test_path("one.patch"), text, (size_t)n);
        assert_true(catalogue_bug_of_patch(test_path("one.patch"), &bug, &e));
        assert_string_equal(bug.what, "b");
        assert_string_equal(bug.where, "w");
        if (i == 0)
            first = bug;
        assert_int_equal(strcmp(bug.patch_sha256, first.patch_sha256) == 0, cases[i].same);
    }
}

TEST(test_a_stale_catalogue_is_refused)
{
    struct fixture *f = *state;
    struct err e = {""};
    const char *dir = test_path("same");
    const char *first = f->c.bug[0].name, *second = f->c.bug[1].name;
    copy_patches(f, dir, "", "");
    assert_true(catalogue_current(&f->c, dir, NULL, &e));
    dir = test_path("changed");
    copy_patches(f, dir, second, "");
    REFUSES(catalogue_current(&f->c, dir, NULL, &e), second);
    assert_non_null(strstr(e.msg, "has changed"));
    dir = test_path("fewer");
    copy_patches(f, dir, "", first);
    assert_false(catalogue_current(&f->c, dir, NULL, &e));
    dir = test_path("more");
    copy_patches(f, dir, "", "");
    MUST(fs_copy(fs_path(PATCHES "/%s.patch", first).s, test_path("more/a_new_one.patch"), &e));
    REFUSES(catalogue_current(&f->c, dir, NULL, &e), "a_new_one");
}

TEST(test_a_damaged_catalogue_is_refused)
{
    struct fixture *f = *state;
    struct err e = {""};
    OWN(catalogue) c;
    const char *dir = test_path("damaged");
    assert_true(fs_make_dirs(dir, &e));
    copy(CATALOGUE, "manifest.json", dir, -1);
    assert_false(catalogue_read(dir, &c, &e)); /* no images */
    for (int v = 0; v < f->c.num_views; v++) {
        copy(CATALOGUE, fs_path("%s.exr", f->c.view[v].name).s, dir, v == 1 ? 3000 : -1);
    }
    REFUSES(catalogue_read(dir, &c, &e), f->c.view[1].name);
    copy(CATALOGUE, fs_path("%s.exr", f->c.view[1].name).s, dir, -1);
    assert_true(catalogue_read(dir, &c, &e));
}

/* ---- sights */

/* Cells by brute force: the mean of the pixels, and the sum of their variances of the mean over the square of
 * their number. */
TEST(test_a_sight_pools_pixels)
{
    struct err e;
    struct signature s;
    uint64_t seed = 4;
    struct moments m = new_moments(48, 24, "sample");
    simulate(&m, LAW_EXPONENTIAL, 2, 9, false, &seed);
    assert_true(signature_of(&m, 16, 18, &s, &e));
    assert_int_equal(s.columns, 16);
    assert_int_equal(s.rows, 8);
    for (int cell = 0; cell < 128; cell += 37) {
        double mean = 0, var = 0;
        for (int y = 0; y < 24; y++)
            for (int x = 0; x < 48; x++)
                if (x / 3 == cell % 16 && y / 3 == cell / 16) {
                    mean += m.mean[3 * (48 * y + x) + 1] / 9;
                    var += moments_var_of_mean(&m, (size_t)(48 * y + x), 1) / 81;
                }
        assert_true(fabs(s.mean[3 * cell + 1] - mean) < 1e-12 * mean);
        assert_true(fabs(s.var[3 * cell + 1] - var) < 1e-12 * var);
    }
    /* 9 of 18 samples that were asked for. */
    assert_true(fabs(s.fact[FACT_SAMPLES] - log(0.5)) < 1e-12);
    moments_free(&m);
    m = new_moments(30, 30, "sample");
    REFUSES(signature_of(&m, 16, 0, &s, &e), "30 x 30");
    moments_free(&m);
    m = new_moments(32, 32, "stratified");
    REFUSES(signature_of(&m, 16, 0, &s, &e), "does not state its error");
    moments_free(&m);
}

/* Two averaged renders are one of twice the samples: half the variance. */
TEST(test_an_average_of_sights)
{
    struct err e;
    struct signature s[2];
    uint64_t seed = 5;
    for (int k = 0; k < 2; k++) {
        OWN(moments) m = new_moments(16, 16, "sample");
        simulate(&m, LAW_NORMAL, 1, 50, true, &seed);
        assert_true(signature_of(&m, 16, 50, &s[k], &e));
    }
    struct signature a = signature_average(s, 2);
    for (int i = 0; i < SIGNATURE_VALUES; i += 101) {
        assert_true(fabs(a.mean[i] - (s[0].mean[i] + s[1].mean[i]) / 2) < 1e-12);
        assert_true(fabs(a.var[i] - (s[0].var[i] + s[1].var[i]) / 4) < 1e-12);
    }
    assert_true(a.n == 100);
}

/* ---- looks drawn from the catalogue */

/* Variance of a cell's mean under a bug over the variance stated: R, times the factor by which the cell's pixels
 * share random numbers. */
static double understated(const struct fixture *f, int bug, int cell)
{
    double factor = 1;
    for (int v = 0; bug >= 0 && v < f->c.num_views; v++) {
        const struct effect *e = f->c.view[v].effect[bug];
        if (e == NULL || isnan(e->fact[FACT_IMAGE]))
            continue;
        double r = exp(e->fact[FACT_PIXELS]), s = exp(e->fact[FACT_IMAGE]);
        factor = (r > 1.25 ? r : 1) * (s > 10 ? fmin(s, cell * cell) : 1);
    }
    return factor;
}

/* bug NULL: correct. noise: times the variance that is stated. */
static void draw_look(struct fixture *f, int view, const struct effect *bug, double amplitude,
                      double noise)
{
    const struct view *v = &f->c.view[view];
    const struct signature *c = &v->correct;
    struct observation *out = &f->clue[view];
    *out = (struct observation){.view = v, .seen = *c, .is_consistent = true};
    struct signature *a = &out->seen;
    a->n = (double)v->spp * v->renders * a->cell * a->cell;
    for (int i = 0; i < 3 * a->columns * a->rows; i++) {
        double mean = c->mean[i] + gsl_ran_gaussian(f->rng, sqrt(c->var[i]));
        if (bug != NULL)
            mean += amplitude *
                    ((double)bug->mean[i] + gsl_ran_gaussian(f->rng, sqrt((double)bug->var[i])));
        a->var[i] = c->var[i] * c->n / a->n;
        a->k3[i] = c->k3[i] * pow(c->n / a->n, 2);
        a->mean[i] = 0;
        if (mean > 0)
            a->mean[i] = a->var[i] > 0 ? gsl_ran_gamma(f->rng, mean * mean / (noise * a->var[i]),
                                                       noise * a->var[i] / mean)
                                       : mean;
    }
    for (int k = 0; k < NUM_FACTS; k++) {
        a->fact_sd[k] = k == FACT_IMAGE ? 0.6 : 0.02;
        if (bug != NULL && !isnan(bug->fact[k]))
            a->fact[k] += amplitude * (bug->fact[k] - a->fact[k]);
        a->fact[k] += k == FACT_SAMPLES ? 0 : gsl_ran_gaussian(f->rng, a->fact_sd[k]);
    }
    if (!isnan(a->fact[FACT_PIXELS]))
        out->is_consistent = fabs(a->fact[FACT_PIXELS]) < 0.4 && a->fact[FACT_IMAGE] < log(20);
}

static struct diagnosis look(struct fixture *f, int bug, double amplitude, const char *without)
{
    struct err e = {""};
    struct diagnosis d;
    for (int v = 0; v < f->c.num_views; v++)
        draw_look(f, v, bug >= 0 ? f->c.view[v].effect[bug] : NULL, amplitude,
                  understated(f, bug, f->c.view[v].correct.cell));
    const struct diagnose_options opt = {.alpha = alpha, .without = without};
    MUST(diagnose(&f->c, f->clue, f->c.num_views, &opt, &d, &e));
    return d;
}

static bool is_named(const struct diagnosis *d, int bug)
{
    for (int i = 0; i < d->num_named; i++)
        if (d->candidate[i].bug == bug)
            return true;
    return false;
}

/* H0: the renderer is correct. Each look names a bug with a probability of at most 1e-6, so any of 500 with 5e-4. */
TEST(test_a_correct_look_is_not_accused)
{
    struct fixture *f = *state;
    double largest = -INFINITY;
    gsl_rng_set(f->rng, 11);
    for (int t = 0; t < 500; t++) {
        struct diagnosis d = look(f, -1, 0, NULL);
        largest = fmax(largest, d.largest_lead);
        if (d.finding != FINDING_CORRECT)
            fail_msg("look %d: %s", t, d.gate);
    }
    /* P(any lead of any bug above log(500 bugs / 1e-3)) is at most 1e-3, by the argument for the bound. */
    assert_true(largest < log(500 * f->c.num_bugs / 1e-3));
}

/* Negative control: stripes, brighter and darker, are wrong and no known bug. */
TEST(test_an_unknown_difference_is_not_named)
{
    struct fixture *f = *state;
    struct err e;
    struct diagnosis d;
    gsl_rng_set(f->rng, 13);
    for (int v = 0; v < f->c.num_views; v++) {
        draw_look(f, v, NULL, 0, 1);
        for (int i = 0; i < SIGNATURE_VALUES; i++)
            f->clue[v].seen.mean[i] *= i % 7 < 3 ? 1.3 : 0.9;
    }
    const struct diagnose_options opt = {.alpha = alpha};
    assert_true(diagnose(&f->c, f->clue, f->c.num_views, &opt, &d, &e));
    assert_int_equal(d.finding, FINDING_UNKNOWN);
    assert_int_equal(d.num_named, 0);
    assert_true(d.gate[0] != '\0');
}

TEST(test_every_bug_is_named)
{
    struct fixture *f = *state;
    int named = 0, first = 0;
    gsl_rng_set(f->rng, 14);
    for (int b = 0; b < f->c.num_bugs; b++) {
        struct diagnosis d = look(f, b, 1, NULL);
        named += is_named(&d, b);
        first += is_named(&d, b) && d.candidate[0].bug == b;
        if (!is_named(&d, b))
            print_message("%s: not named (%s)\n", f->c.bug[b].name,
                          d.finding == FINDING_CORRECT ? "nothing wrong"
                                                       : f->c.bug[d.candidate[0].bug].name);
    }
    print_message("%d of %d named, %d first\n", named, f->c.num_bugs, first);
    assert_true(first >= 0.9 * f->c.num_bugs);
}

/* Do two bugs look the same in every view, as far as the catalogue knows them? */
static bool look_alike(const struct fixture *f, int a, int b)
{
    for (int v = 0; v < f->c.num_views; v++) {
        const struct effect *x = f->c.view[v].effect[a], *y = f->c.view[v].effect[b];
        if ((x == NULL) != (y == NULL))
            return false;
        for (int i = 0; x != NULL && i < SIGNATURE_VALUES; i++) {
            double d = (double)x->mean[i] - (double)y->mean[i];
            if (fabs(d) >
                5 * sqrt((double)(x->var[i] + y->var[i])) + 1e-3 * fabs((double)x->mean[i]))
                return false;
        }
    }
    return true;
}

/* Each bug, as if it were not known: another is named only if it looks the same. Control, that the rule does it: some
 * leave noise at another strength, and are named at none. */
TEST(test_an_uncatalogued_bug_is_not_given_another_name)
{
    struct fixture *f = *state;
    int relatives = 0;
    gsl_rng_set(f->rng, 17);
    for (int b = 0; b < f->c.num_bugs; b++) {
        struct diagnosis d = look(f, b, 1, f->c.bug[b].name);
        if (d.finding == FINDING_BUG && !look_alike(f, b, d.candidate[0].bug))
            fail_msg("%s is called %s", f->c.bug[b].name, f->c.bug[d.candidate[0].bug].name);
        relatives += d.finding == FINDING_UNKNOWN && d.candidate[0].explained > 0.95 &&
                     d.candidate[0].excess < 4 && d.candidate[0].amplitude != 1;
    }
    assert_true(relatives >= 3);
}

/* The balance heuristic in place of the power heuristic: no mean is wrong, but samples vary more, so that adaptive
 * sampling takes more of them. Control: so many more that the sum of squares must be wrong. */
TEST(test_other_noise_has_no_name)
{
    struct fixture *f = *state;
    const double more[] = {1.2, 0};
    int never_stops = catalogue_bug(&f->c, "adaptive_never_stops");
    struct err e;
    gsl_rng_set(f->rng, 18);
    for (int i = 0; i < 2; i++) {
        struct diagnosis d;
        for (int v = 0; v < f->c.num_views; v++) {
            const struct effect *bug = f->c.view[v].effect[never_stops];
            draw_look(f, v, more[i] == 0 ? bug : NULL, 1, 1);
            f->clue[v].seen.fact_sd[FACT_SAMPLES] = f->c.view[v].correct.fact_sd[FACT_SAMPLES];
            if (bug != NULL && more[i] > 0) {
                f->clue[v].seen.fact[FACT_SAMPLES] += log(more[i]);
                f->clue[v].seen.fact[FACT_SPREAD] += log(more[i]);
            }
        }
        const struct diagnose_options opt = {.alpha = alpha};
        MUST(diagnose(&f->c, f->clue, f->c.num_views, &opt, &d, &e));
        assert_int_equal(d.finding, more[i] > 0 ? FINDING_UNKNOWN : FINDING_BUG);
        assert_int_equal(is_named(&d, never_stops), more[i] == 0);
    }
}

/* A bug at 40 % of its strength is the likeliest, with that amplitude, but is not named, as the bug itself does
 * more. */
TEST(test_an_amplitude_is_found)
{
    struct fixture *f = *state;
    int first = 0, right = 0;
    gsl_rng_set(f->rng, 15);
    for (int b = 0; b < f->c.num_bugs; b += 4) {
        struct diagnosis d = look(f, b, 0.4, NULL);
        assert_false(is_named(&d, b));
        if (d.num_candidates == 0 || d.candidate[0].bug != b)
            continue;
        first++;
        right += fabs(d.candidate[0].amplitude - 0.4) < 0.05;
    }
    print_message("of %d bugs at 40 %%, %d first, %d with the amplitude\n", (f->c.num_bugs + 3) / 4,
                  first, right);
    assert_true(right >= 0.6 * ((f->c.num_bugs + 3) / 4));
}

TEST(test_another_shape_is_refused)
{
    struct fixture *f = *state;
    struct err e = {""};
    struct diagnosis d;
    draw_look(f, 0, NULL, 0, 1);
    f->clue[0].seen.rows = 4;
    const struct diagnose_options opt = {.alpha = alpha};
    REFUSES(diagnose(&f->c, f->clue, 1, &opt, &d, &e), "another shape");
}

TEST_GROUP(setup, teardown)
