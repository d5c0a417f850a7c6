#include "matched_filter.h"

#include "renderer/base/isa.h"

#include <math.h>
#include <stdlib.h>

/* sums over pixels p and channels c with weights w = d/v */
struct sums {
    struct cell cell; /* w A and w B, as if they were a region */
    double unit;      /* |w| unit of B */
    double size;      /* |w| max(A, B) */
};

/* What some neighbouring pixels add to them. */
enum { CHUNK = 64 };
struct chunk {
    double w[3][CHUNK], unit[3][CHUNK], size[3][CHUNK];
    double mean[2][CHUNK], v[2][CHUNK], k3[2][CHUNK];
    double var_v[2][CHUNK], var_v_normal[2][CHUNK], var_k3[2][CHUNK];
};

static double larger(double a, double b)
{
    return a > b ? a : b;
}

/* A or B in pixels number `at` and on, their channels weighted. Their correlation is unknown: see pyramid_pixel_estimate(). Where
 * weights have both signs the third cumulants of the channels are added all the same: that they cancel if
 * the channels are perfectly correlated is no permission. */
ISA_CLONES static void weigh(const struct error_modes_frame *f, int side, size_t at, size_t num,
                             struct chunk *t)
{
    const double *n = f->n[side] + at, *mean = f->mean[side] + at, *sd = f->sd[side] + at,
                 *root = f->root[side] + at;
    const size_t room = f->room;
    for (size_t x = 0; x < num; x++) {
        double sum = 0, deviation = 0, cube = 0, sign = 0;
        for (size_t c = 0; c < 3; c++) {
            const double w = t->w[c][x], size = fabs(w);
            sum += w * mean[c * room + x];
            deviation += size * sd[c * room + x];
            cube += size * root[c * room + x];
            sign += w * sd[c * room + x];
        }
        cube = copysign(cube, sign * cube);
        double v = deviation * deviation, k3 = cube * cube * cube;
        struct estimate est = pyramid_estimate_from(sum, v, k3, n[x]);
        t->mean[side][x] = sum;
        t->v[side][x] = v;
        t->k3[side][x] = k3;
        t->var_v[side][x] = est.var_v;
        t->var_v_normal[side][x] = est.var_v_normal;
        /* With weights of both signs the third cumulants of a skewed law can cancel in the sample and not in
         * truth, or the reverse; their own squares bound the variance of each if it is of rare events. */
        t->var_k3[side][x] = larger(est.var_k3, k3 * k3);
    }
}

/* Pixels x .. x+num-1 of row y. */
ISA_CLONES static void add_chunk(const struct judge *j, const struct error_modes *modes, int x,
                                 int y, size_t num, const struct error_change *change,
                                 struct sums *sums)
{
    const struct error_modes_frame *f = &modes->own;
    const size_t at = error_modes_at(f, x, y);
    const double floor = j->floor, *coupled = change->coupled + x;
    struct chunk t;
    for (size_t c = 0; c < 3; c++) {
        const size_t first = c * f->room + at;
        const double *a = f->mean[0] + first, *b = f->mean[1] + first, *d = change->d[c] + x,
                     *weight = f->weight + first;
        for (size_t i = 0; i < num; i++) {
            const double w = weight[i] * d[i];
            t.w[c][i] = w;
            t.unit[c][i] = fabs(w) * larger(b[i], floor);
            t.size[c][i] = fabs(w) * larger(a[i], b[i]);
        }
    }
    weigh(f, 0, at, num, &t);
    weigh(f, 1, at, num, &t);
    struct sums s = *sums;
    for (size_t i = 0; i < num; i++) {
        for (size_t c = 0; c < 3; c++) {
            s.unit += t.unit[c][i];
            s.size += t.size[c][i];
        }
        s.cell.a += t.mean[0][i];
        s.cell.b += t.mean[1][i];
        s.cell.va += t.v[0][i];
        s.cell.vb += t.v[1][i] + coupled[i];
        s.cell.k3 += t.k3[0][i] - t.k3[1][i];
        s.cell.var_v += t.var_v[0][i] + t.var_v[1][i];
        s.cell.var_v_normal += t.var_v_normal[0][i] + t.var_v_normal[1][i];
        s.cell.var_k3 += t.var_k3[0][i] + t.var_k3[1][i];
    }
    *sums = s;
}

static void sum_up(const struct judge *j, struct error_modes *modes,
                   const struct error_change *change, struct sums s[NUM_ERROR_MODES])
{
    for (int top = 0; top < modes->height; top += ERROR_MODES_BAND) {
        const int left = modes->height - top;
        const int rows = left < ERROR_MODES_BAND ? left : ERROR_MODES_BAND;
        error_modes_go_to(modes, top, rows);
        for (int y = top; y < top + rows; y++)
            for (int k = 0; k < NUM_ERROR_MODES; k++) {
                if (!error_mode_applies(modes, k))
                    continue;
                error_mode_row(modes, k, y, change);
                for (int x = 0; x < modes->width; x += CHUNK) {
                    const int rest = modes->width - x, num = rest < CHUNK ? rest : CHUNK;
                    add_chunk(j, modes, x, y, (size_t)num, change, &s[k]);
                }
            }
    }
}

bool matched_filter_test(const struct moments *a, const struct moments *b, struct judge *j,
                         enum error_mode_kind *found, double *log10_p, struct err *e)
{
    struct error_modes modes;
    struct sums s[NUM_ERROR_MODES] = {{.unit = 0}};
    *found = 0;
    *log10_p = 0;
    if (!error_modes_open(a, b, &modes, e))
        return false;
    const size_t width = (size_t)a->width;
    double *row = malloc(4 * width * sizeof *row);
    const struct error_change change = {{row, row + width, row + 2 * width}, row + 3 * width};
    if (row == NULL) {
        error_modes_free(&modes);
        return err_set(e, "out of memory for %d pixels", a->width);
    }
    sum_up(j, &modes, &change, s);
    for (int k = 0; k < NUM_ERROR_MODES; k++) {
        if (!error_mode_applies(&modes, k))
            continue;
        struct measured m = region_measure_weighted(j, &s[k].cell, s[k].unit, s[k].size);
        if (m.noise_free || !region_is_normal(j, &m))
            continue;
        j->num_tests[STATISTIC_MATCHED_FILTER]++;
        double p = region_log10_p(j, &m, CHANNEL_LUMINANCE);
        if (p < *log10_p) {
            *log10_p = p;
            *found = k;
        }
    }
    free(row);
    error_modes_free(&modes);
    return true;
}
