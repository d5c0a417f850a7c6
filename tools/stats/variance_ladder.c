#include "variance_ladder.h"

#include "distributions.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

const double variance_ladder_none = 1e-6;
static const double largest_margin = 3;

void variance_map_free(struct variance_map *m)
{
    free(m->tile);
    *m = (struct variance_map){0};
}

int variance_map_tile(const struct variance_map *m, int x, int y, int side)
{
    x /= side;
    y /= side;
    return (y < m->tiles_y ? y : m->tiles_y - 1) * m->tiles_x +
           (x < m->tiles_x ? x : m->tiles_x - 1);
}

/* Sums over an area: number of pixels, V_p, its variance w_p, and w_p squared. */
struct area {
    double pixels, v, w, ww;
};

struct areas {
    int width, height, side;
    struct area *tile; /* tiles_x * tiles_y, then the image */
};

static int num_tiles(int size, int side)
{
    int n = (size + side / 2) / side;
    return n > 0 ? n : 1;
}

static bool areas_start(struct areas *a, int width, int height, int side, struct variance_map *out,
                        struct err *e)
{
    int x = num_tiles(width, side), y = num_tiles(height, side);
    *out = (struct variance_map){.tiles_x = x, .tiles_y = y};
    *a = (struct areas){.width = width, .height = height, .side = side};
    a->tile = calloc((size_t)x * (size_t)y + 1, sizeof *a->tile);
    out->tile = calloc((size_t)x * (size_t)y, sizeof *out->tile);
    if (a->tile != NULL && out->tile != NULL)
        return true;
    free(a->tile);
    variance_map_free(out);
    return err_set(e, "out of memory");
}

static void areas_add(struct areas *a, const struct variance_map *m, size_t pixel, double v,
                      double w)
{
    int t = variance_map_tile(m, (int)(pixel % (size_t)a->width), (int)(pixel / (size_t)a->width),
                              a->side);
    struct area *to[2] = {&a->tile[t], &a->tile[m->tiles_x * m->tiles_y]};
    for (int i = 0; i < 2; i++) {
        to[i]->pixels++;
        to[i]->v += v;
        to[i]->w += w;
        to[i]->ww += w * w;
    }
}

static struct estimate area_estimate(const struct area *a)
{
    double dof = a->ww > 0 ? 2 * a->w * a->w / a->ww : 1;
    return (struct estimate){a->v / a->pixels, sqrt(a->w) / a->pixels, dof};
}

static void areas_end(struct areas *a, struct variance_map *out)
{
    int tiles = out->tiles_x * out->tiles_y;
    for (int i = 0; i < tiles; i++)
        out->tile[i] = area_estimate(&a->tile[i]);
    out->image = area_estimate(&a->tile[tiles]);
    free(a->tile);
}

/* The mean of the d of a pixel; returns sum (d - mean)^2. */
static double scatter(const double *d, int count, double *mean)
{
    double sum = 0;
    *mean = 0;
    for (int k = 0; k < count; k++)
        *mean += d[k] / count;
    for (int k = 0; k < count; k++)
        sum += (d[k] - *mean) * (d[k] - *mean);
    return sum;
}

/* Fails if some images are the same and others are not. */
static bool check_seeds(const float *images, int count, size_t size, struct err *e)
{
    int same = 0, other = 0;
    for (int k = 1; k < count; k++)
        for (int j = 0; j < k; j++)
            if (memcmp(images + (size_t)j * size, images + (size_t)k * size,
                       size * sizeof *images) == 0)
                same++;
            else
                other++;
    return same == 0 || other == 0 ||
           err_set(e, "replicates with seeds of their own are the same image");
}

bool variance_ladder_between(const float *images, int count, const struct converge_reference *unit,
                             int width, int tile, struct variance_map *out, struct err *e)
{
    assert(count >= 3);
    struct areas a;
    size_t pixels = unit->size / 3;
    double K = count, *d = calloc((size_t)count, sizeof *d);
    if (d == NULL)
        return err_set(e, "out of memory");
    bool ok = check_seeds(images, count, unit->size, e) &&
              areas_start(&a, width, (int)(pixels / (size_t)width), tile, out, e);
    for (size_t p = 0; ok && p < pixels; p++) {
        memset(d, 0, (size_t)count * sizeof *d);
        for (size_t i = 3 * p; i < 3 * p + 3; i++) {
            double m = 0;
            for (int k = 0; k < count; k++)
                m += images[(size_t)k * unit->size + i] / K;
            for (int k = 0; k < count; k++)
                d[k] += pow((images[(size_t)k * unit->size + i] - m) / unit->unit[i], 2);
        }
        double mean, sum = scatter(d, count, &mean);
        areas_add(&a, out, p, mean * K / (3 * (K - 1)),
                  sum * K / (9 * (K - 1) * (K - 2) * (K - 2)));
    }
    free(d);
    if (ok)
        areas_end(&a, out);
    return ok;
}

/* Non-negative samples have E[x^3] E[x] >= E[x^2]^2 [Cauchy-Schwarz], with equality if all are 0 or one value. Files
 * hold 32-bit floats, in which the cubes of values below 1e-12 vanish. */
static bool check_third(const struct moments *m, size_t i, struct err *e)
{
    static const double rounding = 1e-3, darkest = 1e-24;
    double n = m->n[i / 3], mean = m->mean[i], m2 = m->m2[i] / n, m3 = m->m3[i] / n;
    double second = m2 + mean * mean, third = m3 + 3 * mean * m2 + mean * mean * mean;
    return second < darkest || third * mean >= second * second * (1 - rounding) ||
           err_set(e, "pixel %zu: an M3 that no samples of radiance have", i / 3);
}

bool variance_ladder_within(const struct moments *render, int count,
                            const struct converge_reference *unit, int tile,
                            struct variance_map *out, struct err *e)
{
    assert(count >= 2);
    struct areas a;
    size_t pixels = unit->size / 3;
    double K = count, *d = calloc((size_t)count, sizeof *d);
    if (d == NULL)
        return err_set(e, "out of memory");
    bool ok = areas_start(&a, render[0].width, render[0].height, tile, out, e), made = ok;
    for (int k = 0; ok && k < count; k++)
        ok =
            strcmp(render[k].unit, "sample") == 0 ||
            err_set(e, "a render holds moments over its %ss, not over its samples", render[k].unit);
    for (size_t p = 0; ok && p < pixels; p++) {
        memset(d, 0, (size_t)count * sizeof *d);
        for (int k = 0; ok && k < count; k++) {
            const struct moments *m = &render[k];
            ok = m->n[p] >= 2 || err_set(e, "pixel %zu has %g samples", p, m->n[p]);
            for (size_t i = 3 * p; ok && i < 3 * p + 3; i++) {
                d[k] += m->m2[i] / ((m->n[p] - 1) * unit->unit[i] * unit->unit[i]);
                ok = check_third(m, i, e);
            }
        }
        double mean, sum = scatter(d, count, &mean);
        areas_add(&a, out, p, mean / 3, sum / (9 * K * (K - 1)));
    }
    free(d);
    if (ok) {
        areas_end(&a, out);
    } else if (made) {
        free(a.tile);
        variance_map_free(out);
    }
    return ok;
}

struct estimate variance_ladder_log(struct estimate v)
{
    assert(v.value > 0);
    return (struct estimate){log(v.value), v.se / v.value, v.dof};
}

double variance_ladder_reach(struct estimate record, double share)
{
    static const double alpha = 1e-6, missed = 1e-6;
    double dof = fmax(record.dof * share, 1);
    return (stats_t_quantile(alpha, dof) + stats_t_quantile(missed, dof)) * record.se *
           sqrt(1 + 1 / share);
}

double variance_ladder_margin(struct estimate record, double share, double least)
{
    if (record.value <= variance_ladder_none)
        return variance_ladder_none;
    double x = variance_ladder_reach(variance_ladder_log(record), share);
    return fmin(fmax(expm1(x), least), largest_margin);
}

struct estimate variance_ladder_expect(struct estimate run, struct estimate record, double share)
{
    run.dof = fmax(run.dof, record.dof * share);
    return run;
}

struct variance_claim variance_ladder_judge(struct estimate v, struct estimate wanted,
                                            double margin, bool both, double alpha)
{
    struct variance_claim c = {.margin = margin};
    bool outside, inside;
    if (wanted.value <= variance_ladder_none) {
        struct interval i = estimate_interval(v, 2 * alpha);
        c.ratio = v.value;
        c.lo = fmax(i.lo, 0);
        c.hi = i.hi;
        c.margin = variance_ladder_none;
        outside = i.lo > variance_ladder_none;
        inside = v.value <= variance_ladder_none;
    } else if (v.value <= variance_ladder_none) {
        c.ratio = c.lo = c.hi = 0;
        outside = both;
        inside = !both;
    } else {
        struct estimate a = variance_ladder_log(v), b = variance_ladder_log(wanted);
        double va = a.se * a.se, vb = b.se * b.se;
        double var = 2 * va * va / a.dof + 2 * vb * vb / b.dof;
        struct interval i = estimate_interval(
            (struct estimate){a.value - b.value, sqrt(va + vb), fmax(stats_dof(va + vb, var), 1)},
            2 * alpha);
        c.ratio = exp(a.value - b.value);
        c.lo = exp(i.lo);
        c.hi = exp(i.hi);
        outside = i.lo > log1p(margin) || (both && i.hi < -log1p(margin));
        inside = i.hi <= log1p(margin) && (!both || i.lo >= -log1p(margin));
    }
    c.verdict = outside                      ? VERDICT_DIFFERENT
                : inside                     ? VERDICT_EQUIVALENT
                : c.margin >= largest_margin ? VERDICT_NOTHING_FOUND
                                             : VERDICT_INCONCLUSIVE;
    return c;
}
