/* The error rates of tools/sequential/alpha_spending.c, measured on synthetic renders whose truth is known. Seeds and
 * numbers of claims were fixed before the first run; nothing is retried. "Consistent with at most alpha":
 * the lower Clopper-Pearson bound of the observed rate at confidence 0.999 does not exceed alpha. With 2000
 * claims at 5 % it takes 132 wrong verdicts to fail: a true rate of 5 % fails with 9.5e-4, one of 8 %
 * with 0.99 (both binomial).
 *
 * A render is 8 x 8 pixels that add blocks of 16 samples, each a random one of POOL blocks of normal
 * samples of mean 1 and standard deviation 0.7. A and B draw from one pool, so H0 holds exactly for what
 * is drawn, and 2000 claims of 512 samples a pixel cost seconds. Declared: 64 samples, so the looks are at
 * 16, 32, 64, 128, 256 and 512. */
#include "tests/support/rates.h"
#include "tests/support/simulate.h"

#include "tools/sequential/two_stage.h"
#include "tools/sequential/alpha_spending.h"
#include "tests/support/test.h"

enum { SIDE = 8, PIXELS = SIDE * SIDE, BLOCK = 16, POOL = 20000, DECLARED = 64, CLAIMS = 2000 };

static struct block {
    double mean, m2, m3;
} pool[POOL];

static int fill_pool(void **state)
{
    (void)state;
    uint64_t seed = 4711;
    for (int i = 0; i < POOL; i++) {
        struct block *b = &pool[i];
        draw_pixel(LAW_NORMAL, 0.7 / 0.3, BLOCK, &seed, &b->mean, &b->m2, &b->m3);
        b->mean += 1 - 0.7 / 0.3;
    }
    return 0;
}

/* The samples of one side: `m` holds the first n blocks. */
struct stream {
    struct moments m;
    int n;
    uint64_t seed;
    bool grey;
    double bias; /* the means are those of the pool times 1 + bias, the noise is the pool's */
};

static struct stream new_stream(bool grey, double bias, uint64_t seed)
{
    return (struct stream){new_moments(SIDE, SIDE, "sample"), 0, seed, grey, bias};
}

/* Pebay's pairwise sums, written out here for one value. */
static void merge_block(double n, double *mean, double *m2, double *m3, const struct block *b)
{
    double k = BLOCK, all = n + k, d = b->mean - *mean;
    *m3 += b->m3 + d * d * d * n * k * (n - k) / (all * all) + 3 * d * (n * b->m2 - k * *m2) / all;
    *m2 += b->m2 + d * d * n * k / all;
    *mean += d * k / all;
}

static void grow(struct stream *s, int n)
{
    for (; s->n < n; s->n += BLOCK)
        for (size_t p = 0; p < PIXELS; p++) {
            const struct block *b = &pool[(int)(uniform(&s->seed) * POOL)];
            for (size_t i = 3 * p; i < 3 * p + 3; i++) {
                struct block shifted = *b;
                shifted.mean += s->bias;
                merge_block(s->n, &s->m.mean[i], &s->m.m2[i], &s->m.m3[i], &shifted);
                if (!s->grey)
                    b = &pool[(int)(uniform(&s->seed) * POOL)];
            }
            s->m.n[p] = s->n + BLOCK;
        }
}

struct claim {
    struct stream a[2], b[2];
    int look;
};

static bool pair_of(void *ctx, int stage, const struct moments **a, const struct moments **b,
                    struct err *e)
{
    struct claim *c = ctx;
    (void)e;
    int n = alpha_spending_count(c->look, DECLARED, BLOCK);
    grow(&c->a[stage], n);
    grow(&c->b[stage], n);
    *a = &c->a[stage].m;
    *b = &c->b[stage].m;
    return true;
}

/* Outcomes of sequences of looks, each counted at most once a claim. */
struct tally {
    int claims;
    int different, equivalent;           /* the verdict: of the first look that decides */
    int ever_different, ever_equivalent; /* at any of the looks, had they all been taken */
    int at[NUM_LOOKS];                   /* decided there */
    double samples;                      /* of A, mean over claims, as multiple of the declared */
};

static struct tally run(const struct alpha_spending *q, int stages, struct compare_options opt,
                        bool grey, double bias, int claims, uint64_t seed, bool all_looks)
{
    struct tally t = {.claims = claims};
    for (int i = 0; i < claims; i++) {
        struct claim c = {0};
        for (int k = 0; k < 2; k++) {
            uniform(&seed);
            c.a[k] = new_stream(grey, bias, seed ^ 0x5851f42d4c957f2du);
            uniform(&seed);
            c.b[k] = new_stream(grey, 0, seed ^ 0x5851f42d4c957f2du);
        }
        bool decided = false, different = false, equivalent = false;
        int n = 0;
        for (c.look = 0; c.look < NUM_LOOKS && (all_looks || !decided); c.look++) {
            int size = alpha_spending_count(c.look, DECLARED, BLOCK), stage;
            struct comparison r;
            struct err e;
            if (q->share[c.look] == 0 || size == 0)
                continue;
            MUST(alpha_spending_judge(q, c.look, stages, &opt, pair_of, &c, &r, &stage, &e));
            different = different || r.verdict == VERDICT_DIFFERENT;
            equivalent = equivalent || r.verdict == VERDICT_EQUIVALENT;
            if (!decided)
                n = size;
            if (!decided && r.verdict != VERDICT_INCONCLUSIVE) {
                decided = true;
                t.at[c.look]++;
                t.different += r.verdict == VERDICT_DIFFERENT;
                t.equivalent += r.verdict == VERDICT_EQUIVALENT;
            }
            comparison_free(&r);
        }
        t.ever_different += different;
        t.ever_equivalent += equivalent;
        t.samples += (double)n / DECLARED / claims;
        for (int k = 0; k < 2; k++) {
            moments_free(&c.a[k].m);
            moments_free(&c.b[k].m);
        }
    }
    return t;
}

static void print(const char *what, const struct tally *t)
{
    print_message("%-34s DIFFERENT %5.2f %%, EQUIVALENT %6.2f %%; decided at 1/4 .. 8:", what,
                  100.0 * t->different / t->claims, 100.0 * t->equivalent / t->claims);
    for (int l = 2; l < NUM_LOOKS; l++)
        print_message(" %.1f", 100.0 * t->at[l] / t->claims);
    print_message(" %%; %.2f x declared\n", t->samples);
}

static const struct alpha_spending every_look_at_alpha = {{1, 1, 1, 1, 1, 1, 1, 1}};
static const double alpha = 0.05;

/* By hand from the table in alpha_spending.h. */
TEST(test_schedule)
{
    const struct alpha_spending *all[] = {&alpha_spending_single, &alpha_spending_declared,
                                          &alpha_spending_open};
    const double sum[] = {1, 1, .975};
    for (int i = 0; i < 3; i++) {
        double s = 0;
        for (int l = 0; l < NUM_LOOKS; l++)
            s += all[i]->share[l];
        assert_true(fabs(s - sum[i]) < 1e-12);
        assert_true(all[i]->share[LOOK_DECLARED] >= .6);
    }
    const int of_64[NUM_LOOKS] = {0, 0, 16, 32, 64, 128, 256, 512};
    const int of_4096[NUM_LOOKS] = {64, 256, 1024, 2048, 4096, 8192, 16384, 32768};
    for (int l = 0; l < NUM_LOOKS; l++) {
        assert_int_equal(alpha_spending_count(l, 64, 16), of_64[l]);
        assert_int_equal(alpha_spending_count(l, 4096, 16), of_4096[l]);
    }
    assert_int_equal(alpha_spending_count(LOOK_DECLARED, 4, 16), 4);
    assert_int_equal(alpha_spending_count(LOOK_DECLARED - 1, 4, 16), 0);
}

/* H0: equal means. DIFFERENT at any of the looks, had all been taken, at most alpha. (Margins 0, so
 * that nothing is spared.) Negative control: the same looks, each at the whole alpha, break it. */
TEST(test_false_different)
{
    struct compare_options opt = {.alpha = alpha, .tile = SIDE};
    struct tally t = run(&alpha_spending_open, 1, opt, false, 0, CLAIMS, 1, true);
    struct tally naive = run(&every_look_at_alpha, 1, opt, false, 0, CLAIMS, 2, true);
    print_message("null, alpha 5 %%: DIFFERENT at any look %.2f %%; each look at alpha %.2f %%\n",
                  100.0 * t.ever_different / CLAIMS, 100.0 * naive.ever_different / CLAIMS);
    assert_true(lower_bound(t.ever_different, CLAIMS) <= alpha);
    assert_true(lower_bound(naive.ever_different, CLAIMS) > alpha);
}

/* H0: the bias lies just outside the margin of the image. EQUIVALENT at any look at most alpha. Standard
 * error of the image at n = 128: 1.1 %, so that the margin of 3 % is reached by intervals from there on.
 * Negative control as above. */
TEST(test_false_equivalent)
{
    struct compare_options opt = {
        .alpha = alpha, .margin_global = .03, .margin_tile = .25, .tile = 4};
    struct tally t = run(&alpha_spending_open, 1, opt, true, .03 * (1 + 1e-6), CLAIMS, 3, true);
    struct tally naive = run(&every_look_at_alpha, 1, opt, true, .03 * (1 + 1e-6), CLAIMS, 4, true);
    print_message("bias at the margin, alpha 5 %%: EQUIVALENT at any look %.2f %%, DIFFERENT %.2f "
                  "%%; each look at alpha %.2f %%\n",
                  100.0 * t.ever_equivalent / CLAIMS, 100.0 * t.ever_different / CLAIMS,
                  100.0 * naive.ever_equivalent / CLAIMS);
    assert_true(lower_bound(t.ever_equivalent, CLAIMS) <= alpha);
    assert_true(lower_bound(t.ever_different, CLAIMS) <= alpha);
    assert_true(lower_bound(naive.ever_equivalent, CLAIMS) > alpha);
}

/* The saving of several looks over one look at the declared samples. As in the suite, the margins (12 and
 * 40 %) are wide enough for equal renderers to pass at the declared size in most cases. The sequence decides
 * equal renderers with fewer samples on average, grossly different ones at its first look, and those near
 * the margin with more samples, where the single look stays undecided. */
TEST(test_saving)
{
    enum { RUNS = 500 };
    struct compare_options opt = {
        .alpha = 1e-3, .margin_global = .12, .margin_tile = .4, .tile = 4};
    const double bias[] = {0, .5, .06, .2};
    const char *const name[] = {"equal", "bias 50 %", "bias 6 %, half the margin", "bias 20 %"};
    struct tally t[4], single[4];
    for (int i = 0; i < 4; i++) {
        t[i] = run(&alpha_spending_open, 1, opt, true, bias[i], RUNS, 10 + (uint64_t)i, false);
        single[i] =
            run(&alpha_spending_single, 1, opt, true, bias[i], RUNS, 10 + (uint64_t)i, false);
        print(name[i], &t[i]);
        print("  one look", &single[i]);
        assert_true(t[i].different + t[i].equivalent >=
                    single[i].different + single[i].equivalent - RUNS / 50);
    }
    assert_int_equal(t[0].different, 0);
    assert_true(upper_bound(t[0].equivalent, RUNS) >= .99);
    assert_true(t[0].samples < .8);
    assert_true(t[1].at[2] >= RUNS * 95 / 100);
    assert_int_equal(t[1].different, RUNS);
    assert_int_equal(t[3].equivalent, 0);
    assert_true(upper_bound(t[3].different, RUNS) >= .95);
}

/* H0: equal means; two stages, one look, alpha = 1 %, so 10 % a stage. DIFFERENT at most 1 %. Negative
 * controls: stage 1 by itself, at 10 %, exceeds 1 %; so do two stages that share a reference, as with a
 * golden, when most of the noise is the reference's (16 samples against 512). This is why validate judges
 * such a claim in one stage. */
TEST(test_two_stages)
{
    const double product = 0.01;
    struct compare_options opt = {.alpha = product, .tile = SIDE}, one = opt;
    one.alpha = two_stage_alpha(product);
    assert_true(fabs(one.alpha - .1) < 1e-12);
    struct tally t = run(&alpha_spending_single, 2, opt, false, 0, CLAIMS, 21, true);
    struct tally first = run(&alpha_spending_single, 1, one, false, 0, CLAIMS, 22, true);
    int shared = 0;
    uint64_t seed = 23;
    for (int i = 0; i < CLAIMS; i++) {
        struct stream a = new_stream(false, 0, seed += 1000003),
                      a2 = new_stream(false, 0, seed + 1);
        struct stream b = new_stream(false, 0, seed + 2);
        struct comparison r, r2;
        struct err e;
        grow(&a, 512);
        grow(&a2, 512);
        grow(&b, 64);
        MUST(two_stage_first(&a.m, &b.m, &opt, &r, &e));
        if (r.verdict == VERDICT_DIFFERENT) {
            MUST(two_stage_confirm(&r, &a2.m, &b.m, &opt, &r2, &e));
            shared += r2.verdict == VERDICT_DIFFERENT;
            comparison_free(&r2);
        }
        comparison_free(&r);
        moments_free(&a.m);
        moments_free(&a2.m);
        moments_free(&b.m);
    }
    print_message(
        "two stages of 10 %%: DIFFERENT %.2f %%; one of them %.2f %%; reference shared by "
        "both %.2f %%\n",
        100.0 * t.different / CLAIMS, 100.0 * first.different / CLAIMS, 100.0 * shared / CLAIMS);
    assert_true(lower_bound(t.different, CLAIMS) <= product);
    assert_true(lower_bound(first.different, CLAIMS) > product);
    assert_true(lower_bound(shared, CLAIMS) > product);
}

/* Two stages at each of several looks, at an alpha too small for its rate to be measured: a wrong renderer is
 * found, an equal one passes. A second stage that repeats the seeds of the first is refused. */
TEST(test_two_stages_in_sequence)
{
    enum { RUNS = 100 };
    struct compare_options opt = {
        .alpha = 1e-9, .margin_global = .12, .margin_tile = .4, .tile = 4};
    struct tally wrong = run(&alpha_spending_open, 2, opt, true, .5, RUNS, 31, false);
    struct tally equal = run(&alpha_spending_open, 2, opt, true, 0, RUNS, 32, false);
    print("alpha 1e-9, two stages, bias 50 %", &wrong);
    print("alpha 1e-9, two stages, equal", &equal);
    assert_int_equal(wrong.different, RUNS);
    assert_int_equal(equal.equivalent, RUNS);

    struct claim c = {.look = LOOK_DECLARED};
    for (int k = 0; k < 2; k++) {
        c.a[k] = new_stream(true, .5, 33); /* of one seed */
        c.b[k] = new_stream(true, 0, 34 + (uint64_t)k);
    }
    struct comparison r;
    struct err e;
    int stage;
    REFUSES(
        alpha_spending_judge(&alpha_spending_single, c.look, 2, &opt, pair_of, &c, &r, &stage, &e),
        "fresh seeds");
    for (int k = 0; k < 2; k++) {
        moments_free(&c.a[k].m);
        moments_free(&c.b[k].m);
    }
}

TEST_GROUP(fill_pool, NULL)
