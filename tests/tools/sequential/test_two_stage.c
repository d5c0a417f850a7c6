/* tools/sequential/two_stage.c: what two stages call DIFFERENT, and how often when nothing differs. */
#include "tests/support/simulate.h"

#include "tools/sequential/two_stage.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <gsl/gsl_cdf.h>

enum { SIDE = 8 };

struct world {
    struct moments a, b, a2, b2;
};

static struct world new_world(void)
{
    return (struct world){new_moments(SIDE, SIDE, "sample"), new_moments(SIDE, SIDE, "sample"),
                          new_moments(SIDE, SIDE, "sample"), new_moments(SIDE, SIDE, "sample")};
}

static void free_world(struct world *w)
{
    moments_free(&w->a);
    moments_free(&w->b);
    moments_free(&w->a2);
    moments_free(&w->b2);
}

/* Runs both stages. first_only: the second stage judges the first pair again, the mistake to be shown. */
static enum verdict run(const struct world *w, const struct compare_options *opt, bool first_only,
                        bool *flagged, char *reason)
{
    struct comparison first, second;
    struct err e;
    MUST(two_stage_first(&w->a, &w->b, opt, &first, &e));
    enum verdict v = first.verdict;
    *flagged = v == VERDICT_DIFFERENT;
    if (*flagged) {
        const struct moments *a2 = first_only ? &w->a : &w->a2, *b2 = first_only ? &w->b : &w->b2;
        MUST(two_stage_confirm(&first, a2, b2, opt, &second, &e));
        v = second.verdict;
        if (reason != NULL)
            strcpy(reason, second.reason);
        comparison_free(&second);
    }
    comparison_free(&first);
    return v;
}

static void paint(struct world *w, int n, double scale, double scale_again, uint64_t *state)
{
    simulate(&w->a, LAW_NORMAL, scale, n, false, state);
    simulate(&w->b, LAW_NORMAL, 1, n, false, state);
    simulate(&w->a2, LAW_NORMAL, scale_again, n, false, state);
    simulate(&w->b2, LAW_NORMAL, 1, n, false, state);
}

TEST(test_confirmed)
{
    struct world w = new_world();
    struct compare_options opt = {.alpha = 1e-9, .tile = SIDE};
    uint64_t seed = 1;
    bool flagged;
    char reason[256];
    /* sd of the image's relative difference: 0.3 sqrt(2/(16 64)) = 1.3 % a channel. 20 % are found. */
    paint(&w, 16, 1.2, 1.2, &seed);
    assert_int_equal(run(&w, &opt, false, &flagged, reason), VERDICT_DIFFERENT);
    assert_true(flagged);
    assert_non_null(strstr(reason, "confirmed"));
    /* Gone in the second pair, or turned round: not DIFFERENT. */
    paint(&w, 16, 1.2, 1, &seed);
    assert_int_not_equal(run(&w, &opt, false, &flagged, reason), VERDICT_DIFFERENT);
    assert_true(flagged);
    assert_non_null(strstr(reason, "did not confirm"));
    paint(&w, 16, 1.2, 0.8, &seed);
    assert_int_equal(run(&w, &opt, false, &flagged, reason), VERDICT_INCONCLUSIVE);
    assert_true(flagged);
    /* Nothing there: the first stage's word is final. */
    paint(&w, 16, 1, 1.2, &seed);
    assert_int_not_equal(run(&w, &opt, false, &flagged, NULL), VERDICT_DIFFERENT);
    assert_false(flagged);
    assert_true(fabs(two_stage_alpha(1e-6) - 1e-3) < 1e-18);
    free_world(&w);
}

/* One quarter brighter in stage 1, the same or another in stage 2: only the flagged place can be confirmed.
 * (The dense statistic, which has no place, may confirm that there is something.) n = 256: with fewer
 * samples the skewness of regions smaller than the image is not known well enough. */
TEST(test_same_place)
{
    struct world w = new_world();
    struct compare_options opt = {.alpha = 1e-6, .tile = SIDE};
    uint64_t seed = 2;
    bool flagged;
    char reason[256];
    for (int same = 0; same < 2; same++) {
        paint(&w, 256, 1, 1, &seed);
        for (int i = 0; i < 48; i++) { /* sd of a quarter's mean: 0.3/64 */
            int p = i / 3 / 4 * SIDE + i / 3 % 4;
            w.a.mean[3 * p + i % 3] += 0.08;
            w.a2.mean[3 * (p + (same ? 0 : 4)) + i % 3] += 0.08;
        }
        enum verdict v = run(&w, &opt, false, &flagged, reason);
        assert_true(flagged);
        bool place = v == VERDICT_DIFFERENT && strstr(reason, "4 x 4 pixels at 0,0") != NULL;
        assert_int_equal(place, same);
    }
    free_world(&w);
}

/* H0: equal laws. alpha 4 %, so 20 % in each stage. 1000 worlds: DIFFERENT in at most 4 %; more than 66
 * have a probability of 4e-5 at that rate. Negative control: a second stage on the first pair again
 * confirms what it saw, in more than 8 of 10, as its level is divided among the flagged places alone; a fresh
 * pair in at most 1 of 5. */
TEST(test_false_alarms)
{
    struct world w = new_world();
    struct compare_options opt = {.alpha = 0.04, .tile = SIDE};
    uint64_t seed = 3;
    int different = 0, num_flagged = 0, again = 0;
    assert_true(gsl_cdf_binomial_Q(66, 0.04, 1000) < 1e-4);
    for (int i = 0; i < 1000; i++) {
        bool flagged;
        paint(&w, 16, 1, 1, &seed);
        different += run(&w, &opt, false, &flagged, NULL) == VERDICT_DIFFERENT;
        num_flagged += flagged;
        if (flagged)
            again += run(&w, &opt, true, &flagged, NULL) == VERDICT_DIFFERENT;
    }
    print_message("of 1000 equal: %d flagged, %d DIFFERENT; %d if the first pair is used twice\n",
                  num_flagged, different, again);
    assert_true(different <= 66);
    assert_true(num_flagged > 40 && again > 0.8 * num_flagged);
    free_world(&w);
}

/* Each stage may say EQUIVALENT by its 1 - 2 (alpha/2) interval, so its half width is the quantile of Student's law
 * at alpha/2 standard errors, here 2.58; at alpha it would be 2.33, at alpha/4 2.81. Widening for the skew of 64 normal
 * pixels of 64 samples adds less than 0.05. */
TEST(test_level_of_intervals)
{
    struct world w = new_world();
    const struct compare_options opt = {.alpha = 0.01, .tile = SIDE};
    struct comparison first, second;
    uint64_t seed = 5;
    struct err e;
    paint(&w, 64, 1, 1, &seed);
    MUST(two_stage_first(&w.a, &w.b, &opt, &first, &e));
    assert_int_not_equal(first.verdict, VERDICT_DIFFERENT);
    paint(&w, 64, 1.2, 1, &seed);
    struct comparison flagged;
    MUST(two_stage_first(&w.a, &w.b, &opt, &flagged, &e));
    assert_int_equal(flagged.verdict, VERDICT_DIFFERENT);
    MUST(two_stage_confirm(&flagged, &w.a2, &w.b2, &opt, &second, &e));
    const struct region *image[] = {&first.global[3], &second.global[3]};
    for (int i = 0; i < 2; i++) {
        double half = (image[i]->ci_hi - image[i]->ci_lo) / (2 * image[i]->std_error);
        assert_true(image[i]->ci_valid);
        assert_true(fabs(half - gsl_cdf_tdist_Qinv(opt.alpha / 2, image[i]->dof)) < 0.1);
    }
    comparison_free(&first);
    comparison_free(&flagged);
    comparison_free(&second);
    free_world(&w);
}

TEST(test_check_fresh)
{
    struct world w = new_world();
    struct err e;
    uint64_t seed = 4;
    paint(&w, 16, 1, 1, &seed);
    assert_true(two_stage_check_fresh(&w.a, &w.a2, &e));
    REFUSES(two_stage_check_fresh(&w.a, &w.a, &e), "fresh seeds");
    strcpy(w.a.unit, "exact");
    assert_true(two_stage_check_fresh(&w.a, &w.a, &e));
    assert_false(two_stage_check_fresh(&w.a, &w.a2, &e));
    OWN(moments) small = new_moments(4, 4, "sample");
    REFUSES(two_stage_check_fresh(&w.b, &small, &e), "4 x 4");
    free_world(&w);
}
