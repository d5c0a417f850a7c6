#include "hint.h"

#include "error_modes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    BLOCK = 8,               /* side of the blocks in which small differences are seen best */
    ENOUGH_TO_FIT = 1 << 15, /* pixels */
    ENOUGH = 1 << 18,
    GRID = 16, /* amounts that are tried first, either way; of shifts pixels */
    REFINE = 20
};
static const double enough_removed = 0.9, certain = 5 /* standard errors of noise alone */;

struct images {
    const struct moments *side[2];
    bool exact[2];
    int columns, rows;
    double *weight;  /* 3 for each block: 1 / variance of a pixel's A - B there */
    double mean;     /* of B */
    bool stands_out; /* A - B, from its noise */
};

/* Squared differences, noise removed: of pixels, and of the means of blocks. */
struct excess {
    double before[2], after[2];
    double all_before, all_after; /* of the means of blocks, noise and all */
    size_t num[2], of; /* pixels and blocks that have a partner, and all pixels that were asked */
};

static double variance(const struct images *m, int side, size_t i)
{
    double n = moments_n(m->side[side], i / 3);
    return m->exact[side] ? 0 : moments_m2(m->side[side], i) / (n * (n - 1));
}

static size_t at(const struct images *m, int x, int y)
{
    return 3 * ((size_t)y * (size_t)m->side[1]->width + (size_t)x);
}

/* From which pixel of B the changed pixel comes: the same for changes of values alone. */
static size_t source(const struct images *m, enum error_mode_kind kind, int x, int y)
{
    int w = m->side[1]->width, h = m->side[1]->height;
    bool turned = kind == ERROR_ROTATE;
    if (kind == ERROR_TRANSPOSE)
        return at(m, y, x);
    return at(m, kind == ERROR_FLIP_X || turned ? w - 1 - x : x,
              kind == ERROR_FLIP_Y || turned ? h - 1 - y : y);
}

/* B between two pixels. False where it would come from beyond the border. */
static bool shifted(const struct images *m, bool down, double amount, int x, int y, double mean[3],
                    double var[3])
{
    double from = (down ? y : x) - amount, low = floor(from), share = from - low;
    int last = (down ? m->side[1]->height : m->side[1]->width) - 1, k = (int)low;
    if (from < 0 || from > last)
        return false;
    int next = k < last ? k + 1 : k;
    size_t p = down ? at(m, x, k) : at(m, k, y), q = down ? at(m, x, next) : at(m, next, y);
    for (size_t c = 0; c < 3; c++) {
        mean[c] =
            (1 - share) * moments_mean(m->side[1], p + c) + share * moments_mean(m->side[1], q + c);
        var[c] = (1 - share) * (1 - share) * variance(m, 1, p + c) +
                 share * share * variance(m, 1, q + c);
    }
    return true;
}

/* B, changed: mean and variance. The amount is the logarithm of a factor or an exponent, in means, or in pixels. */
static bool changed(const struct images *m, enum error_mode_kind kind, double amount, int x, int y,
                    double mean[3], double var[3])
{
    static const int from[NUM_ERROR_MODES][3] = {
        [ERROR_SWAP_RB] = {2, 1, 0}, [ERROR_SWAP_RG] = {1, 0, 2}, [ERROR_SWAP_GB] = {0, 2, 1}};
    if (kind == ERROR_SHIFT_X || kind == ERROR_SHIFT_Y)
        return shifted(m, kind == ERROR_SHIFT_Y, amount, x, y, mean, var);
    bool swaps = kind >= ERROR_SWAP_RB && kind <= ERROR_SWAP_GB;
    size_t p = source(m, kind, x, y);
    for (size_t c = 0; c < 3; c++) {
        size_t i = p + (swaps ? (size_t)from[kind][c] : c);
        double own = moments_mean(m->side[1], i), v = variance(m, 1, i), slope = 1;
        mean[c] = own;
        if (kind == ERROR_SCALE) {
            slope = exp(amount);
            mean[c] = slope * own;
        } else if (kind == ERROR_OFFSET) {
            mean[c] = own + amount * m->mean;
        } else if (kind == ERROR_GAMMA) {
            mean[c] = own > 0 ? pow(own, exp(amount)) : 0;
            slope = own > 0 ? exp(amount) * mean[c] / own : 0;
        } else if (kind == ERROR_CLAMP && own > 1) {
            mean[c] = 1;
            slope = 0;
        }
        var[c] = slope * slope * v;
    }
    return true;
}

static void add_block(const struct images *m, enum error_mode_kind kind, double amount, int column,
                      int row, struct excess *out)
{
    const double *weight = m->weight + 3 * ((size_t)row * (size_t)m->columns + (size_t)column);
    double before[3] = {0}, after[3] = {0}, v_before[3] = {0}, v_after[3] = {0}, mean[3], var[3];
    int num = 0;
    for (int y = row * BLOCK; y < (row + 1) * BLOCK && y < m->side[0]->height; y++)
        for (int x = column * BLOCK; x < (column + 1) * BLOCK && x < m->side[0]->width; x++) {
            out->of++;
            if (!changed(m, kind, amount, x, y, mean, var))
                continue;
            num++;
            for (size_t c = 0, i = at(m, x, y); c < 3; c++, i++) {
                double d = moments_mean(m->side[0], i) - moments_mean(m->side[1], i),
                       va = variance(m, 0, i), r = moments_mean(m->side[0], i) - mean[c],
                       vb = variance(m, 1, i);
                out->before[0] += weight[c] * (d * d - va - vb);
                out->after[0] += weight[c] * (r * r - va - var[c]);
                before[c] += d;
                after[c] += r;
                v_before[c] += va + vb;
                v_after[c] += va + var[c];
            }
        }
    out->num[0] += (size_t)num;
    out->num[1] += num > 0;
    for (size_t c = 0; num > 0 && c < 3; c++) {
        out->all_before += before[c] * before[c] / num;
        out->all_after += after[c] * after[c] / num;
        out->before[1] += weight[c] / num * (before[c] * before[c] - v_before[c]);
        out->after[1] += weight[c] / num * (after[c] * after[c] - v_after[c]);
    }
}

static struct excess measure(const struct images *m, enum error_mode_kind kind, double amount,
                             size_t enough)
{
    struct excess e = {.of = 0};
    size_t pixels = (size_t)m->side[0]->width * (size_t)m->side[0]->height;
    int step = 1 + (int)(pixels / enough);
    for (int k = step / 2; k < m->columns * m->rows; k += step)
        add_block(m, kind, amount, k % m->columns, k / m->columns, &e);
    return e;
}

static double standard_errors(const struct excess *e, int k)
{
    return e->num[k] > 0 ? e->before[k] / sqrt(2 * 3 * (double)e->num[k]) : 0;
}

/* Judged where the difference stands out most from noise. If it stands out nowhere (noise that was guessed from the
 * difference takes much of it for its own), noise and all: no change removes noise. -1: few pixels have a partner. */
static double removed_by(const struct images *m, enum error_mode_kind kind, double amount,
                         size_t enough)
{
    const struct excess e = measure(m, kind, amount, enough);
    if (2 * e.num[0] < e.of || !(e.all_before > 0))
        return -1;
    if (!m->stands_out)
        return 1 - e.all_after / e.all_before;
    int best = standard_errors(&e, 1) > standard_errors(&e, 0);
    return e.before[best] > 0 ? 1 - e.after[best] / e.before[best] : 0;
}

/* The amount that removes most: on a grid, then between its neighbours by thirds. */
static double fit(const struct images *m, enum error_mode_kind kind)
{
    static const double reach[NUM_ERROR_MODES] = {[ERROR_SCALE] = 2,
                                                  [ERROR_OFFSET] = 1,
                                                  [ERROR_GAMMA] = 1.1,
                                                  [ERROR_SHIFT_X] = GRID,
                                                  [ERROR_SHIFT_Y] = GRID};
    double step = reach[kind] / GRID, best = 0, most = -INFINITY;
    for (int k = -GRID; k <= GRID; k++) {
        double r = removed_by(m, kind, k * step, ENOUGH_TO_FIT);
        if (r > most) {
            most = r;
            best = k * step;
        }
    }
    double lo = best - step, hi = best + step;
    for (int i = 0; i < REFINE; i++) {
        double third = (hi - lo) / 3;
        if (removed_by(m, kind, lo + third, ENOUGH_TO_FIT) <
            removed_by(m, kind, hi - third, ENOUGH_TO_FIT))
            lo += third;
        else
            hi -= third;
    }
    return (lo + hi) / 2;
}

static struct hint describe(enum error_mode_kind kind, double amount, double share)
{
    struct hint h = {.name = error_mode_name[kind], .removed = share, .unit = ""};
    if (!error_mode_has_amount(kind))
        return h;
    h.amount = amount;
    h.unit = "px";
    if (kind == ERROR_OFFSET) {
        h.amount = 100 * amount;
        h.unit = "% of the mean";
    } else if (kind == ERROR_SCALE) {
        h.amount = 100 * expm1(amount);
        h.unit = "%";
    } else if (kind == ERROR_GAMMA) {
        h.amount = expm1(amount);
        h.unit = "in the exponent";
    }
    return h;
}

/* The variance of a block is at least a share of the image's, and a little more than none. */
static bool open_images(const struct moments *a, const struct moments *b, struct images *m)
{
    static const double least = 0.03, dust = 1e-6;
    *m = (struct images){.side = {a, b},
                         .exact = {strcmp(a->unit, "exact") == 0, strcmp(b->unit, "exact") == 0},
                         .columns = (b->width + BLOCK - 1) / BLOCK,
                         .rows = (b->height + BLOCK - 1) / BLOCK};
    size_t blocks = (size_t)m->columns * (size_t)m->rows,
           values = 3 * (size_t)b->width * (size_t)b->height;
    double mean_var = 0, mean_square = 0;
    m->weight = calloc(4 * blocks, sizeof *m->weight);
    if (m->weight == NULL)
        return false;
    double *num = m->weight + 3 * blocks;
    for (size_t i = 0; i < values; i++) {
        size_t p = i / 3, x = p % (size_t)b->width, y = p / (size_t)b->width,
               k = y / BLOCK * (size_t)m->columns + x / BLOCK;
        double v = variance(m, 0, i) + variance(m, 1, i);
        m->weight[3 * k + i % 3] += v;
        num[k] += 1. / 3;
        mean_var += v / (double)values;
        mean_square += moments_mean(b, i) * moments_mean(b, i) / (double)values;
        m->mean += moments_mean(b, i) / (double)values;
    }
    for (size_t k = 0; k < 3 * blocks; k++)
        m->weight[k] =
            1 / (fmax(m->weight[k] / num[k / 3], least * mean_var) + dust * mean_square + 1e-300);
    const struct excess e = measure(m, ERROR_SCALE, 0, ENOUGH);
    m->stands_out = fmax(standard_errors(&e, 0), standard_errors(&e, 1)) > certain;
    return true;
}

bool hint_add(const struct moments *a, const struct moments *b, struct comparison *c, struct err *e)
{
    static const enum error_mode_kind order[NUM_ERROR_MODES] = {
        ERROR_FLIP_X,  ERROR_FLIP_Y,  ERROR_ROTATE, ERROR_TRANSPOSE, ERROR_SWAP_RB,
        ERROR_SWAP_RG, ERROR_SWAP_GB, ERROR_SCALE,  ERROR_OFFSET,    ERROR_GAMMA,
        ERROR_SHIFT_X, ERROR_SHIFT_Y, ERROR_CLAMP};
    static const double clearly = 0.01; /* more is removed than by what is simpler */
    struct images m;
    double most = enough_removed - clearly;
    if (c->verdict == VERDICT_EQUIVALENT)
        return true;
    if (!open_images(a, b, &m))
        return err_set(e, "out of memory for the hint of %d x %d pixels", a->width, a->height);
    for (int i = 0; i < NUM_ERROR_MODES; i++) {
        if (order[i] == ERROR_TRANSPOSE && a->width != a->height)
            continue;
        double amount = error_mode_has_amount(order[i]) ? fit(&m, order[i]) : 0,
               share = fmin(1, removed_by(&m, order[i], amount, ENOUGH));
        if (share >= most + clearly) {
            most = share;
            c->hint = describe(order[i], amount, share);
        }
    }
    free(m.weight);
    size_t used = strlen(c->reason);
    if (c->hint.name != NULL && c->hint.unit[0] == '\0')
        snprintf(c->reason + used, sizeof c->reason - used, "; looks like %s, %.0f %% of it",
                 c->hint.name, 100 * c->hint.removed);
    else if (c->hint.name != NULL)
        snprintf(c->reason + used, sizeof c->reason - used,
                 "; looks like %s %+.3g %s, %.0f %% of it", c->hint.name, c->hint.amount,
                 c->hint.unit, 100 * c->hint.removed);
    return true;
}
