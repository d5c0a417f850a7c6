#include "chi_square.h"

#include "tools/stats/distributions.h"

#include <math.h>
#include <stdlib.h>

/* A region as the union of smaller ones, each testable. */
struct part {
    double sum; /* of their squares */
    int num;
    bool whole; /* they cover all of it */
};

/* The square of a region's excess over its margin, as of a standard normal law. Where the bias is
 * within the margin it is at most what noise alone would give. */
static double square(const struct measured *m)
{
    double t = region_excess_t(m);
    if (t <= 0)
        return 0;
    double z = stats_hill_z(t, m->dof_normal);
    return z * z;
}

/* A region without noise has nothing to sum and is no gap either. */
static struct part part_of(const struct measured *m)
{
    return (struct part){m->noise_free ? 0 : square(m), !m->noise_free, true};
}

/* The next level of whose regions each is the union of some of level l, or -1. Sides are powers of 2
 * up to the tile, which need not be one. */
static int next_level(const struct pyramid *p, int l)
{
    for (int i = l + 1; i < p->num_levels; i++)
        if (i >= p->tile_level || p->level[p->tile_level].side % p->level[i].side == 0)
            return i;
    return -1;
}

/* Level l from the one below: its parts if they cover it, itself if it is testable, else what there is
 * of parts. */
static void merge(const struct judge *j, const struct pyramid *p, int below, int l,
                  const struct part *from, struct part *to)
{
    const struct pyramid_level *fine = &p->level[below], *coarse = &p->level[l];
    size_t parts = (size_t)fine->nx * (size_t)fine->ny;
    size_t regions = (size_t)coarse->nx * (size_t)coarse->ny;
    for (size_t i = 0; i < regions; i++)
        to[i] = (struct part){.whole = true};
    for (size_t i = 0; i < parts; i++) {
        struct part *d = &to[pyramid_parent(p, below, l, i)];
        d->sum += from[i].sum;
        d->num += from[i].num;
        d->whole = d->whole && from[i].whole;
    }
    for (size_t i = 0; i < regions; i++) {
        if (to[i].whole)
            continue;
        struct measured m = region_measure(j, &coarse->cell[i], pyramid_rect(p, l, i));
        if (region_is_normal(j, &m))
            to[i] = part_of(&m);
    }
}

/* From level `first` on. `part` has room for the regions of that level twice. */
static void test(struct judge *j, const struct pyramid *p, int channel, int first,
                 struct part *part, struct chi_square *d)
{
    size_t regions = (size_t)p->level[first].nx * (size_t)p->level[first].ny;
    struct part *from = part, *to = part + regions;
    for (size_t i = 0; i < regions; i++) {
        struct measured m = region_measure(j, &p->level[first].cell[i], pyramid_rect(p, first, i));
        from[i] = region_is_normal(j, &m) ? part_of(&m) : (struct part){0};
    }
    for (int l = first, next; (next = next_level(p, l)) >= 0; l = next) {
        merge(j, p, l, next, from, to);
        struct part *swap = from;
        from = to;
        to = swap;
    }
    if (from->num < 2) /* one square is what the pyramid tests */
        return;
    j->num_tests[STATISTIC_CHI_SQUARE]++;
    double log10_p = fmax(region_smallest_log10_p, stats_chi2_log10_p(from->sum, from->num));
    if (log10_p < d->log10_p)
        *d = (struct chi_square){log10_p, channel, p->level[first].side, from->num};
}

bool chi_square_scan(struct judge *j, const struct pyramid *p, int channel, struct chi_square *d,
                     struct err *e)
{
    size_t pixels = (size_t)p->width * (size_t)p->height;
    struct part *part = malloc(2 * pixels * sizeof *part);
    if (part == NULL)
        return err_set(e, "out of memory for the regions of %d x %d pixels", p->width, p->height);
    test(j, p, channel, 0, part, d);
    if (p->tile_level > 0)
        test(j, p, channel, p->tile_level, part, d);
    free(part);
    return true;
}
