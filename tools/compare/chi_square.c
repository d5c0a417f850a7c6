#include "chi_square.h"

#include "tools/stats/distributions.h"

#include <math.h>
#include <string.h>

/* The square of the normal equivalent of a region's excess over its margin. If the bias is within the
 * margin, it is stochastically no larger than by noise alone. */
static double square(const struct judge *j, const struct measured *m, int channel)
{
    double t = region_excess_t(m);
    if (t <= 0)
        return 0;
    double z = fmin(stats_hill_z(t, m->dof_normal), region_missed_z(j, m, channel));
    return z * z;
}

/* A region without noise adds nothing, but is not a gap in the partition either. */
static struct part part_of(const struct judge *j, const struct measured *m, int channel)
{
    return (struct part){m->noise_free ? 0 : square(j, m, channel), !m->noise_free, true};
}

/* The next level each of whose regions is a union of regions of level l, or -1. Sides are powers of 2 up
 * to the tile, which need not be one. */
static int next_level(const struct pyramid *p, int l)
{
    for (int i = l + 1; i < p->num_levels; i++)
        if (i >= p->tile_level || p->level[p->tile_level].side % p->level[i].side == 0)
            return i;
    return -1;
}

/* Merges level `below` into level l: a region becomes its parts if they cover it, itself if it is
 * testable, else whatever parts there are. */
static void merge(const struct judge *j, const struct pyramid *p, int channel, int below, int l,
                  const struct part *from, struct part *to)
{
    const struct pyramid_level *fine = &p->level[below], *coarse = &p->level[l];
    const int factor = coarse->side / fine->side;
    size_t regions = (size_t)coarse->nx * (size_t)coarse->ny;
    for (size_t i = 0; i < regions; i++)
        to[i] = (struct part){.whole = true};
    for (int y = 0; y < fine->ny; y++)
        for (int x = 0; x < fine->nx; x++, from++) {
            struct part *d = &to[pyramid_around(coarse, factor, x, y)];
            d->sum += from->sum;
            d->num += from->num;
            d->whole = d->whole && from->whole;
        }
    for (size_t i = 0; i < regions; i++) {
        if (to[i].whole || region_is_skewed(j, &coarse->cell[i]))
            continue;
        struct measured m = region_measure(j, &coarse->cell[i], pyramid_rect(p, l, i));
        if (region_is_normal(j, &m))
            to[i] = part_of(j, &m, channel);
    }
}

static size_t regions_of(const struct pyramid *p, int level)
{
    return (size_t)p->level[level].nx * (size_t)p->level[level].ny;
}

/* Starts with every testable region of level 0 by itself. */
static void begin(const struct judge *j, const struct pyramid *p, int channel, struct part *part)
{
    size_t regions = regions_of(p, 0);
    for (size_t i = 0; i < regions; i++) {
        part[i] = (struct part){0};
        if (region_is_skewed(j, &p->level[0].cell[i]))
            continue;
        struct measured m = region_measure(j, &p->level[0].cell[i], pyramid_rect(p, 0, i));
        if (region_is_normal(j, &m))
            part[i] = part_of(j, &m, channel);
    }
}

/* Merges from level 0 to level `last`; returns the result, in one half of `part`, which holds level 0 twice. */
static struct part *merge_up(const struct judge *j, const struct pyramid *p, int channel, int last,
                             struct part *part)
{
    struct part *from = part, *to = part + regions_of(p, 0);
    for (int l = 0, next; l < last && (next = next_level(p, l)) >= 0; l = next) {
        merge(j, p, channel, l, next, from, to);
        struct part *swap = from;
        from = to;
        to = swap;
    }
    return from;
}

void chi_square_gather(const struct judge *j, const struct pyramid *band, int channel,
                       struct part *part, struct part *tiles)
{
    begin(j, band, channel, part);
    memcpy(tiles, merge_up(j, band, channel, band->tile_level, part),
           regions_of(band, band->tile_level) * sizeof *tiles);
}

static void test(struct judge *j, const struct pyramid *above, int channel, int side,
                 struct part *tiles, struct chi_square *d)
{
    const struct part *all = merge_up(j, above, channel, above->num_levels - 1, tiles);
    if (all->num < 2) /* one square is what the pyramid tests */
        return;
    j->num_tests[STATISTIC_CHI_SQUARE]++;
    double log10_p = fmax(region_smallest_log10_p, stats_chi2_log10_p(all->sum, all->num));
    if (log10_p < d->log10_p)
        *d = (struct chi_square){log10_p, channel, side, all->num};
}

void chi_square_test(struct judge *j, const struct pyramid *above, int channel, struct part *tiles,
                     struct chi_square *d)
{
    test(j, above, channel, 1, tiles, d);
    if (above->level[0].side == 1)
        return;
    begin(j, above, channel, tiles);
    test(j, above, channel, above->level[0].side, tiles, d);
}
