#include "pyramid.h"

#include "renderer/base/huge_alloc.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SMALLEST_BAND = 32 }; /* rows */
const double float_tolerance = 1e-5;
const double luminance_weight[3] = {0.2126, 0.7152, 0.0722};

static inline struct estimate estimate(const struct moments *m, bool exact, size_t pixel,
                                       int channel)
{
    double n = moments_n(m, pixel);
    assert(exact || n >= 3);
    double v_scale = exact ? 0 : 1 / (n * (n - 1));
    double k_scale = exact ? 0 : v_scale / (n - 2);
    const double *tolerance = m->tolerance != NULL ? m->tolerance + 3 * pixel : (double[3]){0};
    if (channel < CHANNEL_LUMINANCE) {
        size_t i = 3 * pixel + (size_t)channel;
        struct estimate est = pyramid_estimate_from(moments_mean(m, i), moments_m2(m, i) * v_scale,
                                                    moments_m3(m, i) * k_scale, n);
        est.tolerance = tolerance[channel];
        return est;
    }
    double sum = 0, deviation = 0, root = 0, rounding = 0;
    for (size_t c = 0; c < 3; c++) {
        size_t i = 3 * pixel + c;
        sum += luminance_weight[c] * moments_mean(m, i);
        deviation += luminance_weight[c] * sqrt(moments_m2(m, i) * v_scale);
        root += luminance_weight[c] * cbrt(moments_m3(m, i) * k_scale);
        rounding += luminance_weight[c] * tolerance[c];
    }
    struct estimate est = pyramid_estimate_from(sum, deviation * deviation, root * root * root, n);
    est.tolerance = rounding;
    return est;
}

static bool is_exact(const struct moments *m)
{
    return strcmp(m->unit, "exact") == 0;
}

struct estimate pyramid_pixel_estimate(const struct moments *m, size_t pixel, int channel)
{
    return estimate(m, is_exact(m), pixel, channel);
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

static bool is_observed(const struct moments *m)
{
    return strcmp(m->unit, "sample") == 0 || strcmp(m->unit, "replicate") == 0;
}

static bool one_value(const struct moments *m, size_t pixel, int channel)
{
    bool observed = true;
    int first = channel < CHANNEL_LUMINANCE ? channel : 0;
    int last = channel < CHANNEL_LUMINANCE ? channel : 2;
    for (int c = first; observed && c <= last; c++) {
        size_t i = 3 * pixel + (size_t)c;
        double mean = moments_mean(m, i);
        observed = mean > 0 &&
                   moments_m2(m, i) <= (moments_n(m, pixel) - 1) * pow(float_tolerance * mean, 2);
    }
    return observed;
}

static void fill_pixels(const struct moments *a, const struct moments *b, int channel,
                        struct pyramid_level *level)
{
    const size_t pixels = (size_t)level->nx * (size_t)level->ny;
    const bool exact_a = is_exact(a), exact_b = is_exact(b);
    const bool observed = is_observed(a) && is_observed(b);
    for (size_t p = 0; p < pixels; p++) {
        struct estimate ea = estimate(a, exact_a, p, channel),
                        eb = estimate(b, exact_b, p, channel);
        level->cell[p] = (struct cell){0};
        pyramid_add_pixel(&level->cell[p], &ea, &eb);
        if (observed && one_value(a, p, channel) && one_value(b, p, channel))
            level->cell[p].log10_alike =
                fmin(log10_one_value_each(moments_n(a, p), moments_n(b, p)),
                     log10_one_value_each(moments_n(b, p), moments_n(a, p)));
    }
}

static int least(int a, int b)
{
    return a < b ? a : b;
}

size_t pyramid_parent(const struct pyramid *p, int fine, int coarse, size_t i)
{
    const struct pyramid_level *f = &p->level[fine], *c = &p->level[coarse];
    return pyramid_around(c, c->side / f->side, (int)(i % (size_t)f->nx), (int)(i / (size_t)f->nx));
}

/* Every region of a level is the sum of the regions of level `from` that lie in it; that one's side
 * divides its own. */
static void fill_from(struct pyramid *p, int from, int level)
{
    const struct pyramid_level *fine = &p->level[from], *coarse = &p->level[level];
    const int factor = coarse->side / fine->side;
    const struct cell *src = fine->cell;
    for (int y = 0; y < fine->ny; y++)
        for (int x = 0; x < fine->nx; x++)
            add_cell(&coarse->cell[pyramid_around(coarse, factor, x, y)], src++);
}

int pyramid_tiles(int length, int tile)
{
    int tiles = (length + tile / 2) / tile;
    return tiles > 0 ? tiles : 1;
}

static void add_level(struct pyramid *p, int side, int nx, int ny)
{
    p->level[p->num_levels++] = (struct pyramid_level){.side = side, .nx = nx, .ny = ny};
}

struct pyramid pyramid_levels(int width, int height, int tile)
{
    struct pyramid p = {.width = width, .height = height};
    assert(tile >= 1);
    tile = least(tile, width > height ? width : height);
    for (int side = 1; side < tile; side *= 2)
        add_level(&p, side, (width - 1) / side + 1, (height - 1) / side + 1);
    p.tile_level = p.num_levels;
    int nx = pyramid_tiles(width, tile), ny = pyramid_tiles(height, tile);
    for (int side = tile;; side *= 2, nx = (nx + 1) / 2, ny = (ny + 1) / 2) {
        add_level(&p, side, nx, ny);
        if (nx == 1 && ny == 1)
            return p;
    }
}

/* Zeroed, in the memory of `old` if there is enough of that. */
static bool alloc_cells(struct pyramid *p, struct pyramid old, struct err *e)
{
    p->room = pyramid_regions(p);
    if (old.cells == NULL || old.room < p->room) {
        pyramid_free(&old);
        p->cells = huge_calloc(p->room, sizeof *p->cells);
    } else {
        p->cells = old.cells;
        memset(p->cells, 0, p->room * sizeof *p->cells);
        p->room = old.room;
    }
    if (p->cells == NULL)
        return err_set(e, "out of memory for the regions of %d x %d pixels", p->width, p->height);
    struct cell *next = p->cells;
    for (int i = 0; i < p->num_levels; i++) {
        p->level[i].cell = next;
        next += (size_t)p->level[i].nx * (size_t)p->level[i].ny;
    }
    return true;
}

bool pyramid_rebuild(const struct moments *a, const struct moments *b, int channel, int tile,
                     struct pyramid *p, struct err *e)
{
    assert(a->width == b->width && a->height == b->height);
    const struct pyramid old = *p;
    *p = pyramid_levels(a->width, a->height, tile);
    if (!alloc_cells(p, old, e))
        return false;
    for (int i = 0; i < p->num_levels; i++) {
        if (p->level[i].side == 1)
            fill_pixels(a, b, channel, &p->level[i]);
        else /* a tile that is no power of two is not made of the level below it */
            fill_from(p, i == p->tile_level ? 0 : i - 1, i);
    }
    return true;
}

bool pyramid_build(const struct moments *a, const struct moments *b, int channel, int tile,
                   struct pyramid *out, struct err *e)
{
    *out = (struct pyramid){.width = 0};
    return pyramid_rebuild(a, b, channel, tile, out, e);
}

int pyramid_band(const struct pyramid *levels)
{
    int tile = levels->level[levels->tile_level].side;
    if ((tile & (tile - 1)) != 0 || tile > levels->height / 2)
        return levels->height;
    return tile < SMALLEST_BAND / 2 ? SMALLEST_BAND : 2 * tile;
}

bool pyramid_above(const struct pyramid *levels, struct pyramid *out, struct err *e)
{
    *out = *levels;
    out->tile_level = 0;
    out->num_levels -= levels->tile_level;
    memmove(out->level, levels->level + levels->tile_level,
            (size_t)out->num_levels * sizeof *out->level);
    return alloc_cells(out, (struct pyramid){0}, e);
}

void pyramid_sum_up(struct pyramid *above)
{
    for (int i = 1; i < above->num_levels; i++)
        fill_from(above, i - 1, i);
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
    int column = (int)(i % (size_t)l->nx), row = (int)(i / (size_t)l->nx);
    int x = column * l->side, y = row * l->side;
    return (struct rect){x, y, column + 1 < l->nx ? l->side : p->width - x,
                         row + 1 < l->ny ? l->side : p->height - y};
}
