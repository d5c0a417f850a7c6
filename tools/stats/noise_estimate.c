#include "noise_estimate.h"

#include "line_noise.h"

#include <gsl/gsl_cdf.h>
#include <gsl/gsl_sort.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK = 8, FEWEST = 16 };
static const double tail_factor = 4;    /* Var(sum r^2) / sum r^4 */
static const double skew_factor = 6;    /* 1 / sum of the kernel cubed */
static const double most_sd = 2.5;      /* at which D is clipped for its level */
static const double level_error = 1e-3; /* chance that the level is still too low */
/* Growth of the factor from one side to twice that: above `rising` larger squares are used, above `steep` still larger
 * ones; `unbounded` caps it. It is 4 while a square holds hardly more than one independent value. */
static const double rising = 1.5, steep = 2.5, unbounded = 3.8;
/* 2 / relative variance of the median of n squared differences of neighbours in a grid of independent normal values:
 * between 0.236 and 0.246 n in simulations of grids of 6 x 4 to 32 x 24 */
static const double median_dof = 0.236;

/* A grid of values, NAN where there is none. */
struct grid {
    int width, height;
    double *v;
};

static bool grid_alloc(struct grid *g, int width, int height, struct err *e)
{
    *g = (struct grid){width, height, malloc((size_t)width * (size_t)height * sizeof *g->v)};
    return g->v != NULL || err_set(e, "out of memory for %d x %d pixels", width, height);
}

static double at(const struct grid *g, int x, int y)
{
    return g->v[(size_t)y * (size_t)g->width + (size_t)x];
}

/* The kernel at x, y; NAN at the border and next to what is missing. */
static double second_difference(const struct grid *g, int x, int y)
{
    if (x < 1 || y < 1 || x > g->width - 2 || y > g->height - 2)
        return NAN;
    double row[3];
    for (int i = 0; i < 3; i++)
        row[i] = at(g, x - 1, y + i - 1) - 2 * at(g, x, y + i - 1) + at(g, x + 1, y + i - 1);
    return (row[0] - 2 * row[1] + row[2]) / 6;
}

/* Sums over one block. */
struct block {
    double num, s2, s3, s4;
};

static struct block sums_in(const struct grid *d, int left, int top, int right, int bottom)
{
    struct block s = {0};
    for (int y = top; y < bottom && y < d->height; y++)
        for (int x = left; x < right && x < d->width; x++) {
            double r = second_difference(d, x, y);
            if (isnan(r))
                continue;
            s.num++;
            s.s2 += r * r;
            s.s3 += r * r * r;
            s.s4 += r * r * r * r;
        }
    return s;
}

static struct block grid_sums(const struct grid *d)
{
    return sums_in(d, 0, 0, d->width, d->height);
}

struct blocks {
    int nx, ny;
    struct block *b;
    double *v,
        *m4; /* mean r^2 and r^4 of the block, with its neighbours if it has too few values */
};

static void blocks_free(struct blocks *g)
{
    free(g->b);
    free(g->v);
    free(g->m4);
}

static bool blocks_make(const struct grid *d, struct blocks *g, struct err *e)
{
    *g = (struct blocks){.nx = (d->width - 1) / BLOCK + 1, .ny = (d->height - 1) / BLOCK + 1};
    size_t num = (size_t)g->nx * (size_t)g->ny;
    g->b = malloc(num * sizeof *g->b);
    g->v = malloc(num * sizeof *g->v);
    g->m4 = malloc(num * sizeof *g->m4);
    if (g->b == NULL || g->v == NULL || g->m4 == NULL)
        return err_set(e, "out of memory for %zu blocks", num);
    double total = 0;
    for (int y = 0; y < g->ny; y++)
        for (int x = 0; x < g->nx; x++) {
            struct block *b = &g->b[(size_t)y * (size_t)g->nx + (size_t)x];
            *b = sums_in(d, x * BLOCK, y * BLOCK, (x + 1) * BLOCK, (y + 1) * BLOCK);
            total += b->num;
        }
    if (total < FEWEST)
        return err_set(
            e,
            "too many pixels are saturated to tell the noise of the others: give darker images, or "
            "files of floats");
    for (int y = 0; y < g->ny; y++)
        for (int x = 0; x < g->nx; x++) {
            struct block s = {0};
            for (int reach = 0; s.num < FEWEST; reach++) {
                s = (struct block){0};
                for (int j = y - reach; j <= y + reach; j++)
                    for (int i = x - reach; i <= x + reach; i++)
                        if (i >= 0 && j >= 0 && i < g->nx && j < g->ny) {
                            const struct block *b = &g->b[(size_t)j * (size_t)g->nx + (size_t)i];
                            s.num += b->num;
                            s.s2 += b->s2;
                            s.s4 += b->s4;
                        }
            }
            size_t k = (size_t)y * (size_t)g->nx + (size_t)x;
            g->v[k] = s.s2 / s.num;
            g->m4[k] = s.s4 / s.num;
        }
    return true;
}

/* Mean of D over 3 x 3 blocks, which follows a smooth difference of the images, and sqrt(pi/2) times the
 * mean absolute deviation from it, which is the sd of a normal distribution. */
static void local_scale(const struct grid *d, int bx, int by, double *mean, double *sd)
{
    for (int pass = 0; pass < 2; pass++) {
        double sum = 0, num = 0;
        for (int y = (by - 1) * BLOCK; y < (by + 2) * BLOCK; y++)
            for (int x = (bx - 1) * BLOCK; x < (bx + 2) * BLOCK; x++)
                if (x >= 0 && y >= 0 && x < d->width && y < d->height && !isnan(at(d, x, y))) {
                    sum += pass == 0 ? at(d, x, y) : fabs(at(d, x, y) - *mean);
                    num++;
                }
        *(pass == 0 ? mean : sd) = num > 0 ? sum / num : 0;
    }
    *sd *= sqrt(M_PI / 2);
}

/* (D - local mean)/sd, clipped at +-most_sd: independent if D is, and without the tails that would leave
 * few degrees of freedom. NAN where nothing varies. */
static void clip(const struct grid *d, struct grid *out)
{
    for (int by = 0; by * BLOCK < d->height; by++)
        for (int bx = 0; bx * BLOCK < d->width; bx++) {
            double mean = 0, sd = 0;
            local_scale(d, bx, by, &mean, &sd);
            for (int y = by * BLOCK; y < (by + 1) * BLOCK && y < d->height; y++)
                for (int x = bx * BLOCK; x < (bx + 1) * BLOCK && x < d->width; x++) {
                    double z = at(d, x, y) - mean;
                    out->v[(size_t)y * (size_t)d->width + (size_t)x] =
                        sd > 0 && !isnan(z) ? fmax(-most_sd, fmin(most_sd, z / sd)) : NAN;
                }
        }
}

/* Means of side x side values. */
static bool bin_means(const struct grid *d, int side, struct grid *bins, struct err *e)
{
    if (!grid_alloc(bins, d->width / side, d->height / side, e))
        return false;
    for (int y = 0; y < bins->height; y++)
        for (int x = 0; x < bins->width; x++) {
            double sum = 0;
            for (int i = 0; i < side * side; i++)
                sum += at(d, x * side + i % side, y * side + i / side);
            bins->v[(size_t)y * (size_t)bins->width + (size_t)x] = sum / (side * side);
        }
    return true;
}

/* Mean variance of the blocks that square (x, y) of this side overlaps. */
static double blocks_under(const struct blocks *g, int side, int x, int y)
{
    double sum = 0;
    int num = 0;
    for (int j = y * side / BLOCK; j <= ((y + 1) * side - 1) / BLOCK; j++)
        for (int i = x * side / BLOCK; i <= ((x + 1) * side - 1) / BLOCK; i++, num++)
            sum += g->v[(size_t)j * (size_t)g->nx + (size_t)i];
    return sum / num;
}

/* Variance of means over squares of this side, over that of independent pixels, and its degrees of freedom (0: too few
 * squares). From the median of squared differences of neighbouring squares, as few squares are left and many may lie in
 * a region in which the images differ. */
static bool coarse(const struct grid *d, const struct blocks *g, int side, double *factor,
                   double *dof, struct err *e)
{
    struct grid bins = {0};
    double *square = NULL;
    size_t num = 0;
    bool ok = bin_means(d, side, &bins, e);
    *factor = *dof = 0;
    if (ok) {
        square = malloc((2 * (size_t)bins.width * (size_t)bins.height + 1) * sizeof *square);
        ok = square != NULL || err_set(e, "out of memory for squares of %d pixels", side);
    }
    for (int y = 0; ok && y < bins.height; y++)
        for (int x = 0; x < bins.width; x++)
            for (int down = 0; down < 2; down++) {
                int right = x + !down, below = y + down;
                if (right == bins.width || below == bins.height)
                    continue;
                double r = at(&bins, x, y) - at(&bins, right, below),
                       v = blocks_under(g, side, x, y) + blocks_under(g, side, right, below);
                if (!isnan(r) && v > 0)
                    square[num++] = r * r / v;
            }
    if (ok && num >= FEWEST) {
        gsl_sort(square, 1, num);
        *factor = side * side * square[num / 2] / gsl_cdf_chisq_Pinv(0.5, 1);
        *dof = median_dof * (double)num;
    }
    free(square);
    free(bins.v);
    return ok;
}

/* An upper bound of the variance of sums over rows (or columns) over that of independent pixels of variance v; 1 unless
 * that is shown to be more than `factor`. */
static bool lines(const struct grid *d, bool columns, double v, double factor, double *bound,
                  struct err *e)
{
    const int num = columns ? d->width : d->height, length = columns ? d->height : d->width;
    double *sum = malloc(3 * (size_t)num * sizeof *sum);
    *bound = 1;
    if (sum == NULL)
        return err_set(e, "out of memory for %d lines", num);
    double *variance = sum + num, *square = variance + num;
    for (int i = 0; i < num; i++) {
        sum[i] = variance[i] = 0;
        for (int k = 0; k < length; k++) {
            const double z = columns ? at(d, i, k) : at(d, k, i);
            if (!isnan(z)) {
                sum[i] += z;
                variance[i] += v;
            }
        }
    }
    const size_t squares = line_noise_squares(sum, variance, (size_t)num, square);
    if (squares >= FEWEST) {
        double dof, ratio = line_noise_ratio(square, squares, &dof);
        if (gsl_cdf_chisq_Q(dof * ratio / factor, dof) < level_error)
            *bound = ratio * dof / gsl_cdf_chisq_Pinv(level_error, dof);
    }
    free(sum);
    return true;
}

static bool tell_too_few(struct err *e)
{
    return err_set(
        e, "too few pixels vary or are not saturated to tell their noise: give larger images, or "
           "directories of at least 3 renders");
}

/* *factor: variance of means over squares, over that of independent pixels; *bound: an upper bound of it for
 * arbitrarily large squares: the chi-square limit with the degrees of freedom of the sums of squares, plus the increase
 * from half the side once more, as the factor approaches its limit like 1/side, or more if it rises steeply. The side
 * is 4, or larger while the factor rises. */
static bool level(const struct grid *d, const struct blocks *blocks, double *factor, double *bound,
                  struct err *e)
{
    struct grid fine = {0}, twos = {0}, fours = {0};
    bool ok = grid_alloc(&fine, d->width, d->height, e);
    *factor = *bound = 1;
    if (ok)
        clip(d, &fine);
    ok = ok && bin_means(&fine, 2, &twos, e) && bin_means(&fine, 4, &fours, e);
    struct block f = {0}, g = {0}, h = {0};
    if (ok) {
        f = grid_sums(&fine);
        g = grid_sums(&twos);
        h = grid_sums(&fours);
        if (f.s2 > 0 && h.num < FEWEST)
            ok = tell_too_few(e);
    }
    if (ok && f.s2 > 0 && h.s2 > 0) {
        double dof = 2 / (tail_factor * (f.s4 / (f.s2 * f.s2) + h.s4 / (h.s2 * h.s2)));
        double half = 4 * (g.s2 / g.num) / (f.s2 / f.num);
        *factor = 16 * (h.s2 / h.num) / (f.s2 / f.num);
        bool shared = *factor > rising * half;
        double next, more;
        if (shared)
            ok = coarse(d, blocks, 4, factor, &dof, e) && (dof > 0 || tell_too_few(e));
        for (int side = 2 * 4; ok && shared; side *= 2) {
            ok = coarse(d, blocks, side, &next, &more, e);
            if (more == 0)
                break;
            half = *factor;
            *factor = next;
            dof = more;
            shared = *factor > steep * half;
        }
        double q = fmin(*factor / half, unbounded), rows = 1, columns = 1;
        const double v = f.s2 / f.num, known = fmax(1, *factor);
        ok = ok && lines(&fine, false, v, known, &rows, e) &&
             lines(&fine, true, v, known, &columns, e);
        if (ok) {
            *bound = *factor * dof / gsl_cdf_chisq_Pinv(level_error, dof) +
                     fmax(0, *factor - half) * fmax(1, q / (4 - q));
            *bound = fmax(*bound, rows + columns - 1);
            *factor = fmax(*factor, rows + columns - 1);
        }
    }
    free(fine.v);
    free(twos.v);
    free(fours.v);
    return ok;
}

/* Skewness of D, from the mean of (r/sd)^3 over the image, and its standard error, from the scatter of blocks' sums. */
static void skewness(const struct blocks *g, double *skew, double *error)
{
    size_t blocks = (size_t)g->nx * (size_t)g->ny;
    double num = 0, sum = 0, scatter = 0;
    for (size_t k = 0; k < blocks; k++)
        if (g->v[k] > 0) {
            num += g->b[k].num;
            sum += g->b[k].s3 / pow(g->v[k], 1.5);
        }
    *skew = *error = 0;
    if (num == 0)
        return;
    double mean = sum / num;
    for (size_t k = 0; k < blocks; k++)
        if (g->v[k] > 0)
            scatter += pow(g->b[k].s3 / pow(g->v[k], 1.5) - mean * g->b[k].num, 2);
    *skew = skew_factor * mean;
    *error = skew_factor * sqrt(scatter) / num;
}

/* Writes one side's pixel so that pyramid.c finds the variance v and the third cumulant k3:
 * n = 3, M2 = v n (n-1), M3 = k3 n (n-1)(n-2). */
static void set_pixel(struct moments *m, size_t i, double v, double k3)
{
    m->m2[i] = 6 * v;
    m->m3[i] = 6 * k3;
}

/* pyramid_estimate_from() takes k3^2/v for the variance of v: a third cumulant s on both sides, which cancels in the
 * difference, makes that of v/2 + v/2 tail_factor m4, as 2 s^2/(v/2) = 4 m4. */
static void set_channel(struct moments *a, struct moments *b, int c, const struct blocks *g,
                        double bound, double skew, const double *more_a, const double *more_b,
                        const unsigned char *censored)
{
    for (int y = 0; y < a->height; y++)
        for (int x = 0; x < a->width; x++) {
            size_t p = (size_t)y * (size_t)a->width + (size_t)x, i = 3 * p + (size_t)c;
            size_t k = (size_t)(y / BLOCK) * (size_t)g->nx + (size_t)(x / BLOCK);
            double v = bound * g->v[k], s = sqrt(tail_factor / 4 * bound * bound * g->m4[k] * v);
            double half_skew = skew * v * sqrt(v) / 2;
            if (censored != NULL && censored[p]) {
                set_pixel(a, i, 0, 0);
                set_pixel(b, i, 0, 0);
                continue;
            }
            set_pixel(a, i, v / 2 + (more_a != NULL ? more_a[i] : 0), s + half_skew);
            set_pixel(b, i, v / 2 + (more_b != NULL ? more_b[i] : 0), s - half_skew);
        }
}

static bool one_channel(struct moments *a, struct moments *b, int c, struct grid *d,
                        const double *more_a, const double *more_b, const unsigned char *censored,
                        bool independent, struct noise_estimate *out, struct err *e)
{
    size_t pixels = (size_t)d->width * (size_t)d->height;
    for (size_t p = 0; p < pixels; p++) {
        size_t i = 3 * p + (size_t)c;
        d->v[p] = censored != NULL && censored[p] ? NAN : a->mean[i] - b->mean[i];
    }
    struct blocks g;
    double bound = 1;
    out->factor[c] = 1;
    bool ok = blocks_make(d, &g, e) && (independent || level(d, &g, &out->factor[c], &bound, e));
    if (ok) {
        skewness(&g, &out->skewness[c], &out->skew_error[c]);
        double skew = out->skewness[c] + copysign(out->skew_error[c], out->skewness[c]);
        set_channel(a, b, c, &g, fmax(1, bound), skew, more_a, more_b, censored);
    }
    blocks_free(&g);
    return ok;
}

bool noise_estimate_variance(struct moments *a, struct moments *b, const double *more_a,
                             const double *more_b, const unsigned char *censored, bool independent,
                             struct noise_estimate *out, struct err *e)
{
    size_t pixels = (size_t)a->width * (size_t)a->height;
    bool same = true;
    for (size_t i = 0; i < 3 * pixels && same; i++)
        same = (censored != NULL && censored[i / 3]) || a->mean[i] == b->mean[i];
    if (same)
        return err_set(e, "A and B are the same image: nothing tells how noisy it is");
    if (a->width < 4 * BLOCK || a->height < 4 * BLOCK)
        return err_set(e,
                       "%d x %d pixels are too few to tell noise by its neighbours, 32 x 32 are "
                       "needed",
                       a->width, a->height);
    struct grid d;
    if (!grid_alloc(&d, a->width, a->height, e))
        return false;
    bool ok = true;
    for (int c = 0; ok && c < 3; c++)
        ok = one_channel(a, b, c, &d, more_a, more_b, censored, independent, out, e);
    free(d.v);
    for (size_t p = 0; p < pixels; p++)
        a->n[p] = b->n[p] = 3;
    strcpy(a->unit, "picture");
    strcpy(b->unit, "picture");
    return ok;
}
