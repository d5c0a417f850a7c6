#include "agreement.h"

#include "hygiene.h"
#include "rubric.h"
#include "spatial.h"
#include "stats.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

double interval_distance(const struct interval *i)
{
    return fmax(0, fmax(i->lo, -i->hi));
}

double interval_half(const struct interval *i)
{
    return (i->hi - i->lo) / 2;
}

static bool side(const struct student *s, const unsigned char *use, struct moments *m,
                 struct err *e)
{
    size_t pixels = (size_t)s->width * (size_t)s->height;
    if (!moments_alloc(m, s->width, s->height, e))
        return false;
    m->tolerance = calloc(3 * pixels, sizeof *m->tolerance);
    if (m->tolerance == NULL)
        return err_set(e, "out of memory for %zu pixels", pixels);
    for (size_t i = 0; i < 3 * pixels; i++) {
        m->mean[i] = use[i / 3] ? s->mean[i] : 0;
        m->tolerance[i] = use[i / 3] ? s->tolerance[i] : 0;
    }
    return true;
}

static struct interval interval_of(const struct region *r)
{
    return (struct interval){r->difference, r->ci_lo, r->ci_hi, r->std_error};
}

static double share_used(const unsigned char *use, int width, struct rect r)
{
    double num = 0;
    for (int y = r.y; y < r.y + r.height; y++)
        for (int x = r.x; x < r.x + r.width; x++)
            num += use[(size_t)y * (size_t)width + (size_t)x] != 0;
    return num / ((double)r.width * r.height);
}

static void measure_tiles(const struct judge *j, const struct pyramid *p, const unsigned char *use,
                          struct agreement *out)
{
    static const double least_used = 0.25;
    const struct pyramid_level *level = &p->level[p->tile_level];
    double furthest = -1;
    for (int i = 0; i < level->nx * level->ny; i++) {
        struct rect rect = pyramid_rect(p, p->tile_level, (size_t)i);
        struct region r = region_fill(j, &level->cell[i], rect, CHANNEL_LUMINANCE);
        out->relative[i] = r.difference;
        if (!r.ci_valid || share_used(use, j->width, rect) < least_used) {
            out->relative[i] = NAN;
            continue;
        }
        struct interval interval = interval_of(&r);
        /* Among tiles that agree: the one that is least sure to. */
        double distance =
            interval_distance(&interval) + 1e-9 * fmax(fabs(interval.lo), fabs(interval.hi));
        out->tiles++;
        if (distance > furthest) {
            furthest = distance;
            out->tile = interval;
            out->tile_x = rect.x;
            out->tile_y = rect.y;
        }
    }
}

static bool measure(const struct moments *a, const struct moments *b, const unsigned char *use,
                    double alpha, struct agreement *out, struct err *e)
{
    size_t tiles = (size_t)(a->width / RUBRIC_TILE) * (size_t)(a->height / RUBRIC_TILE);
    /* region_fill() gives 1 - 2 alpha. */
    struct compare_options opt = {.alpha = alpha / 2 / (double)(NUM_CHANNELS + tiles),
                                  .tile = RUBRIC_TILE};
    struct judge j;
    struct rect whole = {0, 0, a->width, a->height};
    out->relative = calloc(tiles, sizeof *out->relative);
    if (out->relative == NULL)
        return err_set(e, "out of memory for %zu tiles", tiles);
    if (!hygiene_check(a, b, &opt, &j, e))
        return false;
    for (int c = 0; c < NUM_CHANNELS; c++) {
        struct pyramid p;
        if (!pyramid_build(a, b, c, RUBRIC_TILE, &p, e))
            return false;
        struct region r = region_fill(&j, &p.level[p.num_levels - 1].cell[0], whole, c);
        out->image[c] = interval_of(&r);
        if (c == CHANNEL_LUMINANCE)
            measure_tiles(&j, &p, use, out);
        pyramid_free(&p);
    }
    return true;
}

/* Where all that is compared is the same, there is no noise to find: both sides are exact. */
static bool is_same(const struct student *a, const struct student *b, const unsigned char *use)
{
    for (size_t i = 0; i < 3 * (size_t)a->width * (size_t)a->height; i++)
        if (use[i / 3] && a->mean[i] != b->mean[i])
            return false;
    return true;
}

bool agreement_measure(const struct student *a, const struct student *b, const unsigned char *use,
                       double alpha, struct agreement *out, struct err *e)
{
    size_t pixels = (size_t)a->width * (size_t)a->height, used = 0;
    struct moments ma = {0}, mb = {0};
    struct spatial noise;
    unsigned char *left = malloc(pixels);
    *out = (struct agreement){0};
    bool ok = left != NULL || err_set(e, "out of memory for %zu pixels", pixels);
    for (size_t p = 0; ok && p < pixels; p++) {
        left[p] = !use[p];
        used += use[p] != 0;
    }
    out->compared = (double)used / (double)pixels;
    ok = ok && (4 * used >= pixels ||
                err_set(e, "only %.0f %% of the pixels can be compared: the others are saturated",
                        100 * out->compared));
    ok = ok && side(a, use, &ma, e) && side(b, use, &mb, e);
    if (ok && is_same(a, b, use)) {
        strcpy(ma.unit, "exact");
        strcpy(mb.unit, "exact");
        for (size_t p = 0; p < pixels; p++)
            ma.n[p] = mb.n[p] = 1;
    } else {
        ok = ok && spatial_variance(&ma, &mb, a->rounding, b->rounding, left, &noise, e);
    }
    ok = ok && measure(&ma, &mb, use, alpha, out, e);
    moments_free(&ma);
    moments_free(&mb);
    free(left);
    if (!ok)
        agreement_free(out);
    return ok;
}

void agreement_free(struct agreement *a)
{
    free(a->relative);
    *a = (struct agreement){0};
}

/* Sums of squares and fourth powers of second differences of picture less reference. */
struct sums {
    double num, s2, s4, rounding;
};

static bool all_used(const unsigned char *use, int width, int x, int y)
{
    for (int v = y - 1; v <= y + 1; v++)
        for (int u = x - 1; u <= x + 1; u++)
            if (!use[(size_t)v * (size_t)width + (size_t)u])
                return false;
    return true;
}

static struct sums noise_sums(const struct student *s, const double *reference,
                              const unsigned char *use)
{
    static const double kernel[3] = {1, -2, 1};
    struct sums out = {0};
    for (int y = 1; y < s->height - 1; y++)
        for (int x = 1; x < s->width - 1; x++) {
            if (!all_used(use, s->width, x, y))
                continue;
            for (size_t c = 0; c < 3; c++) {
                double r = 0, rounding = 0;
                for (int k = 0; k < 9; k++) {
                    size_t i =
                        3 * ((size_t)(y - 1 + k / 3) * (size_t)s->width + (size_t)(x - 1 + k % 3)) +
                        c;
                    double w = kernel[k / 3] * kernel[k % 3] / 6;
                    r += w * (s->mean[i] - reference[i]);
                    rounding += w * w * s->rounding[i];
                }
                out.num++;
                out.s2 += r * r;
                out.s4 += pow(r, 4);
                out.rounding += rounding;
            }
        }
    return out;
}

bool agreement_noise(const struct student *p, const double *reference_p, const struct student *q,
                     const double *reference_q, const unsigned char *use, double alpha,
                     struct interval *out, struct err *e)
{
    static const double tail_factor = 4, least = 100;
    const struct sums a = noise_sums(p, reference_p, use), b = noise_sums(q, reference_q, use);
    double va = a.s2 - a.rounding, vb = b.s2 - b.rounding;
    if (a.num < 3 * least)
        return err_set(e, "too few pixels can be compared to tell their noise");
    if (!(va > 0) || !(vb > 0))
        return err_set(e, "there is no noise in one of the pictures");
    /* Three channels of one lamp vary together: as if a third of them. */
    double sd = sqrt(3 * tail_factor * (a.s4 / (va * va) + b.s4 / (vb * vb)));
    double half = stats_normal_quantile(alpha / 2) * sd, value = log(va / vb);
    *out = (struct interval){value, value - half, value + half, sd};
    return true;
}
