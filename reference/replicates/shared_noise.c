#include "shared_noise.h"

#include <assert.h>
#include <gsl/gsl_cdf.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double fewest_dof = 100; /* to know a variance to 14 % */
static const double most_growth =
    1.5; /* of a ratio beyond the largest squares; 1.75 if all pixels share */

/* Sums of residuals over squares: num planes of nx x ny, and the noisy pixels in each square. */
struct level {
    int nx, ny, num;
    double *sum, *pixels;
};

/* Sums the residuals of 2 x 2 pixels; e has room for one pixel's. */
static void sum_pixels(const struct replicates *r, double *e, struct level *l)
{
    const size_t squares = (size_t)l->nx * (size_t)l->ny;
    for (int y = 0; y < r->height; y++)
        for (int x = 0; x < r->width; x++) {
            if (!replicates_residuals(r, (size_t)y * (size_t)r->width + (size_t)x, e))
                continue;
            const size_t i = (size_t)(y / 2) * (size_t)l->nx + (size_t)(x / 2);
            l->pixels[i]++;
            for (int k = 0; k < r->num; k++)
                l->sum[(size_t)k * squares + i] += e[k];
        }
}

/* Sums 2 x 2 squares of one plane; it may be written over, or what lies before it. */
static void halve(const double *plane, int nx, int ny, double *to)
{
    for (int y = 0; y < ny; y += 2)
        for (int x = 0; x < nx; x += 2) {
            double sum = 0;
            for (int i = 0; i < 4; i++)
                if (x + i % 2 < nx && y + i / 2 < ny)
                    sum += plane[(size_t)(y + i / 2) * (size_t)nx + (size_t)(x + i % 2)];
            *to++ = sum;
        }
}

static void coarsen(struct level *l)
{
    const size_t stride = (size_t)l->nx * (size_t)l->ny;
    const int nx = (l->nx + 1) / 2, ny = (l->ny + 1) / 2;
    halve(l->pixels, l->nx, l->ny, l->pixels);
    for (int k = 0; k < l->num; k++)
        halve(l->sum + (size_t)k * stride, l->nx, l->ny,
              l->sum + (size_t)k * (size_t)nx * (size_t)ny);
    l->nx = nx;
    l->ny = ny;
}

/* log10 of the chi-square tail beyond x, at least -300. */
static double log10_tail(double x, double dof)
{
    return log10(fmax(1e-300, gsl_cdf_chisq_Q(x, dof)));
}

/* Pairs of pixels p, q in one square: C = sum over k of e_k(p) e_k(q) has the mean 0 and, over permutations of one
 * against the other, the variance K - 1; different pairs are uncorrelated. */
static struct square_noise measure(const struct level *l, int side)
{
    const size_t squares = (size_t)l->nx * (size_t)l->ny;
    double products = 0, pairs = 0, pixels = 0, noisy = 0, freedom = l->num - 1;
    for (size_t i = 0; i < squares; i++) {
        double n = l->pixels[i], square = 0;
        for (int k = 0; k < l->num; k++)
            square += l->sum[(size_t)k * squares + i] * l->sum[(size_t)k * squares + i];
        products += (square - n * freedom) / 2;
        pairs += n * (n - 1) / 2;
        pixels += n;
        noisy += n > 0;
    }
    struct square_noise s = {.side = side, .ratio = 1, .dof = noisy * freedom};
    if (!(pairs > 0))
        return s;
    s.r = products / pairs / freedom;
    s.se = 1 / sqrt(pairs * freedom);
    s.ratio = 1 + 2 * products / (pixels * freedom);
    double x = s.dof + s.r / s.se * sqrt(2 * s.dof);
    s.log10_p = x > 0 ? log10_tail(x, s.dof) : 0;
    return s;
}

/* Measures groups of squares instead: those whose columns are equal modulo nx, and rows modulo ny. */
static struct square_noise measure_folded(const struct level *l, int nx, int ny, int side,
                                          double *sums)
{
    const size_t squares = (size_t)l->nx * (size_t)l->ny, groups = (size_t)nx * (size_t)ny;
    const struct level f = {nx, ny, l->num, sums, sums + (size_t)l->num * groups};
    memset(sums, 0, ((size_t)l->num + 1) * groups * sizeof *sums);
    for (int y = 0; y < l->ny; y++)
        for (int x = 0; x < l->nx; x++) {
            const size_t from = (size_t)y * (size_t)l->nx + (size_t)x;
            const size_t to = (size_t)(y % ny) * (size_t)nx + (size_t)(x % nx);
            f.pixels[to] += l->pixels[from];
            for (int k = 0; k < l->num; k++)
                f.sum[(size_t)k * groups + to] += l->sum[(size_t)k * squares + from];
        }
    return measure(&f, side);
}

/* From squares of 2 x 2 pixels: rows, columns, and tiles of 8, 16, .. that may repeat. */
static bool measure_groups(const struct level *l, struct shared_noise *out, struct err *e)
{
    double *sums = malloc(((size_t)l->num + 1) * (size_t)l->nx * (size_t)l->ny * sizeof *sums);
    if (sums == NULL)
        return err_set(e, "noise that pixels share: out of memory");
    out->group[out->num_groups++] = measure_folded(l, 1, l->ny, 0, sums);
    out->group[out->num_groups++] = measure_folded(l, l->nx, 1, 0, sums);
    for (int n = 4; n < (l->nx > l->ny ? l->nx : l->ny); n *= 2)
        out->group[out->num_groups++] =
            measure_folded(l, n < l->nx ? n : l->nx, n < l->ny ? n : l->ny, 2 * n, sums);
    free(sums);
    return true;
}

bool shared_noise_measure(const struct replicates *r, struct shared_noise *out, struct err *e)
{
    assert(r->num >= SHARED_NOISE_FEWEST);
    *out = (struct shared_noise){.width = r->width, .height = r->height};
    struct level l = {.nx = (r->width + 1) / 2, .ny = (r->height + 1) / 2, .num = r->num};
    const size_t squares = (size_t)l.nx * (size_t)l.ny, k = (size_t)r->num;
    l.sum = calloc((k + 1) * squares + k, sizeof *l.sum);
    if (l.sum == NULL)
        return err_set(e, "noise that pixels share: out of memory");
    l.pixels = l.sum + k * squares;
    sum_pixels(r, l.pixels + squares, &l);
    if (!measure_groups(&l, out, e)) {
        free(l.sum);
        return false;
    }
    for (int side = 2;; side *= 2) {
        out->square[out->num++] = measure(&l, side);
        if (l.nx == 1 && l.ny == 1)
            break;
        coarsen(&l);
    }
    free(l.sum);
    return true;
}

/* The ratio plus three standard errors. */
static double at_most(const struct square_noise *q)
{
    return q->ratio * (1 + 3 * sqrt(2 / q->dof));
}

bool shared_noise_exceeds(const struct square_noise *q, double ratio, double log10_p)
{
    return log10_tail(q->dof * q->ratio / ratio, q->dof) <= log10_p;
}

/* What rows, columns and tiles add to the ratio of squares of this side, if they share noise. */
static double of_groups(const struct shared_noise *s, int side, double level)
{
    double lines = 1, tiles = 1;
    for (int i = 0; i < s->num_groups; i++) {
        const struct square_noise *g = &s->group[i];
        if (!shared_noise_exceeds(g, 1, level))
            continue;
        if (i < 2)
            lines += (at_most(g) - 1) * fmin(1, (double)side / (i == 0 ? s->width : s->height));
        else if (side > g->side)
            tiles = fmax(tiles, at_most(g));
    }
    return fmax(lines, tiles);
}

/* The factor by squares alone. */
static double of_squares(const struct shared_noise *s, double level,
                         const struct square_noise **unlimited)
{
    const struct square_noise *shown = NULL, *largest = NULL;
    double before = 1;
    for (const struct square_noise *q = s->square; q < s->square + s->num; q++) {
        if (q->log10_p <= level)
            shown = q;
        if (q->dof >= fewest_dof || largest == NULL) {
            before = largest != NULL ? largest->ratio : 1;
            largest = q;
        }
    }
    if (shown == NULL)
        return 1;
    const double limit = 2 * largest->ratio - before;
    const double factor = fmax(limit, largest->ratio) + at_most(largest) - largest->ratio;
    if (limit > most_growth * largest->ratio)
        *unlimited = largest;
    /* What the largest squares would show if that were all; as sharing is shown, sqrt(alpha) is rare enough. */
    for (const struct square_noise *q = largest + 1; q < s->square + s->num; q++)
        if (shared_noise_exceeds(q, factor, level / 2))
            *unlimited = q;
    return factor;
}

double shared_noise_factor(const struct shared_noise *s, double alpha,
                           const struct square_noise **unlimited)
{
    const double level = log10(alpha / fmax(1, s->num + s->num_groups));
    const double groups = of_groups(s, s->width > s->height ? s->width : s->height, level);
    bool explained = groups > 1; /* squares show no more than groups add to them */
    *unlimited = NULL;
    for (int i = 0; i < s->num; i++) {
        const struct square_noise *q = &s->square[i];
        explained = explained && !shared_noise_exceeds(q, of_groups(s, q->side, level), level / 2);
    }
    if (explained)
        return groups;
    double factor = of_squares(s, level, unlimited);
    for (int i = 0; i < s->num_groups; i++)
        if (shared_noise_exceeds(&s->group[i], factor, level))
            factor = fmax(factor, groups);
    return factor;
}
