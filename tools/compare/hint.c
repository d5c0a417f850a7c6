#include "hint.h"

#include "error_modes.h"
#include "renderer/base/parallel.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    BLOCK = 8,               /* side of the blocks in which small differences are seen best */
    ENOUGH_TO_FIT = 1 << 15, /* pixels */
    ENOUGH = 1 << 18,
    GRID = 16, /* amounts tried first in each direction; for shifts, pixels */
    REFINE = 20
};
static const double enough_removed = 0.9, certain = 5 /* standard errors of noise alone */;

/* One channel of a pixel: mean and its variance. */
struct value {
    double mean, var;
};

/* A sample of blocks that stands for the whole image: their pixels in A and B, block after block. */
struct sample {
    int step; /* every step-th block is taken */
    struct value (*side[2])[3];
};

struct images {
    const struct moments *side[2];
    bool exact[2];
    int columns, rows;
    double *weight;  /* 3 for each block: 1 / variance of a pixel's A - B there */
    double mean;     /* of B */
    bool stands_out; /* A - B, from its noise */
    struct sample few, many;
};

/* Squared differences, noise removed: of pixels, and of the means of blocks. */
struct excess {
    double before[2], after[2];
    double all_before, all_after; /* of the means of blocks, noise included */
    size_t num[2], of; /* pixels and blocks with a counterpart in B; all pixels looked at */
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

/* The pixel of B that a change puts at (x, y); (x, y) itself if it changes only values. */
static size_t source(const struct images *m, enum error_mode_kind kind, int x, int y)
{
    int w = m->side[1]->width, h = m->side[1]->height;
    bool turned = kind == ERROR_ROTATE;
    if (kind == ERROR_TRANSPOSE)
        return at(m, y, x);
    return at(m, kind == ERROR_FLIP_X || turned ? w - 1 - x : x,
              kind == ERROR_FLIP_Y || turned ? h - 1 - y : y);
}

static struct value value_of(const struct images *m, int side, size_t i)
{
    return (struct value){moments_mean(m->side[side], i), variance(m, side, i)};
}

/* A change to try. amount: the logarithm of a factor or an exponent, an offset in units of B's mean, or pixels. */
struct change {
    enum error_mode_kind kind;
    double amount, factor; /* factor: exp(amount) */
};

/* B shifted by the amount, interpolated between two pixels. False if that would be beyond the border. */
static bool shifted(const struct images *m, const struct change *how, int x, int y,
                    struct value out[3])
{
    const bool down = how->kind == ERROR_SHIFT_Y;
    double from = (down ? y : x) - how->amount, low = floor(from), share = from - low;
    int last = (down ? m->side[1]->height : m->side[1]->width) - 1, i = (int)low;
    if (from < 0 || from > last)
        return false;
    const int next = i < last ? i + 1 : i;
    const size_t near = down ? at(m, x, i) : at(m, i, y),
                 far = down ? at(m, x, next) : at(m, next, y);
    for (size_t c = 0; c < 3; c++) {
        const struct value p = value_of(m, 1, near + c), q = value_of(m, 1, far + c);
        out[c] = (struct value){(1 - share) * p.mean + share * q.mean,
                                (1 - share) * (1 - share) * p.var + share * share * q.var};
    }
    return true;
}

/* Mean and variance of the changed B at (x, y); `own`: unchanged. False if they are not defined there. */
static bool changed(const struct images *m, const struct change *how, int x, int y,
                    const struct value own[3], struct value out[3])
{
    static const size_t from[NUM_ERROR_MODES][3] = {
        [ERROR_SWAP_RB] = {2, 1, 0}, [ERROR_SWAP_RG] = {1, 0, 2}, [ERROR_SWAP_GB] = {0, 2, 1}};
    const enum error_mode_kind kind = how->kind;
    if (kind == ERROR_SHIFT_X || kind == ERROR_SHIFT_Y)
        return shifted(m, how, x, y, out);
    bool swaps = kind >= ERROR_SWAP_RB && kind <= ERROR_SWAP_GB;
    bool moves = kind >= ERROR_FLIP_X && kind <= ERROR_TRANSPOSE;
    size_t p = source(m, kind, x, y);
    for (size_t c = 0; c < 3; c++) {
        struct value v = moves ? value_of(m, 1, p + c) : own[swaps ? from[kind][c] : c];
        double slope = 1, mean = v.mean;
        if (kind == ERROR_SCALE) {
            slope = how->factor;
            mean = slope * v.mean;
        } else if (kind == ERROR_OFFSET) {
            mean = v.mean + how->amount * m->mean;
        } else if (kind == ERROR_GAMMA) {
            /* Near 0 the slope is infinite, and no guide to the noise: that of a standard error away is. */
            const double from_zero = fmax(v.mean, sqrt(v.var));
            mean = v.mean > 0 ? pow(v.mean, how->factor) : 0;
            slope = v.mean > 0 ? how->factor * pow(from_zero, how->factor - 1) : 0;
        } else if (kind == ERROR_CLAMP && v.mean > 1) {
            mean = 1;
            slope = 0;
        }
        out[c] = (struct value){mean, slope * slope * v.var};
    }
    return true;
}

/* Adds one block, whose first pixel is number *first of the sample; advances *first to the next block. */
static void add_block(const struct images *m, const struct change *how, const struct sample *s,
                      int column, int row, size_t *first, struct excess *out)
{
    struct excess e = *out; /* in registers */
    const double *weight = m->weight + 3 * ((size_t)row * (size_t)m->columns + (size_t)column);
    double before[3] = {0}, after[3] = {0}, v_before[3] = {0}, v_after[3] = {0};
    int num = 0;
    for (int y = row * BLOCK; y < (row + 1) * BLOCK && y < m->side[0]->height; y++)
        for (int x = column * BLOCK; x < (column + 1) * BLOCK && x < m->side[0]->width; x++) {
            const struct value *a = s->side[0][*first], *b = s->side[1][*first];
            struct value new[3];
            e.of++;
            ++*first;
            if (!changed(m, how, x, y, b, new))
                continue;
            num++;
            for (size_t c = 0; c < 3; c++) {
                double d = a[c].mean - b[c].mean, va = a[c].var, r = a[c].mean - new[c].mean,
                       vb = b[c].var;
                e.before[0] += weight[c] * (d * d - va - vb);
                e.after[0] += weight[c] * (r * r - va - new[c].var);
                before[c] += d;
                after[c] += r;
                v_before[c] += va + vb;
                v_after[c] += va + new[c].var;
            }
        }
    e.num[0] += (size_t)num;
    e.num[1] += num > 0;
    for (size_t c = 0; num > 0 && c < 3; c++) {
        e.all_before += before[c] * before[c] / num;
        e.all_after += after[c] * after[c] / num;
        e.before[1] += weight[c] / num * (before[c] * before[c] - v_before[c]);
        e.after[1] += weight[c] / num * (after[c] * after[c] - v_after[c]);
    }
    *out = e;
}

static struct excess measure(const struct images *m, enum error_mode_kind kind, double amount,
                             const struct sample *s)
{
    const struct change how = {kind, amount, exp(amount)};
    struct excess e = {.of = 0};
    size_t first = 0;
    for (int block = s->step / 2; block < m->columns * m->rows; block += s->step)
        add_block(m, &how, s, block % m->columns, block / m->columns, &first, &e);
    return e;
}

static bool open_sample(const struct images *m, size_t enough, struct sample *s)
{
    const size_t pixels = (size_t)m->side[0]->width * (size_t)m->side[0]->height;
    s->step = 1 + (int)(pixels / enough);
    const size_t most =
        ((size_t)m->columns * (size_t)m->rows / (size_t)s->step + 1) * BLOCK * BLOCK;
    s->side[0] = malloc(2 * most * sizeof *s->side[0]);
    if (s->side[0] == NULL)
        return false;
    s->side[1] = s->side[0] + most;
    size_t first = 0;
    for (int block = s->step / 2; block < m->columns * m->rows; block += s->step) {
        const int left = block % m->columns * BLOCK, top = block / m->columns * BLOCK;
        for (int y = top; y < top + BLOCK && y < m->side[0]->height; y++)
            for (int x = left; x < left + BLOCK && x < m->side[0]->width; x++, first++)
                for (size_t c = 0; c < 3; c++)
                    for (int side = 0; side < 2; side++)
                        s->side[side][first][c] = value_of(m, side, at(m, x, y) + c);
    }
    return true;
}

static double standard_errors(const struct excess *e, int k)
{
    return e->num[k] > 0 ? e->before[k] / sqrt(2 * 3 * (double)e->num[k]) : 0;
}

/* The share of the squared difference that the change removes, at the scale (pixels or blocks) at
 * which the difference stands out most from the noise. If it stands out at neither, as where the
 * noise was estimated from the difference itself, noise is included on both sides of the ratio: no
 * change removes noise. -1: too few pixels have a counterpart in B. */
static double removed_by(const struct images *m, enum error_mode_kind kind, double amount,
                         const struct sample *sample)
{
    const struct excess e = measure(m, kind, amount, sample);
    if (2 * e.num[0] < e.of || !(e.all_before > 0))
        return -1;
    if (!m->stands_out)
        return 1 - e.all_after / e.all_before;
    int best = standard_errors(&e, 1) > standard_errors(&e, 0);
    return e.before[best] > 0 ? 1 - e.after[best] / e.before[best] : 0;
}

/* The amount that removes most: the best on a grid, refined by ternary search between its neighbours. NAN if that is at the
 * end of what is tried. */
static double fit(const struct images *m, enum error_mode_kind kind)
{
    static const double reach[NUM_ERROR_MODES] = {[ERROR_SCALE] = 2,
                                                  [ERROR_OFFSET] = 1,
                                                  [ERROR_GAMMA] = 1.1,
                                                  [ERROR_SHIFT_X] = GRID,
                                                  [ERROR_SHIFT_Y] = GRID};
    double step = reach[kind] / GRID, best = 0, most = -INFINITY;
    for (int k = -GRID; k <= GRID; k++) {
        double r = removed_by(m, kind, k * step, &m->few);
        if (r > most) {
            most = r;
            best = k * step;
        }
    }
    double lo = best - step, hi = best + step;
    for (int i = 0; i < REFINE; i++) {
        double third = (hi - lo) / 3;
        if (removed_by(m, kind, lo + third, &m->few) < removed_by(m, kind, hi - third, &m->few))
            lo += third;
        else
            hi -= third;
    }
    return fabs(lo + hi) / 2 < reach[kind] + 0.99 * step ? (lo + hi) / 2 : NAN;
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

/* Weights: a block's variance counts as at least the share `least` of the image's, plus a trifle (`dust`). */
static bool open_images(const struct moments *a, const struct moments *b, struct images *m)
{
    static const double least = 0.03, dust = 1e-6;
    *m = (struct images){.side = {a, b},
                         .exact = {moments_is_exact(a), moments_is_exact(b)},
                         .columns = (b->width + BLOCK - 1) / BLOCK,
                         .rows = (b->height + BLOCK - 1) / BLOCK};
    size_t blocks = (size_t)m->columns * (size_t)m->rows,
           values = 3 * (size_t)b->width * (size_t)b->height;
    double mean_var = 0, mean_square = 0, mean_b = 0;
    m->weight = calloc(4 * blocks, sizeof *m->weight);
    if (m->weight == NULL || !open_sample(m, ENOUGH_TO_FIT, &m->few) ||
        !open_sample(m, ENOUGH, &m->many))
        return false;
    double *num = m->weight + 3 * blocks;
    for (size_t i = 0, x = 0, y = 0; i < values; i++, x++) {
        if (x == 3 * (size_t)b->width) {
            x = 0;
            y++;
        }
        const size_t k = y / BLOCK * (size_t)m->columns + x / (3 * BLOCK);
        const double v = variance(m, 0, i) + variance(m, 1, i), mean = moments_mean(b, i);
        m->weight[3 * k + x % 3] += v;
        num[k] += 1. / 3;
        mean_var += v / (double)values;
        mean_square += mean * mean / (double)values;
        mean_b += mean / (double)values;
    }
    m->mean = mean_b;
    for (size_t k = 0; k < 3 * blocks; k++)
        m->weight[k] =
            1 / (fmax(m->weight[k] / num[k / 3], least * mean_var) + dust * mean_square + 1e-300);
    const struct excess e = measure(m, ERROR_SCALE, 0, &m->many);
    m->stands_out = fmax(standard_errors(&e, 0), standard_errors(&e, 1)) > certain;
    return true;
}

static void close_images(struct images *m)
{
    free(m->weight);
    free(m->few.side[0]);
    free(m->many.side[0]);
}

/* In order of preference. */
static const enum error_mode_kind order[NUM_ERROR_MODES] = {
    ERROR_FLIP_X,  ERROR_FLIP_Y,  ERROR_ROTATE, ERROR_TRANSPOSE, ERROR_SWAP_RB,
    ERROR_SWAP_RG, ERROR_SWAP_GB, ERROR_SCALE,  ERROR_OFFSET,    ERROR_GAMMA,
    ERROR_SHIFT_X, ERROR_SHIFT_Y, ERROR_CLAMP};

/* The changes tried on the images, and their results. */
struct trials {
    const struct images *images;
    double amount[NUM_ERROR_MODES], share[NUM_ERROR_MODES];
};

static void try(void *ctx, size_t first, size_t last)
{
    struct trials *t = ctx;
    const struct images *m = t->images;
    for (size_t i = first; i < last; i++) {
        if (order[i] == ERROR_TRANSPOSE && m->side[0]->width != m->side[0]->height)
            continue;
        t->amount[i] = error_mode_has_amount(order[i]) ? fit(m, order[i]) : 0;
        t->share[i] =
            isnan(t->amount[i]) ? 0 : fmin(1, removed_by(m, order[i], t->amount[i], &m->many));
    }
}

bool hint_add(const struct moments *a, const struct moments *b, int threads, struct comparison *c,
              struct err *e)
{
    static const double clearly =
        0.01; /* how much more a change must remove than those before it in `order` */
    struct images m;
    struct trials t = {.images = &m};
    double most = enough_removed - clearly;
    if (c->verdict == VERDICT_EQUIVALENT || c->verdict == VERDICT_NOTHING_FOUND)
        return true;
    bool ok = open_images(a, b, &m);
    if (ok)
        parallel_for(threads, NUM_ERROR_MODES, try, &t);
    for (int i = 0; ok && i < NUM_ERROR_MODES; i++)
        if (t.share[i] >= most + clearly) {
            most = t.share[i];
            c->hint = describe(order[i], t.amount[i], t.share[i]);
        }
    close_images(&m);
    if (!ok)
        return err_set(e, "out of memory for the hint of %d x %d pixels", a->width, a->height);
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
