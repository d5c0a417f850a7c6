#include "compare.h"

#include "pyramid.h"
#include "region.h"
#include "stats.h"
#include "verdict.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double floor_fraction = 0.05; /* of the mean luminance of B */
static const double largest_z = 1e4;
const char *const statistic_name[NUM_STATISTICS] = {"image", "pyramid", "dense", "directed",
                                                    "noise"};

static bool check_options(const struct compare_options *opt, int width, int height, struct err *e)
{
    if (!(opt->alpha > 0 && opt->alpha < 0.5))
        return err_set(e, "alpha is %g, must lie in (0, 0.5)", opt->alpha);
    if (!(opt->margin_global >= 0 && opt->margin_global <= opt->margin_tile &&
          opt->margin_tile < 1))
        return err_set(e, "margins %g (image) and %g (tile): must be 0 <= image <= tile < 1",
                       opt->margin_global, opt->margin_tile);
    if ((opt->margin_global == 0) != (opt->margin_tile == 0))
        return err_set(e, "margins %g (image) and %g (tile): both or none must be 0",
                       opt->margin_global, opt->margin_tile);
    if (opt->tile < 1 || width % opt->tile != 0 || height % opt->tile != 0)
        return err_set(e, "tile side %d does not divide the image's %d x %d pixels", opt->tile,
                       width, height);
    return true;
}

static bool check_pixel(const struct moments *m, size_t p, bool exact, struct err *e)
{
    int x = (int)(p % (size_t)m->width), y = (int)(p / (size_t)m->width);
    if (!(m->n[p] >= (exact ? 1 : 3)) || isinf(m->n[p]))
        return err_set(e, "pixel %d,%d has %g observations, at least 3 are needed", x, y, m->n[p]);
    for (size_t i = 3 * p; i < 3 * p + 3; i++) {
        if (isnan(m->mean[i]) || isnan(m->m2[i]) || isnan(m->m3[i]))
            return err_set(e, "pixel %d,%d is not a number", x, y);
        if (isinf(m->mean[i]) || isinf(m->m2[i]) || isinf(m->m3[i]))
            return err_set(e, "pixel %d,%d is infinite", x, y);
        if (m->mean[i] < 0)
            return err_set(e, "pixel %d,%d has negative radiance %g", x, y, m->mean[i]);
        if (m->m2[i] < 0)
            return err_set(e, "pixel %d,%d has a negative sum of squares %g", x, y, m->m2[i]);
        if (exact && m->m2[i] != 0)
            return err_set(e, "pixel %d,%d is called exact but has variance", x, y);
    }
    return true;
}

/* Checks one side and gathers what it contributes to the judge. An observation's typical brightness
 * where it matters is E[x^2]/E[x], for something seen rarely its brightness when seen. */
static bool check_side(const struct moments *m, struct judge *j, struct err *e)
{
    bool exact = strcmp(m->unit, "exact") == 0, replicates = strcmp(m->unit, "replicate") == 0;
    if (strcmp(m->unit, "stratified") == 0)
        return err_set(e, "its samples depend on each other (--sampler sobol), so its variance is "
                          "unknown: only replicates with seeds of their own may be compared");
    if (!exact && !replicates && strcmp(m->unit, "sample") != 0)
        return err_set(e, "unknown unit '%s' of an observation", m->unit);
    bool varies = false;
    size_t pixels = (size_t)m->width * (size_t)m->height;
    for (size_t p = 0; p < pixels; p++) {
        if (!check_pixel(m, p, exact, e))
            return false;
        if (!exact)
            j->n_min = fmin(j->n_min, m->n[p]);
        for (size_t c = 0; c < 3; c++) {
            double mean = m->mean[3 * p + c], m2 = m->m2[3 * p + c];
            varies = varies || m2 > 0;
            if (mean > 0)
                j->event[c] = fmax(j->event[c], mean + m2 / (m->n[p] * mean));
        }
    }
    if (replicates && !varies)
        return err_set(e, "%g replicates without any variance: was the seed ignored?", m->n[0]);
    return true;
}

/* Parts of alpha. What does not apply gives its part to the others, in proportion. That is a matter of
 * options and kind of input: by the data it would be a choice among tests. */
static void set_shares(struct judge *j)
{
    static const double part[NUM_STATISTICS] = {.25, .40, 0, 0, 0};
    bool applies[NUM_STATISTICS] = {
        [STATISTIC_IMAGE] = true,
        [STATISTIC_PYRAMID] = j->width * j->height > 1,
    };
    double sum = 0;
    for (int s = 0; s < NUM_STATISTICS; s++)
        sum += applies[s] ? part[s] : 0;
    for (int s = 0; s < NUM_STATISTICS; s++)
        j->share[s] = applies[s] ? part[s] / sum : 0;
}

bool judge_init(const struct moments *a, const struct moments *b, const struct compare_options *opt,
                struct judge *j, struct err *e)
{
    if (a->width != b->width || a->height != b->height)
        return err_set(e, "A is %d x %d pixels, B is %d x %d", a->width, a->height, b->width,
                       b->height);
    if (!check_options(opt, a->width, a->height, e))
        return false;
    *j = (struct judge){.opt = *opt, .width = a->width, .height = a->height, .n_min = INFINITY};
    set_shares(j);
    if (!check_side(a, j, e))
        return err_prefix(e, "A");
    if (!check_side(b, j, e))
        return err_prefix(e, "B");
    size_t pixels = (size_t)b->width * (size_t)b->height;
    double luminance = 0;
    for (int c = 0; c < 3; c++) {
        j->event[CHANNEL_LUMINANCE] += luminance_weight[c] * j->event[c];
        for (size_t p = 0; p < pixels; p++)
            luminance += luminance_weight[c] * b->mean[3 * p + (size_t)c];
    }
    if (!(luminance > 0))
        return err_set(e, "B is black: relative differences have no unit");
    j->floor = floor_fraction * luminance / (double)pixels;
    return true;
}

/* Skewness is judged where a statistic's part of alpha would be divided by all its regions. */
static void set_guards(struct judge *j, size_t regions)
{
    double tests[2] = {NUM_CHANNELS, NUM_CHANNELS * (double)(regions - 1)};
    for (int s = 0; s < 2; s++)
        if (j->share[s] > 0)
            j->z_guard[s] = stats_normal_quantile(j->opt.alpha * j->share[s] / (2 * tests[s]));
}

/* The region with the smallest p so far. */
struct worst {
    struct cell cell;
    struct rect rect;
    int channel;
    double log10_p, z;
};

/* Tests every region of one channel; worst, of the image and of all smaller ones. */
static void scan(struct judge *j, const struct pyramid *p, int channel, struct worst worst_of[2],
                 struct comparison *out)
{
    for (int l = p->num_levels - 1; l >= 0; l--) {
        const struct pyramid_level *level = &p->level[l];
        size_t regions = (size_t)level->nx * (size_t)level->ny, tested = 0;
        for (size_t i = 0; i < regions; i++) {
            struct rect r = pyramid_rect(p, l, i);
            struct measured m = region_measure(j, &level->cell[i], r);
            if (!region_testable(j, &m))
                continue;
            tested++;
            /* An exact p only for what may be the smallest: noise-free regions and those whose
             * normal equivalent, good to 3 %, comes near the largest. */
            struct worst *worst = &worst_of[m.statistic];
            double z = m.noise_free ? INFINITY : stats_z_of_t(region_excess_t(&m), m.dof);
            if (!m.noise_free && (z <= 0 || z < 0.94 * worst->z))
                continue;
            double log10_p = region_log10_p(j, &m, channel);
            if (log10_p < worst->log10_p) {
                *worst = (struct worst){level->cell[i], r, channel, log10_p,
                                        m.noise_free ? worst->z : fmax(z, worst->z)};
            }
        }
        j->num_tests[l == p->num_levels - 1 ? STATISTIC_IMAGE : STATISTIC_PYRAMID] += tested;
        if (l >= p->tile_level && tested < regions)
            out->skew_limited = true;
        if (channel == CHANNEL_LUMINANCE && 2 * tested >= regions)
            out->finest_side = level->side;
    }
}

/* sum over pixels of d^2 - v: without bias for the sum of squared biases. */
static double squared_bias(const struct pyramid *p)
{
    double sum = 0;
    size_t pixels = (size_t)p->width * (size_t)p->height;
    const struct cell *cell = p->level[0].cell;
    for (size_t i = 0; i < pixels; i++) {
        double d = cell[i].a - cell[i].b;
        sum += d * d - cell[i].va - cell[i].vb;
    }
    return sum;
}

static bool fill_images(const struct judge *j, const struct pyramid *p, struct comparison *out,
                        struct err *e)
{
    if (!image_alloc(&out->z, p->width, p->height, 1, (const char *const[]){"z"}, e) ||
        !image_alloc(&out->relative, p->width, p->height, 1, (const char *const[]){"rel"}, e))
        return false;
    size_t pixels = (size_t)p->width * (size_t)p->height;
    for (size_t i = 0; i < pixels; i++) {
        struct measured m = region_measure(j, &p->level[0].cell[i], pyramid_rect(p, 0, i));
        out->z.data[i] = (float)fmin(largest_z, fmax(-largest_z, region_t(&m)));
        out->relative.data[i] = (float)(m.d / m.unit);
    }
    return true;
}

/* The region's own MDB or, if it is too skewed to be tested, that of the smallest tested region
 * around it: there the same error is diluted. */
static double mdb_of(const struct judge *j, const struct pyramid *p, int level, size_t i)
{
    struct measured own = region_measure(j, &p->level[level].cell[i], pyramid_rect(p, level, i));
    size_t x = i % (size_t)p->level[level].nx, y = i / (size_t)p->level[level].nx;
    for (int l = level; l < p->num_levels; l++, x /= 2, y /= 2) {
        size_t at = y * (size_t)p->level[l].nx + x;
        struct measured m = region_measure(j, &p->level[l].cell[at], pyramid_rect(p, l, at));
        if (region_testable(j, &m))
            return fmin(region_mdb_none, region_mdb(j, &m, CHANNEL_LUMINANCE) * m.unit / own.unit);
    }
    return region_mdb_none;
}

static bool fill_tiles(const struct judge *j, const struct pyramid *p, struct comparison *out,
                       struct region **tiles, struct err *e)
{
    const struct pyramid_level *level = &p->level[p->tile_level];
    size_t num = (size_t)level->nx * (size_t)level->ny;
    out->tiles_x = level->nx;
    out->tiles_y = level->ny;
    *tiles = malloc(num * sizeof **tiles);
    out->tile_log10_p = malloc(num * sizeof *out->tile_log10_p);
    out->tile_t = malloc(num * sizeof *out->tile_t);
    if (*tiles == NULL || out->tile_log10_p == NULL || out->tile_t == NULL)
        return err_set(e, "out of memory for %zu tiles", num);
    for (size_t i = 0; i < num; i++) {
        struct rect r = pyramid_rect(p, p->tile_level, i);
        struct measured m = region_measure(j, &level->cell[i], r);
        struct region *tile = &(*tiles)[i];
        *tile = region_fill(j, &level->cell[i], r, CHANNEL_LUMINANCE);
        tile->mdb = mdb_of(j, p, p->tile_level, i);
        out->mdb_tile = fmax(out->mdb_tile, tile->mdb);
        out->tile_t[i] = tile->t;
        out->tile_log10_p[i] = region_log10_p_equal(j, &m, CHANNEL_LUMINANCE);
        if (i == 0 || region_reach(tile) > region_reach(&out->worst_tile))
            out->worst_tile = *tile;
    }
    return true;
}

static void fill_statistic(const struct judge *j, int s, const struct worst *worst,
                           struct comparison *out)
{
    struct statistic *st = &out->statistic[s];
    assert(j->num_tests[s] < 1u << 31);
    st->num_tests = (int)j->num_tests[s];
    out->num_tests += st->num_tests;
    if (st->num_tests == 0)
        return;
    st->log10_p = fmin(0, worst->log10_p + log10(st->num_tests));
    region_name(j->width, j->height, worst->rect, worst->channel, st->what, sizeof st->what);
}

/* How far below the level it is held to the smallest p of a statistic is; above 0: rejected. */
static double evidence(const struct comparison *c, int s)
{
    return c->statistic[s].num_tests > 0 ? log10(c->statistic[s].share) - c->statistic[s].log10_p
                                         : -INFINITY;
}

bool compare_moments(const struct moments *a, const struct moments *b,
                     const struct compare_options *opt, struct comparison *out, struct err *e)
{
    *out = (struct comparison){0};
    struct judge j;
    struct pyramid p = {0};
    struct region *tiles = NULL;
    struct worst worst[2] = {{.log10_p = 1}, {.log10_p = 1}};
    struct cell image[NUM_CHANNELS];
    double squared = 0, mean = 0;
    if (!judge_init(a, b, opt, &j, e))
        return false;
    struct rect whole = {0, 0, a->width, a->height};
    for (int c = 0; c < NUM_CHANNELS; c++) {
        pyramid_free(&p);
        if (!pyramid_build(a, b, c, opt->tile, &p, e))
            goto fail;
        if (c == 0)
            set_guards(&j, pyramid_regions(&p));
        image[c] = p.level[p.num_levels - 1].cell[0];
        scan(&j, &p, c, worst, out);
        if (c < CHANNEL_LUMINANCE)
            squared += luminance_weight[c] * squared_bias(&p);
    }
    for (int s = 0; s < NUM_STATISTICS; s++)
        out->statistic[s].share = j.share[s];
    for (int s = STATISTIC_IMAGE; s <= STATISTIC_PYRAMID; s++)
        fill_statistic(&j, s, &worst[s], out);
    if (!fill_images(&j, &p, out, e) || !fill_tiles(&j, &p, out, &tiles, e))
        goto fail;
    mean = image[CHANNEL_LUMINANCE].b;
    out->rms_bias = sqrt(fmax(0, squared) * whole.width * whole.height) / mean;
    for (int c = 0; c < NUM_CHANNELS; c++) {
        struct measured m = region_measure(&j, &image[c], whole);
        out->global[c] = region_fill(&j, &image[c], whole, c);
        out->global[c].mdb = region_testable(&j, &m) ? region_mdb(&j, &m, c) : region_mdb_none;
    }
    out->mdb_global = out->global[CHANNEL_LUMINANCE].mdb;
    const struct worst *w =
        &worst[evidence(out, STATISTIC_PYRAMID) > evidence(out, STATISTIC_IMAGE)];
    if (w->log10_p > 0) {
        out->worst = out->global[CHANNEL_LUMINANCE];
    } else {
        struct measured m = region_measure(&j, &w->cell, w->rect);
        out->worst = region_fill(&j, &w->cell, w->rect, w->channel);
        out->worst.mdb = region_mdb(&j, &m, w->channel);
    }
    verdict_decide(out, opt, tiles);
    free(tiles);
    pyramid_free(&p);
    return true;

fail:
    free(tiles);
    pyramid_free(&p);
    comparison_free(out);
    return false;
}

void comparison_free(struct comparison *c)
{
    free(c->tile_log10_p);
    free(c->tile_t);
    image_free(&c->z);
    image_free(&c->relative);
    *c = (struct comparison){0};
}
