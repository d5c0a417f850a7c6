/* Closed form of textured rectangles that face the camera (values: truth.h). */
#include "truth.h"

#include "truth_values.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_TEXELS = 64 };

/* Repetitions of the texture that are considered on either side of the first. */
#define REACH 8

enum wrap { WRAP, MIRROR, CLAMP, BORDER, NUM_WRAPS };
static const char *const wrap_names[NUM_WRAPS] = {"WRAP", "MIRROR", "CLAMP", "BORDER"};

struct picture {
    int width, height;
    double linear[MAX_TEXELS * MAX_TEXELS][3];
};

struct board {
    double place[4], uv[4], factor[3];
    enum wrap wrap[2];
    bool nearest;
};

double truth_texel_share(double t, bool nearest)
{
    if (nearest)
        return fmin(1, fmax(0, t + 0.5));
    double s = fmin(1, fmax(-1, t));
    return s < 0 ? 0.5 * (1 + s) * (1 + s) : 1 - 0.5 * (1 - s) * (1 - s);
}

/* Which of n texels is at position k of the infinitely repeated row; -1: none. */
static int texel_at(int k, int n, enum wrap wrap)
{
    int period = wrap == MIRROR ? 2 * n : n, m = ((k % period) + period) % period;
    bool outside = k < 0 || k >= n;
    if (wrap == BORDER)
        return outside ? -1 : k;
    if (wrap == CLAMP)
        return outside ? (k < 0 ? 0 : n - 1) : k;
    return m < n ? m : period - 1 - m;
}

/* Weights of the n texels in the mean of the texture over the texture coordinates a .. b of one
 * axis, times `part`, the fraction of the pixel that this interval covers. */
static void axis_shares(double a, double b, int n, enum wrap wrap, bool nearest, double part,
                        double *share)
{
    memset(share, 0, (size_t)n * sizeof *share);
    for (int k = -REACH * n; k < REACH * n; k++) {
        int i = texel_at(k, n, wrap);
        if (i >= 0)
            share[i] += part / (n * (b - a)) *
                        (truth_texel_share(n * b - k - 0.5, nearest) -
                         truth_texel_share(n * a - k - 0.5, nearest));
    }
}

/* The part of pixel p (of `size`) that lies in [from, to], fractions of the image, and the texture
 * coordinates of its ends. False if the pixel is outside. */
static bool overlap(int p, int size, double from, double to, double at_from, double at_to,
                    double range[2], double *part)
{
    double lo = fmax(from, (double)p / size), hi = fmin(to, (double)(p + 1) / size);
    if (!(hi > lo))
        return false;
    *part = (hi - lo) * size;
    range[0] = at_from + (lo - from) / (to - from) * (at_to - at_from);
    range[1] = at_from + (hi - from) / (to - from) * (at_to - at_from);
    return true;
}

static void add_board(const struct picture *t, const struct board *b, struct moments *out)
{
    for (int row = 0; row < out->height; row++)
        for (int col = 0; col < out->width; col++) {
            double u[2], v[2], part[2], across[MAX_TEXELS], up[MAX_TEXELS];
            if (!overlap(col, out->width, b->place[0], b->place[2], b->uv[0], b->uv[2], u,
                         &part[0]) ||
                !overlap(row, out->height, b->place[1], b->place[3], b->uv[1], b->uv[3], v,
                         &part[1]))
                continue;
            axis_shares(u[0], u[1], t->width, b->wrap[0], b->nearest, part[0], across);
            axis_shares(v[0], v[1], t->height, b->wrap[1], b->nearest, part[1], up);
            double *mean = out->mean + 3 * ((size_t)row * (size_t)out->width + (size_t)col);
            for (int j = 0; j < t->height; j++)
                for (int i = 0; i < t->width; i++)
                    for (int c = 0; c < 3; c++) /* rows are from the top */
                        mean[c] += b->factor[c] * across[i] * up[t->height - 1 - j] *
                                   t->linear[j * t->width + i][c];
        }
}

/* IEC 61966-2-1. */
static double linear_of_byte(double byte)
{
    double c = byte / 255;
    return c <= 0.04045 ? c / 12.92 : pow((c + 0.055) / 1.055, 2.4);
}

static bool read_picture(json_t *rows, struct picture *t, struct err *e)
{
    t->height = (int)json_array_size(rows);
    if (t->width < 1 || t->width > MAX_TEXELS || t->height < 1 || t->height > MAX_TEXELS)
        return err_set(e, "%d x %d texels, not 1 to %d", t->width, t->height, MAX_TEXELS);
    for (int j = 0; j < t->height; j++) {
        const json_t *row = json_array_get(rows, (size_t)j);
        if (json_array_size(row) != 3 * (size_t)t->width)
            return err_set(e, "rows[%d] has %zu numbers, not %d", j, json_array_size(row),
                           3 * t->width);
        for (int k = 0; k < 3 * t->width; k++) {
            double byte = json_number_value(json_array_get(row, (size_t)k));
            if (!(byte >= 0 && byte <= 255))
                return err_set(e, "rows[%d][%d] is %g, not in [0, 255]", j, k, byte);
            t->linear[j * t->width + k / 3][k % 3] = linear_of_byte(byte);
        }
    }
    return true;
}

static bool read_wrap(const json_t *value, enum wrap *out, struct err *e)
{
    const char *name = json_is_string(value) ? json_string_value(value) : "";
    for (int i = 0; i < NUM_WRAPS; i++)
        if (strcmp(name, wrap_names[i]) == 0) {
            *out = (enum wrap)i;
            return true;
        }
    return err_set(e, "unknown wrap '%.40s'", name);
}

static bool read_board(const json_t *value, struct board *b, struct err *e)
{
    const json_t *wrap = json_object_get(value, "wrap");
    b->nearest = json_is_true(json_object_get(value, "nearest"));
    if (!truth_values_read(value, e, "place[4] uv[4] (wrap) (nearest) factor[3]>=0", b->place,
                           b->uv, b->factor) ||
        !read_wrap(json_array_get(wrap, 0), &b->wrap[0], e) ||
        !read_wrap(json_array_get(wrap, 1), &b->wrap[1], e))
        return false;
    for (int k = 0; k < 4; k++)
        if (!(b->place[k] >= 0 && b->place[k] <= 1 && fabs(b->uv[k]) < REACH - 1))
            return err_set(e, "place or uv out of range");
    if (!(b->place[0] < b->place[2] && b->place[1] < b->place[3] && b->uv[0] != b->uv[2] &&
          b->uv[1] != b->uv[3]))
        return err_set(e, "place or uv without an extent");
    return true;
}

static bool fill_pictures(const struct suite_scene *scene, const struct suite_reference *ref,
                          struct moments *out, struct err *e)
{
    json_error_t why;
    json_t *rows, *boards, *value;
    size_t i;
    struct picture *t = calloc(1, sizeof *t);
    bool ok = t != NULL || err_set(e, "out of memory");
    if (ok && json_unpack_ex(ref->values, &why, JSON_STRICT, "{s:i, s:o, s:o}", "width", &t->width,
                             "rows", &rows, "boards", &boards) != 0)
        ok = err_set(e, "%s", why.text);
    ok = ok && truth_check_depth(scene, e) && read_picture(rows, t, e);
    if (ok)
        json_array_foreach(boards, i, value) {
            struct board b;
            ok = ok && read_board(value, &b, e);
            if (ok)
                add_board(t, &b, out);
        }
    free(t);
    return ok;
}

const struct truth_kind truth_texture[] = {{"pictures", fill_pictures, false}, {0}};
