#include "permutation.h"

#include "permutation_table.h"
#include "renderer/base/isa.h"
#include "tools/compare/region.h"
#include "tools/stats/distributions.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <gsl/gsl_sort.h>

enum { MOST_LABELLINGS = 200000 };
static const double tie = 1e-9; /* relative: the same sum in another order is the same */

/* C(n, k), as a double: beyond 2^53 only its size matters. */
static double choose(int n, int k)
{
    double c = 1;
    for (int i = 1; i <= k; i++)
        c = c * (n - k + i) / i;
    return round(c);
}

/* The lowest p that can be reached. Swapping all of A and B does not change |t|, so two labellings tie. */
static double smallest_p(int num_a, int num_b, int sides)
{
    double all = choose(num_a + num_b, num_a);
    if (all > MOST_LABELLINGS)
        return 1 / (1 + (double)MOST_LABELLINGS);
    return (sides == 2 && num_a == num_b ? 2 : 1) / all;
}

int permutation_needed(double alpha, int sides)
{
    for (int k = 3; k <= 64; k++)
        if (smallest_p(k, k, sides) <= alpha)
            return k;
    return 0;
}

/* Row i of the num_a rows of `sum` becomes the sums of z over the first i + 1 rows labelled A; those before row `first`
 * are valid already. Returns the largest of the last row, which has the sums over all of A: absolute or, with t->sign,
 * signed. */
ISA_CLONES static double largest_sum(const struct permutation_table *t, const int *row, int first,
                                     double *sum)
{
    enum { STEP = 8 }; /* doubles in the widest SIMD register */
    for (int i = first; i < t->num_a; i++) {
        const double *z = t->z + (size_t)row[i] * t->num;
        double *to = sum + (size_t)i * t->num;
        if (i == 0)
            memcpy(to, z, t->num * sizeof *z);
        for (size_t r = 0; i > 0 && r < t->num; r++)
            to[r] = to[r - t->num] + z[r];
    }
    sum += (size_t)(t->num_a - 1) * t->num;
    if (t->sign != 0)
        return t->sign * sum[0];
    double best[STEP] = {0};
    size_t r = 0;
    for (; r + STEP <= t->num; r += STEP)
        for (size_t k = 0; k < STEP; k++)
            best[k] = fabs(sum[r + k]) > best[k] ? fabs(sum[r + k]) : best[k];
    for (; r < t->num; r++)
        best[0] = fmax(best[0], fabs(sum[r]));
    for (size_t k = 1; k < STEP; k++)
        best[0] = fmax(best[0], best[k]);
    return best[0];
}

/* Advances to the next subset of num_a rows in lexicographic order; returns the first place that changed, -1 at the
 * end. */
static int next_subset(int *row, int num_a, int rows)
{
    int i = num_a - 1;
    while (i >= 0 && row[i] == rows - num_a + i)
        i--;
    if (i < 0)
        return i;
    row[i]++;
    for (int j = i + 1; j < num_a; j++)
        row[j] = row[j - 1] + 1;
    return i;
}

/* splitmix64 */
static uint64_t next_random(uint64_t *state)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

/* Moves a random subset of num_a to the front. The remainder's bias is below 2^-57. */
static void random_subset(int *row, int num_a, int rows, uint64_t *state)
{
    for (int i = 0; i < num_a; i++) {
        /* NOLINTNEXTLINE(clang-analyzer-core.DivideZero): rows > num_a. */
        int j = i + (int)(next_random(state) % (uint64_t)(rows - i)), other = row[j];
        row[j] = row[i];
        row[i] = other;
    }
}

/* t of a sum of standardised rows: difference of means s (1/na + 1/nb), within groups a sum of
 * squares of 1 - s^2 (1/na + 1/nb). */
static double t_of_sum(const struct permutation_table *t, double s)
{
    double f = 1.0 / t->num_a + 1.0 / t->num_b, within = fmax(1e-18, 1 - s * s * f);
    return s * f / sqrt(within / (t->num_a + t->num_b - 2) * f);
}

/* Fills `largest` with the statistic of every labelling, the observed one first, and sorts it. */
static bool run_labellings(const struct permutation_table *t, struct permutation *out,
                           double **largest, size_t *where, double *observed, struct err *e)
{
    int rows = t->num_a + t->num_b;
    double all = choose(rows, t->num_a);
    out->is_exhaustive = all <= MOST_LABELLINGS;
    out->num_labellings = out->is_exhaustive ? (int)all : MOST_LABELLINGS + 1;
    int *row = malloc((size_t)rows * sizeof *row);
    double *sum = malloc((size_t)t->num_a * t->num * sizeof *sum);
    *largest = malloc((size_t)out->num_labellings * sizeof **largest);
    bool ok = row != NULL && sum != NULL && *largest != NULL;
    if (ok) {
        for (int k = 0; k < rows; k++)
            row[k] = k; /* the observed labelling */
        (*largest)[0] = *observed = largest_sum(t, row, 0, sum);
        const double *of = sum + (size_t)(t->num_a - 1) * t->num;
        for (*where = 0; *where + 1 < t->num && fabs(of[*where]) < *observed;)
            ++*where;
        uint64_t state = 1;
        /* In lexicographic order the second half has the complements of the first, whose sums are the same with the other sign. */
        const bool is_mirrored = out->is_exhaustive && t->sign == 0 && t->num_a == t->num_b;
        const int num = is_mirrored ? out->num_labellings / 2 : out->num_labellings;
        for (int i = 1; i < num; i++) {
            int first = 0;
            if (out->is_exhaustive)
                first = next_subset(row, t->num_a, rows);
            else
                random_subset(row, t->num_a, rows, &state);
            assert(first >= 0);
            (*largest)[i] = largest_sum(t, row, first, sum);
        }
        if (is_mirrored)
            memcpy(*largest + num, *largest, (size_t)num * sizeof **largest);
        gsl_sort(*largest, 1, (size_t)out->num_labellings);
    } else {
        err_set(e, "out of memory for %d labellings", out->num_labellings);
    }
    free(row);
    free(sum);
    return ok;
}

static bool check(const struct replicate_dir *a, const struct replicate_dir *b, struct err *e)
{
    if (a->width != b->width || a->height != b->height)
        return err_set(e, "A is %d x %d pixels, B is %d x %d", a->width, a->height, b->width,
                       b->height);
    int i, j;
    return !replicate_dir_share(a, b, &i, &j) ||
           err_set(e,
                   "%s of A and %s of B are the same image: exchangeable replicates need seeds of "
                   "their own",
                   a->name[i], b->name[j]);
}

static void describe(const struct permutation_table *t, size_t r, struct permutation *out)
{
    out->rect = t->rect[r];
    out->channel = t->channel[r];
    double d = t->mean[0][r] - t->mean[1][r], b = fabs(t->mean[1][r]);
    out->difference = b > 0 ? fmax(-1e6, fmin(1e6, d / b)) : copysign(1e6, d);
}

/* The difference of a region's mean, relative to B there (at least 5 % of the image's mean), that exceeds the critical
 * sum with a probability of about 95 %. */
static double region_found(const struct permutation_table *t, size_t r, double critical)
{
    if (!(t->spread[r] > 0))
        return 0; /* one value in all images */
    double f = 1.0 / t->num_a + 1.0 / t->num_b, dof = t->num_a + t->num_b - 2;
    double s = (t->mean[0][r] - t->mean[1][r]) / t->spread[r] / f;
    double se = t->spread[r] * sqrt(fmax(0, 1 - s * s * f) / dof * f);
    double unit = fmax(t->mean[1][r], 0.05 * t->mean[1][t->num - 1]);
    return fmin(region_mdb_none, (t_of_sum(t, critical) + stats_t_quantile(0.05, dof)) * se / unit);
}

/* The largest such difference over the smallest squares that hold a tile, in luminance; in a square larger than the
 * tile its error is diluted. */
static double tile_found(const struct permutation_table *t, int tile, double critical)
{
    size_t first = t->num - t->num / NUM_CHANNELS, level = t->num - 1;
    double largest = 0;
    for (size_t r = t->num; r-- > first;) {
        int side = t->rect[r].width > t->rect[r].height ? t->rect[r].width : t->rect[r].height;
        if (t->rect[r].x == 0 && t->rect[r].y == 0 && side >= tile)
            level = r;
    }
    for (size_t r = level; r < t->num; r++) {
        const struct rect *q = &t->rect[r];
        if (r > level && q->x == 0 && q->y == 0)
            break;
        double held = fmin(tile, q->width) * fmin(tile, q->height);
        largest = fmax(largest, region_found(t, r, critical) * q->width * q->height / held);
    }
    return fmin(region_mdb_none, largest);
}

static void decide(const struct permutation_options *opt, int num_a, int num_b, int width,
                   int height, struct permutation *out)
{
    char where[96];
    region_name(width, height, out->rect, out->channel, where, sizeof where);
    const char *kind = out->is_exhaustive ? "all" : "random";
    if (out->p <= opt->alpha) {
        out->verdict = VERDICT_DIFFERENT;
        snprintf(out->reason, sizeof out->reason,
                 "%s: difference %+.3g %%, t = %.3g; p = %.3g by %d labellings (%s), none smaller "
                 "than %.2g possible",
                 where, 100 * out->difference, out->t, out->p, out->num_labellings, kind,
                 out->smallest_p);
        return;
    }
    out->verdict = VERDICT_INCONCLUSIVE;
    int needed = permutation_needed(opt->alpha, 2);
    if (out->smallest_p > opt->alpha && needed > 0)
        snprintf(out->reason, sizeof out->reason,
                 "%d and %d replicates cannot reach a p below %.2g, alpha is %.2g: %d a side are "
                 "needed",
                 num_a, num_b, out->smallest_p, opt->alpha, needed);
    else if (out->smallest_p > opt->alpha)
        snprintf(out->reason, sizeof out->reason,
                 "no p below %.2g can be reached, alpha is %.2g: two stages (--again) of %d "
                 "replicates a side can",
                 out->smallest_p, opt->alpha, permutation_needed(sqrt(opt->alpha), 2));
    else {
        char image[32], tile[32];
        out->verdict = VERDICT_NOTHING_FOUND;
        snprintf(
            out->reason, sizeof out->reason,
            "an error of %s of the image or of %s of a tile would have been seen with 95 %%; p = "
            "%.3g by %d labellings (%s)",
            region_mdb_text(out->mdb, image), region_mdb_text(out->mdb_tile, tile), out->p,
            out->num_labellings, kind);
    }
}

/* Of the labellings, how many reach what was observed; `largest` is sorted. */
static int count_reaching(const double *largest, int num, double observed)
{
    int above = 0;
    while (above < num && largest[num - 1 - above] >= observed - tie * fabs(observed))
        above++;
    return above;
}

bool permutation_test(const struct replicate_dir *a, const struct replicate_dir *b,
                      const struct permutation_options *opt, struct permutation *out, struct err *e)
{
    *out = (struct permutation){.smallest_p = smallest_p(a->num, b->num, 2)};
    struct permutation_table t = {0};
    double *largest = NULL, observed = 0;
    size_t where = 0;
    bool ok = check(a, b, e) && permutation_table_make(a, b, opt->min_side, &t, e) &&
              run_labellings(&t, out, &largest, &where, &observed, e);
    size_t image = t.num - 1; /* the coarsest of the last channel */
    for (size_t r = 0; ok && r < t.num; r++)
        out->num_regions += t.spread[r] > 0;
    if (ok && !(t.spread[image] > 0))
        ok = err_set(e, "the images of A and B do not vary: were the seeds ignored?");
    if (ok && !(t.mean[1][image] > 0))
        ok = err_set(e, "B is black: relative differences have no unit");
    if (ok) {
        int n = out->num_labellings, most = (int)floor(opt->alpha * n);
        out->p = (double)count_reaching(largest, n, observed) / n;
        describe(&t, where, out);
        out->t = t_of_sum(&t, copysign(observed, t.mean[0][where] - t.mean[1][where]));
        out->mdb = out->mdb_tile = region_mdb_none;
        if (most > 0 && out->smallest_p <= opt->alpha) {
            out->mdb = region_found(&t, image, largest[n - most]);
            out->mdb_tile = tile_found(&t, opt->tile > 1 ? opt->tile : 1, largest[n - most]);
        }
        decide(opt, a->num, b->num, a->width, a->height, out);
    }
    free(largest);
    permutation_table_free(&t);
    return ok;
}

bool permutation_confirm(const struct permutation *first, const struct replicate_dir *a2,
                         const struct replicate_dir *b2, const struct permutation_options *opt,
                         struct permutation *out, struct err *e)
{
    *out = (struct permutation){.smallest_p = smallest_p(a2->num, b2->num, 1), .num_regions = 1};
    if (!check(a2, b2, e))
        return false;
    struct permutation_table t;
    double *largest = NULL, observed = 0;
    size_t region;
    bool ok = permutation_table_make_one(a2, b2, first->rect, first->channel, &t, e);
    t.sign = copysign(1, first->difference);
    ok = ok && run_labellings(&t, out, &largest, &region, &observed, e);
    if (ok) {
        char where[96];
        out->p =
            (double)count_reaching(largest, out->num_labellings, observed) / out->num_labellings;
        describe(&t, 0, out);
        out->t = t_of_sum(&t, observed * t.sign);
        region_name(a2->width, a2->height, t.rect[0], t.channel[0], where, sizeof where);
        out->verdict = out->p <= opt->alpha ? VERDICT_DIFFERENT : VERDICT_INCONCLUSIVE;
        snprintf(out->reason, sizeof out->reason,
                 "%s: %+.3g %%, then %+.3g %% with fresh seeds, p = %.2g and %.2g%s, each held "
                 "against %.2g",
                 where, 100 * first->difference, 100 * out->difference, first->p, out->p,
                 out->verdict == VERDICT_DIFFERENT ? "" : " (not confirmed)", opt->alpha);
    }
    free(largest);
    permutation_table_free(&t);
    return ok;
}
