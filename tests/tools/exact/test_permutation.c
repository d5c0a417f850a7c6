/* tools/exact/permutation.c: p against an enumeration written another way, its level by simulation of laws for
 * which no t would do, power, and a second stage. */
#include "tests/support/simulate.h"

#include "tools/exact/permutation.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <gsl/gsl_cdf.h>

static struct replicate_dir new_renders(int num, int width, int height)
{
    struct replicate_dir r = {.num = num, .width = width, .height = height};
    r.rgb = calloc((size_t)num, sizeof *r.rgb);
    r.name = calloc((size_t)num, sizeof *r.name);
    for (int k = 0; k < num; k++) {
        r.rgb[k] = calloc((size_t)(3 * width * height), sizeof **r.rgb);
        r.name[k] = malloc(16);
        snprintf(r.name[k], 16, "%d.exr", k);
    }
    return r;
}

enum law_of_images {
    NORMAL,
    CORRELATED, /* one number shared by all pixels, as much as each has of its own */
    FIREFLIES,  /* up to 1, but up to 1000 in 2 % of the pixels */
    NUM_LAWS
};

static void paint(struct replicate_dir *r, enum law_of_images law, double scale, uint64_t *state)
{
    for (int k = 0; k < r->num; k++) {
        double shared = draw(LAW_NORMAL, state) - 1;
        for (int i = 0; i < r->width * r->height; i++) {
            double v = draw(LAW_NORMAL, state);
            if (law == CORRELATED)
                v += shared;
            if (law == FIREFLIES)
                v = uniform(state) < 0.02 ? 1000 * uniform(state) : uniform(state);
            for (int c = 0; c < 3; c++)
                r->rgb[k][3 * i + c] = (float)(scale * v);
        }
    }
}

static struct permutation test_pair(const struct replicate_dir *a, const struct replicate_dir *b,
                                    struct permutation_options opt)
{
    struct permutation p;
    struct err e;
    MUST(permutation_test(a, b, &opt, &p, &e));
    return p;
}

/* Two-sample |t| with pooled variance, by its definition, of the three images whose bit is set in `labels` against
 * the other three: the largest over the 4 + 1 squares of side 1 and 2 in a 2 x 2 image. Grey, so channels add
 * nothing. */
static double largest_t(const double v[6][4], int labels)
{
    double best = 0;
    for (int r = 0; r < 5; r++) {
        double x[6], mean[2] = {0}, squares = 0;
        for (int k = 0; k < 6; k++) {
            x[k] = r < 4 ? v[k][r] : (v[k][0] + v[k][1] + v[k][2] + v[k][3]) / 4;
            mean[labels >> k & 1] += x[k] / 3;
        }
        for (int k = 0; k < 6; k++)
            squares += pow(x[k] - mean[labels >> k & 1], 2);
        best = fmax(best, fabs(mean[1] - mean[0]) / sqrt(squares / 4 * (2.0 / 3)));
    }
    return best;
}

TEST(test_by_enumeration)
{
    uint64_t seed = 3;
    for (int run = 0; run < 20; run++) {
        OWN(replicate_dir) a = new_renders(3, 2, 2), b = new_renders(3, 2, 2);
        double v[6][4];
        paint(&a, NORMAL, 1, &seed);
        paint(&b, NORMAL, run % 2 ? 1 : 2, &seed);
        for (int k = 0; k < 6; k++)
            for (int i = 0; i < 4; i++)
                v[k][i] = (k < 3 ? a.rgb[k] : b.rgb[k - 3])[3 * i];
        double observed = largest_t(v, 7);
        int reach = 0, all = 0;
        for (int labels = 0; labels < 64; labels++)
            if (__builtin_popcount((unsigned)labels) == 3) {
                all++;
                reach += largest_t(v, labels) >= observed * (1 - 1e-6);
            }
        struct permutation p = test_pair(&a, &b, (struct permutation_options){0.1, 1, 1});
        assert_int_equal(p.num_labellings, 20);
        assert_true(p.is_exhaustive);
        assert_true(fabs(p.p - (double)reach / all) < 1e-12);
        assert_true(fabs(p.smallest_p - 0.1) < 1e-12); /* 2/C(6,3) */
        assert_true(fabs(fabs(p.t) - observed) < 1e-4 * observed);
        assert_int_equal(p.num_regions, 4 * 5);
    }
}

/* 2/C(2K,K) for K = 5 to 10: 2/252, 2/924, 2/3432, 2/12870, 2/48620, 2/184756. From K = 11 on labellings are drawn at
 * random, so that 1/200001 is the least. */
TEST(test_smallest)
{
    assert_int_equal(permutation_needed(0.05, 2), 4);
    assert_int_equal(permutation_needed(8e-3, 2), 5);
    assert_int_equal(permutation_needed(1e-3, 2), 7);
    assert_int_equal(permutation_needed(1e-3, 1), 7);
    assert_int_equal(permutation_needed(1.1e-5, 2), 10);
    assert_int_equal(permutation_needed(5e-6, 2), 11);
    assert_int_equal(permutation_needed(1e-6, 2), 0);
    uint64_t seed = 9;
    OWN(replicate_dir) a = new_renders(4, 4, 4), b = new_renders(4, 4, 4);
    paint(&a, NORMAL, 1, &seed);
    paint(&b, NORMAL, 5, &seed);
    struct permutation p = test_pair(&a, &b, (struct permutation_options){1e-3, 0, 1});
    assert_int_equal(p.verdict, VERDICT_INCONCLUSIVE);
    assert_non_null(strstr(p.reason, "7 a side are needed"));
    p = test_pair(&a, &b, (struct permutation_options){1e-9, 0, 1});
    assert_int_equal(p.verdict, VERDICT_INCONCLUSIVE);
    assert_non_null(strstr(p.reason, "--again"));
    p = test_pair(&a, &b, (struct permutation_options){0.03, 0, 1});
    assert_int_equal(p.verdict, VERDICT_DIFFERENT);
}

/* p <= alpha in how many of `runs` pairs from one law. */
static int count_rejected(enum law_of_images law, double scale, double alpha, int runs,
                          uint64_t seed)
{
    OWN(replicate_dir) a = new_renders(5, 8, 8), b = new_renders(5, 8, 8);
    int rejected = 0;
    for (int i = 0; i < runs; i++) {
        paint(&a, law, scale, &seed);
        paint(&b, law, 1, &seed);
        struct permutation p = test_pair(&a, &b, (struct permutation_options){alpha, 2, 1});
        rejected += p.p <= alpha;
    }
    return rejected;
}

/* H0 holds exactly: P(p <= 5 %) = 12/252 = 4.76 % (p is a multiple of 2/252, ties aside). 2000 pairs a
 * law: 95 expected, sd 9.5; outside 65 to 128 with a probability below 1e-3. Fireflies tie, so only the
 * upper end is checked. Negative control: A brighter by a third must exceed it. */
TEST(test_level)
{
    for (int law = 0; law < NUM_LAWS; law++) {
        int got = count_rejected((enum law_of_images)law, 1, 0.05, 2000, 40 + (uint64_t)law);
        print_message("law %d: %d of 2000 at 5 %%\n", law, got);
        assert_true(got <= 128);
        if (law != FIREFLIES)
            assert_true(got >= 65);
    }
    assert_true(count_rejected(NORMAL, 1.33, 0.05, 200, 50) > 100);
}

/* A second stage tests the one region, one-sided: p a multiple of 1/252. */
TEST(test_confirm)
{
    uint64_t seed = 60;
    OWN(replicate_dir) a = new_renders(5, 8, 8), b = new_renders(5, 8, 8);
    struct permutation_options opt = {0.01, 2, 1};
    struct permutation first, second;
    struct err e;
    paint(&a, NORMAL, 1.5, &seed);
    paint(&b, NORMAL, 1, &seed);
    first = test_pair(&a, &b, opt);
    assert_int_equal(first.verdict, VERDICT_DIFFERENT);
    paint(&a, NORMAL, 1.5, &seed);
    paint(&b, NORMAL, 1, &seed);
    assert_true(permutation_confirm(&first, &a, &b, &opt, &second, &e));
    assert_int_equal(second.verdict, VERDICT_DIFFERENT);
    assert_true(fabs(second.p - 1.0 / 252) < 1e-12);
    assert_int_equal(second.num_regions, 1);
    assert_memory_equal(&second.rect, &first.rect, sizeof second.rect);
    assert_int_equal(second.channel, first.channel);
    /* As large, but the other way round: not confirmed. */
    assert_true(permutation_confirm(&first, &b, &a, &opt, &second, &e));
    assert_int_equal(second.verdict, VERDICT_INCONCLUSIVE);
    assert_true(second.p > 0.9);
    /* Equal renderers: p is uniform; here just not below. */
    paint(&a, NORMAL, 1, &seed);
    paint(&b, NORMAL, 1, &seed);
    assert_true(permutation_confirm(&first, &a, &b, &opt, &second, &e));
    assert_int_equal(second.verdict, VERDICT_INCONCLUSIVE);
}

/* A tile off by its MDB is found with about 95 %, one off by half of it less often. 60 of each: fewer than 50 have a
 * probability of 2e-4 at 95 %. Tiles of 4 in 8 x 8 pixels. */
TEST(test_tile_mdb)
{
    uint64_t seed = 91;
    OWN(replicate_dir) a = new_renders(7, 8, 8), b = new_renders(7, 8, 8);
    int found[2] = {0};
    for (int i = 0; i < 120; i++) {
        paint(&a, NORMAL, 1, &seed);
        paint(&b, NORMAL, 1, &seed);
        struct permutation_options opt = {0.01, 2, 4};
        struct permutation p = test_pair(&a, &b, opt);
        assert_true(p.mdb_tile > p.mdb);
        for (int k = 0; k < a.num; k++)
            for (int px = 0; px < 64; px++)
                for (int c = 0; c < 3 && px % 8 < 4 && px / 8 < 4; c++)
                    a.rgb[k][3 * px + c] += (float)(p.mdb_tile / (1 + i % 2));
        found[i % 2] += test_pair(&a, &b, opt).verdict == VERDICT_DIFFERENT;
    }
    print_message("a tile off by its MDB: found %d of 60, by half of it %d\n", found[0], found[1]);
    assert_true(found[0] >= 50 && found[1] < 45);
}

/* 11 a side are 705 432 labellings, more than 200 000, so random ones are drawn: p is a multiple of 1/200 001, and what
 * is far out is still found. */
TEST(test_random_labellings)
{
    uint64_t seed = 70;
    OWN(replicate_dir) a = new_renders(11, 2, 2), b = new_renders(11, 2, 2);
    paint(&a, NORMAL, 1, &seed);
    paint(&b, NORMAL, 1.5, &seed);
    struct permutation p = test_pair(&a, &b, (struct permutation_options){1e-3, 2, 1});
    assert_false(p.is_exhaustive);
    assert_int_equal(p.num_labellings, 200001);
    double steps = p.p * 200001;
    assert_true(fabs(steps - round(steps)) < 1e-6 && steps >= 1);
    assert_true(fabs(p.smallest_p - 1.0 / 200001) < 1e-15);
    assert_int_equal(p.verdict, VERDICT_DIFFERENT);
}

TEST(test_refused)
{
    uint64_t seed = 80;
    struct replicate_dir a = new_renders(3, 4, 4), b = new_renders(3, 4, 4),
                         c = new_renders(3, 2, 2);
    struct permutation p;
    struct permutation_options opt = {0.1, 0, 1};
    struct err e;
    paint(&a, NORMAL, 1, &seed);
    paint(&b, NORMAL, 1, &seed);
    paint(&c, NORMAL, 1, &seed);
    REFUSES(permutation_test(&a, &c, &opt, &p, &e), "4 x 4");
    memcpy(b.rgb[1], a.rgb[2], 48 * sizeof **a.rgb);
    REFUSES(permutation_test(&a, &b, &opt, &p, &e), "2.exr of A and 1.exr of B are the same image");
    replicate_dir_free(&a);
    replicate_dir_free(&b);
    replicate_dir_free(&c);
}
