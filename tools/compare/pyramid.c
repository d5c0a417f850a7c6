#include "pyramid.h"

#include "renderer/base/huge_alloc.h"
#include "renderer/base/isa.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SMALLEST_BAND = 32 }; /* rows */
const double float_tolerance = 1e-5;

/* Estimates in a run of pixels of one side: arrays for SIMD that stay in the L1 cache. */
enum { RUN = 64 };
struct run {
    double n[RUN], v_scale[RUN], k_scale[RUN], mean[RUN], v[RUN], k3[RUN];
    double var_v[RUN], var_v_normal[RUN], var_k3[RUN], tolerance[RUN];
};

/* root: see pyramid_build(). */
ISA_CLONES static void estimate(const struct moments *m, bool exact, int channel, size_t first,
                                size_t num, const double *root, struct run *r)
{
    const bool luminance = channel == CHANNEL_LUMINANCE;
    for (size_t p = 0; p < num; p++) {
        const double n = moments_n(m, first + p);
        r->n[p] = n;
        r->v_scale[p] = exact ? 0 : 1 / (n * (n - 1));
        r->k_scale[p] = exact ? 0 : r->v_scale[p] / (n - 2);
        r->mean[p] = r->v[p] = r->k3[p] = r->tolerance[p] = 0;
    }
    for (size_t c = luminance ? 0 : (size_t)channel; c <= (luminance ? 2 : (size_t)channel); c++) {
        const double w = luminance ? luminance_weight[c] : 1;
        for (size_t p = 0, i = 3 * first + c; p < num; p++, i += 3) {
            const double v = moments_m2(m, i) * r->v_scale[p];
            r->mean[p] += w * moments_mean(m, i);
            r->v[p] += w * (luminance ? sqrt(v) : v);
        }
        for (size_t p = 0, i = 3 * first + c; root == NULL && p < num; p++, i += 3) {
            const double k3 = moments_m3(m, i) * r->k_scale[p];
            r->k3[p] += w * (luminance ? cbrt(k3) : k3);
        }
        for (size_t p = 0, i = 3 * first + c; m->tolerance != NULL && p < num; p++, i += 3)
            r->tolerance[p] += w * m->tolerance[i];
    }
    for (size_t p = 0; p < num; p++) {
        const double v = r->v[p], k3 = root != NULL ? root[first + p] : r->k3[p];
        const struct pixel_estimate est = pyramid_estimate_from(
            r->mean[p], luminance ? v * v : v, luminance ? k3 * k3 * k3 : k3, r->n[p]);
        r->v[p] = est.v;
        r->k3[p] = est.k3;
        r->var_v[p] = est.var_v;
        r->var_v_normal[p] = est.var_v_normal;
        r->var_k3[p] = est.var_k3;
    }
}

static struct pixel_estimate of_pixel(const struct run *r, size_t p)
{
    return (struct pixel_estimate){r->mean[p],         r->v[p],      r->k3[p],       r->var_v[p],
                                   r->var_v_normal[p], r->var_k3[p], r->tolerance[p]};
}

struct pixel_estimate pyramid_pixel_estimate(const struct moments *m, size_t pixel, int channel)
{
    struct run r;
    const bool exact = moments_is_exact(m);
    assert(exact || moments_n(m, pixel) >= 3);
    estimate(m, exact, channel, pixel, 1, NULL, &r);
    return of_pixel(&r, 0);
}

void pyramid_add_pixel(struct cell *dst, const struct pixel_estimate *a,
                       const struct pixel_estimate *b)
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

/* log10 of a bound of the probability that n observations of one distribution are all a and m others all b,
 * for any a and b != a. With p_x the probability of the value x, it is sum_a p_a^n (sum_{b != a} p_b^m) <=
 * sum_a p_a p_a^(n-1) (1 - p_a)^m <= max over p of p^(n-1) (1 - p)^m, attained at p = (n-1)/(n-1+m). */
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
                        double *const root[2], struct pyramid_level *level)
{
    const size_t pixels = (size_t)level->nx * (size_t)level->ny;
    const bool exact_a = moments_is_exact(a), exact_b = moments_is_exact(b);
    const bool observed = is_observed(a) && is_observed(b);
    struct run run[2];
    for (size_t p = 0; p < pixels; p++) {
        if (p % RUN == 0) {
            const size_t num = pixels - p < RUN ? pixels - p : RUN;
            estimate(a, exact_a, channel, p, num, root != NULL ? root[0] : NULL, &run[0]);
            estimate(b, exact_b, channel, p, num, root != NULL ? root[1] : NULL, &run[1]);
        }
        struct pixel_estimate ea = of_pixel(&run[0], p % RUN), eb = of_pixel(&run[1], p % RUN);
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

/* Allocates zeroed cells, in the memory of `old` if that is large enough; else frees it. */
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

bool pyramid_build(const struct moments *a, const struct moments *b, int channel,
                   double *const root[2], int tile, struct pyramid *p, struct err *e)
{
    assert(a->width == b->width && a->height == b->height);
    const struct pyramid old = *p;
    *p = pyramid_levels(a->width, a->height, tile);
    if (!alloc_cells(p, old, e))
        return false;
    for (int i = 0; i < p->num_levels; i++) {
        if (p->level[i].side == 1)
            fill_pixels(a, b, channel, root, &p->level[i]);
        else /* a tile that is no power of two is not made of the level below it */
            fill_from(p, i == p->tile_level ? 0 : i - 1, i);
    }
    return true;
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
