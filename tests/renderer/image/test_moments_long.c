/* A day of rendering, and longer, by merging: 10^10 samples of one pixel against exact sums in whole numbers.
 *
 * The samples are whole numbers, so that n, S1 = sum x, S2 = sum x^2, S3 = sum x^3 are known exactly, and
 *   mean = S1/n,  M2 = (n S2 - S1^2)/n,  M3 = (n^2 S3 - 3 n S1 S2 + 2 S1^3)/n^2
 * with whole sums in 128-bit integers and the divisions in long double. Bounds: each of the K merges rounds each moment
 * a few times, each time by at most u = 2^-53 of a sum that only grows (samples >= 0, no cancellation), so the relative
 * error is below 8 K u in the worst case, and about 8 sqrt(K) u if roundings have random signs. Drift would be an error
 * that grows as K: the test asks for 100 sqrt(K) u, which is a tenth of the worst case at K = 15000 and an eightieth of
 * it at the end (K = 10^6). */
#include "renderer/image/moments.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

__extension__ typedef __int128 wide;

struct sums {
    wide n, s1, s2, s3;
};

/* One pass of the renderer over the pixel: mostly dark, with rare bright samples, skewed like a caustic; 0 .. 400. */
static long sample(long i)
{
    uint32_t h = (uint32_t)i * 2654435761u;
    h ^= h >> 15;
    return h % 97 == 0 ? 200 + (long)(h >> 8) % 201 : (long)(h >> 8) % 7;
}

static void add_block(struct moments *m, struct sums *s, long first, long count)
{
    for (long i = first; i < first + count; i++) {
        long x = sample(i);
        moments_add(m, 0, (double[3]){(double)x, (double)(2 * x), (double)(3 * x)});
        s->n += 1;
        s->s1 += x;
        s->s2 += x * x;
        s->s3 += x * x * x;
    }
}

static double relative_error(double got, long double want)
{
    return (double)fabsl(((long double)got - want) / want);
}

/* The largest relative error of mean, M2 and M3 of all channels, which are 1, 2 and 3 times the same numbers. */
static double worst_error(const struct moments *m, const struct sums *s, double each[3])
{
    long double n = (long double)s->n;
    long double mean = (long double)s->s1 / n;
    /* n S2 - S1^2: at most 10^10 * 10^10 * 1.6 10^5, far below 2^127. */
    long double m2 = (long double)(s->n * s->s2 - s->s1 * s->s1) / n;
    /* M3 about a whole number r near the mean, so that no product comes near 2^127: with the exact sums
     * t_k = sum (x - r)^k and d = t1/n it is t3 - 3 d t2 + 2 n d^3. */
    wide r = s->s1 / s->n;
    wide t1 = s->s1 - s->n * r;
    wide t2 = s->s2 - 2 * r * s->s1 + s->n * r * r;
    wide t3 = s->s3 - 3 * r * s->s2 + 3 * r * r * s->s1 - s->n * r * r * r;
    long double d = (long double)t1 / n;
    long double m3 = (long double)t3 - 3 * d * (long double)t2 + 2 * d * d * d * n;
    each[0] = each[1] = each[2] = 0;
    for (int c = 0; c < 3; c++) {
        long double k = c + 1;
        each[0] = fmax(each[0], relative_error(m->mean[c], k * mean));
        each[1] = fmax(each[1], relative_error(m->m2[c], k * k * m2));
        each[2] = fmax(each[2], relative_error(m->m3[c], k * k * k * m3));
    }
    return fmax(each[0], fmax(each[1], each[2]));
}

static void merge(struct moments *dst, const struct moments *src)
{
    struct err e;
    MUST(moments_merge(dst, src, &e));
}

enum { BLOCK = 10000, NUM_BLOCKS = 16 };

struct blocks {
    struct moments m[NUM_BLOCKS];
    struct sums s[NUM_BLOCKS];
};

static void make_blocks(struct blocks *b)
{
    struct err e;
    memset(b, 0, sizeof *b);
    for (int i = 0; i < NUM_BLOCKS; i++) {
        assert_true(moments_alloc(&b->m[i], 1, 1, &e));
        add_block(&b->m[i], &b->s[i], (long)i * BLOCK, BLOCK);
    }
}

static void free_blocks(struct blocks *b)
{
    for (int i = 0; i < NUM_BLOCKS; i++)
        moments_free(&b->m[i]);
}

static void add_sums(struct sums *to, const struct sums *s, long times)
{
    to->n += times * s->n;
    to->s1 += times * s->s1;
    to->s2 += times * s->s2;
    to->s3 += times * s->s3;
}

static void check(const char *what, const struct moments *m, const struct sums *s, double merges)
{
    double each[3], bound = 100 * sqrt(merges) * 0x1p-53;
    double worst = worst_error(m, s, each);
    print_message("%s, %.0f samples: mean %.2g, M2 %.2g, M3 %.2g; bound %.2g\n", what, m->n[0],
                  each[0], each[1], each[2], bound);
    assert_true(m->n[0] == (double)s->n);
    assert_true(worst < bound);
}

static void merge_in_turn(const struct blocks *b, int merges, struct moments *all,
                          struct sums *sums)
{
    for (int i = 0; i < merges; i++)
        merge(all, &b->m[i % NUM_BLOCKS]);
    for (int i = 0; i < NUM_BLOCKS; i++)
        add_sums(sums, &b->s[i], merges / NUM_BLOCKS);
}

/* One after the other, as passes come: 10^6 blocks of 10^4. */
TEST(a_long_row_of_merges_does_not_drift)
{
    enum { MERGES = 1000000 };
    struct blocks b;
    OWN(moments) all;
    struct sums sums = {0};
    struct err e;
    make_blocks(&b);
    assert_true(moments_alloc(&all, 1, 1, &e));
    merge_in_turn(&b, MERGES, &all, &sums);
    check("one after the other", &all, &sums, MERGES);
    free_blocks(&b);
}

/* A tree, as machines would: 16 blocks, doubled 16 times: 1.05 10^10. */
TEST(a_tree_of_merges_does_not_drift)
{
    struct blocks b;
    struct sums sums = {0};
    make_blocks(&b);
    for (int step = 1; step < NUM_BLOCKS; step *= 2)
        for (int i = 0; i < NUM_BLOCKS; i += 2 * step)
            merge(&b.m[i], &b.m[i + step]);
    for (int i = 0; i < NUM_BLOCKS; i++)
        add_sums(&sums, &b.s[i], 1L << 16);
    for (int k = 0; k < 16; k++)
        merge(&b.m[0], &b.m[0]);
    check("a tree", &b.m[0], &sums, 20);
    free_blocks(&b);
}

/* The test can fail: one block merged with its mean off by 10^-9 of itself, each time, is seen. */
TEST(drift_would_be_seen)
{
    enum { MERGES = 100000 };
    struct blocks b;
    OWN(moments) all;
    struct sums sums = {0};
    struct err e;
    make_blocks(&b);
    assert_true(moments_alloc(&all, 1, 1, &e));
    b.m[3].mean[1] *= 1 + 1e-9;
    merge_in_turn(&b, MERGES, &all, &sums);
    double each[3];
    assert_true(worst_error(&all, &sums, each) > 100 * sqrt(MERGES) * 0x1p-53);
    free_blocks(&b);
}
