/* Pairs of images of the same seeds, judged in blocks (block_means.h): error rates and power, with images of other
 * seeds as the control. Seeds were fixed before the first run and nothing is retried. */
#include "reference/replicates/block_means.h"
#include "tests/support/simulate.h"
#include "tests/support/test.h"
#include "tools/compare/compare.h"

#include <gsl/gsl_cdf.h>

static struct block_means means_of(int width, int height, int tile, int capacity)
{
    struct block_means b;
    struct err e;
    MUST(block_means_alloc(&b, width, height, tile, capacity, &e));
    return b;
}

enum { SIDE = 32, PIXELS = SIDE * SIDE, IMAGES = 16, SAMPLES = 4, SETS = 200 };
static const double alpha = 0.05;

/* Each of a pixel's samples is taken from b and multiplied by `scale`, or with the probability `other` drawn anew. */
static void draw_pairs(enum law law, double scale, double other, uint64_t *state,
                       struct block_means *a, struct block_means *b)
{
    float x[2][3 * PIXELS];
    struct err e;
    *a = means_of(SIDE, SIDE, 16, IMAGES);
    *b = means_of(SIDE, SIDE, 16, IMAGES);
    for (int k = 0; k < IMAGES; k++) {
        for (int p = 0; p < PIXELS; p++) {
            double sum[2] = {0};
            for (int i = 0; i < SAMPLES; i++) {
                const double of_b = draw(law, state);
                sum[0] += scale * (uniform(state) < other ? draw(law, state) : of_b);
                sum[1] += of_b;
            }
            for (int c = 0; c < 3; c++)
                for (int s = 0; s < 2; s++)
                    x[s][3 * p + c] = (float)(sum[s] / SAMPLES);
        }
        MUST(block_means_add(a, x[0], &e));
        MUST(block_means_add(b, x[1], &e));
    }
}

/* How many of SETS sets come out so. */
static int count_verdicts(enum verdict verdict, enum law law, double scale, double other,
                          double margin, uint64_t seed)
{
    const struct compare_options opt = {.alpha = alpha,
                                        .margin_global = margin,
                                        .margin_tile = 4 * margin,
                                        .tile = 4,
                                        .is_paired = true};
    int found = 0;
    for (int i = 0; i < SETS; i++) {
        struct block_means a, b;
        struct moments pairs, mean;
        struct comparison c;
        struct err e;
        draw_pairs(law, scale, other, &seed, &a, &b);
        MUST(block_means_pair(&a, &b, &pairs, &mean, &e));
        MUST(compare_moments(&pairs, &mean, &opt, &c, &e));
        found += c.verdict == verdict;
        comparison_free(&c);
        moments_free(&pairs);
        moments_free(&mean);
        block_means_free(&a);
        block_means_free(&b);
    }
    return found;
}

/* Is the number of wrong verdicts one that a chance of at most alpha gives, but for 1e-6? */
static bool is_at_most_alpha(int wrong)
{
    return wrong == 0 || gsl_cdf_binomial_Q((unsigned)wrong - 1, alpha, SETS) > 1e-6;
}

/* n = 200 sets of 16 pairs for each law, alpha 5 %. H0: no difference, without a margin: DIFFERENT in at most alpha.
 * H0: a difference of exactly the margin: EQUIVALENT in at most alpha. From hardly any sample that differs to all: the
 * pairs need not be alike. Power: without a difference and 1 % of samples drawn anew the margin is kept in at least 90
 * %; of images of other seeds, the control, in at most 10 %. The margins are 1.2 standard errors of the image of other
 * seeds, sd of a sample, 0.3 and 1, times sqrt(2/(1024 x 4 x 16)) = 0.0055, and 12 where one sample in a hundred is
 * drawn anew. */
TEST(error_rates_of_pairs)
{
    static const struct {
        enum law law;
        double other, margin;
    } rows[] = {{LAW_NORMAL, 0.01, 0.002},      {LAW_NORMAL, 1, 0.01},
                {LAW_EXPONENTIAL, 0.01, 0.007}, {LAW_EXPONENTIAL, 1, 0.03},
                {LAW_RARE, 0.01, 0.04},         {LAW_FIREFLY, 0.01, 0.1},
                {LAW_LOGNORMAL, 0.0005, 0.01}};
    for (size_t i = 0; i < COUNT(rows); i++) {
        const enum law law = rows[i].law;
        const double other = rows[i].other, margin = rows[i].margin;
        const int different = count_verdicts(VERDICT_DIFFERENT, law, 1, other, 0, 100 + i),
                  equivalent =
                      count_verdicts(VERDICT_EQUIVALENT, law, 1 + margin, other, margin, 200 + i);
        print_message("law %d, %g drawn anew: DIFFERENT %d, EQUIVALENT at the margin %d of %d\n",
                      law, other, different, equivalent, SETS);
        assert_true(is_at_most_alpha(different));
        assert_true(is_at_most_alpha(equivalent));
    }
    for (size_t i = 0; i < COUNT(rows); i++) {
        if (rows[i].other == 1 || rows[i].law > LAW_EXPONENTIAL)
            continue;
        const double margin = rows[i].margin;
        const int pairs = count_verdicts(VERDICT_EQUIVALENT, rows[i].law, 1, 0.01, margin, 300 + i),
                  control = count_verdicts(VERDICT_EQUIVALENT, rows[i].law, 1, 1, margin, 400 + i),
                  seen = count_verdicts(VERDICT_DIFFERENT, rows[i].law, 1 + 2 * margin, 0.01,
                                        margin, 500 + i);
        print_message(
            "law %d: EQUIVALENT %d, of other seeds %d; DIFFERENT at twice the margin %d\n",
            rows[i].law, pairs, control, seen);
        assert_true(pairs >= 0.9 * SETS && control <= 0.1 * SETS && seen >= 0.9 * SETS);
    }
}
