#include "independence.h"

#include <gsl/gsl_cdf.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LARGEST_BLOCK = 8, FEWEST_BLOCKS = 64, FEWEST_REPLICATES = 4 };

/* Sums over blocks from which z_of() computes the moments over permutations. */
struct sums {
    size_t k;
    double *g;     /* k x k, lower triangle: sum of G_b */
    double *block; /* k x k, lower triangle: one G_b */
    double s0, s0_squared, s1, s2;
    int pixels, blocks;
};

/* Adds the lower triangle of the sum of e e' over n pixels, each a vector e of k numbers. */
static void add_products(double *g, const double *e, size_t n, size_t k)
{
    for (size_t i = 0; i < k; i++) {
        double *row = g + i * k;
        for (size_t p = 0; p < n; p++) {
            const double *x = e + p * k;
            double xi = x[i];
            for (size_t j = 0; j <= i; j++)
                row[j] += xi * x[j];
        }
    }
}

static void add_block(struct sums *s, const double *e, size_t n)
{
    size_t k = s->k;
    memset(s->block, 0, k * k * sizeof *s->block);
    add_products(s->block, e, n, k);
    double s0 = 0, s1 = 0, s2 = 0;
    for (size_t i = 0; i < k; i++) {
        for (size_t j = 0; j < i; j++) {
            double x = s->block[i * k + j];
            s0 += 2 * x;
            s1 += 4 * x * x;
            s->g[i * k + j] += x;
        }
        /* Residuals add up to 0, so the rest of row i adds up to minus its diagonal. */
        double diagonal = s->block[i * k + i];
        s2 += 4 * diagonal * diagonal;
    }
    s->s0 += s0;
    s->s0_squared += s0 * s0;
    s->s1 += s1;
    s->s2 += s2;
    s->pixels += (int)n;
    s->blocks++;
}

/* Adds all blocks of the image that have a noisy pixel; e has room for one block. */
static void add_blocks(struct sums *s, const struct replicates *r, int side, double *e)
{
    for (int y0 = 0; y0 < r->height; y0 += side)
        for (int x0 = 0; x0 < r->width; x0 += side) {
            size_t n = 0;
            for (int y = y0; y < y0 + side && y < r->height; y++)
                for (int x = x0; x < x0 + side && x < r->width; x++)
                    n += replicates_residuals(r, (size_t)y * (size_t)r->width + (size_t)x,
                                              e + n * s->k);
            if (n > 0)
                add_block(s, e, n);
        }
}

/* Sums of the weights w: S0 = sum w, S1 = 2 sum w^2, S2 = sum over rows of (2 row sum)^2. */
struct weights {
    double s0, s1, s2;
};

/* Mean and variance over permutations of T = sum over i != j of w_ij G_ij [CliffOrd81, eq. 2.27 ff.]:
 * for one block
 *   E T   = S0 W0 / (k)_2
 *   E T^2 = S1 W1 / (2 (k)_2) + (S2 - 2 S1)(W2 - 2 W1) / (4 (k)_3)
 *         + (S0^2 + S1 - S2)(W0^2 + W1 - W2) / (k)_4
 * with (k)_m = k (k-1) .. (k-m+1); blocks are permuted independently, so both add up. */
static double z_of(const struct sums *s, struct weights w, double t)
{
    double k = (double)s->k, k2 = k * (k - 1), k3 = k2 * (k - 2), k4 = k3 * (k - 3);
    double mean = s->s0 * w.s0 / k2;
    double square = s->s1 * w.s1 / (2 * k2) + (s->s2 - 2 * s->s1) * (w.s2 - 2 * w.s1) / (4 * k3) +
                    (s->s0_squared + s->s1 - s->s2) * (w.s0 * w.s0 + w.s1 - w.s2) / k4;
    double variance = square - s->s0_squared * w.s0 * w.s0 / (k2 * k2);
    return variance > 0 ? (t - mean) / sqrt(variance) : 0;
}

static void test_pairs(const struct sums *s, struct independence *out)
{
    size_t k = s->k;
    const struct weights one = {.s0 = 2, .s1 = 4, .s2 = 8};
    for (size_t i = 0; i < k; i++)
        for (size_t j = 0; j < i; j++) {
            double z = z_of(s, one, 2 * s->g[i * k + j]);
            if (fabs(z) > fabs(out->pair_z)) {
                out->pair_z = z;
                out->pair_r = s->g[i * k + j] / s->pixels;
                out->pair[0] = (int)j;
                out->pair[1] = (int)i;
            }
        }
}

static void test_neighbours(const struct sums *s, struct independence *out)
{
    size_t k = s->k;
    double sum = 0;
    for (size_t i = 1; i < k; i++)
        sum += s->g[i * k + i - 1];
    double n = (double)(k - 1);
    const struct weights w = {.s0 = 2 * n, .s1 = 4 * n, .s2 = 4 * (4 * (n - 1) + 2)};
    out->neighbours_r = sum / n / s->pixels;
    out->neighbours_z = z_of(s, w, 2 * sum);
}

/* Whole batches only. With a mean correlation r within batches of B (-1/K under H0), and Var estimated from all
 * K replicates, B times the variance of a batch's mean over Var is 1 + (B - 1)(r + 1/K) up to terms of order 1/K^2. */
static void test_batches(const struct sums *s, struct independence *out)
{
    size_t k = s->k, b = (size_t)fmax(2, floor(sqrt((double)k))), m = k / b;
    double sum = 0;
    for (size_t i = 0; i < m * b; i++)
        for (size_t j = i / b * b; j < i; j++)
            sum += s->g[i * k + j];
    double pairs = (double)(m * b * (b - 1)) / 2, row = (double)(b - 1);
    const struct weights w = {
        .s0 = 2 * pairs, .s1 = 4 * pairs, .s2 = (double)(m * b) * 4 * row * row};
    out->batch = (int)b;
    out->batches_ratio = 1 + row * (sum / pairs / s->pixels + 1 / (double)k);
    out->batches_z = z_of(s, w, 2 * sum);
}

/* As large blocks as there are enough of, without those that are black. */
static int add_all(struct sums *s, const struct replicates *r, double *e)
{
    for (int side = LARGEST_BLOCK;; side /= 2) {
        memset(s->g, 0, s->k * s->k * sizeof *s->g);
        *s = (struct sums){.k = s->k, .g = s->g, .block = s->block};
        add_blocks(s, r, side, e);
        if (s->blocks >= FEWEST_BLOCKS || side == 1)
            return side;
    }
}

static double square_ratio(int i, double r)
{
    return 1 + (double)((2 << i) * (2 << i) - 1) * r;
}

static void test_squares(struct independence *out, double sharing)
{
    for (int i = 0; i < NUM_SQUARES; i++)
        if (square_ratio(i, out->square_r[i] - out->square_limit * out->square_se[i]) >
            SQUARES_VARY_MOST * sharing)
            out->square_failed = 2 << i;
}

/* Random numbers that all rows have in common add little to small squares, and much to columns. */
static void test_groups(struct independence *out, const struct shared_noise *shared, double alpha,
                        double sharing)
{
    for (int i = 0; i < shared->num_groups; i++) {
        const struct square_noise *g = &shared->group[i];
        if (g->ratio > out->group_ratio &&
            shared_noise_exceeds(g, SQUARES_VARY_MOST * sharing,
                                 log10(alpha / shared->num_groups))) {
            out->group_failed = i;
            out->group_side = g->side;
            out->group_ratio = g->ratio;
        }
    }
}

static void judge(const struct sums *s, const struct shared_noise *shared, double alpha,
                  double sharing, struct independence *out)
{
    double pairs = (double)s->k * (double)(s->k - 1) / 2;
    test_pairs(s, out);
    test_neighbours(s, out);
    test_batches(s, out);
    out->limit = sqrt(sharing) * gsl_cdf_ugaussian_Qinv(alpha / 4 / 2);
    out->pair_limit = sqrt(sharing) * gsl_cdf_ugaussian_Qinv(alpha / 4 / 2 / pairs);
    out->square_limit = sqrt(sharing) * gsl_cdf_ugaussian_Qinv(alpha / 4 / 2 / NUM_SQUARES);
    test_squares(out, sharing);
    test_groups(out, shared, alpha / 4 / 2, sharing);
    out->tested = true;
    out->passed = fabs(out->pair_z) <= out->pair_limit && fabs(out->neighbours_z) <= out->limit &&
                  fabs(out->batches_z) <= out->limit && out->square_failed == 0 &&
                  out->group_failed < 0;
}

bool independence_test(const struct replicates *r, const struct shared_noise *shared, double alpha,
                       struct independence *out, struct err *e)
{
    size_t k = (size_t)r->num;
    *out = (struct independence){.passed = true, .replicates = r->num, .group_failed = -1};
    if (k < FEWEST_REPLICATES)
        return true;
    struct sums s = {.k = k};
    s.g = calloc((2 * k + LARGEST_BLOCK * LARGEST_BLOCK) * k, sizeof *s.g); /* one block for all */
    if (s.g == NULL)
        return err_set(e, "independence of replicates: out of memory");
    s.block = s.g + k * k;
    out->block = add_all(&s, r, s.block + k * k);
    out->pixels = s.pixels;
    for (int i = 0; i < NUM_SQUARES; i++) {
        const struct square_noise *q = &shared->square[i < shared->num ? i : shared->num - 1];
        out->square_r[i] = q->r;
        out->square_se[i] = q->se;
    }
    if (s.blocks >= FEWEST_BLOCKS)
        judge(&s, shared, alpha, fmax(r->sharing, 1), out);
    free(s.g);
    return true;
}

static json_t *to_json(const struct independence *t)
{
    if (!t->tested)
        return json_pack("{s:b, s:i, s:i}", "tested", 0, "replicates", t->replicates,
                         "noisy_pixels", t->pixels);
    json_t *squares = json_array();
    for (int i = 0; i < NUM_SQUARES; i++)
        json_array_append_new(squares,
                              json_pack("{s:i, s:f, s:f}", "side", 2 << i, "pixel_correlation",
                                        t->square_r[i], "std_error", t->square_se[i]));
    return json_pack(
        "{s:b, s:b, s:f, s:i, s:i, s:i, s:{s:[i,i], s:f, s:f, s:f}, s:{s:f, s:f, s:f}, "
        "s:{s:i, s:f, s:f, s:f}, s:o}",
        "tested", 1, "passed", t->passed, "alpha", INDEPENDENCE_ALPHA, "replicates", t->replicates,
        "noisy_pixels", t->pixels, "block", t->block, "worst_pair", "replicates", t->pair[0],
        t->pair[1], "correlation", t->pair_r, "z", t->pair_z, "limit", t->pair_limit, "neighbours",
        "correlation", t->neighbours_r, "z", t->neighbours_z, "limit", t->limit, "batches", "size",
        t->batch, "variance_ratio", t->batches_ratio, "z", t->batches_z, "limit", t->limit,
        "squares", squares);
}

bool independence_check(const struct replicates *r, json_t *manifest, struct err *e)
{
    struct independence t;
    struct shared_noise shared = {0};
    if (r->num >= SHARED_NOISE_FEWEST && !shared_noise_measure(r, &shared, e))
        return false;
    if (!independence_test(r, &shared, INDEPENDENCE_ALPHA, &t, e))
        return false;
    json_object_set_new(manifest, "independence", to_json(&t));
    if (t.passed)
        return true;
    if (t.square_failed > 0 || t.group_failed >= 0) {
        char sums[64];
        double ratio = t.group_ratio;
        if (t.square_failed > 0) {
            int i = 0;
            while (2 << i < t.square_failed)
                i++;
            ratio = square_ratio(i, t.square_r[i]);
            snprintf(sums, sizeof sums, "%d x %d pixels", t.square_failed, t.square_failed);
        } else if (t.group_side == 0)
            snprintf(sums, sizeof sums, "two %s", t.group_failed == 0 ? "rows" : "columns");
        else
            snprintf(sums, sizeof sums, "one place in tiles of %d", t.group_side);
        return err_set(
            e,
            "pixels share their noise: sums over %s vary %.2g times as much as "
            "independent pixels would, and intervals would be too narrow (a pixel filter wider than "
            "declared, a denoiser, or random numbers that rows or tiles have in common?)",
            sums, ratio);
    }
    /* Reports the test that failed most clearly. */
    double pair = fabs(t.pair_z) / t.pair_limit, neighbours = fabs(t.neighbours_z) / t.limit,
           batches = fabs(t.batches_z) / t.limit;
    if (pair > neighbours && pair > batches)
        return err_set(e, "replicates %d and %d are not independent: correlation %.3f, z %.1f",
                       t.pair[0], t.pair[1], t.pair_r, t.pair_z);
    if (neighbours > batches)
        return err_set(e, "successive replicates are not independent: correlation %.4f, z %.1f",
                       t.neighbours_r, t.neighbours_z);
    return err_set(e,
                   "replicates are not independent: means of %d vary %.3f times as much as they "
                   "should, z %.1f",
                   t.batch, t.batches_ratio, t.batches_z);
}
