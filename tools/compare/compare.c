#include "compare.h"

#include "channel_sweep.h"
#include "chi_square.h"
#include "input_checks.h"
#include "variance_ratio.h"
#include "tools/stats/distributions.h"
#include "verdict.h"

#include "renderer/base/parallel.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *const statistic_name[NUM_STATISTICS] = {"image", "pyramid", "dense", "directed",
                                                    "noise"};

/* The critical values at which skewness is judged: a statistic's part of alpha divided by all its
 * regions. */
static void set_guards(struct judge *j, size_t regions)
{
    double tests[NUM_STATISTICS] = {NUM_CHANNELS, NUM_CHANNELS * (double)(regions - 1), 6,
                                    NUM_ERROR_MODES, 1};
    for (int s = 0; s < NUM_STATISTICS; s++)
        if (j->share[s] > 0)
            j->z_guard[s] = stats_normal_quantile(j->opt.alpha * j->share[s] / (2 * tests[s]));
}

/* One claim: what its threads look at and find, channel by channel. */
struct claim {
    const struct moments *a, *b;
    const struct judge *j;
    struct pyramid levels;
    struct channel_sweep sweep[NUM_CHANNELS];
    struct comparison *out; /* luminance fills the images */
    double noise;           /* of variance_ratio_test() */
    bool has_noise;
    struct err err[NUM_CHANNELS];
    bool ok[NUM_CHANNELS];
};

/* Items of work: luminance, which takes longest, then B, G, R, and the variances. */
static void claim_work(void *ctx, size_t first, size_t last)
{
    struct claim *c = ctx;
    for (size_t i = first; i < last; i++) {
        if (i == NUM_CHANNELS) {
            c->out->variance = variance_ratio_test(c->a, c->b, c->j, &c->noise, &c->has_noise);
            continue;
        }
        const int channel = NUM_CHANNELS - 1 - (int)i;
        c->ok[channel] = channel_sweep_run(c->j, c->a, c->b, &c->levels, channel,
                                           &c->sweep[channel], c->out, &c->err[channel]);
    }
}

/* Collects what the sweeps found, in the order of the channels, whatever thread finished first. */
static void gather(struct judge *j, struct claim *c, struct worst_region worst[2],
                   struct chi_square *dense)
{
    const struct pyramid *levels = &c->levels;
    for (int channel = 0; channel < NUM_CHANNELS; channel++) {
        struct channel_sweep *s = &c->sweep[channel];
        for (int l = levels->num_levels - 1; l >= 0; l--) {
            const struct pyramid_level *level = &levels->level[l];
            size_t regions = (size_t)level->nx * (size_t)level->ny, tested = s->tested[l];
            j->num_tests[l == levels->num_levels - 1 ? STATISTIC_IMAGE : STATISTIC_PYRAMID] +=
                tested;
            if (l >= levels->tile_level && tested < regions)
                c->out->skew_limited = true;
            if (channel == CHANNEL_LUMINANCE && 2 * tested >= regions)
                c->out->finest_side = level->side;
        }
        for (int i = 0; i < 2; i++)
            if (s->worst[i].log10_p < worst[i].log10_p)
                worst[i] = s->worst[i];
        if (channel < CHANNEL_LUMINANCE && j->share[STATISTIC_CHI_SQUARE] > 0)
            chi_square_test(j, &s->above, channel, s->tiles, dense);
    }
    j->num_tests[STATISTIC_VARIANCE] = j->share[STATISTIC_VARIANCE] > 0 && c->has_noise;
}

/* The MDB of tile i or, if it is too skewed to be tested, that of the smallest testable region that
 * contains it, converted to the tile, as the same error is diluted there. */
static double mdb_of(const struct judge *j, const struct pyramid *p, size_t i)
{
    struct measured own = region_measure(j, &p->level[0].cell[i], pyramid_rect(p, 0, i));
    for (int l = 0; l < p->num_levels; l++) {
        size_t at = pyramid_parent(p, 0, l, i);
        struct measured m = channel_sweep_measure(j, p, l, at);
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
        const struct measured around = channel_sweep_measure(j, p, 0, i);
        if (region_testable(j, &around))
            tile->log10_p_equal = region_log10_p_equal(j, &around, CHANNEL_LUMINANCE);
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

static void fill_statistics(struct judge *j, const struct worst_region worst[2],
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
        snprintf(st[STATISTIC_VARIANCE].what, sizeof st->what, "variance of a %s: %.3g times",
                 variance_ratio_of(&out->variance), out->variance.ratio);
}

/* How far the smallest p of a statistic is below its share; it rejects from -log10(alpha) on. */
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
    struct worst_region worst[2] = {{.log10_p = 1}, {.log10_p = 1}};
    struct chi_square dense = {0};
    double squared = 0, directed = 0;
    enum error_mode_kind like = 0;
    if (!input_checks_run(a, b, opt, &j, e))
        return false;
    struct rect whole = {0, 0, a->width, a->height};
    struct claim claim = {.a = a,
                          .b = b,
                          .j = &j,
                          .levels = pyramid_levels(a->width, a->height, opt->tile),
                          .out = out};
    set_guards(&j, pyramid_regions(&claim.levels));
    bool ok = image_alloc(&out->z, a->width, a->height, 1, (const char *const[]){"z"}, e) &&
              image_alloc(&out->relative, a->width, a->height, 1, (const char *const[]){"rel"}, e);
    if (ok)
        parallel_for(opt->threads, NUM_CHANNELS + 1, claim_work, &claim);
    for (int c = 0; ok && c < NUM_CHANNELS; c++)
        ok = claim.ok[c] || err_set(e, "%s", claim.err[c].msg);
    const struct pyramid *above = &claim.sweep[CHANNEL_LUMINANCE].above;
    if (!ok)
        goto done;
    gather(&j, &claim, worst, &dense);
    if (j.share[STATISTIC_MATCHED_FILTER] > 0)
        matched_filter_test(&j, &claim.sweep[CHANNEL_LUMINANCE].directed, &like, &directed);
    fill_statistics(&j, worst, &dense, like, directed, claim.noise, out);
    ok = fill_tiles(&j, above, out, &tiles, e);
    if (!ok)
        goto done;
    for (int c = 0; c < NUM_CHANNELS; c++) {
        const struct pyramid *p = &claim.sweep[c].above;
        const struct cell *image = &p->level[p->num_levels - 1].cell[0];
        struct measured m = region_measure(&j, image, whole);
        out->global[c] = region_fill(&j, image, whole, c);
        const bool is_tested = region_testable(&j, &m);
        out->global[c].mdb = is_tested ? region_mdb(&j, &m, c) : region_mdb_none;
        out->global[c].log10_p_equal = is_tested ? region_log10_p_equal(&j, &m, c) : 0;
        if (c < CHANNEL_LUMINANCE)
            squared += luminance_weight[c] * claim.sweep[c].squared;
    }
    const double mean = above->level[above->num_levels - 1].cell[0].b;
    out->rms_bias = sqrt(fmax(0, squared) * whole.width * whole.height) / mean;
    out->mdb_global = out->global[CHANNEL_LUMINANCE].mdb;
    const struct worst_region *w =
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

done:
    free(tiles);
    for (int c = 0; c < NUM_CHANNELS; c++)
        channel_sweep_close(&claim.sweep[c]);
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
