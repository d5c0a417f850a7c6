#include "error_modes.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double smallest_variance =
    0.03; /* of the image's mean: noise-free pixels weigh finitely */

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

static void fill_side(const struct moments *m, double *sd, double *root)
{
    bool exact = strcmp(m->unit, "exact") == 0;
    size_t pixels = (size_t)m->width * (size_t)m->height;
    for (size_t p = 0; p < pixels; p++) {
        double n = m->n[p], v = exact ? 0 : 1 / (n * (n - 1)), k = exact ? 0 : v / (n - 2);
        for (size_t i = 3 * p; i < 3 * p + 3; i++) {
            sd[i] = sqrt(m->m2[i] * v);
            root[i] = cbrt(m->m3[i] * k);
        }
    }
}

/* out = mean of f(in) over the (2 reach + 1)^2 pixels around each that lie in the image, without the
 * pixel itself; f is the square or nothing. `row` has room for one image. */
static void around(int width, int height, const double *in, bool square, int reach, double *row,
                   double *out)
{
    size_t stride = 3 * (size_t)width;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            int lo = x < reach ? 0 : x - reach, hi = x + reach < width ? x + reach : width - 1;
            double sum[3] = {0};
            for (int k = lo; k <= hi; k++)
                for (int c = 0; c < 3; c++) {
                    double v = in[(size_t)y * stride + 3 * (size_t)k + (size_t)c];
                    sum[c] += square ? v * v : v;
                }
            memcpy(&row[(size_t)y * stride + 3 * (size_t)x], sum, sizeof sum);
        }
    for (int y = 0; y < height; y++) {
        int lo = y < reach ? 0 : y - reach, hi = y + reach < height ? y + reach : height - 1;
        for (int x = 0; x < width; x++) {
            int x_lo = x < reach ? 0 : x - reach, x_hi = x + reach < width ? x + reach : width - 1;
            double others = (double)(hi - lo + 1) * (x_hi - x_lo + 1) - 1;
            size_t i = (size_t)y * stride + 3 * (size_t)x;
            for (size_t c = 0; c < 3; c++) {
                double own = square ? in[i + c] * in[i + c] : in[i + c], sum = -own;
                for (int k = lo; k <= hi; k++)
                    sum += row[(size_t)k * stride + 3 * (size_t)x + c];
                out[i + c] = fmax(0, sum) / others;
            }
        }
    }
}

bool error_modes_base_build(const struct moments *a, const struct moments *b,
                            struct error_modes_base *out, struct err *e)
{
    size_t n = 3 * (size_t)a->width * (size_t)a->height;
    assert(n > 3);
    *out = (struct error_modes_base){.width = a->width, .height = a->height, .a = a, .b = b};
    double **const part[] = {&out->sd[0],      &out->sd[1],     &out->root[0], &out->root[1],
                             &out->around[0],  &out->around[1], &out->weight,  &out->mix,
                             &out->mix_around, &out->b_around};
    size_t num = sizeof part / sizeof *part;
    out->data = malloc((num + 1) * n * sizeof *out->data);
    if (out->data == NULL)
        return err_set(e, "out of memory for the directions of %d x %d pixels", a->width,
                       a->height);
    for (size_t i = 0; i < num; i++)
        *part[i] = out->data + i * n;
    double *row = out->data + num * n;
    const struct moments *side[2] = {a, b};
    for (int s = 0; s < 2; s++) {
        fill_side(side[s], out->sd[s], out->root[s]);
        around(a->width, a->height, out->sd[s], true, 2, row, out->around[s]);
    }
    double mean[3] = {0};
    for (size_t i = 0; i < n; i++) {
        double va = out->around[0][i], vb = out->around[1][i];
        double share = va + vb > 0 ? vb / (va + vb) : 0.5;
        out->weight[i] = va + vb;
        out->mix[i] = b->mean[i] + share * (a->mean[i] - b->mean[i]);
        mean[i % 3] += 3 * (va + vb) / (double)n;
    }
    for (size_t i = 0; i < n; i++)
        out->weight[i] =
            mean[i % 3] > 0 ? 1 / fmax(out->weight[i], smallest_variance * mean[i % 3]) : 0;
    around(a->width, a->height, out->mix, false, 1, row, out->mix_around);
    around(a->width, a->height, b->mean, false, 1, row, out->b_around);
    return true;
}

void error_modes_base_free(struct error_modes_base *base)
{
    free(base->data);
    *base = (struct error_modes_base){0};
}

bool error_mode_applies(const struct error_modes_base *base, enum error_mode_kind kind)
{
    if (kind == ERROR_SHIFT_X || kind == ERROR_SHIFT_Y)
        return base->width > 2 && base->height > 2;
    return kind != ERROR_TRANSPOSE || base->width == base->height;
}

static double power(double x)
{
    return x > 0 ? x * log(x) : 0;
}

static double over(double x)
{
    return fmin(x, 1) - x;
}

static size_t at(const struct error_modes_base *base, int x, int y)
{
    return 3 * ((size_t)y * (size_t)base->width + (size_t)x);
}

/* Minus the central difference in row y, per pixel to the right (or, transposed, down). */
static void slope(const struct error_modes_base *base, int x, int y, bool down, double out[3])
{
    size_t lo = down ? at(base, x, y - 1) : at(base, x - 1, y);
    size_t hi = down ? at(base, x, y + 1) : at(base, x + 1, y);
    for (size_t c = 0; c < 3; c++)
        out[c] = -(base->mix[hi + c] - base->mix[lo + c]) / 2;
}

/* From the rows (columns) beside that of the pixel. */
static void shift(const struct error_modes_base *base, bool down, int x, int y,
                  struct error_change *out)
{
    double left[3], right[3];
    if (x < 1 || y < 1 || x >= base->width - 1 || y >= base->height - 1)
        return;
    slope(base, down ? x - 1 : x, down ? y : y - 1, down, left);
    slope(base, down ? x + 1 : x, down ? y : y + 1, down, right);
    for (int c = 0; c < 3; c++)
        out->d[c] = (left[c] + right[c]) / 2;
}

/* B of channel from[c] around the pixel (or, moved, of another pixel) less B around it. */
static void exchange(const struct error_modes_base *base, size_t own, size_t other,
                     const int from[3], struct error_change *out)
{
    const struct error_modes_base *s = base;
    bool moved = own != other;
    double to_other = 0, to_own = 0, near = 0;
    for (size_t c = 0; c < 3; c++) {
        size_t k = (size_t)from[c];
        double there = moved ? s->b->mean[other + c] : s->b_around[own + k];
        out->d[c] = there - s->b_around[own + c];
        to_other += s->sd[1][own + c] * s->sd[1][other + c] * s->weight[own + c];
        to_own += s->sd[1][own + c] * s->sd[1][other + c] * s->weight[other + c];
        near += (s->around[1][own + c] + (moved ? 0 : s->around[1][own + k])) * s->weight[own + c];
    }
    out->coupled = (moved ? to_other * to_own : 0) + near * near / 8;
}

struct error_change error_mode_at(const struct error_modes_base *base, enum error_mode_kind kind,
                                  int x, int y)
{
    struct error_change out = {0};
    static const int same[3] = {0, 1, 2};
    int w = base->width, h = base->height;
    size_t own = at(base, x, y), other;
    const double *near = base->mix_around + own;
    switch (kind) {
    case ERROR_SCALE: memcpy(out.d, near, sizeof out.d); return out;
    case ERROR_OFFSET:
        for (int c = 0; c < 3; c++)
            out.d[c] = 1;
        return out;
    case ERROR_GAMMA:
        for (int c = 0; c < 3; c++)
            out.d[c] = power(near[c]);
        return out;
    case ERROR_CLAMP:
        for (int c = 0; c < 3; c++)
            out.d[c] = over(near[c]);
        return out;
    case ERROR_SHIFT_X:
    case ERROR_SHIFT_Y: shift(base, kind == ERROR_SHIFT_Y, x, y, &out); return out;
    case ERROR_SWAP_RB: exchange(base, own, own, (int[3]){2, 1, 0}, &out); return out;
    case ERROR_SWAP_RG: exchange(base, own, own, (int[3]){1, 0, 2}, &out); return out;
    case ERROR_SWAP_GB: exchange(base, own, own, (int[3]){0, 2, 1}, &out); return out;
    case ERROR_FLIP_X: other = at(base, w - 1 - x, y); break;
    case ERROR_FLIP_Y: other = at(base, x, h - 1 - y); break;
    case ERROR_ROTATE: other = at(base, w - 1 - x, h - 1 - y); break;
    case ERROR_TRANSPOSE: other = at(base, y, x); break;
    case NUM_ERROR_MODES:
    default: assert(!"no direction"); return out;
    }
    if (other != own)
        exchange(base, own, other, same, &out);
    return out;
}
