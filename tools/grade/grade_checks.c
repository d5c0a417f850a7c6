#include "grade_checks.h"

#include "judging.h"
#include "tools/base/text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

/* Takes one more interval into account: the smallest share counts. Does it cost points by its width alone? */
static bool judge(const struct judging *w, const struct margin *m, const struct interval *i,
                  double blur, struct result *out)
{
    double share = score_share(m, i), chance = score_chance(m, i), width = score_width(m, i);
    const bool wide = !judging_can_buy(w) && width < share;
    if (judging_can_buy(w)) {
        out->more = fmax(out->more, score_more(m, i, blur));
    } else if (wide) {
        share = width;
        chance = width > 0;
    }
    if (share < out->share)
        out->chance = chance;
    else if (share == 1 && out->share == 1)
        out->chance = fmin(1, out->chance + chance);
    out->share = fmin(out->share, share);
    return wide;
}

static void tell_if_wide(bool wide, struct result *out)
{
    if (wide)
        text_append(out->seen, sizeof out->seen,
                    "; too noisy: an interval is longer than the margins, which costs points too");
}

/* A check that has lost all its points is decided. A check whose images cannot be compared yet
 * (blind) keeps its points while more samples can be had. */
static void settle(const struct judging *w, bool blind, struct result *out)
{
    if (blind && judging_can_buy(w))
        out->share = 1;
    else if (!judging_can_buy(w) || out->share == 0)
        out->more = 0;
}

static void score_agreement(const struct judging *w, struct result *out)
{
    const struct rubric_check *c = w->check;
    bool wide = false;
    out->share = 1;
    out->chance = 0;
    for (int k = 0; k <= NUM_CHANNELS; k++) {
        const struct interval *i =
            k < NUM_CHANNELS ? &out->agreement.image[k] : &out->agreement.tile;
        const struct margin *m = k < NUM_CHANNELS ? &c->image : &c->tile;
        if (k == NUM_CHANNELS && out->agreement.tiles == 0)
            continue;
        wide = judge(w, m, i, out->agreement.blur[k], out) || wide;
    }
    grade_checks_tell(&out->agreement, out->seen, sizeof out->seen);
    tell_if_wide(wide, out);
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

/* Compares A with B and scores it. If they cannot be compared, out->seen says why, for the student
 * to mend; fails only out of memory. */
static bool compare(const struct judging *w, const struct submitted_image *a,
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
        out->noise[k] = skewness_of(judging_student(w, k), w->use);
    settle(w, blind, out);
    return true;
}

/* Compares again, allowing for the bias of the assignment's stopping rule at the student's noise:
 * it is not the student's fault. */
static bool compare_stopped(struct judging *w, double blind, struct result *out, struct err *e)
{
    struct submitted_image *right = &w->compare[0];
    struct stopping rule;
    int columns = right->width / RUBRIC_TILE;
    if (!judging_stopping(w, &rule, e))
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
    return compare(w, judging_student(w, 0), right, out, e);
}

static bool check_equal(struct judging *w, struct result *out, struct err *e)
{
    const struct rubric_image *p = judging_image(w, 0);
    const struct moments *plain = &w->g->a->of[0][w->check->images[0]].m;
    const struct submitted_image *s = judging_student(w, 0), *first = s->num_runs > 0 ? s->run : s;
    snprintf(
        out->expected, sizeof out->expected,
        "the mean of the image within %.3g %%, of any 8 x 8 pixels within %.3g %% of the reference",
        100 * w->check->image.full, 100 * w->check->tile.full);
    bool stops = true;
    if (rubric_is_adaptive(p) && !grade_checks_stops(w->g, &stops, e))
        return false;
    if (!stops) {
        snprintf(
            out->seen, sizeof out->seen,
            "the rate images say that no pixel of any image stopped early: adaptive sampling is missing, or they "
            "are wrong");
        return true;
    }
    if (!judging_find_usable(w, out, e))
        return false;
    double blind = out->more;
    if (!submitted_image_from(judging_reference(w, 0), s, &w->compare[0], e) ||
        !compare(w, s, &w->compare[0], out, e) ||
        (out->share < 1 && rubric_is_adaptive(p) && !compare_stopped(w, blind, out, e)))
        return false;
    if (is_copy(first, judging_reference(w, 0), p->spp, w->use) ||
        is_copy(first, plain, p->spp, w->use)) {
        out->share = out->chance = 0;
        snprintf(
            out->seen, sizeof out->seen,
            "this is the reference itself, with its noise; a render of %d samples has noise of its own",
            p->spp);
        snprintf(out->flag, sizeof out->flag, "%s is a copy of the reference", p->name);
    }
    return true;
}

/* q plus the difference of two references, to - from, with the noise of all three. */
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

/* Do they differ in bounces alone? */
static bool differ_in_bounces(const struct rubric_image *p, const struct rubric_image *q)
{
    return p->bounces != q->bounces && p->spp == q->spp && p->lights == q->lights &&
           p->width == q->width && p->height == q->height && strcmp(p->scene, q->scene) == 0 &&
           strcmp(p->environment, q->environment) == 0 && strcmp(p->options, q->options) == 0;
}

/* May two images be the same file? A program that traces one bounce more than it is asked for draws the same numbers
 * where no bounce adds anything: it may, if it makes two other images of those that differ in bounces alone, neither
 * black. */
static bool may_be_the_same(const struct judging *w)
{
    const struct rubric *r = w->g->r;
    const struct submitted_image *image = w->g->h->image;
    if (!differ_in_bounces(judging_image(w, 0), judging_image(w, 1)))
        return false;
    for (int i = 0; i < r->num_images; i++)
        for (int k = 0; k < i; k++)
            if (differ_in_bounces(&r->image[i], &r->image[k]) && image[i].mean != NULL &&
                image[k].mean != NULL && strcmp(image[i].sha256, image[k].sha256) != 0 &&
                !submitted_image_is_black(&image[i]) && !submitted_image_is_black(&image[k]))
                return true;
    return false;
}

static bool check_agree(struct judging *w, struct result *out, struct err *e)
{
    const struct moments *m = judging_reference(w, 0), *n = judging_reference(w, 1);
    bool deviates = w->set > 0 && m != NULL && n != NULL;
    snprintf(out->expected, sizeof out->expected,
             "%s and %s %s, within %.3g %% (any 8 x 8 pixels: %.3g %%)", judging_image(w, 0)->name,
             judging_image(w, 1)->name,
             deviates ? "differ as in our renders with the same deviation" : "have the same mean",
             100 * w->check->image.full, 100 * w->check->tile.full);
    const bool black = submitted_image_is_black(judging_student(w, 0));
    if (strcmp(judging_student(w, 0)->sha256, judging_student(w, 1)->sha256) == 0 &&
        (black || !may_be_the_same(w))) {
        snprintf(
            out->seen, sizeof out->seen, "%s",
            black ? "both images are black"
                  : "the two files are the same: the option that tells them apart has no effect");
        return true;
    }
    return judging_find_usable(w, out, e) &&
           (!deviates || moved(judging_student(w, 1), m, n, &w->compare[0], e)) &&
           compare(w, judging_student(w, 0), deviates ? &w->compare[0] : judging_student(w, 1), out,
                   e);
}

static bool check_sum(struct judging *w, struct result *out, struct err *e)
{
    struct submitted_image *sum = &w->compare[0];
    snprintf(out->expected, sizeof out->expected,
             "%s is the sum of the other %d images, within %.3g %% (any 8 x 8 pixels: %.3g %%)",
             judging_image(w, 0)->name, w->check->num_images - 1, 100 * w->check->image.full,
             100 * w->check->tile.full);
    if (!judging_find_usable(w, out, e) ||
        !submitted_image_from(NULL, judging_student(w, 0), sum, e))
        return false;
    for (int k = 1; k < w->check->num_images; k++)
        submitted_image_add(sum, judging_student(w, k));
    submitted_image_unclipped(sum, w->use);
    return compare(w, judging_student(w, 0), sum, out, e);
}

/* Adds a wrong pixel to its tile's share, and keeps the tile with the largest. */
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

/* The only noise is where in a pixel rays fall: allowed are 6 standard errors of the mean, by the
 * reference's own samples, and the rounding to codes. */
static bool check_exact(struct judging *w, struct result *out, struct err *e)
{
    static const double allowed_sd = 6;
    const struct submitted_image *s = judging_student(w, 0);
    const struct moments *m = judging_reference(w, 0);
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
            double sd = hypot(submitted_image_expected_sd(m, i, judging_image(w, 0)->spp),
                              submitted_image_expected_sd(m, i, m->n[p] * fmax(1, m->spp)));
            lit |= m->mean[i] > 0;
            off |= fabs(s->mean[i] - fmin(m->mean[i], s->clip)) >
                   allowed_sd * sd + 2 * s->tolerance[i] + 1e-3;
        }
        lit &= !judging_masks(w, s, p);
        num += lit;
        wrong += lit && off;
        if (lit && off) {
            first = first < 0 ? (int)p : first;
            map_wrong(map, columns, (int)(p % (size_t)s->width), (int)(p / (size_t)s->width));
        }
    }
    out->share = score_pixels(&w->check->share, wrong, num);
    out->chance = 0;
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

static bool check_noise(struct judging *w, struct result *out, struct err *e)
{
    const struct submitted_image *p = judging_student(w, 0), *q = judging_student(w, 1);
    struct submitted_image *rp = &w->compare[0], *rq = &w->compare[1];
    struct interval i;
    struct err why;
    snprintf(
        out->expected, sizeof out->expected,
        "the relative variance of %s over that of %s at least as with independent samples, within a factor of %.3g",
        judging_image(w, 0)->name, judging_image(w, 1)->name, exp(w->check->log_ratio.full));
    if (strcmp(p->sha256, q->sha256) == 0) {
        snprintf(out->seen, sizeof out->seen,
                 "the two files are the same, though one has more samples");
        return true;
    }
    if (!judging_find_usable(w, out, e) ||
        !submitted_image_from(judging_reference(w, 0), p, rp, e) ||
        !submitted_image_from(judging_reference(w, 1), q, rq, e))
        return false;
    if (!difference_related(q, rq, w->use)) {
        snprintf(out->seen, sizeof out->seen,
                 "%s differs too much from the right image for its noise to be judged",
                 judging_image(w, 1)->name);
        out->no_hint = true;
        out->more = 0;
    } else if (difference_noise(p, rp, q, rq, w->use, w->g->alpha, &i, &why)) {
        snprintf(out->seen, sizeof out->seen, "%.3g times as much (%.3g to %.3g)", exp(i.value),
                 exp(i.lo), exp(i.hi));
        out->share = 1;
        out->more = 0; /* clipped pixels are left out of it */
        i = score_at_least(i); /* noise may fall faster, as that of stratified samples */
        tell_if_wide(judge(w, &w->check->log_ratio, &i, 0, out), out);
        settle(w, false, out);
    } else if (err_is_of_memory(&why)) {
        return err_set(e, "%s", why.msg);
    } else {
        snprintf(out->seen, sizeof out->seen, "%.390s", why.msg);
    }
    return true;
}

static bool check_growth(struct judging *w, struct result *out, struct err *e)
{
    if (!check_equal(w, out, e))
        return false;
    bool is_wrong = out->share < 0.5; /* not 0: a black image's interval starts inside -100 % */
    grade_checks_growth(w->g, w->check, out);
    if (is_wrong && w->g->h->made[w->check->images[0]].cpu_s > 0) {
        out->share = 0;
        snprintf(out->seen, sizeof out->seen,
                 "%s differs too much from the right image for its time to count",
                 judging_image(w, 0)->name);
        out->no_hint = true;
    }
    return true;
}

bool grade_checks_run(const struct grading *g, const struct rubric_check *check, int set,
                      struct result *out, struct err *e)
{
    static bool (*const kinds[NUM_CHECK_KINDS])(struct judging *, struct result *, struct err *) = {
        [CHECK_EQUAL] = check_equal,  [CHECK_AGREE] = check_agree,
        [CHECK_SUM] = check_sum,      [CHECK_EXACT] = check_exact,
        [CHECK_NOISE] = check_noise,  [CHECK_RATES] = grade_checks_judge_rates,
        [CHECK_GROWTH] = check_growth};
    struct judging w = {.g = g, .check = check, .set = set};
    *out = (struct result){.judged = true, .image = check->images[0]};
    for (int k = 0; k < check->num_images; k++) {
        int i = check->images[k];
        if (g->h->image[i].mean != NULL)
            continue;
        snprintf(out->expected, sizeof out->expected, "image '%s'", g->r->image[i].name);
        snprintf(out->seen, sizeof out->seen, "%s", g->h->why[i]);
        out->judged = g->h->made[i].end != SANDBOX_LOST;
        out->no_hint = true;
        return true;
    }
    bool ok = true;
    for (int k = 0; ok && k < check->num_images; k++)
        ok = judging_expect_noise(g, set, check->images[k], e);
    ok = ok && kinds[check->kind](&w, out, e);
    free(w.use);
    submitted_image_free(&w.compare[0]);
    submitted_image_free(&w.compare[1]);
    return ok;
}

void result_free(struct result *r)
{
    difference_free(&r->agreement);
}
