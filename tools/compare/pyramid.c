#include "pyramid.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

const double float_tolerance = 1e-5;
const double luminance_weight[3] = {0.2126, 0.7152, 0.0722};

struct estimate pyramid_estimate_from(double mean, double v, double k3, double n)
{
    struct estimate est = {.mean = mean, .v = v, .k3 = k3};
    if (v > 0) {
        est.var_v_normal = 2 * v * v / (n - 1);
        est.var_v = fmax(est.var_v_normal, k3 * k3 / v);
        est.var_k3 = 6 * v * v * v / ((n - 1) * (n - 2));
    }
    return est;
}

struct estimate pyramid_pixel_estimate(const struct moments *m, size_t pixel, int channel)
{
    double n = m->n[pixel];
    bool exact = strcmp(m->unit, "exact") == 0;
    assert(exact || n >= 3);
    double v_scale = exact ? 0 : 1 / (n * (n - 1));
    double k_scale = exact ? 0 : v_scale / (n - 2);
    const double *mean = m->mean + 3 * pixel, *m2 = m->m2 + 3 * pixel, *m3 = m->m3 + 3 * pixel;
    const double *tolerance = m->tolerance != NULL ? m->tolerance + 3 * pixel : (double[3]){0};
    if (channel < CHANNEL_LUMINANCE) {
        struct estimate est =
            pyramid_estimate_from(mean[channel], m2[channel] * v_scale, m3[channel] * k_scale, n);
        est.tolerance = tolerance[channel];
        return est;
    }
    double sum = 0, deviation = 0, root = 0, rounding = 0;
    for (int c = 0; c < 3; c++) {
        sum += luminance_weight[c] * mean[c];
        deviation += luminance_weight[c] * sqrt(m2[c] * v_scale);
        root += luminance_weight[c] * cbrt(m3[c] * k_scale);
        rounding += luminance_weight[c] * tolerance[c];
    }
    struct estimate est = pyramid_estimate_from(sum, deviation * deviation, root * root * root, n);
    est.tolerance = rounding;
    return est;
}

void pyramid_add_pixel(struct cell *dst, const struct estimate *a, const struct estimate *b)
{
    dst->a += a->mean;
    dst->b += b->mean;
    dst->va += a->v;
    dst->vb += b->v;
    dst->k3 += a->k3 - b->k3;
    dst->var_v += a->var_v + b->var_v;
    dst->var_v_normal += a->var_v_normal + b->var_v_normal;
    dst->var_k3 += a->var_k3 + b->var_k3;
    dst->tolerance += a->tolerance + b->tolerance;
}

static void add_cell(struct cell *dst, const struct cell *src)
{
    dst->a += src->a;
    dst->b += src->b;
    dst->va += src->va;
    dst->vb += src->vb;
    dst->k3 += src->k3;
    dst->var_v += src->var_v;
    dst->var_v_normal += src->var_v_normal;
    dst->var_k3 += src->var_k3;
    dst->tolerance += src->tolerance;
}

/* Of a law that takes the value x with probability p_x, n observations are all a and m all b, for any a
 * and b != a, with sum_a p_a^n (sum_{b != a} p_b^m) <= sum_a p_a p_a^(n-1) (1 - p_a)^m <= max over p of
 * p^(n-1) (1 - p)^m, which is at p = (n-1)/(n-1+m). */
static double log10_one_value_each(double n, double m)
{
    double k = n - 1, all = k + m;
    return (k * log(k / all) + m * log(m / all)) / log(10);
}

static bool one_value(const struct moments *m, size_t pixel, int channel)
{
    bool observed = strcmp(m->unit, "sample") == 0 || strcmp(m->unit, "replicate") == 0;
    int first = channel < CHANNEL_LUMINANCE ? channel : 0;
    int last = channel < CHANNEL_LUMINANCE ? channel : 2;
    for (int c = first; observed && c <= last; c++) {
        size_t i = 3 * pixel + (size_t)c;
        observed =
            m->mean[i] > 0 && m->m2[i] <= (m->n[pixel] - 1) * pow(float_tolerance * m->mean[i], 2);
    }
    return observed;
}

static void fill_pixels(const struct moments *a, const struct moments *b, int channel,
                        struct pyramid_level *level)
{
    size_t pixels = (size_t)level->nx * (size_t)level->ny;
    for (size_t p = 0; p < pixels; p++) {
        struct estimate ea = pyramid_pixel_estimate(a, p, channel),
                        eb = pyramid_pixel_estimate(b, p, channel);
        level->cell[p] = (struct cell){0};
        pyramid_add_pixel(&level->cell[p], &ea, &eb);
        if (one_value(a, p, channel) && one_value(b, p, channel))
            level->cell[p].log10_alike = fmin(log10_one_value_each(a->n[p], b->n[p]),
                                              log10_one_value_each(b->n[p], a->n[p]));
    }
}

/* Every region of `dst` is the sum of the regions of `src` that lie in it; src's side divides
 * dst's. */
static void fill_from(const struct pyramid_level *src, struct pyramid_level *dst)
{
    int factor = dst->side / src->side;
    for (int y = 0; y < src->ny; y++)
        for (int x = 0; x < src->nx; x++)
            add_cell(&dst->cell[(size_t)(y / factor) * (size_t)dst->nx + (size_t)(x / factor)],
                     &src->cell[(size_t)y * (size_t)src->nx + (size_t)x]);
}

static void add_level(struct pyramid *p, int side)
{
    struct pyramid_level *level = &p->level[p->num_levels++];
    level->side = side;
    level->nx = (p->width - 1) / side + 1;
    level->ny = (p->height - 1) / side + 1;
}

bool pyramid_build(const struct moments *a, const struct moments *b, int channel, int tile,
                   struct pyramid *out, struct err *e)
{
    assert(a->width == b->width && a->height == b->height && tile >= 1);
    *out = (struct pyramid){.width = a->width, .height = a->height};
    for (int side = 1; side < tile; side *= 2)
        add_level(out, side);
    out->tile_level = out->num_levels;
    int longest = a->width > a->height ? a->width : a->height;
    add_level(out, tile);
    while (out->level[out->num_levels - 1].side < longest)
        add_level(out, 2 * out->level[out->num_levels - 1].side);
    /* NOLINTNEXTLINE(clang-analyzer-optin.portability.UnixAPI): an image has a pixel. */
    out->cells = calloc(pyramid_regions(out), sizeof *out->cells);
    if (out->cells == NULL)
        return err_set(e, "out of memory for the regions of %d x %d pixels", a->width, a->height);
    struct cell *next = out->cells;
    for (int i = 0; i < out->num_levels; i++) {
        struct pyramid_level *level = &out->level[i];
        level->cell = next;
        next += (size_t)level->nx * (size_t)level->ny;
    }
    for (int i = 0; i < out->num_levels; i++) {
        struct pyramid_level *level = &out->level[i];
        if (level->side == 1)
            fill_pixels(a, b, channel, level);
        else /* a tile that is no power of two is not made of the level below it */
            fill_from(&out->level[i == out->tile_level ? 0 : i - 1], level);
    }
    return true;
}

void pyramid_free(struct pyramid *p)
{
    free(p->cells);
    *p = (struct pyramid){0};
}

size_t pyramid_regions(const struct pyramid *p)
{
    size_t regions = 0;
    for (int i = 0; i < p->num_levels; i++)
        regions += (size_t)p->level[i].nx * (size_t)p->level[i].ny;
    return regions;
}

struct rect pyramid_rect(const struct pyramid *p, int level, size_t i)
{
    const struct pyramid_level *l = &p->level[level];
    int x = (int)(i % (size_t)l->nx) * l->side, y = (int)(i / (size_t)l->nx) * l->side;
    int width = p->width - x, height = p->height - y;
    return (struct rect){x, y, width < l->side ? width : l->side,
                         height < l->side ? height : l->side};
}
