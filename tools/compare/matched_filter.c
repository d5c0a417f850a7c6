#include "matched_filter.h"

#include "renderer/base/isa.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The contributions of some neighbouring pixels to struct matched_sums. */
enum { CHUNK = 64 };
struct chunk {
    double w[3][CHUNK], unit[3][CHUNK], size[3][CHUNK], event[CHUNK];
    double mean[2][CHUNK], v[2][CHUNK], k3[2][CHUNK];
    double var_v[2][CHUNK], var_v_normal[2][CHUNK], var_k3[2][CHUNK];
};

static double larger(double a, double b)
{
    return a > b ? a : b;
}

/* Estimates of one side (A or B) for `num` pixels from number `at` on, the channels combined with
 * the weights t->w. Their correlation is unknown; the bounds are those of pyramid_pixel_estimate().
 * Third cumulants are added with |w| even where weights have both signs: that they would cancel for
 * perfectly correlated channels must not be relied on. */
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
        struct pixel_estimate est = pyramid_estimate_from(sum, v, k3, n[x]);
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
                                 struct matched_sums *sums)
{
    const struct error_modes_frame *f = &modes->own;
    const size_t at = error_modes_at(f, x, y);
    const double floor = j->floor, *coupled = change->coupled + x;
    struct chunk t;
    memset(t.event, 0, sizeof t.event);
    for (size_t c = 0; c < 3; c++) {
        const size_t first = c * f->room + at;
        const double *a = f->mean[0] + first, *b = f->mean[1] + first, *d = change->d[c] + x,
                     *weight = f->weight + first;
        for (size_t i = 0; i < num; i++) {
            const double w = weight[i] * d[i];
            t.w[c][i] = w;
            t.unit[c][i] = fabs(w) * larger(b[i], floor);
            t.size[c][i] = fabs(w) * larger(a[i], b[i]);
            t.event[i] += fabs(w) * j->event[c];
        }
    }
    weigh(f, 0, at, num, &t);
    weigh(f, 1, at, num, &t);
    struct matched_sums s = *sums;
    for (size_t i = 0; i < num; i++) {
        for (size_t c = 0; c < 3; c++) {
            s.unit += t.unit[c][i];
            s.size += t.size[c][i];
        }
        s.largest = larger(s.largest, t.event[i]);
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

bool matched_filter_open(const struct moments *a, const struct moments *b,
                         struct matched_filter *out, struct err *e)
{
    *out = (struct matched_filter){.row = malloc(4 * (size_t)a->width * sizeof *out->row)};
    if (out->row == NULL)
        return err_set(e, "out of memory for %d pixels", a->width);
    if (error_modes_open(a, b, &out->modes, e))
        return true;
    matched_filter_free(out);
    return false;
}

void matched_filter_free(struct matched_filter *f)
{
    error_modes_free(&f->modes);
    free(f->row);
    *f = (struct matched_filter){.row = NULL};
}

/* Adds a row that error_modes_go_to() has prepared. */
static void add_row(const struct judge *j, struct matched_filter *f, int y)
{
    const size_t width = (size_t)f->modes.width;
    double *row = f->row;
    const struct error_change change = {{row, row + width, row + 2 * width}, row + 3 * width};
    for (int k = 0; k < NUM_ERROR_MODES; k++) {
        if (!error_mode_applies(&f->modes, k))
            continue;
        error_mode_row(&f->modes, k, y, &change);
        for (int x = 0; x < f->modes.width; x += CHUNK) {
            const int rest = f->modes.width - x, num = rest < CHUNK ? rest : CHUNK;
            add_chunk(j, &f->modes, x, y, (size_t)num, &change, &f->sums[k]);
        }
    }
}

void matched_filter_add(const struct judge *j, struct matched_filter *f, int y, int rows,
                        double *const root[2])
{
    const struct error_modes_frame *own = &f->modes.own;
    const int width = f->modes.width, end = y + rows;
    for (int i = 0; y < end; y++, i += width) {
        if (i / width % ERROR_MODES_BAND == 0)
            error_modes_go_to(&f->modes, y,
                              end - y < ERROR_MODES_BAND ? end - y : ERROR_MODES_BAND);
        add_row(j, f, y);
        for (int side = 0; side < 2; side++)
            for (int x = 0; x < width; x++) {
                const double *of = own->root[side] + error_modes_at(own, x, y);
                root[side][i + x] = 0;
                for (size_t c = 0; c < 3; c++)
                    root[side][i + x] += luminance_weight[c] * of[c * own->room];
            }
    }
}

void matched_filter_test(struct judge *j, const struct matched_filter *f,
                         enum error_mode_kind *found, double *log10_p)
{
    *found = 0;
    *log10_p = 0;
    for (int k = 0; k < NUM_ERROR_MODES; k++) {
        const struct matched_sums *s = &f->sums[k];
        if (!error_mode_applies(&f->modes, k))
            continue;
        struct measured m = region_measure_weighted(j, &s->cell, s->unit, s->size, s->largest);
        if (m.noise_free || !region_is_normal(j, &m))
            continue;
        j->num_tests[STATISTIC_MATCHED_FILTER]++;
        double p = region_log10_p(j, &m, CHANNEL_LUMINANCE);
        if (p < *log10_p) {
            *log10_p = p;
            *found = k;
        }
    }
}
