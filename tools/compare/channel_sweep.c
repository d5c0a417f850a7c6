#include "channel_sweep.h"

#include "chi_square.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double largest_z = 1e4;

struct measured channel_sweep_measure(const struct judge *j, const struct pyramid *p, int level,
                                      size_t i)
{
    struct measured m = region_measure(j, &p->level[level].cell[i], pyramid_rect(p, level, i));
    int around = level + 2 < p->num_levels ? level + 2 : p->num_levels - 1;
    /* Below tiles whose side is not a power of 2, the surroundings are the image. */
    if (p->level[around].side % p->level[level].side != 0)
        around = p->num_levels - 1;
    if (level < around)
        region_look_around(j, &m, &p->level[around].cell[pyramid_parent(p, level, around, i)]);
    return m;
}

/* The z of region_smallest_log10_p, beyond which log10 p does not change any more. */
static const double largest_rank = 2146;

/* Tests every region of level l of p, whose first row is row y of the image; it is the image's level `number`. */
static void scan(const struct judge *j, const struct pyramid *p, int l, int y, int number,
                 struct channel_sweep *s)
{
    const struct pyramid_level *level = &p->level[l];
    const size_t regions = (size_t)level->nx * (size_t)level->ny;
    const int statistic = regions > 1 ? STATISTIC_PYRAMID : STATISTIC_IMAGE;
    for (size_t i = 0; i < regions; i++) {
        if (region_is_hopeless(j, &level->cell[i], statistic))
            continue;
        struct measured m = channel_sweep_measure(j, p, l, i);
        if (!region_testable(j, &m))
            continue;
        s->tested[number]++;
        /* An exact p is computed only where it may be the smallest: for regions without noise on a
         * side, and for those whose normal equivalent, good to 3 %, comes near the largest. */
        struct worst_region *worst = &s->worst[m.statistic];
        bool is_ranked = !m.noise_free && !m.silent;
        double z =
            is_ranked ? fmin(region_rank(j, &m), region_missed_z(j, &m, s->channel)) : INFINITY;
        if (is_ranked && (z <= 0 || z < 0.94 * worst->z))
            continue;
        double log10_p = region_log10_p(j, &m, s->channel);
        /* Of regions with equal p the larger one counts. */
        if (log10_p < worst->log10_p || (log10_p == worst->log10_p && level->side > worst->side)) {
            struct rect r = pyramid_rect(p, l, i);
            r.y += y;
            *worst = (struct worst_region){
                level->cell[i], r,
                s->channel,     level->side,
                log10_p,        is_ranked ? fmin(largest_rank, fmax(z, worst->z)) : worst->z};
        }
    }
}

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

/* Tests everything smaller than a tile in one band: a and b are its rows, the first of which is row y. */
static bool sweep_band(const struct judge *j, const struct moments *a, const struct moments *b,
                       int y, struct channel_sweep *s, struct comparison *out, struct err *e)
{
    struct pyramid *p = &s->band;
    const bool directed = s->channel == CHANNEL_LUMINANCE && s->root[0] != NULL;
    if (directed)
        matched_filter_add(j, &s->directed, y, a->height, s->root);
    if (!pyramid_build(a, b, s->channel, directed ? s->root : NULL, j->opt.tile, p, e))
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
            chi_square_gather(j, p, s->channel, s->part, s->tiles + first);
    }
    return true;
}

/* Rows of the largest band. */
static int last_band(int height, int band)
{
    return height < band ? height : height - (height / band - 1) * band;
}

/* Allocates what a sweep of an image with these levels needs. */
static bool open_sweep(const struct judge *j, const struct moments *a, const struct moments *b,
                       const struct pyramid *levels, struct channel_sweep *s, struct err *e)
{
    const struct pyramid_level *tile = &levels->level[levels->tile_level];
    const size_t band = (size_t)a->width * (size_t)last_band(a->height, pyramid_band(levels));
    const bool luminance = s->channel == CHANNEL_LUMINANCE;
    const bool is_directed = luminance && j->share[STATISTIC_MATCHED_FILTER] > 0;
    const bool is_summed = !luminance && j->share[STATISTIC_CHI_SQUARE] > 0;
    if (is_summed) {
        s->tiles = malloc(2 * (size_t)tile->nx * (size_t)tile->ny * sizeof *s->tiles);
        s->part = malloc(2 * band * sizeof *s->part);
    }
    if (is_directed && (s->root[0] = malloc(2 * band * sizeof *s->root[0])) != NULL)
        s->root[1] = s->root[0] + band;
    if ((is_summed && (s->tiles == NULL || s->part == NULL)) || (is_directed && s->root[0] == NULL))
        return err_set(e, "out of memory for the regions of %d x %d pixels", a->width, a->height);
    return pyramid_above(levels, &s->above, e) &&
           (!is_directed || matched_filter_open(a, b, &s->directed, e));
}

/* Frees what is no longer needed after the last band. */
static void close_bands(struct channel_sweep *s)
{
    free(s->part);
    free(s->root[0]);
    s->part = NULL;
    s->root[0] = s->root[1] = NULL;
    pyramid_free(&s->band);
}

void channel_sweep_close(struct channel_sweep *s)
{
    close_bands(s);
    free(s->tiles);
    matched_filter_free(&s->directed);
    pyramid_free(&s->above);
}

bool channel_sweep_run(const struct judge *j, const struct moments *a, const struct moments *b,
                       const struct pyramid *levels, int channel, struct channel_sweep *s,
                       struct comparison *out, struct err *e)
{
    *s = (struct channel_sweep){.channel = channel, .worst = {{.log10_p = 1}, {.log10_p = 1}}};
    if (!open_sweep(j, a, b, levels, s, e))
        return false;
    const int band = pyramid_band(levels), bands = j->height / band > 0 ? j->height / band : 1;
    for (int k = 0, y = 0; k < bands; k++, y += band) {
        const int rows = k + 1 < bands ? band : j->height - y;
        const struct moments part[2] = {moments_rows(a, y, rows), moments_rows(b, y, rows)};
        if (!sweep_band(j, &part[0], &part[1], y, s, out, e))
            return false;
    }
    close_bands(s);
    pyramid_sum_up(&s->above);
    for (int l = s->above.num_levels - 1; l >= 0; l--)
        scan(j, &s->above, l, 0, levels->tile_level + l, s);
    return true;
}
