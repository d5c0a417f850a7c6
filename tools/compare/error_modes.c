#include "error_modes.h"

#include "pyramid.h"
#include "renderer/base/isa.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double smallest_variance =
    0.03; /* of its mean over the image: keeps weights of noise-free pixels finite */

const char *const error_mode_name[NUM_ERROR_MODES] = {
    [ERROR_SCALE] = "scale",
    [ERROR_OFFSET] = "offset",
    [ERROR_GAMMA] = "gamma",
    [ERROR_SHIFT_X] = "shift by x",
    [ERROR_SHIFT_Y] = "shift by y",
    [ERROR_FLIP_X] = "left and right exchanged",
    [ERROR_FLIP_Y] = "top and bottom exchanged",
    [ERROR_ROTATE] = "turned by 180 degrees",
    [ERROR_TRANSPOSE] = "rows and columns exchanged",
    [ERROR_SWAP_RB] = "red and blue exchanged",
    [ERROR_SWAP_RG] = "red and green exchanged",
    [ERROR_SWAP_GB] = "green and blue exchanged",
    [ERROR_CLAMP] = "clamped at 1",
};

bool error_mode_has_amount(enum error_mode_kind kind)
{
    return kind <= ERROR_SHIFT_Y;
}

static double larger(double a, double b)
{
    return a > b ? a : b;
}

size_t error_modes_at(const struct error_modes_frame *f, int x, int y)
{
    return (size_t)(y - f->y) * (size_t)f->across + (size_t)(x - f->x);
}

/* r, larger by `by` on every side, even beyond the image. */
static struct rect grown(struct rect r, int by)
{
    return (struct rect){r.x - by, r.y - by, r.width + 2 * by, r.height + 2 * by};
}

/* Loads n, mean and sd of one side; beyond the image all is 0. */
ISA_CLONES static void fill_side(const struct error_modes *modes, struct error_modes_frame *f,
                                 int side)
{
    const struct moments *m = modes->side[side];
    const bool exact = moments_is_exact(m);
    const int x = f->x > 0 ? f->x : 0, right = f->x + f->across;
    const size_t room = f->room, left = (size_t)(x - f->x);
    for (int y = f->y; y < f->y + f->down; y++) {
        const bool is_inside = y >= 0 && y < modes->height;
        const int end = right < modes->width ? right : modes->width;
        const size_t num = is_inside ? (size_t)(end - x) : 0, rest = (size_t)f->across - left - num;
        const size_t to = error_modes_at(f, x, y),
                     from = (size_t)y * (size_t)modes->width + (size_t)x;
        double *sd = f->sd[side] + to, *mean = f->mean[side] + to, *count = f->n[side] + to;
        for (size_t c = 0; c < 3 * room; c += room) {
            memset(sd + c - left, 0, left * sizeof *sd);
            memset(sd + c + num, 0, rest * sizeof *sd);
            memset(mean + c - left, 0, left * sizeof *mean);
            memset(mean + c + num, 0, rest * sizeof *mean);
        }
        for (size_t i = 0; i < num; i++) {
            double n = moments_n(m, from + i), v = exact ? 0 : 1 / (n * (n - 1));
            count[i] = n;
            for (size_t c = 0; c < 3; c++) {
                mean[c * room + i] = moments_mean(m, 3 * (from + i) + c);
                sd[c * room + i] = moments_m2(m, 3 * (from + i) + c) * v;
            }
        }
        for (size_t c = 0; c < 3 * room; c += room)
            for (size_t i = 0; i < num; i++)
                sd[c + i] = sqrt(sd[c + i]);
    }
}

static void fill_root(const struct error_modes *modes, struct error_modes_frame *f, int side,
                      struct rect r)
{
    const struct moments *m = modes->side[side];
    const bool exact = moments_is_exact(m);
    for (int y = r.y; y < r.y + r.height; y++)
        for (int x = r.x; x < r.x + r.width; x++) {
            size_t to = error_modes_at(f, x, y),
                   from = (size_t)y * (size_t)modes->width + (size_t)x;
            double n = f->n[side][to], v = exact ? 0 : 1 / (n * (n - 1)),
                   k = exact ? 0 : v / (n - 2);
            for (size_t c = 0; c < 3; c++)
                f->root[side][to + c * f->room] = cbrt(moments_m3(m, 3 * from + c) * k);
        }
}

/* How many of the `size` places are at most `reach` away from place i. */
static inline int places(int i, int reach, int size)
{
    const int first = i < reach ? 0 : i - reach, last = i + reach < size ? i + reach : size - 1;
    return last - first + 1;
}

/* One plane: out = mean of f(in) over the (2 reach + 1)^2 pixels around each of r that lie in the image, without the
 * pixel itself; f is the square or the identity. */
static inline __attribute__((always_inline)) void around(const struct error_modes *modes,
                                                         const struct error_modes_frame *f,
                                                         struct rect r, const double *in,
                                                         bool square, int reach, double *out)
{
    for (int y = r.y - reach; y < r.y + r.height + reach; y++) {
        const size_t at = error_modes_at(f, r.x, y);
        for (int x = 0; x < r.width; x++) {
            double sum = 0;
            for (int k = -reach; k <= reach; k++) {
                const double v = in[(ptrdiff_t)at + x + k];
                sum += square ? v * v : v;
            }
            f->row[at + (size_t)x] = sum;
        }
    }
    for (int y = r.y; y < r.y + r.height; y++) {
        const size_t at = error_modes_at(f, r.x, y);
        const int rows = places(y, reach, modes->height);
        for (int x = 0; x < r.width; x++) {
            const double v = in[at + (size_t)x];
            double sum = square ? -(v * v) : -v;
            for (int k = -reach; k <= reach; k++)
                sum += f->row[(ptrdiff_t)at + x + (ptrdiff_t)k * f->across];
            const int others = rows * places(r.x + x, reach, modes->width) - 1;
            out[at + (size_t)x] = larger(0, sum) / (others > 1 ? others : 1);
        }
    }
}

/* Moves the frame to the pixels r of the image and computes what `depth` asks for. */
enum depth { VARIANCES, WEIGHTS, ALL };
ISA_CLONES static void move_frame(const struct error_modes *modes, struct error_modes_frame *f,
                                  struct rect r, enum depth depth)
{
    const struct rect near = grown(r, depth == ALL ? 1 : 0), whole = grown(near, 2);
    f->x = whole.x;
    f->y = whole.y;
    f->across = whole.width;
    f->down = whole.height;
    for (int s = 0; s < 2; s++) {
        fill_side(modes, f, s);
        for (size_t c = 0; c < 3 * f->room; c += f->room)
            around(modes, f, near, f->sd[s] + c, true, 2, f->around[s] + c);
    }
    for (size_t c = 0; depth != VARIANCES && c < 3; c++)
        for (int y = near.y; y < near.y + near.height; y++) {
            const size_t at = c * f->room + error_modes_at(f, near.x, y);
            const double *va = f->around[0] + at, *vb = f->around[1] + at, *a = f->mean[0] + at,
                         *b = f->mean[1] + at, least = modes->least[c];
            for (int x = 0; x < near.width; x++) {
                double share = va[x] + vb[x] > 0 ? vb[x] / (va[x] + vb[x]) : 0.5;
                f->mix[at + (size_t)x] = b[x] + share * (a[x] - b[x]);
                f->weight[at + (size_t)x] = least > 0 ? 1 / larger(va[x] + vb[x], least) : 0;
            }
        }
    if (depth != ALL)
        return;
    fill_root(modes, f, 0, r);
    fill_root(modes, f, 1, r);
    for (size_t c = 0; c < 3 * f->room; c += f->room) {
        around(modes, f, r, f->mix + c, false, 1, f->mix_around + c);
        around(modes, f, r, f->mean[1] + c, false, 1, f->b_around + c);
    }
}

static bool alloc_frame(struct error_modes_frame *f, size_t room)
{
    double **const part[] = {&f->mean[0], &f->mean[1], &f->sd[0],      &f->sd[1],
                             &f->root[0], &f->root[1], &f->around[0],  &f->around[1],
                             &f->weight,  &f->mix,     &f->mix_around, &f->b_around};
    size_t num = sizeof part / sizeof *part;
    f->room = room;
    f->data = malloc((3 * num + 3) * room * sizeof *f->data);
    for (size_t i = 0; f->data != NULL && i < num; i++)
        *part[i] = f->data + 3 * i * room;
    f->n[0] = f->data + 3 * num * room;
    f->n[1] = f->n[0] + room;
    f->row = f->n[1] + room;
    return f->data != NULL;
}

/* 3 % of the mean of the variances around all pixels. */
static void find_least(struct error_modes *modes)
{
    const double n = 3 * (double)modes->width * modes->height;
    const size_t room = modes->own.room;
    double mean[3] = {0};
    for (int y = 0; y < modes->height; y += ERROR_MODES_BAND) {
        const int left = modes->height - y,
                  rows = left < ERROR_MODES_BAND ? left : ERROR_MODES_BAND;
        move_frame(modes, &modes->own, (struct rect){0, y, modes->width, rows}, VARIANCES);
        for (int i = 0; i < rows * modes->width; i++)
            for (size_t c = 0,
                        at = error_modes_at(&modes->own, i % modes->width, y + i / modes->width);
                 c < 3; c++, at += room)
                mean[c] += 3 * (modes->own.around[0][at] + modes->own.around[1][at]) / n;
    }
    for (int c = 0; c < 3; c++)
        modes->least[c] = smallest_variance * mean[c];
}

bool error_modes_open(const struct moments *a, const struct moments *b, struct error_modes *out,
                      struct err *e)
{
    const int halo = 3, rows = a->height < ERROR_MODES_BAND ? a->height : ERROR_MODES_BAND;
    assert(a->width > 1 || a->height > 1);
    *out = (struct error_modes){{a, b}, .width = a->width, .height = a->height};
    const size_t room = (size_t)(a->width + 2 * halo) * (size_t)(rows + 2 * halo);
    if (!alloc_frame(&out->own, room) || !alloc_frame(&out->turned, room) ||
        (a->width == a->height && !alloc_frame(&out->columns, room))) {
        error_modes_free(out);
        return err_set(e, "out of memory for the directions of %d x %d pixels", a->width,
                       a->height);
    }
    find_least(out);
    return true;
}

void error_modes_free(struct error_modes *modes)
{
    free(modes->own.data);
    free(modes->turned.data);
    free(modes->columns.data);
    *modes = (struct error_modes){0};
}

void error_modes_go_to(struct error_modes *modes, int y, int rows)
{
    const int w = modes->width, h = modes->height;
    move_frame(modes, &modes->own, (struct rect){0, y, w, rows}, ALL);
    move_frame(modes, &modes->turned, (struct rect){0, h - y - rows, w, rows}, WEIGHTS);
    if (w == h)
        move_frame(modes, &modes->columns, (struct rect){y, 0, rows, h}, WEIGHTS);
}

bool error_mode_applies(const struct error_modes *modes, enum error_mode_kind kind)
{
    if (kind == ERROR_SHIFT_X || kind == ERROR_SHIFT_Y)
        return modes->width > 2 && modes->height > 2;
    return kind != ERROR_TRANSPOSE || modes->width == modes->height;
}

static double power(double x)
{
    return x > 0 ? x * log(x) : 0;
}

static double over(double x)
{
    return (x < 1 ? x : 1) - x;
}

/* Minus the central difference, averaged over the two rows (for a shift down, columns) beside the pixel's. */
ISA_CLONES static void shift(const struct error_modes *modes, bool down, int y,
                             double *const out[3])
{
    const struct error_modes_frame *f = &modes->own;
    const int last = modes->width - 1;
    for (size_t c = 0; c < 3; c++) {
        memset(out[c], 0, (size_t)modes->width * sizeof *out[c]);
        if (y < 1 || y >= modes->height - 1)
            continue;
        const double *above = f->mix + c * f->room + error_modes_at(f, 0, y - 1),
                     *below = f->mix + c * f->room + error_modes_at(f, 0, y + 1);
        for (int x = 1; x < last; x++) {
            double left = -((down ? below[x - 1] : above[x + 1]) - above[x - 1]) / 2;
            double right = -(below[x + 1] - (down ? above[x + 1] : below[x - 1])) / 2;
            out[c][x] = (left + right) / 2;
        }
    }
}

/* B of channel from[c] around the pixel minus B of channel c around it. */
ISA_CLONES static void swap(const struct error_modes *modes, const int from[3], int y,
                            const struct error_change *out)
{
    const struct error_modes_frame *f = &modes->own;
    const size_t at = error_modes_at(f, 0, y), room = f->room;
    for (size_t x = 0; x < (size_t)modes->width; x++) {
        double near = 0;
        for (size_t c = 0; c < 3; c++) {
            size_t i = c * room + at + x, k = (size_t)from[c] * room + at + x;
            out->d[c][x] = f->b_around[k] - f->b_around[i];
            near += (f->around[1][i] + f->around[1][k]) * f->weight[i];
        }
        out->coupled[x] = near * near / 8;
    }
}

/* B at another pixel minus B around this one. For column 0 the other is element `other` of frame g; the next is `step`
 * on. */
ISA_CLONES static void move(const struct error_modes *modes, const struct error_modes_frame *g,
                            size_t other, ptrdiff_t step, int y, const struct error_change *out)
{
    const struct error_modes_frame *f = &modes->own;
    const double *b = g->mean[1] + other, *sd = g->sd[1] + other, *weight = g->weight + other;
    for (size_t x = 0, i = error_modes_at(f, 0, y); x < (size_t)modes->width; x++, i++) {
        const ptrdiff_t k = (ptrdiff_t)x * step;
        double to_other = 0, to_own = 0, near = 0;
        for (size_t c = 0; c < 3; c++) {
            const size_t own = c * f->room + i;
            const ptrdiff_t o = (ptrdiff_t)(c * g->room) + k;
            out->d[c][x] = b[o] - f->b_around[own];
            to_other += f->sd[1][own] * sd[o] * f->weight[own];
            to_own += f->sd[1][own] * sd[o] * weight[o];
            near += f->around[1][own] * f->weight[own];
        }
        out->coupled[x] = to_other * to_own + near * near / 8;
    }
}

/* A pixel that is mapped to itself does not change. */
static void stay(int x, const struct error_change *out)
{
    out->d[0][x] = out->d[1][x] = out->d[2][x] = out->coupled[x] = 0;
}

void error_mode_row(const struct error_modes *modes, enum error_mode_kind kind, int y,
                    const struct error_change *out)
{
    const struct error_modes_frame *own = &modes->own, *turned = &modes->turned,
                                   *columns = &modes->columns;
    const int w = modes->width, other = modes->height - 1 - y;
    const size_t size = (size_t)w;
    const bool centre = w % 2 == 1;
    memset(out->coupled, 0, size * sizeof *out->coupled);
    for (size_t c = 0; c < 3; c++) {
        const double *near = own->mix_around + c * own->room + error_modes_at(own, 0, y);
        for (size_t x = 0; kind == ERROR_SCALE && x < size; x++)
            out->d[c][x] = near[x];
        for (size_t x = 0; kind == ERROR_OFFSET && x < size; x++)
            out->d[c][x] = 1;
        for (size_t x = 0; kind == ERROR_GAMMA && x < size; x++)
            out->d[c][x] = power(near[x]);
        for (size_t x = 0; kind == ERROR_CLAMP && x < size; x++)
            out->d[c][x] = over(near[x]);
    }
    switch (kind) {
    case ERROR_SCALE:
    case ERROR_OFFSET:
    case ERROR_GAMMA:
    case ERROR_CLAMP: return;
    case ERROR_SHIFT_X:
    case ERROR_SHIFT_Y: shift(modes, kind == ERROR_SHIFT_Y, y, out->d); return;
    case ERROR_SWAP_RB: swap(modes, (int[3]){2, 1, 0}, y, out); return;
    case ERROR_SWAP_RG: swap(modes, (int[3]){1, 0, 2}, y, out); return;
    case ERROR_SWAP_GB: swap(modes, (int[3]){0, 2, 1}, y, out); return;
    case ERROR_FLIP_X:
        move(modes, own, error_modes_at(own, w - 1, y), -1, y, out);
        if (centre)
            stay(w / 2, out);
        return;
    case ERROR_FLIP_Y:
        move(modes, turned, error_modes_at(turned, 0, other), 1, y, out);
        for (int x = 0; other == y && x < w; x++)
            stay(x, out);
        return;
    case ERROR_ROTATE:
        move(modes, turned, error_modes_at(turned, w - 1, other), -1, y, out);
        if (centre && other == y)
            stay(w / 2, out);
        return;
    case ERROR_TRANSPOSE:
        move(modes, columns, error_modes_at(columns, y, 0), columns->across, y, out);
        stay(y, out);
        return;
    case NUM_ERROR_MODES:
    default: assert(!"no direction");
    }
}
