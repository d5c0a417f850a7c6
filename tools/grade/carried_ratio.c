#include "carried_ratio.h"

#include "tools/submission/rate_image.h"

#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Mean luminance over use[] without masked pixels; 0 if there are none. Clipped pixels, such as
 * lamps, say nothing. */
static double brightness(const struct rubric *r, const double *mean, int width, int height,
                         const unsigned char *use)
{
    double sum = 0, num = 0;
    for (size_t p = 0; p < (size_t)width * (size_t)height; p++)
        if (use[p] && !rubric_masks(r, width, height, p)) {
            sum += luminance(mean + 3 * p);
            num++;
        }
    return num > 0 ? sum / num : 0;
}

static double ratio_of(const struct rubric *r, const double *a, const double *b, int width,
                       int height, const unsigned char *use)
{
    double below = brightness(r, b, width, height, use);
    return below > 0 ? brightness(r, a, width, height, use) / below : 0;
}

/* use[p] = 0 where the image is as bright as the brightest code. */
static void leave_bright(const double *mean, size_t pixels, double clip, unsigned char *use)
{
    for (size_t i = 0; i < 3 * pixels; i++)
        if (mean[i] >= clip)
            use[i / 3] = 0;
}

/* Clipped luminance of each tile, summed over its pixels; the caller frees. NULL: out of memory. */
static double *tiles_of(const double *mean, int width, int height, double clip)
{
    int columns = width / RUBRIC_TILE, rows = height / RUBRIC_TILE;
    double *tile = calloc((size_t)columns * (size_t)rows, sizeof *tile);
    for (int y = 0; tile != NULL && y < rows * RUBRIC_TILE; y++)
        for (int x = 0; x < columns * RUBRIC_TILE; x++)
            for (size_t c = 0; c < 3; c++)
                tile[y / RUBRIC_TILE * columns + x / RUBRIC_TILE] +=
                    luminance_weight[c] *
                    fmin(mean[3 * ((size_t)y * (size_t)width + (size_t)x) + c], clip);
    return tile;
}

/* Correlation of the tiles of two images, the largest of the four mirrorings, as a wrong camera may
 * mirror. */
static double correlation(const double *u, const double *v, int columns, int rows)
{
    double n = columns * rows, best = -1;
    for (int flip = 0; flip < 4; flip++) {
        double a = 0, b = 0, aa = 0, bb = 0, ab = 0;
        for (int t = 0; t < columns * rows; t++) {
            int x = t % columns, y = t / columns;
            x = flip & 1 ? columns - 1 - x : x;
            y = flip & 2 ? rows - 1 - y : y;
            double p = u[y * columns + x], q = v[t];
            a += p;
            b += q;
            aa += p * p;
            bb += q * q;
            ab += p * q;
        }
        double spread = (aa - a * a / n) * (bb - b * b / n);
        best = fmax(best, spread > 0 ? (ab - a * b / n) / sqrt(spread) : -1);
    }
    return best;
}

/* Standard deviation over mean. */
static double spread_of(const double *tile, int columns, int rows)
{
    size_t num = (size_t)columns * (size_t)rows;
    double mean = gsl_stats_mean(tile, 1, num);
    return mean > 0 ? gsl_stats_sd_with_fixed_mean(tile, 1, num, mean) / mean : INFINITY;
}

/* Does the image show what m shows? Nearly uniform images do not correlate: with even_too it is
 * enough that both are so. */
static bool is_like(const struct submitted_image *s, const struct moments *m, bool even_too,
                    bool *is, struct err *e)
{
    static const double least = 0.5, even = 0.15, noisy = 0.3;
    int columns = s->width / RUBRIC_TILE, rows = s->height / RUBRIC_TILE;
    double *theirs = tiles_of(s->mean, s->width, s->height, s->clip),
           *ours = tiles_of(m->mean, s->width, s->height, s->clip);
    bool ok = (theirs != NULL && ours != NULL) || err_set(e, "out of memory");
    *is = ok && (correlation(theirs, ours, columns, rows) >= least ||
                 (even_too && spread_of(ours, columns, rows) < even &&
                  spread_of(theirs, columns, rows) < noisy));
    free(theirs);
    free(ours);
    return ok;
}

/* Times count as long as the image shows the scene. */
static bool carry_growth(const struct grading *g, int set, const struct rubric_check *c,
                         struct result *out, struct err *e)
{
    struct result other = *out;
    bool is;
    if (!is_like(&g->h->image[c->images[0]], answer_key_image(g->a, set, c->images[0]), false, &is,
                 e))
        return false;
    if (!is)
        return true;
    grade_checks_growth(g, c, &other);
    if (other.share <= out->share)
        return true;
    *out = other;
    snprintf(out->carried, sizeof out->carried, "timed as it is: it shows the scene");
    return true;
}

/* Is a ratio far enough from 1 (10 %) to be evidence? */
static bool is_telling(double ratio)
{
    return fabs(log(ratio)) > 0.1;
}

/* An image that adds nothing to the earlier one has R = B/P; halfway there, in logarithms, no
 * points are left. */
static struct margin margin_of(const struct margin *given, double expected)
{
    static const double least = 0.5;
    struct margin m = *given;
    if (is_telling(expected))
        m.none = fmin(m.none, least * fabs(log(expected)));
    m.full = fmin(m.full, 0.5 * m.none);
    return m;
}

static bool same_view(const struct rubric_image *a, const struct rubric_image *b)
{
    return strcmp(a->scene, b->scene) == 0 && strcmp(a->environment, b->environment) == 0 &&
           a->width == b->width && a->height == b->height;
}

/* Is it, to the bit, the earlier image, or one of another depth? */
static bool is_another(const struct grading *g, const struct rubric_check *c)
{
    const int image = c->images[0];
    const struct rubric_image *p = &g->r->image[image];
    for (int i = 0; i < g->r->num_images; i++) {
        const struct rubric_image *q = &g->r->image[i];
        if ((i == c->after || (same_view(p, q) && p->bounces != q->bounces)) &&
            g->h->image[i].mean != NULL &&
            strcmp(g->h->image[image].sha256, g->h->image[i].sha256) == 0)
            return true;
    }
    return false;
}

/* Does the image agree, in each channel and tile, with the reference of the earlier image of the
 * same view, although it should have more bounces? Then it lacks them. */
static bool is_what_was_asked_before(const struct grading *g, const struct rubric_check *c,
                                     bool *is, struct err *e)
{
    const struct rubric *r = g->r;
    const struct rubric_image *now = &r->image[c->images[0]], *before = &r->image[c->after];
    const struct submitted_image *p = &g->h->image[c->images[0]];
    const size_t pixels = (size_t)p->width * (size_t)p->height;
    unsigned char *use = malloc(pixels);
    bool ok = use != NULL || err_set(e, "out of memory");
    *is = false;
    for (size_t k = 0; ok && k < pixels; k++)
        use[k] = !rubric_masks(r, p->width, p->height, k);
    for (int set = 0;
         ok && set < r->num_sets && same_view(now, before) && before->bounces < now->bounces;
         set++) {
        struct submitted_image right = {0};
        struct difference d;
        struct err why; /* not comparable */
        ok = submitted_image_from(answer_key_image(g->a, set, c->after), p, &right, e);
        if (ok && difference_measure(p, &right, use, g->alpha, &d, &why)) {
            double share = score_share(&c->tile, &d.tile);
            for (int k = 0; k < NUM_CHANNELS; k++)
                share = fmin(share, score_share(&c->image, &d.image[k]));
            *is = *is || share == 1;
            difference_free(&d);
        }
        submitted_image_free(&right);
    }
    free(use);
    return ok;
}

/* Expected P/B if a wrong BSDF makes direct light, B, s times as bright, and every further bounce s
 * times again. right: P/B of the references. The radiances of successive bounces are taken for a
 * geometric series; right < 1: P is the last bounce alone. */
static double ratio_of_bounces(double right, double s, int bounces)
{
    if (right < 1)
        return right * pow(s, bounces - 1);
    double q[2] = {0, 1}, sum[2];
    for (int step = 0; step < 40; step++) {
        double mid = (q[0] + q[1]) / 2;
        sum[0] = sum[1] = 1;
        for (int k = 1; k < bounces; k++) {
            sum[0] = 1 + mid * sum[0];
            sum[1] = 1 + s * mid * sum[1];
        }
        q[sum[0] > right] = mid;
    }
    return sum[1];
}

static bool carry_ratio(const struct grading *g, int set, const struct rubric_check *c, bool drawn,
                        struct result *out, struct err *e)
{
    const struct rubric *r = g->r;
    const struct submitted_image *p = &g->h->image[c->images[0]], *b = &g->h->image[c->after];
    const struct moments *rp = answer_key_image(g->a, set, c->images[0]),
                         *rb = answer_key_image(g->a, set, c->after);
    if (b->mean == NULL || p->width != b->width || p->height != b->height || is_another(g, c))
        return true;
    const size_t pixels = (size_t)p->width * (size_t)p->height;
    const double clip = rubric_sight_clip(r);
    unsigned char *use = malloc(2 * pixels);
    if (use == NULL)
        return err_set(e, "out of memory");
    unsigned char *own = use + pixels;
    /* A wrong camera clips other pixels, and an image that is too bright more of them: first each
     * side by a mask of its own, then both by the pixels that neither clips. */
    memset(use, 1, 2 * pixels);
    leave_bright(p->mean, pixels, clip, own);
    leave_bright(b->mean, pixels, clip, own);
    leave_bright(rp->mean, pixels, clip, use);
    leave_bright(rb->mean, pixels, clip, use);
    double right = ratio_of(r, rp->mean, rb->mean, p->width, p->height, use),
           theirs = ratio_of(r, p->mean, b->mean, p->width, p->height, own);
    double v = log(theirs / right), bounced = right;
    if (r->image[c->after].bounces == 1 && r->image[c->images[0]].bounces > 1)
        bounced = ratio_of_bounces(right,
                                   brightness(r, b->mean, p->width, p->height, own) /
                                       brightness(r, rb->mean, p->width, p->height, use),
                                   r->image[c->images[0]].bounces);
    for (size_t k = 0; k < pixels; k++)
        use[k] = use[k] && own[k];
    double other = log(ratio_of(r, p->mean, b->mean, p->width, p->height, use) /
                       ratio_of(r, rp->mean, rb->mean, p->width, p->height, use));
    free(use);
    if (isnan(v) || fabs(other) < fabs(v))
        v = other;
    /* Not where the expected ratio is near 1: with so small a factor missing bounces could not be
     * seen. */
    if (is_telling(bounced) && fabs(log(theirs / bounced)) < fabs(v)) {
        v = log(theirs / bounced);
        right = bounced;
    }
    bool is;
    if (!is_like(p, rp, is_telling(right) || drawn, &is, e))
        return false;
    if (!isfinite(v) || !is)
        return true;
    const struct interval i = {v, v, v, 0};
    const struct margin m = margin_of(&c->carried, right);
    double share = score_share(&m, &i);
    if (share <= out->share)
        return true;
    out->share = share;
    out->chance = 0;
    snprintf(
        out->carried, sizeof out->carried,
        "held against '%s', which lost points before: %.3g times as bright as that, should be %.3g",
        r->image[c->after].name, right * exp(v), right);
    return true;
}

static bool is_there(const struct submitted_images *h, const struct rubric_check *c)
{
    for (int k = 0; k < c->num_images; k++)
        if (h->image[c->images[k]].mean == NULL)
            return false;
    return true;
}

/* Did an earlier part lose points in a check of this image? image -1: of any image with the view of
 * `like`. */
static bool was_lost(const struct rubric *r, const struct rubric_check *c, int image,
                     const struct rubric_image *like, const double *share)
{
    for (int i = 0; i < r->num_checks; i++)
        for (int k = 0; r->check[i].part < c->part && share[i] < 1 && k < r->check[i].num_images;
             k++) {
            int seen = r->check[i].images[k];
            if (seen == image || (image < 0 && same_view(&r->image[seen], like)))
                return true;
        }
    return false;
}

/* Does an earlier part have a check `equal` of this view with all its points, carried ones
 * included? */
static bool is_drawn(const struct rubric *r, const struct rubric_check *c,
                     const struct result *result)
{
    for (int i = 0; i < r->num_checks; i++)
        if (r->check[i].part < c->part && r->check[i].kind == CHECK_EQUAL && result[i].share == 1 &&
            same_view(&r->image[r->check[i].images[0]], &r->image[c->images[0]]))
            return true;
    return false;
}

/* A wrong image may take a few samples more or less than ours, or as many as the rule takes with
 * its own light and noise: whichever gives more points. */
static bool carry_rates(const struct grading *g, int set, const struct rubric_check *c,
                        struct result *out, struct err *e)
{
    const struct rubric_image *p = &g->r->image[c->images[0]];
    struct rate_image rates;
    struct err why;
    if (!rate_image_read(g->h->made[c->images[0]].rates, p, c->batch,
                         answer_key_counts(g->a, set, c->images[0]), &rates, &why))
        return !err_is_of_memory(&why) || err_set(e, "%s", why.msg);
    double v = rates.more > -1 ? log1p(rates.more) : -INFINITY,
           odd = rates.odd / fmax(1, rates.pixels);
    const struct interval count = {v, v, v, 0}, share = {odd, odd, odd, 0};
    const struct margin m = margin_of(&c->carried, rates.mean / (1 + rates.more) / p->spp);
    double better = fmin(score_share(&m, &count), score_share(&c->share, &share));
    struct result own = {0};
    if (!grade_checks_rates(g, set, c, &own, e))
        return false;
    if (own.share > fmax(better, out->share)) {
        out->share = own.share;
        out->chance = own.chance;
        snprintf(
            out->carried, sizeof out->carried,
            "an earlier part lost points in this scene: the rule takes as many samples with the light and noise of the program's own image");
        return true;
    }
    if (better <= out->share)
        return true;
    out->share = better;
    out->chance = 0;
    snprintf(
        out->carried, sizeof out->carried,
        "an earlier part lost points in this scene: the number of samples may be off by %.0f %%",
        100 * expm1(m.full));
    return true;
}

/* Index of another image of the same view, bounces and options with at least 4 times the samples;
 * -1: none. */
static int quieter(const struct rubric *r, const struct submitted_images *h, int image)
{
    const struct rubric_image *p = &r->image[image];
    for (int i = 0; i < r->num_images; i++) {
        const struct rubric_image *q = &r->image[i];
        if (h->image[i].mean != NULL && same_view(p, q) && p->bounces == q->bounces &&
            strcmp(p->options, q->options) == 0 && q->spp >= 4 * p->spp &&
            q->spp * q->lights >= 4 * p->spp * p->lights)
            return i;
    }
    return -1;
}

/* Measures noise against the program's own image with more samples, which may be wrong. */
static bool carry_noise(const struct grading *g, const struct rubric_check *c, struct result *out,
                        struct err *e)
{
    struct submitted_image *p = &g->h->image[c->images[0]], *q = &g->h->image[c->images[1]], own;
    int other = quieter(g->r, g->h, c->images[0]);
    size_t pixels = (size_t)p->width * (size_t)p->height;
    struct interval i = {0};
    struct err why;
    if (other < 0 || strcmp(p->sha256, q->sha256) == 0)
        return true;
    submitted_image_expect(&g->h->image[other], &g->a->of[0][other].noise, g->r->image[other].spp);
    unsigned char *use = malloc(pixels);
    if (use == NULL || !submitted_image_copy(&g->h->image[other], &own, e)) {
        free(use);
        return err_set(e, "out of memory");
    }
    own.known = true;
    for (size_t k = 0; k < pixels; k++)
        use[k] = !rubric_masks(g->r, p->width, p->height, k);
    submitted_image_unclipped(p, use);
    submitted_image_unclipped(q, use);
    submitted_image_unclipped(&own, use);
    bool related = difference_related(q, &own, use),
         known = related && difference_noise(p, &own, q, &own, use, g->alpha, &i, &why);
    const struct interval least = score_at_least(i);
    if (known && score_share(&c->log_ratio, &least) > out->share) {
        out->share = score_share(&c->log_ratio, &least);
        out->chance = score_chance(&c->log_ratio, &least);
        out->more = 0;
        snprintf(out->carried, sizeof out->carried, "against the program's own image '%s'",
                 g->r->image[other].name);
        snprintf(out->seen, sizeof out->seen, "%.3g times as much (%.3g to %.3g)", exp(i.value),
                 exp(i.lo), exp(i.hi));
    }
    submitted_image_free(&own);
    free(use);
    return known || !related || !err_is_of_memory(&why) || err_set(e, "%s", why.msg);
}

bool carried_by_ratio(const struct grading *g, int set, const double *share, const bool *paid,
                      struct result *result, struct err *e)
{
    const struct rubric *r = g->r;
    bool stops, ok = grade_checks_stops(g, &stops, e);
    for (int i = 0; ok && i < r->num_checks; i++) {
        const struct rubric_check *c = &r->check[i];
        const struct rubric_image *p = &r->image[c->images[0]];
        if (result[i].share == 1 || paid[c->part] || !result[i].judged || !is_there(g->h, c) ||
            (rubric_is_adaptive(p) && !stops))
            continue;
        /* All sets are tried: a mistake in every image that shows an accepted deviation hides it
         * (grade_all_checks()). */
        if (c->after >= 0 && was_lost(r, c, c->after, p, share)) {
            bool shows_no_more;
            ok = is_what_was_asked_before(g, c, &shows_no_more, e);
            for (int k = 0; ok && !shows_no_more && k < r->num_sets; k++)
                ok = carry_ratio(g, k, c, is_drawn(r, c, result), &result[i], e);
        } else if (c->kind == CHECK_RATES && was_lost(r, c, -1, p, share))
            ok = carry_rates(g, set, c, &result[i], e);
        else if (c->kind == CHECK_GROWTH)
            ok = carry_growth(g, set, c, &result[i], e);
        else if (c->kind == CHECK_NOISE)
            ok = carry_noise(g, c, &result[i], e);
    }
    return ok;
}
