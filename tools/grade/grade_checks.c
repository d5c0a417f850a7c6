#include "grade_checks.h"

#include "rate_image.h"
#include "stopping_rule.h"
#include "tools/base/text.h"
#include "tools/stats/distributions.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

double score_share(const struct margin *m, const struct interval *i)
{
    return fmin(1, fmax(0, (m->none - interval_distance(i)) / (m->none - m->full)));
}

double score_width(const struct margin *m, const struct interval *i)
{
    return fmin(1, fmax(0, 2 - interval_half(i) / m->none));
}

double score_more(const struct margin *m, const struct interval *i, double blur)
{
    double wide = (interval_half(i) - blur) / m->none;
    return wide > 1 && score_share(m, i) > 0 ? wide * wide : 0;
}

static double beyond(double distance, double sd)
{
    return sd > 0 ? 0.5 * erfc(distance / (sd * sqrt(2))) : distance >= 0 ? 0 : 1;
}

double score_chance(const struct margin *m, const struct interval *i)
{
    double share = score_share(m, i), half = interval_half(i), v = fabs(i->value);
    if (share == 1)
        return fmin(1, beyond(m->full + half - v, i->sd) + beyond(m->full + half + v, i->sd));
    return share == 0 ? beyond(v - half - m->none, i->sd) : 1;
}

/* One check being made. */
struct work {
    const struct grading *g;
    const struct rubric_check *check;
    int set;
    unsigned char *use;                /* pixels that can be compared; NULL: nobody has asked */
    struct submitted_image compare[2]; /* what images are held against */
};

static const struct rubric_image *image_of(const struct work *w, int k)
{
    return &w->g->r->image[w->check->images[k]];
}

static const struct submitted_image *student(const struct work *w, int k)
{
    return &w->g->h->image[w->check->images[k]];
}

/* NULL: the rubric gives none. */
static const struct moments *reference(const struct work *w, int k)
{
    return answer_key_image(w->g->a, w->set, w->check->images[k]);
}

static const struct moments *expected_noise(const struct work *w, int k)
{
    const struct moments *own = &w->g->a->of[w->set][w->check->images[k]].m;
    return own->width > 0 ? own : &w->g->a->of[0][w->check->images[k]].noise;
}

static bool is_masked(const struct work *w, const struct submitted_image *s, size_t p)
{
    return rubric_masks(w->g->r, s->width, s->height, p);
}

/* Times the samples, where it is not known how many it takes. */
static const double few = 4;

/* More samples can be had of all its images. */
static bool can_buy(const struct work *w)
{
    bool all = w->g->h->can_buy;
    for (int k = 0; k < w->check->num_images; k++)
        all = all && !w->g->h->fixed[w->check->images[k]];
    return all;
}

/* Of the smallest of its runs, which is cut off first. */
static double least_samples(const struct work *w, int k)
{
    const struct submitted_image *s = student(w, k);
    double least = s->num_runs > 0 ? INFINITY : image_of(w, k)->spp;
    for (int run = 0; run < s->num_runs; run++)
        least = fmin(least, s->run[run].spp);
    return least;
}

/* kappa of image k, 1 where its noise is measured from run to run, and the variance that it adds to a sum of pixels. */
static bool measure_noise(const struct work *w, int k, const unsigned char *use, double *kappa,
                          double *noise, struct err *e)
{
    struct submitted_image right;
    const struct submitted_image *s = student(w, k);
    if (!submitted_image_from(expected_noise(w, k), s, &right, e))
        return false;
    *kappa = s->num_runs > 1 ? 1 : difference_kappa(s, &right, use);
    *noise = 0;
    for (size_t i = 0; i < 3 * (size_t)s->width * (size_t)s->height; i++)
        if (use[i / 3])
            *noise += s->num_runs > 1 ? s->measured[i / 3 * 4 + i % 3] : *kappa * s->variance[i];
    submitted_image_free(&right);
    return true;
}

/* Where some images of a check have several runs, those of the others are taken to vary as kappa says. */
static void model_noise(const struct work *w, const unsigned char *use, const double *kappa)
{
    bool any = false;
    for (int k = 0; k < w->check->num_images; k++)
        any = any || student(w, k)->num_runs > 1;
    for (int k = 0; k < w->check->num_images; k++)
        if (student(w, k)->num_runs <= 1)
            submitted_image_model(&w->g->h->image[w->check->images[k]], any ? kappa[k] : 0);
    for (int k = 0; any && k < w->check->num_images; k++)
        submitted_image_scale_skewness(&w->g->h->image[w->check->images[k]], use);
}

/* Fills w->use, the pixels that can be compared. Around the clipping point a program that is
 * noisier than ours loses more pixels. If fewer than 30 % would be left, out->more asks for more
 * samples instead. False: our failure, not the submission's. */
static bool find_usable(struct work *w, struct result *out, struct err *e)
{
    static const double louder = 1.3, fewest = 0.3;
    size_t pixels = (size_t)student(w, 0)->width * (size_t)student(w, 0)->height, left = 0;
    unsigned char *use = w->use = malloc(2 * pixels);
    double kappa[CHECK_IMAGES];
    if (use == NULL)
        return err_set(e, "out of memory for %zu pixels", pixels);
    unsigned char *quiet = use + pixels;
    for (size_t p = 0; p < pixels; p++)
        use[p] = !is_masked(w, student(w, 0), p);
    for (int k = 0; k < w->check->num_images; k++)
        if (!submitted_image_comparable(student(w, k), expected_noise(w, k), least_samples(w, k),
                                        false, use, e))
            return false;
    for (int k = 0; k < w->check->num_images; k++)
        if (!measure_noise(w, k, use, &kappa[k], &out->noise[k], e))
            return false;
    model_noise(w, use, kappa);
    memcpy(quiet, use, pixels);
    for (int k = 0; k < w->check->num_images; k++)
        if ((kappa[k] > louder || student(w, k)->num_runs > 1) &&
            !submitted_image_comparable(student(w, k), expected_noise(w, k),
                                        least_samples(w, k) / kappa[k], true, quiet, e))
            return false;
    for (size_t p = 0; p < pixels; p++)
        left += quiet[p];
    if ((double)left >= fewest * (double)pixels)
        memcpy(use, quiet, pixels);
    else if (memcmp(use, quiet, pixels) != 0)
        out->more = few;
    return true;
}

/* A copy of the reference: an image that should have noise of its own shows the reference's. More
 * than 98 % of at least 100 values lie in their code's bin around the reference, where chance would
 * put fewer than 60 %. */
static bool is_copy(const struct submitted_image *s, const struct moments *m, double spp,
                    const unsigned char *use)
{
    double same = 0, expected = 0, num = 0;
    for (size_t i = 0; i < 3 * (size_t)s->width * (size_t)s->height; i++) {
        double sd = submitted_image_expected_sd(m, i, spp),
               bin = s->tolerance[i] + 1e-6 * m->mean[i];
        if (!use[i / 3] || s->clipped[i] || !(sd > 0))
            continue;
        num++;
        same += fabs(s->mean[i] - m->mean[i]) <= bin * 1.01;
        expected += erf(bin / (sd * sqrt(2)));
    }
    return num >= 100 && same > 0.98 * num && expected < 0.6 * num;
}

void grade_checks_tell(const struct difference *a, char *text, size_t size)
{
    const struct interval *worst = &a->image[0];
    static const char *const names[NUM_CHANNELS] = {"red", "green", "blue", "luminance"};
    int channel = 0;
    for (int c = 0; c < NUM_CHANNELS; c++)
        if (interval_distance(&a->image[c]) >= interval_distance(worst)) {
            worst = &a->image[c];
            channel = c;
        }
    snprintf(text, size, "mean of the image (%s) %+.2f %% (%+.2f to %+.2f)", names[channel],
             100 * worst->value, 100 * worst->lo, 100 * worst->hi);
    if (a->tiles > 0)
        text_append(text, size, "; furthest tile at %d,%d: %+.1f %% (%+.1f to %+.1f)", a->tile_x,
                    a->tile_y, 100 * a->tile.value, 100 * a->tile.lo, 100 * a->tile.hi);
}

/* One more interval that decides: the smallest share counts. */
static void judge(const struct work *w, const struct margin *m, const struct interval *i,
                  double blur, struct result *out)
{
    double share = score_share(m, i), chance = score_chance(m, i), width = score_width(m, i);
    if (can_buy(w)) {
        out->more = fmax(out->more, score_more(m, i, blur));
    } else if (width < share) {
        share = width;
        chance = width > 0;
    }
    if (share < out->share)
        out->chance = chance;
    else if (share == 1 && out->share == 1)
        out->chance = fmin(1, out->chance + chance);
    out->share = fmin(out->share, share);
}

/* A check that has lost all its points is decided. A check whose images cannot be compared yet (blind) keeps its points
 * while more samples can be had. */
static void settle(const struct work *w, bool blind, struct result *out)
{
    if (blind && can_buy(w))
        out->share = 1;
    else if (!can_buy(w) || out->share == 0)
        out->more = 0;
}

static void score_agreement(const struct work *w, struct result *out)
{
    const struct rubric_check *c = w->check;
    out->share = 1;
    out->chance = 0;
    for (int k = 0; k <= NUM_CHANNELS; k++) {
        const struct interval *i =
            k < NUM_CHANNELS ? &out->agreement.image[k] : &out->agreement.tile;
        const struct margin *m = k < NUM_CHANNELS ? &c->image : &c->tile;
        if (k == NUM_CHANNELS && out->agreement.tiles == 0)
            continue;
        judge(w, m, i, out->agreement.blur[k], out);
    }
    grade_checks_tell(&out->agreement, out->seen, sizeof out->seen);
}

static bool is_brighter(const struct rubric_check *c, const struct difference *a)
{
    bool any = a->tiles > 0 && a->tile.lo > c->tile.none;
    for (int k = 0; k < NUM_CHANNELS; k++)
        any = any || a->image[k].lo > c->image.none;
    return any;
}

static double skewness_of(const struct submitted_image *s, const unsigned char *use)
{
    double k3 = 0;
    for (size_t i = 0; i < 3 * (size_t)s->width * (size_t)s->height; i++)
        k3 += use[i / 3] ? fabs(s->k3[i]) : 0;
    return k3;
}

/* A against B; what keeps them from being compared, but for memory, is the student's to mend. */
static bool compare(const struct work *w, const struct submitted_image *a,
                    const struct submitted_image *b, struct result *out, struct err *e)
{
    struct err why;
    bool blind = out->more > 0;
    const bool measured = difference_measure(a, b, w->use, w->g->alpha, &out->agreement, &why);
    if (measured) {
        score_agreement(w, out);
        blind =
            blind && !is_brighter(w->check, &out->agreement); /* clipping makes nothing brighter */
    } else if (err_is_of_memory(&why))
        return err_set(e, "%s", why.msg);
    else
        snprintf(out->seen, sizeof out->seen, "cannot be compared: %.370s", why.msg);
    for (int k = 0; measured && out->agreement.skewed && k < w->check->num_images; k++)
        out->noise[k] = skewness_of(student(w, k), w->use);
    settle(w, blind, out);
    return true;
}

/* What the rule of stopping may do to this program: the range for an adaptive image with as much
 * noise as the student's. */
static bool stopping_of(const struct work *w, struct stopping *out, struct err *e)
{
    struct submitted_image right;
    if (!submitted_image_from(expected_noise(w, 0), student(w, 0), &right, e))
        return false;
    bool ok = stopping_rule_range(image_of(w, 0), student(w, 0), &right, expected_noise(w, 0),
                                  w->use, out, e);
    submitted_image_free(&right);
    return ok;
}

/* The rule of stopping is biased, which is not the student's fault: against what it does to noise like his. */
static bool compare_stopped(struct work *w, double blind, struct result *out, struct err *e)
{
    struct submitted_image *right = &w->compare[0];
    struct stopping rule;
    int columns = right->width / RUBRIC_TILE;
    if (!stopping_of(w, &rule, e))
        return false;
    for (size_t i = 0; i < 3 * (size_t)right->width * (size_t)right->height; i++) {
        int x = (int)(i / 3) % right->width, y = (int)(i / 3) / right->width;
        int t = y / RUBRIC_TILE * columns + x / RUBRIC_TILE;
        right->tolerance[i] += (rule.high[t] - rule.low[t]) / 2 * right->mean[i];
        right->mean[i] *= 1 + (rule.high[t] + rule.low[t]) / 2;
    }
    stopping_rule_free(&rule);
    difference_free(&out->agreement);
    out->share = out->chance = 0;
    out->more = blind;
    return compare(w, student(w, 0), right, out, e);
}

static bool check_equal(struct work *w, struct result *out, struct err *e)
{
    const struct rubric_image *p = image_of(w, 0);
    const struct moments *plain = &w->g->a->of[0][w->check->images[0]].m;
    const struct submitted_image *s = student(w, 0), *first = s->num_runs > 0 ? s->run : s;
    snprintf(
        out->expected, sizeof out->expected,
        "the mean of the image within %.3g %%, of any 8 x 8 pixels within %.3g %% of the reference",
        100 * w->check->image.full, 100 * w->check->tile.full);
    if (!find_usable(w, out, e))
        return false;
    double blind = out->more;
    if (!submitted_image_from(reference(w, 0), s, &w->compare[0], e) ||
        !compare(w, s, &w->compare[0], out, e) ||
        (out->share < 1 && rubric_is_adaptive(p) && !compare_stopped(w, blind, out, e)))
        return false;
    if (is_copy(first, reference(w, 0), p->spp, w->use) || is_copy(first, plain, p->spp, w->use)) {
        out->share = out->chance = 0;
        snprintf(
            out->seen, sizeof out->seen,
            "this is the reference itself, with its noise; a render of %d samples has noise of its own",
            p->spp);
        snprintf(out->flag, sizeof out->flag, "%s is a copy of the reference", p->name);
    }
    return true;
}

/* A copy of q, moved by the difference of two references, with their noise. */
static bool moved(const struct submitted_image *q, const struct moments *to,
                  const struct moments *from, struct submitted_image *out, struct err *e)
{
    struct submitted_image a = {0}, b = {0};
    bool ok = submitted_image_from(to, q, &a, e) && submitted_image_from(from, q, &b, e) &&
              submitted_image_copy(q, out, e);
    for (size_t i = 0; ok && i < 3 * (size_t)q->width * (size_t)q->height; i++) {
        out->mean[i] += a.mean[i] - b.mean[i];
        out->variance[i] += a.variance[i] + b.variance[i];
        out->measured[i / 3 * 4 + i % 3] += a.variance[i] + b.variance[i];
        if (i % 3 == 1) /* green is most of luminance */
            out->measured[i / 3 * 4 + 3] += a.variance[i] + b.variance[i];
    }
    submitted_image_free(&a);
    submitted_image_free(&b);
    return ok;
}

/* To what its codes tell. */
static bool is_black(const struct submitted_image *s)
{
    for (size_t i = 0; i < 3 * (size_t)s->width * (size_t)s->height; i++)
        if (s->mean[i] > s->tolerance[i])
            return false;
    return true;
}

static bool check_agree(struct work *w, struct result *out, struct err *e)
{
    const struct moments *m = reference(w, 0), *n = reference(w, 1);
    bool deviates = w->set > 0 && m != NULL && n != NULL;
    snprintf(out->expected, sizeof out->expected,
             "%s and %s %s, within %.3g %% (any 8 x 8 pixels: %.3g %%)", image_of(w, 0)->name,
             image_of(w, 1)->name,
             deviates ? "differ as in our renders with the same deviation" : "have the same mean",
             100 * w->check->image.full, 100 * w->check->tile.full);
    if (strcmp(student(w, 0)->sha256, student(w, 1)->sha256) == 0) {
        snprintf(
            out->seen, sizeof out->seen, "%s",
            is_black(student(w, 0))
                ? "both images are black"
                : "the two files are the same: the option that tells them apart has no effect");
        return true;
    }
    return find_usable(w, out, e) && (!deviates || moved(student(w, 1), m, n, &w->compare[0], e)) &&
           compare(w, student(w, 0), deviates ? &w->compare[0] : student(w, 1), out, e);
}

static bool check_sum(struct work *w, struct result *out, struct err *e)
{
    struct submitted_image *sum = &w->compare[0];
    snprintf(out->expected, sizeof out->expected,
             "%s is the sum of the other %d images, within %.3g %% (any 8 x 8 pixels: %.3g %%)",
             image_of(w, 0)->name, w->check->num_images - 1, 100 * w->check->image.full,
             100 * w->check->tile.full);
    if (!find_usable(w, out, e) || !submitted_image_from(NULL, student(w, 0), sum, e))
        return false;
    for (int k = 1; k < w->check->num_images; k++)
        submitted_image_add(sum, student(w, k));
    submitted_image_unclipped(sum, w->use);
    return compare(w, student(w, 0), sum, out, e);
}

/* Deterministic shares of pixels. */
static void score_pixels(const struct work *w, double wrong, double num, struct result *out)
{
    double v = num > 0 ? wrong / num : 1;
    const struct interval i = {v, v, v, 0};
    out->share = score_share(&w->check->share, &i);
    out->chance = 0;
}

/* One wrong pixel: the share of its tile's, and which tile has most. */
static void map_wrong(struct difference *map, int columns, int x, int y)
{
    double *here = &map->relative[y / RUBRIC_TILE * columns + x / RUBRIC_TILE];
    *here += 1.0 / (RUBRIC_TILE * RUBRIC_TILE);
    if (map->tiles > 0 &&
        *here <= map->relative[map->tile_y / RUBRIC_TILE * columns + map->tile_x / RUBRIC_TILE])
        return;
    map->tiles = 1;
    map->tile_x = x / RUBRIC_TILE * RUBRIC_TILE;
    map->tile_y = y / RUBRIC_TILE * RUBRIC_TILE;
}

/* An image without noise but for where in the pixel its rays fell: 6 standard deviations of a sample mean, by
 * the reference's own samples, and the rounding to codes. */
static bool check_exact(struct work *w, struct result *out, struct err *e)
{
    static const double allowed_sd = 6;
    const struct submitted_image *s = student(w, 0);
    const struct moments *m = reference(w, 0);
    double wrong = 0, num = 0;
    int first = -1, columns = s->width / RUBRIC_TILE;
    struct difference *map = &out->agreement;
    map->relative =
        calloc((size_t)columns * (size_t)(s->height / RUBRIC_TILE), sizeof *map->relative);
    if (map->relative == NULL)
        return err_set(e, "out of memory");
    for (size_t p = 0; p < (size_t)s->width * (size_t)s->height; p++) {
        bool off = false, lit = false;
        for (size_t i = 3 * p; i < 3 * p + 3; i++) {
            double sd = hypot(submitted_image_expected_sd(m, i, image_of(w, 0)->spp),
                              submitted_image_expected_sd(m, i, m->n[p] * fmax(1, m->spp)));
            lit |= m->mean[i] > 0;
            off |= fabs(s->mean[i] - fmin(m->mean[i], s->clip)) >
                   allowed_sd * sd + 2 * s->tolerance[i] + 1e-3;
        }
        lit &= !is_masked(w, s, p);
        num += lit;
        wrong += lit && off;
        if (lit && off) {
            first = first < 0 ? (int)p : first;
            map_wrong(map, columns, (int)(p % (size_t)s->width), (int)(p / (size_t)s->width));
        }
    }
    score_pixels(w, wrong, num, out);
    snprintf(out->expected, sizeof out->expected,
             "all pixels of objects as in the reference, at most %.3g %% of them not",
             100 * w->check->share.full);
    snprintf(out->seen, sizeof out->seen, "%.0f of %.0f pixels differ (%.2f %%)", wrong, num,
             100 * wrong / fmax(1, num));
    if (first >= 0)
        text_append(out->seen, sizeof out->seen, ", the first at %d,%d from the top left",
                    first % s->width, first / s->width);
    return true;
}

static bool check_noise(struct work *w, struct result *out, struct err *e)
{
    const struct submitted_image *p = student(w, 0), *q = student(w, 1);
    struct submitted_image *rp = &w->compare[0], *rq = &w->compare[1];
    struct interval i;
    struct err why;
    snprintf(out->expected, sizeof out->expected,
             "the noise of %s over that of %s as with independent samples, within a factor of %.3g",
             image_of(w, 0)->name, image_of(w, 1)->name, exp(w->check->log_ratio.full));
    if (strcmp(p->sha256, q->sha256) == 0) {
        snprintf(out->seen, sizeof out->seen,
                 "the two files are the same, though one has more samples");
        return true;
    }
    if (!find_usable(w, out, e) || !submitted_image_from(reference(w, 0), p, rp, e) ||
        !submitted_image_from(reference(w, 1), q, rq, e))
        return false;
    if (!difference_related(q, rq, w->use)) {
        snprintf(out->seen, sizeof out->seen, "%s is no image of its scene", image_of(w, 1)->name);
        out->more = 0;
    } else if (difference_noise(p, rp, q, rq, w->use, w->g->alpha, &i, &why)) {
        snprintf(out->seen, sizeof out->seen, "%.3g times as much (%.3g to %.3g)", exp(i.value),
                 exp(i.lo), exp(i.hi));
        out->share = 1;
        out->more = 0; /* clipped pixels are left out of it */
        judge(w, &w->check->log_ratio, &i, 0, out);
        settle(w, false, out);
    } else {
        snprintf(out->seen, sizeof out->seen, "%.390s", why.msg);
    }
    return true;
}

/* By what the rule gives for a program with as much noise: `ours` is the mean of our counts. */
static bool widen_count(struct work *w, double ours, struct interval *count, struct result *out,
                        struct err *e)
{
    struct stopping rule;
    if (!find_usable(w, out, e) || !stopping_of(w, &rule, e))
        return false;
    count->lo -= fmax(0, rule.most / ours - 1);
    count->hi -= fmin(0, rule.least / ours - 1);
    stopping_rule_free(&rule);
    out->more = 0;
    return true;
}

static bool check_rates(struct work *w, struct result *out, struct err *e)
{
    const struct rubric_check *c = w->check;
    const struct made *made = &w->g->h->made[c->images[0]];
    struct rate_image rates;
    struct err why;
    snprintf(
        out->expected, sizeof out->expected,
        "every pixel of the rate image stands for a multiple of %d samples, and on average for as many as in our render, within %.3g %%",
        c->batch, 100 * c->count.full);
    if (made->rates[0] == '\0') {
        snprintf(out->seen, sizeof out->seen, "there is no rate image");
        return true;
    }
    if (!rate_image_read(made->rates, image_of(w, 0), c->batch,
                         answer_key_counts(w->g->a, w->set, c->images[0]), &rates, &why)) {
        if (err_is_of_memory(&why))
            return err_set(e, "%s", why.msg);
        snprintf(out->seen, sizeof out->seen, "the rate image: %.370s", why.msg);
        return true;
    }
    double half = stats_normal_quantile(w->g->alpha / 2) * rates.sd;
    struct interval count = {rates.more, rates.more - half, rates.more + half, rates.sd};
    if (score_share(&c->count, &count) < 1 && rubric_is_adaptive(image_of(w, 0)) &&
        !widen_count(w, rates.mean / (1 + rates.more), &count, out, e))
        return false;
    score_pixels(w, rates.odd, rates.pixels, out);
    if (score_share(&c->count, &count) <= out->share) {
        out->share = score_share(&c->count, &count);
        out->chance = score_chance(&c->count, &count);
    }
    snprintf(
        out->seen, sizeof out->seen,
        "%.0f of %.0f pixels stand for no multiple of %d; %.0f stopped early; %.4g samples a pixel on average, %+.2f %% from ours (%+.2f to %+.2f)",
        rates.odd, rates.pixels, c->batch, rates.early, rates.mean, 100 * count.value,
        100 * count.lo, 100 * count.hi);
    return true;
}

void grade_checks_rates(const struct grading *g, int set, const struct rubric_check *c,
                        struct result *out)
{
    int image = c->images[0];
    const struct rubric_image *p = &g->r->image[image];
    struct stopping by[NUM_STOPPING_KINDS];
    struct rate_image rates;
    struct err why; /* which has been said */
    if (!rate_image_read(g->h->made[image].rates, p, c->batch, answer_key_counts(g->a, set, image),
                         &rates, &why) ||
        !stopping_rule_samples(p, &g->h->image[image], answer_key_image(g->a, set, image), by,
                               &why))
        return;
    double least = by[STOPS_RIGHTLY].least, most = by[STOPS_RIGHTLY].most,
           odd = rates.odd / fmax(1, rates.pixels),
           half = stats_normal_quantile(g->alpha / 2) * rates.sd;
    const struct interval count = {rates.mean / sqrt(least * most) - 1,
                                   rates.mean / most - 1 - half, rates.mean / least - 1 + half,
                                   rates.sd},
                          share = {odd, odd, odd, 0};
    out->share = fmin(score_share(&c->share, &share), score_share(&c->count, &count));
    out->chance = score_chance(&c->count, &count);
}

/* What a run may take longer or shorter than another of the same work. */
static double timing_error(const struct made *m)
{
    return 0.01 + 0.05 * m->cpu_s;
}

void grade_checks_growth(const struct grading *g, const struct rubric_check *c, struct result *out)
{
    const struct made *made[4];
    for (int k = 0; k < 4; k++)
        made[k] = &g->h->made[c->images[k]];
    out->share = out->chance = out->more = 0;
    snprintf(out->expected, sizeof out->expected,
             "the samples of %s take at most %.3g times as long as those of %s",
             g->r->image[c->images[0]].name, exp(c->log_ratio.full),
             g->r->image[c->images[2]].name);
    if (made[0]->cpu_s <= 0) {
        snprintf(out->seen, sizeof out->seen, "no program ran that could be timed");
        return;
    }
    double large = made[0]->cpu_s - made[1]->cpu_s, small = made[2]->cpu_s - made[3]->cpu_s,
           large_error = timing_error(made[0]) + timing_error(made[1]),
           small_error = timing_error(made[2]) + timing_error(made[3]);
    double least = log(fmax(large - large_error, 1e-6) / (fmax(small, 0) + small_error));
    const struct interval i = {least, least, least, 0};
    out->share = least <= 0 ? 1 : score_share(&c->log_ratio, &i);
    snprintf(out->seen, sizeof out->seen,
             "%.3g s of CPU time against %.3g s (+- %.2g and %.2g): at least %.3g times as long",
             large, small, large_error, small_error, exp(least));
}

static bool check_growth(struct work *w, struct result *out, struct err *e)
{
    if (!check_equal(w, out, e))
        return false;
    bool is_wrong = out->share < 0.5; /* black is off by less than 100 % of it */
    grade_checks_growth(w->g, w->check, out);
    if (is_wrong && w->g->h->made[w->check->images[0]].cpu_s > 0) {
        out->share = 0;
        snprintf(out->seen, sizeof out->seen, "%s is no image of its scene", image_of(w, 0)->name);
    }
    return true;
}

/* A program that stops by itself has the noise of the samples that it says it took. */
static void scale_noise(struct submitted_image *s, const double *count, double spp)
{
    for (size_t i = 0; i < 3 * (size_t)s->width * (size_t)s->height; i++) {
        s->variance[i] *= spp / count[i / 3];
        s->k3[i] *= pow(spp / count[i / 3], 2);
    }
    for (int k = 0; k < s->num_runs; k++)
        scale_noise(&s->run[k], count, spp);
}

/* The noise that an image should have. */
static bool expect_noise(const struct work *w, struct err *e)
{
    for (int k = 0; k < w->check->num_images; k++) {
        const struct rubric_image *p = image_of(w, k);
        struct submitted_image *s = &w->g->h->image[w->check->images[k]];
        const struct made *made = &w->g->h->made[w->check->images[k]];
        struct err no_rates;
        submitted_image_expect(s, expected_noise(w, k), p->spp);
        if (made->rates[0] == '\0' || !rubric_is_adaptive(p))
            continue;
        double *count = calloc((size_t)s->width * (size_t)s->height, sizeof *count);
        if (count == NULL)
            return err_set(e, "out of memory");
        if (rate_image_counts(made->rates, p, count, &no_rates))
            scale_noise(s, count, p->spp);
        free(count);
    }
    return true;
}

bool grade_checks_run(const struct grading *g, const struct rubric_check *check, int set,
                      struct result *out, struct err *e)
{
    static bool (*const kinds[NUM_CHECK_KINDS])(struct work *, struct result *, struct err *) = {
        [CHECK_EQUAL] = check_equal,  [CHECK_AGREE] = check_agree, [CHECK_SUM] = check_sum,
        [CHECK_EXACT] = check_exact,  [CHECK_NOISE] = check_noise, [CHECK_RATES] = check_rates,
        [CHECK_GROWTH] = check_growth};
    struct work w = {.g = g, .check = check, .set = set};
    *out = (struct result){.judged = true, .image = check->images[0]};
    for (int k = 0; k < check->num_images; k++) {
        int i = check->images[k];
        if (g->h->image[i].mean != NULL)
            continue;
        snprintf(out->expected, sizeof out->expected, "image '%s'", g->r->image[i].name);
        snprintf(out->seen, sizeof out->seen, "%s", g->h->why[i]);
        out->judged = g->h->made[i].end != SANDBOX_LOST;
        return true;
    }
    bool ok = expect_noise(&w, e) && kinds[check->kind](&w, out, e);
    free(w.use);
    submitted_image_free(&w.compare[0]);
    submitted_image_free(&w.compare[1]);
    return ok;
}

void result_free(struct result *r)
{
    difference_free(&r->agreement);
}
