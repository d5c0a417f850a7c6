/* The Sobol sampler: its sequence against the definition, the nets that it promises, uniformity and
 * independence of its scrambles, and how fast the variance of a mean falls. All statistical tests:
 * alpha = 1e-6, seeds and n fixed, no retry. */
#include "renderer/math/sampler.h"
#include "renderer/math/sampler_simd.h"
#include "tests/support/test.h"

#include <gsl/gsl_cdf.h>
#include <stdbool.h>

#define ALPHA   1e-6
#define Z_LIMIT 4.89

/* An element a + b w of the field of four elements: bit 1 is a, bit 0 is b. */
static unsigned times_w(unsigned x)
{
    /* w (a + b w) = a w + b (1 + w) */
    unsigned a = x >> 1, b = x & 1;
    return b << 1 | (a ^ b);
}

/* C(n, k) mod 2, of which the entries of the matrices of sampler.h are made; by_entries_2() and by_entries_4()
 * multiply them with the digits entry by entry. */
static unsigned binomial_is_odd(unsigned n, unsigned k)
{
    /* Pascal's rule, row after row. */
    bool row[33] = {true};
    for (unsigned i = 0; i < n; i++)
        for (unsigned j = i + 1; j > 0; j--)
            row[j] = row[j] != row[j - 1];
    return row[k];
}

static uint32_t by_entries_2(uint32_t digits)
{
    uint32_t out = 0;
    for (unsigned i = 0; i < 32; i++)
        for (unsigned j = i; j < 32; j++)
            if (digits >> (31 - j) & binomial_is_odd(j, i))
                out ^= 1u << (31 - i);
    return out;
}

static uint32_t by_entries_4(uint32_t digits)
{
    uint32_t out = 0;
    for (unsigned i = 0; i < 16; i++)
        for (unsigned j = i; j < 16; j++) {
            unsigned x = digits >> (30 - 2 * j) & 3;
            for (unsigned k = i; k < j; k++)
                x = times_w(x);
            if (binomial_is_odd(j, i))
                out ^= x << (30 - 2 * i);
        }
    return out;
}

static void sobol_point(uint32_t index, uint32_t x[4])
{
    sobolv(index, x);
    for (int d = 0; d < 4; d++)
        x[d] = vu_reverse_bits(x[d]);
}

TEST(sequence_is_as_defined)
{
    for (uint32_t i = 0; i < 300; i++) {
        uint32_t index = i < 200 ? i : i * 2654435761u, x[4], reversed = 0;
        for (int b = 0; b < 32; b++)
            reversed |= (index >> b & 1) << (31 - b);
        sobol_point(index, x);
        assert_true(x[0] == reversed);
        assert_true(x[1] == by_entries_2(x[0]));
        assert_true(x[2] == by_entries_4(x[0]));
        assert_true(x[3] == by_entries_2(x[2]));
    }
    /* The second dimension is Sobol's: direction numbers of the polynomial x + 1, by recurrence
     * v_k = v_{k-1} ^ v_{k-1} >> 1 [Joe08]. */
    uint32_t v = 1u << 31;
    for (int k = 0; k < 32; k++) {
        uint32_t x[4];
        sobol_point(1u << k, x);
        assert_true(x[1] == v);
        v ^= v >> 1;
    }
}

static struct sample4 draw(enum sampler_kind kind, uint32_t sample, uint32_t block)
{
    const struct sampler s = {kind, 77 + block / 8};
    return sampler_draw(&s, 31 * block, sample, block % 5, block % 3);
}

/* Whether each of n boxes holds exactly one of the n points; dimension d is cut into 2^bits[d] intervals. */
static bool one_in_each(enum sampler_kind kind, uint32_t block, uint32_t first, uint32_t n,
                        const int bits[4])
{
    bool *seen = calloc(n, sizeof *seen), ok = true;
    assert_non_null(seen);
    for (uint32_t i = 0; i < n; i++) {
        struct sample4 s = draw(kind, first + i, block);
        uint32_t box = 0;
        for (int d = 0; d < 4; d++)
            box = box << bits[d] | (uint32_t)(s.u[d] * (float)(1 << bits[d]));
        assert_true(box < n);
        ok = ok && !seen[box];
        seen[box] = true;
    }
    free(seen);
    return ok;
}

/* Every net that sampler.h promises, up to 2^12 points in two dimensions and 4^5 in four. */
TEST(points_are_nets)
{
    for (uint32_t block = 0; block < 12; block++) {
        for (int m = 0; m <= 12; m += 1 + (m > 6))
            for (int a = 0; a <= m; a++) {
                uint32_t n = 1u << m, first = block % 4 * n;
                assert_true(
                    one_in_each(SAMPLER_SOBOL, block, first, n, (const int[4]){a, m - a, 0, 0}));
                assert_true(
                    one_in_each(SAMPLER_SOBOL, block, first, n, (const int[4]){0, 0, a, m - a}));
            }
        for (int m = 1; m <= 5; m++)
            for (int a = 0; a <= m; a++)
                for (int b = 0; a + b <= m; b++)
                    for (int c = 0; a + b + c <= m; c++) {
                        const int bits[4] = {2 * a, 2 * b, 2 * c, 2 * (m - a - b - c)};
                        uint32_t n = 1u << 2 * m;
                        assert_true(one_in_each(SAMPLER_SOBOL, block, block % 4 * n, n, bits));
                    }
    }
    /* Negative controls: independent points are no net, nor are points that straddle two nets, nor
     * do the four dimensions do what two of them do (8 points, boxes 1/4 x 1/2 of u[0], u[2]). */
    const int bits[4] = {4, 4, 0, 0}, across[4] = {2, 0, 1, 0}, swapped[4] = {1, 0, 2, 0};
    assert_false(one_in_each(SAMPLER_INDEPENDENT, 0, 0, 256, bits));
    assert_false(one_in_each(SAMPLER_SOBOL, 0, 100, 256, bits));
    assert_false(one_in_each(SAMPLER_SOBOL, 0, 0, 8, across) &&
                 one_in_each(SAMPLER_SOBOL, 0, 0, 8, swapped));
}

enum { BINS = 16, SEEDS = 200000 };

/* H0: (x, y) is uniform on the square. 256 bins, each expecting 781: a density 3 % too high in half of
 * them and 3 % too low in the others adds 180 to chi-square, which is 255 +- 23 under H0. */
struct square {
    double count[BINS][BINS];
};

static void square_add(struct square *q, float x, float y)
{
    q->count[(int)(x * BINS)][(int)(y * BINS)]++;
}

static double square_p(const struct square *q)
{
    double chi2 = 0, expected = (double)SEEDS / (BINS * BINS);
    for (int i = 0; i < BINS; i++)
        for (int k = 0; k < BINS; k++)
            chi2 += (q->count[i][k] - expected) * (q->count[i][k] - expected) / expected;
    return gsl_cdf_chisq_Q(chi2, BINS * BINS - 1);
}

/* Over seeds, each number of each sample is uniform and independent of the other numbers of the same
 * sample. */
TEST(numbers_are_uniform)
{
    static const uint32_t samples[] = {0, 1, 6, 1023};
    static const int pairs[][2] = {{0, 1}, {2, 3}, {0, 2}, {1, 3}};
    for (size_t k = 0; k < sizeof samples / sizeof *samples; k++) {
        struct square q[4] = {{{{0}}}};
        for (uint32_t seed = 0; seed < SEEDS; seed++) {
            const struct sampler s = {SAMPLER_SOBOL, seed};
            struct sample4 u = sampler_draw(&s, 5, samples[k], 1, 2);
            for (int i = 0; i < 4; i++)
                square_add(&q[i], u.u[pairs[i][0]], u.u[pairs[i][1]]);
        }
        for (int i = 0; i < 4; i++)
            if (square_p(&q[i]) < ALPHA)
                fail_msg("sample %u, pair %d: p = %g", samples[k], i, square_p(&q[i]));
    }
}

/* The same sample of two blocks that differ in one index, over many such pairs: independent. */
TEST(blocks_are_independent)
{
    enum { PIXEL, VERTEX, PURPOSE, SEED, SAME, CHANGES };
    for (int change = 0; change < CHANGES; change++)
        for (int d = 0; d < 4; d++) {
            struct square q = {{{0}}};
            for (uint32_t i = 0; i < SEEDS; i++) {
                const struct sampler s = {SAMPLER_SOBOL, 9},
                                     t = {SAMPLER_SOBOL, change == SEED ? 10 : 9};
                struct sample4 a = sampler_draw(&s, 2 * i, 3, 1, 1);
                struct sample4 b = sampler_draw(&t, 2 * i + (change == PIXEL), 3,
                                                1 + (change == VERTEX), 1 + (change == PURPOSE));
                square_add(&q, a.u[d], b.u[d]);
            }
            double p = square_p(&q);
            if (change == SAME) /* negative control */
                assert_true(p < ALPHA);
            else if (p < ALPHA)
                fail_msg("change %d, dimension %d: p = %g", change, d, p);
        }
}

enum integrand { LINE, SMOOTH_2, STEP_2, SMOOTH_4, NUM_INTEGRANDS };

static double value(enum integrand f, const float u[4], int d)
{
    switch (f) {
    case LINE: return u[d];
    case SMOOTH_2: return exp(-u[0] - 2 * u[1]);
    case STEP_2: return u[2] * u[2] + u[3] * u[3] < 0.7f;
    case SMOOTH_4: return (1 + u[0]) * (1 + u[1]) * (1 + u[2]) * (1 + u[3]);
    case NUM_INTEGRANDS: break;
    }
    return 0;
}

/* Variance over `seeds` seeds of the mean over the first n samples. */
static double variance_of_mean(enum sampler_kind kind, enum integrand f, int d, uint32_t n,
                               uint32_t seeds)
{
    double mean = 0, m2 = 0;
    for (uint32_t seed = 0; seed < seeds; seed++) {
        const struct sampler s = {kind, seed + 1000000};
        double sum = 0;
        for (uint32_t i = 0; i < n; i++)
            sum += value(f, sampler_draw(&s, 1, i, 2, 1).u, d);
        double x = sum / n - mean;
        mean += x / (seed + 1);
        m2 += x * (sum / n - mean);
    }
    return m2 / (seeds - 1);
}

/* In one dimension nested uniform scrambling puts each of n = 2^m points uniformly and independently
 * into an interval of its own [Owen95], so the mean of u has variance 1/(12 n^3). H0: it has. The
 * sum of 8 or more such numbers is normal enough for var s^2 = 2 sigma^4/(seeds - 1): with 4000 seeds
 * 2.2 %, so the test accepts up to 10.9 % either way, and finds 20 % with power above 0.999. */
TEST(variance_on_a_line_is_owens)
{
    enum { R = 4000 };
    double limit = Z_LIMIT * sqrt(2.0 / (R - 1));
    for (int d = 0; d < 4; d++)
        for (uint32_t n = 8; n <= 128; n *= 4) {
            double expected = 1 / (12.0 * n * n * n);
            double v = variance_of_mean(SAMPLER_SOBOL, LINE, d, n, R);
            if (!(fabs(v / expected - 1) < limit))
                fail_msg("dimension %d, n = %u: variance %g, expected %g", d, n, v, expected);
        }
    /* Negative controls: independent numbers, which have 1/(12 n). */
    double v = variance_of_mean(SAMPLER_INDEPENDENT, LINE, 0, 32, R);
    assert_true(fabs(v * 12 * 32 - 1) < limit);
    assert_true(fabs(v * 12 * 32 * 32 * 32 - 1) > limit);
}

/* Slope of log variance over log n for n = 16, 64, 256, 1024, with its standard error. The kurtosis
 * of these means is at most 4, so each log variance has a variance of at most 3/(R-1). */
static double slope(enum sampler_kind kind, enum integrand f, double *std_error)
{
    enum { R = 400, POINTS = 4 };
    double sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (int k = 0; k < POINTS; k++) {
        uint32_t n = 16u << 2 * k;
        double x = log(n), y = log(variance_of_mean(kind, f, 0, n, R));
        sx += x;
        sy += y;
        sxx += x * x;
        sxy += x * y;
    }
    double spread = sxx - sx * sx / POINTS;
    *std_error = sqrt(3.0 / (R - 1) / spread);
    return (sxy - sx * sy / POINTS) / spread;
}

/* Variance falls as 1/n for independent samples. Of a scrambled net it falls as n^-3 (log n)^(s-1)
 * where the integrand is smooth [Owen97], which is -2.8 for s = 2 over these n and about -2.4 for s =
 * 4, and as n^-1.5 where a plane region has a smooth edge, since only the n^0.5 boxes on the edge
 * count. H0 for Sobol: the slope is no steeper than the limit; the standard error is 0.03, so these
 * limits are rejected with certainty if the rates are those. */
TEST(variance_falls_faster)
{
    static const double limit[NUM_INTEGRANDS] = {
        [LINE] = -2.7, [SMOOTH_2] = -2.4, [STEP_2] = -1.25, [SMOOTH_4] = -1.5};
    for (enum integrand f = LINE; f < NUM_INTEGRANDS; f++) {
        double se, b = slope(SAMPLER_SOBOL, f, &se);
        print_message("integrand %d: Sobol slope %.2f +- %.2f\n", (int)f, b, se);
        if (!(b + Z_LIMIT * se < limit[f]))
            fail_msg("integrand %d: slope %.3f +- %.3f, should be below %g", (int)f, b, se,
                     limit[f]);
        /* Negative control: independent samples, -1 and nothing else. */
        b = slope(SAMPLER_INDEPENDENT, f, &se);
        if (!(fabs(b + 1) < Z_LIMIT * se))
            fail_msg("integrand %d: slope of independent samples %.3f +- %.3f", (int)f, b, se);
        assert_true(b + Z_LIMIT * se > limit[f]);
    }
}
