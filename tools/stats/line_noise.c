#include "line_noise.h"

#include <gsl/gsl_cdf.h>
#include <gsl/gsl_sort.h>
#include <math.h>

enum { BLOCK = 8, STRIP = 4, ROWS = 4 };
static const double fewest_sd = 4,
                    fewest_sd_strip = 3.5; /* "lines begin alike" where they do not: 1e-3 in all */
static const double median_dof = 0.25; /* a square; 0.25 to 0.28 in simulations of 32 to 512 lines */

size_t line_noise_squares(const double *sum, const double *variance, size_t n, double *square)
{
    size_t num = 0;
    for (size_t i = 1; i + 1 < n; i++) {
        const double d = sum[i - 1] - 2 * sum[i] + sum[i + 1],
                     v = variance[i - 1] + 4 * variance[i] + variance[i + 1];
        if (variance[i - 1] > 0 && variance[i] > 0 && variance[i + 1] > 0)
            square[num++] = d * d / v;
    }
    return num;
}

double line_noise_ratio(double *square, size_t num, double *dof)
{
    gsl_sort(square, 1, num);
    *dof = median_dof * (double)num;
    return (square[(num - 1) / 2] + square[num / 2]) / 2 / gsl_cdf_chisq_Pinv(0.5, 1);
}

/* `lines` lines of an image, each of `length` values that are `step` apart; the next line begins `next` further on. */
struct bundle {
    const double *v;
    int lines, length;
    size_t step, next;
};

/* Of values `at` .. at + ROWS - 1 of STRIP or BLOCK lines from `first`, less the mean of BLOCK lines from `beside`; at
 * most sqrt(6), and 0 where less than a fifth of the values has the other sign. */
static double block_agreement(const struct bundle *b, int first, int lines, int beside, int at)
{
    double part[ROWS][BLOCK] = {{0}}, sum = 0, squares = 0;
    int up = 0, down = 0;
    for (int j = 0; j < ROWS; j++) {
        const double *v = b->v + (size_t)(at + j) * b->step;
        double mean = 0;
        for (int i = 0; i < BLOCK; i++)
            mean += v[(size_t)(beside + i) * b->next] / BLOCK;
        for (int i = 0; i < lines; i++) {
            const double one = v[(size_t)(first + i) * b->next];
            part[j][i] = one - mean;
            up += one > 0;
            down += one < 0;
        }
    }
    for (int j = 1; j < ROWS; j++)
        for (int k = 0; k < j; k++) {
            double product = 0;
            for (int i = 0; i < lines; i++)
                product += part[j][i] * part[k][i];
            sum += product;
            squares += product * product;
        }
    return squares > 0 && 5 * (up < down ? up : down) >= up + down ? sum / sqrt(squares) : 0;
}

/* Sums over blocks, and how many were not 0. */
struct agreement {
    double sum, num;
};

static void add_strip(const struct bundle *b, int first, int lines, int beside, struct agreement *a)
{
    for (int at = 0; at + ROWS <= b->length; at += ROWS) {
        const double u = block_agreement(b, first, lines, beside, at);
        a->sum += u;
        a->num += u != 0;
    }
}

static double in_sd(const struct agreement *a)
{
    return a->num > 0 ? a->sum / sqrt(a->num) : 0;
}

bool line_noise_begins_alike(const double *v, int num, int width, int height)
{
    struct agreement all[2] = {{0}}, strip[4] = {{0}};
    for (int k = 0; k < num; k++, v += (size_t)width * (size_t)height)
        for (int rows = 0; rows < 2; rows++) {
            const struct bundle columns = {v, width, height, (size_t)width, 1},
                                across = {v, height, width, 1, (size_t)width};
            const struct bundle *b = rows ? &across : &columns;
            const int last = b->lines - STRIP;
            for (int i = 0; i + BLOCK <= b->lines; i += BLOCK)
                add_strip(b, i, BLOCK, i, &all[rows]);
            if (last < STRIP + BLOCK)
                continue;
            add_strip(b, 0, STRIP, STRIP, &strip[2 * rows]);
            add_strip(b, last, STRIP, last - BLOCK, &strip[2 * rows + 1]);
        }
    const double z[2] = {in_sd(&all[0]), in_sd(&all[1])};
    bool alike = fmax(z[0], z[1]) > fmax(fewest_sd, 2 * fmin(z[0], z[1]));
    for (int i = 0; i < 4; i++)
        alike = alike || in_sd(&strip[i]) > fewest_sd_strip;
    return alike;
}
