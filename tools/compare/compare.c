#include "compare.h"

#include "chi_square.h"
#include "matched_filter.h"
#include "error_modes.h"
#include "input_checks.h"
#include "variance_ratio.h"
#include "pyramid.h"
#include "region.h"
#include "tools/stats/distributions.h"
#include "verdict.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double largest_z = 1e4;
const char *const statistic_name[NUM_STATISTICS] = {"image", "pyramid", "dense", "directed",
                                                    "noise"};

/* Skewness is judged where a statistic's part of alpha would be divided by all its regions. */
static void set_guards(struct judge *j, size_t regions)
{
    double tests[NUM_STATISTICS] = {NUM_CHANNELS, NUM_CHANNELS * (double)(regions - 1), 6,
                                    NUM_ERROR_MODES, 1};
    for (int s = 0; s < NUM_STATISTICS; s++)
        if (j->share[s] > 0)
            j->z_guard[s] = stats_normal_quantile(j->opt.alpha * j->share[s] / (2 * tests[s]));
}

/* A region, and what is around it: that of four times its side, or the image. */
static struct measured measure_in(const struct judge *j, const struct pyramid *p, int level,
                                  size_t i)
{
    struct measured m = region_measure(j, &p->level[level].cell[i], pyramid_rect(p, level, i));
    int around = level + 2 < p->num_levels ? level + 2 : p->num_levels - 1;
    /* Below tiles whose side is no power of 2 it is the image. */
    if (p->level[around].side % p->level[level].side != 0)
        around = p->num_levels - 1;
    if (level < around)
        region_look_around(j, &m, &p->level[around].cell[pyramid_parent(p, level, around, i)]);
    return m;
}

/* The region with the smallest p so far. */
struct worst {
    struct cell cell;
    struct rect rect;
    int channel, side;
    double log10_p, z;
};

/* All regions of one channel, from band to band and then what lies above. */
struct sweep {
    int channel;
    struct pyramid above;
    size_t tested[PYRAMID_LEVELS]; /* of each level of the image */
    struct worst *worst;           /* of the image and of all smaller ones */
    struct pyramid band;
    struct part *part,
        *tiles;     /* chi_square.h: of the largest band, and of the tiles; room for them twice */
    double squared; /* squared_bias() */
    struct matched_filter directed;
    double *root[2]; /* which that knows of the band; NULL */
};

/* Beyond that z the smallest log10 p is all that is known. */
static const double largest_rank = 2146;

/* Tests every region of a level, whose first row is row y of the image, as the image's level `number`. */
static void scan(const struct judge *j, const struct pyramid *p, int l, int y, int number,
                 struct sweep *s)
{
    const struct pyramid_level *level = &p->level[l];
    const size_t regions = (size_t)level->nx * (size_t)level->ny;
    const int statistic = regions > 1 ? STATISTIC_PYRAMID : STATISTIC_IMAGE;
    for (size_t i = 0; i < regions; i++) {
        if (region_is_hopeless(j, &level->cell[i], statistic))
            continue;
        struct measured m = measure_in(j, p, l, i);
        if (!region_testable(j, &m))
            continue;
        s->tested[number]++;
        /* An exact p only for what may be the smallest: regions without noise on a side and those
         * whose normal equivalent, good to 3 %, comes near the largest. */
        struct worst *worst = &s->worst[m.statistic];
        bool is_ranked = !m.noise_free && !m.silent;
        double z = is_ranked ? region_rank(j, &m) : INFINITY;
        if (is_ranked && (z <= 0 || z < 0.94 * worst->z))
            continue;
        double log10_p = region_log10_p(j, &m, s->channel);
        /* Of equal ones the larger region counts. */
        if (log10_p < worst->log10_p ||
            (log10_p == worst->log10_p && s->channel == worst->channel &&
             level->side > worst->side)) {
            struct rect r = pyramid_rect(p, l, i);
            r.y += y;
            *worst = (struct worst){
                level->cell[i], r,
                s->channel,     level->side,
                log10_p,        is_ranked ? fmin(largest_rank, fmax(z, worst->z)) : worst->z};
        }
    }
}

/* sum over pixels of d^2 - v: without bias for the sum of squared biases. */
static void add_squared_bias(const struct pyramid *p, double *sum)
{
    size_t pixels = (size_t)p->width * (size_t)p->height;
    const struct cell *cell = p->level[0].cell;
    for (size_t i = 0; i < pixels; i++) {
        double d = cell[i].a - cell[i].b;
        *sum += d * d - cell[i].va - cell[i].vb;
    }
}

static void fill_images(const struct judge *j, const struct pyramid *p, size_t first,
                        struct comparison *out)
{
    size_t pixels = (size_t)p->width * (size_t)p->height;
    for (size_t i = 0; i < pixels; i++) {
        double relative, t = region_pixel_t(j, &p->level[0].cell[i], &relative);
        out->z.data[first + i] = (float)fmin(largest_z, fmax(-largest_z, t));
        out->relative.data[first + i] = (float)relative;
    }
}

/* Everything that is smaller than a tile, of all rows from y on that a and b have. */
static bool sweep_band(const struct judge *j, const struct moments *a, const struct moments *b,
                       int y, struct sweep *s, struct comparison *out, struct err *e)
{
    struct pyramid *p = &s->band;
    const bool directed = s->channel == CHANNEL_LUMINANCE && s->root[0] != NULL;
    if (directed)
        matched_filter_add(j, &s->directed, y, a->height, s->root);
    if (!pyramid_rebuild(a, b, s->channel, directed ? s->root : NULL, j->opt.tile, p, e))
        return false;
    for (int l = p->tile_level - 1; l >= 0; l--)
        scan(j, p, l, y, l, s);
    const struct pyramid_level *tile = &p->level[p->tile_level];
    size_t first = (size_t)(y / tile->side) * (size_t)tile->nx;
    memcpy(s->above.level[0].cell + first, tile->cell,
           (size_t)tile->nx * (size_t)tile->ny * sizeof *tile->cell);
    if (s->channel == CHANNEL_LUMINANCE) {
        fill_images(j, p, (size_t)y * (size_t)p->width, out);
    } else {
        add_squared_bias(p, &s->squared);
        if (j->share[STATISTIC_CHI_SQUARE] > 0)
            chi_square_gather(j, p, s->part, s->tiles + first);
    }
    return true;
}

/* Rows of the largest band. */
static int last_band(int height, int band)
{
    return height < band ? height : height - (height / band - 1) * band;
}

/* All of a channel. `levels` are the image's. */
static bool sweep_channel(struct judge *j, const struct moments *a, const struct moments *b,
                          const struct pyramid *levels, struct sweep *s, struct chi_square *dense,
                          struct comparison *out, struct err *e)
{
    const int band = pyramid_band(levels), bands = j->height / band > 0 ? j->height / band : 1;
    memset(s->tested, 0, sizeof s->tested);
    s->squared = 0;
    for (int k = 0, y = 0; k < bands; k++, y += band) {
        const int rows = k + 1 < bands ? band : j->height - y;
        const struct moments part[2] = {moments_rows(a, y, rows), moments_rows(b, y, rows)};
        if (!sweep_band(j, &part[0], &part[1], y, s, out, e))
            return false;
    }
    pyramid_sum_up(&s->above);
    for (int l = s->above.num_levels - 1; l >= 0; l--)
        scan(j, &s->above, l, 0, levels->tile_level + l, s);
    for (int l = levels->num_levels - 1; l >= 0; l--) {
        const struct pyramid_level *level = &levels->level[l];
        size_t regions = (size_t)level->nx * (size_t)level->ny, tested = s->tested[l];
        j->num_tests[l == levels->num_levels - 1 ? STATISTIC_IMAGE : STATISTIC_PYRAMID] += tested;
        if (l >= levels->tile_level && tested < regions)
            out->skew_limited = true;
        if (s->channel == CHANNEL_LUMINANCE && 2 * tested >= regions)
            out->finest_side = level->side;
    }
    if (s->channel < CHANNEL_LUMINANCE && j->share[STATISTIC_CHI_SQUARE] > 0)
        chi_square_test(j, &s->above, s->channel, s->tiles, dense);
    return true;
}

/* The region's own MDB or, if it is too skewed to be tested, that of the smallest tested region
 * around it: there the same error is diluted. */
static double mdb_of(const struct judge *j, const struct pyramid *p, size_t i)
{
    struct measured own = region_measure(j, &p->level[0].cell[i], pyramid_rect(p, 0, i));
    for (int l = 0; l < p->num_levels; l++) {
        size_t at = pyramid_parent(p, 0, l, i);
        struct measured m = measure_in(j, p, l, at);
        if (region_testable(j, &m))
            return fmin(region_mdb_none, region_mdb(j, &m, CHANNEL_LUMINANCE) * m.unit / own.unit);
    }
    return region_mdb_none;
}

static bool fill_tiles(const struct judge *j, const struct pyramid *p, struct comparison *out,
                       struct region **tiles, struct err *e)
{
    const struct pyramid_level *level = &p->level[0];
    size_t num = (size_t)level->nx * (size_t)level->ny;
    out->tiles_x = level->nx;
    out->tiles_y = level->ny;
    *tiles = malloc(num * sizeof **tiles);
    out->tile_log10_p = malloc(num * sizeof *out->tile_log10_p);
    out->tile_t = malloc(num * sizeof *out->tile_t);
    if (*tiles == NULL || out->tile_log10_p == NULL || out->tile_t == NULL)
        return err_set(e, "out of memory for %zu tiles", num);
    for (size_t i = 0; i < num; i++) {
        struct rect r = pyramid_rect(p, 0, i);
        struct measured m = region_measure(j, &level->cell[i], r);
        struct region *tile = &(*tiles)[i];
        *tile = region_fill(j, &level->cell[i], r, CHANNEL_LUMINANCE);
        tile->mdb = mdb_of(j, p, i);
        out->mdb_tile = fmax(out->mdb_tile, tile->mdb);
        out->tile_t[i] = tile->t;
        out->tile_log10_p[i] = region_log10_p_equal(j, &m, CHANNEL_LUMINANCE);
        if (i == 0 || region_reach(tile) > region_reach(&out->worst_tile))
            out->worst_tile = *tile;
    }
    return true;
}

/* log10_p: the smallest. False if the statistic has no test. */
static bool fill_statistic(const struct judge *j, int s, double log10_p, struct comparison *out)
{
    struct statistic *st = &out->statistic[s];
    assert(j->num_tests[s] < 1u << 31);
    st->share = j->share[s];
    st->num_tests = (int)j->num_tests[s];
    out->num_tests += st->num_tests;
    if (st->num_tests > 0)
        st->log10_p = fmin(0, log10_p + log10(st->num_tests));
    return st->num_tests > 0;
}

static void fill_statistics(struct judge *j, const struct worst worst[2],
                            const struct chi_square *dense, enum error_mode_kind like,
                            double directed, double noise, struct comparison *out)
{
    struct statistic *st = out->statistic;
    for (int s = STATISTIC_IMAGE; s <= STATISTIC_PYRAMID; s++)
        if (fill_statistic(j, s, worst[s].log10_p, out))
            region_name(j->width, j->height, worst[s].rect, worst[s].channel, st[s].what,
                        sizeof st[s].what);
    if (fill_statistic(j, STATISTIC_CHI_SQUARE, dense->log10_p, out))
        snprintf(st[STATISTIC_CHI_SQUARE].what, sizeof st->what,
                 "%d regions of %d x %d pixels or more (%s)", dense->regions, dense->side,
                 dense->side, channel_name[dense->channel]);
    if (fill_statistic(j, STATISTIC_MATCHED_FILTER, directed, out))
        snprintf(st[STATISTIC_MATCHED_FILTER].what, sizeof st->what, "%s", error_mode_name[like]);
    if (fill_statistic(j, STATISTIC_VARIANCE, noise, out))
        snprintf(st[STATISTIC_VARIANCE].what, sizeof st->what, "variance of a path: %.3g times",
                 out->variance.ratio);
}

/* The statistics besides those of the regions. */
static void test_rest(const struct moments *a, const struct moments *b, struct judge *j,
                      const struct sweep *s, enum error_mode_kind *like, double *directed,
                      double *noise, struct comparison *out)
{
    bool testable;
    *directed = 0;
    *like = 0;
    if (j->share[STATISTIC_MATCHED_FILTER] > 0)
        matched_filter_test(j, &s->directed, like, directed);
    out->variance = variance_ratio_test(a, b, j, noise, &testable);
    j->num_tests[STATISTIC_VARIANCE] = j->share[STATISTIC_VARIANCE] > 0 && testable;
}

/* What a sweep needs for all of them, of an image of such levels. */
static bool open_sweep(const struct judge *j, const struct moments *a, const struct moments *b,
                       const struct pyramid *levels, struct sweep *s, struct err *e)
{
    const struct pyramid_level *tile = &levels->level[levels->tile_level];
    const size_t band = (size_t)a->width * (size_t)last_band(a->height, pyramid_band(levels));
    s->tiles = malloc(2 * (size_t)tile->nx * (size_t)tile->ny * sizeof *s->tiles);
    s->part = malloc(2 * band * sizeof *s->part);
    const bool is_directed = j->share[STATISTIC_MATCHED_FILTER] > 0;
    if (is_directed && (s->root[0] = malloc(2 * band * sizeof *s->root[0])) != NULL)
        s->root[1] = s->root[0] + band;
    if (s->tiles == NULL || s->part == NULL || (is_directed && s->root[0] == NULL))
        return err_set(e, "out of memory for the regions of %d x %d pixels", a->width, a->height);
    return !is_directed || matched_filter_open(a, b, &s->directed, e);
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
    struct region *tiles = NULL;
    struct worst worst[2] = {{.log10_p = 1}, {.log10_p = 1}};
    struct sweep s = {.worst = worst};
    struct cell image[NUM_CHANNELS];
    struct chi_square dense = {0};
    double squared = 0, mean = 0, directed, noise;
    bool ok = false;
    enum error_mode_kind like;
    if (!input_checks_run(a, b, opt, &j, e))
        return false;
    struct rect whole = {0, 0, a->width, a->height};
    const struct pyramid levels = pyramid_levels(a->width, a->height, opt->tile);
    set_guards(&j, pyramid_regions(&levels));
    if (!open_sweep(&j, a, b, &levels, &s, e) ||
        !image_alloc(&out->z, a->width, a->height, 1, (const char *const[]){"z"}, e) ||
        !image_alloc(&out->relative, a->width, a->height, 1, (const char *const[]){"rel"}, e))
        goto done;
    for (s.channel = 0; s.channel < NUM_CHANNELS; s.channel++) {
        pyramid_free(&s.above);
        if (!pyramid_above(&levels, &s.above, e) ||
            !sweep_channel(&j, a, b, &levels, &s, &dense, out, e))
            goto done;
        image[s.channel] = s.above.level[s.above.num_levels - 1].cell[0];
        if (s.channel < CHANNEL_LUMINANCE)
            squared += luminance_weight[s.channel] * s.squared;
    }
    test_rest(a, b, &j, &s, &like, &directed, &noise, out);
    fill_statistics(&j, worst, &dense, like, directed, noise, out);
    if (!fill_tiles(&j, &s.above, out, &tiles, e))
        goto done;
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
        out->worst.log10_p = w->log10_p;
        out->worst.mdb = region_mdb(&j, &m, w->channel);
    }
    verdict_decide(out, opt, tiles);
    ok = true;

done:
    free(tiles);
    free(s.tiles);
    free(s.part);
    free(s.root[0]);
    matched_filter_free(&s.directed);
    pyramid_free(&s.band);
    pyramid_free(&s.above);
    if (!ok)
        comparison_free(out);
    return ok;
}

void comparison_free(struct comparison *c)
{
    free(c->tile_log10_p);
    free(c->tile_t);
    image_free(&c->z);
    image_free(&c->relative);
    *c = (struct comparison){0};
}
