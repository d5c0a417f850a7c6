#include "carried.h"

#include "tools/base/text.h"
#include "tools/diagnose/bug_fit.h"
#include "tools/stats/distributions.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Relative error of a bug's effect, measured with our renderer, for another program with that
 * bug. */
static const double effect_error = 0.03;
/* Clipping at the brightest code depends on the distribution of a program's noise: cells brighter
 * than `bright` times that code may be off by `clip_error` of their radiance, all with the same
 * sign. */
static const double bright = 0.5, clip_error = 0.05;
/* Relative differences are taken over at least this share of the right image, as a bug may make a
 * cell black. */
static const double dark = 0.1;
/* An image that the bug leaves less than this share of its light shows nothing of what it is meant to show. */
static const double black = 0.01;

/* ---- which part pays? */

/* A part of the assignment, as the catalogue and rubrics write it: 3-1 has Parts 1 to 5, 3-2 has 1 to 4. */
struct place {
    int project, part; /* part 0: not known */
};

static struct place place_of_bug(const char *where)
{
    static const struct {
        const char *topic;
        int part;
    } topics[] = {
        {"mirror", 1}, {"glass", 1}, {"microfacet", 2}, {"environment", 3}, {"depth of field", 4}};
    struct place p = {1, 0};
    if (sscanf(where, "part %d", &p.part) == 1)
        return p;
    p.project = 2;
    for (size_t i = 0; i < sizeof topics / sizeof *topics; i++)
        if (strncmp(where, "project 3-2, ", 13) == 0 &&
            strncmp(where + 13, topics[i].topic, strlen(topics[i].topic)) == 0)
            p.part = topics[i].part;
    return p;
}

static struct place place_of_check(const struct rubric *r, const struct rubric_check *c)
{
    struct place p = {strstr(c->where, "3-2") != NULL ? 2 : 1, 0};
    const char *part = strstr(c->where, "Part ");
    if (part == NULL || sscanf(part, "Part %d", &p.part) != 1)
        p.part = atoi(r->part[c->part].number);
    return p;
}

int carried_part_of(const struct rubric *r, const struct bug *b)
{
    struct place bug = place_of_bug(b->where);
    for (int i = 0; bug.part > 0 && i < r->num_checks; i++) {
        struct place check = place_of_check(r, &r->check[i]);
        if (check.project == bug.project && check.part == bug.part)
            return r->check[i].part;
    }
    return -1;
}

/* What is being carried on. */
struct carry {
    const struct grading *g;
    int with, bug[2], paid[2], num; /* bugs, and the parts in which they are paid */
    bool is_right[RUBRIC_PARTS];    /* a check of the part had all points before any came back */
};

static bool loses(const struct rubric *r, const struct result *result, int part)
{
    for (int i = 0; i < r->num_checks; i++)
        if (r->check[i].part == part && result[i].share < 1)
            return true;
    return false;
}

static bool shows(const struct carry *w, int bug, const struct rubric_check *c)
{
    for (int k = 0; k < c->num_images; k++) {
        int view = w->g->bugs->view[w->with][c->images[k]];
        if (view >= 0 && w->g->bugs->catalogue.view[view].effect[bug] != NULL)
            return true;
    }
    return false;
}

/* The part of the first check that lost points and shows the bug; else of the first that lost
 * points; -1: none did. */
static int earliest(const struct carry *w, int bug, const struct result *result)
{
    int first = -1;
    for (int i = 0; i < w->g->r->num_checks; i++) {
        if (result[i].share == 1)
            continue;
        if (shows(w, bug, &w->g->r->check[i]))
            return w->g->r->check[i].part;
        first = first < 0 ? w->g->r->check[i].part : first;
    }
    return first;
}

/* A bug is paid in its own part if that lost points; of bugs that cannot be told apart, in the
 * earliest such part; else by earliest(). member: 0 or 1, the first or the second bug of the
 * diagnosis. */
static void find_payer(struct carry *w, const struct diagnosis *found, int member,
                       const struct result *result)
{
    const struct candidate *first = &found->candidate[0];
    int paid = -1;
    for (int k = 0; k < found->num_named; k++) {
        const struct candidate *c = &found->candidate[k];
        if (member == 0 ? c->second != first->second : c->bug != first->bug)
            continue;
        int own =
            carried_part_of(w->g->r, &w->g->bugs->catalogue.bug[member == 0 ? c->bug : c->second]);
        if (own >= 0 && loses(w->g->r, result, own) && (paid < 0 || own < paid))
            paid = own;
    }
    w->bug[member] = member == 0 ? first->bug : first->second;
    w->paid[member] = paid >= 0 ? paid : earliest(w, w->bug[member], result);
    w->num = member + 1;
}

/* ---- judged with a bug */

/* The signed sum of a check's images, cell by cell: as seen, and as expected with the bugs. */
struct cells {
    int columns, rows, cell;
    double seen[SIGNATURE_VALUES], expected[SIGNATURE_VALUES], var[SIGNATURE_VALUES];
    double bias[SIGNATURE_VALUES]; /* bound of the systematic error, of one sign in all cells */
    double
        base[SIGNATURE_VALUES]; /* expected of the first image: what differences are relative to */
    double light, lit;          /* of the first image with the bugs, and without, in all cells */
};

/* Adds sign (+1, -1) times an image. bugs: bit k adds the effect of w->bug[k] to what is
 * expected. */
static bool add_image(const struct carry *w, int image, int sign, int bugs, struct cells *out,
                      struct err *e)
{
    struct observation *seen = malloc(sizeof *seen);
    struct effect *room = malloc(sizeof *room);
    bool ok = (seen != NULL && room != NULL) || err_set(e, "out of memory");
    ok = ok && rubric_bugs_observe(w->g, w->with, image, seen, e);
    if (ok) {
        double clip = rubric_sight_clip(w->g->r);
        int first = bugs & 1 ? w->bug[0] : w->bug[1], second = bugs == 3 ? w->bug[1] : -1;
        const struct signature *s = &seen->seen, *c = &seen->view->correct;
        const struct effect *effect =
            bug_fit_effect(seen->view, first, second, false, isfinite(clip) ? clip : 0, room);
        bool is_first = out->columns == 0;
        out->columns = s->columns;
        out->rows = s->rows;
        out->cell = s->cell;
        for (int i = 0; i < 3 * s->columns * s->rows; i++) {
            double more = effect != NULL ? (double)effect->mean[i] : 0;
            if (s->var[i] >= rubric_sight_masked)
                continue; /* as expected, as far as is known */
            out->seen[i] += sign * s->mean[i];
            out->expected[i] += sign * (c->mean[i] + more);
            if (fmax(s->mean[i], c->mean[i] + more) > bright * clip)
                out->bias[i] += clip_error * (c->mean[i] + more);
            out->var[i] += s->var[i] + c->var[i] + pow(effect_error * more, 2) +
                           (effect != NULL ? (double)effect->var[i] : 0);
            if (is_first) {
                out->base[i] = fmax(c->mean[i] + more, dark * c->mean[i]);
                out->light += c->mean[i] + more;
                out->lit += c->mean[i];
            }
        }
    }
    free(seen);
    free(room);
    return ok;
}

/* Sums over a rectangle of cells, of one channel or luminance. */
struct sums {
    double difference, var, bias, base;
};

static struct interval interval_of(const struct sums *s, double base, double z)
{
    double value = s->difference / base, half = (z * sqrt(s->var) + s->bias) / base;
    return (struct interval){value, value - half, value + half, sqrt(s->var) / base};
}

static struct sums sum_of(const struct cells *s, int x, int y, int side_x, int side_y, int channel)
{
    struct sums sum = {0};
    for (int j = y; j < y + side_y && j < s->rows; j++)
        for (int i = x; i < x + side_x && i < s->columns; i++)
            for (int c = 0; c < 3; c++) {
                int at = 3 * (j * s->columns + i) + c;
                double weight = channel == CHANNEL_LUMINANCE ? luminance_weight[c] : c == channel;
                sum.difference += weight * (s->seen[at] - s->expected[at]);
                sum.base += weight * s->base[at];
                sum.bias += weight * s->bias[at];
                sum.var += weight * weight * s->var[at];
            }
    return sum;
}

/* As difference_measure(), but of whole cells, whose variance is known: pixels of a wrong image
 * need not resemble ours. */
static bool measure(const struct cells *s, double alpha, struct difference *out, struct err *e)
{
    assert(s->cell > 0); /* add_image() has set it */
    int side = s->cell < RUBRIC_TILE ? RUBRIC_TILE / s->cell : 1;
    int columns = s->columns / side, rows = s->rows / side, num = columns * rows;
    double z = stats_normal_quantile(alpha / 2 / (num + NUM_CHANNELS)), worst = -1;
    *out = (struct difference){.compared = 1, .kappa = 1};
    if (side * s->cell == RUBRIC_TILE) {
        out->relative = calloc((size_t)num, sizeof *out->relative);
        if (out->relative == NULL)
            return err_set(e, "out of memory");
    }
    const double no_light = 1e-6;
    for (int c = 0; c < NUM_CHANNELS; c++) {
        struct sums all = sum_of(s, 0, 0, s->columns, s->rows, c);
        out->image[c] = interval_of(&all, fmax(all.base, no_light), z);
    }
    struct sums whole = sum_of(s, 0, 0, s->columns, s->rows, CHANNEL_LUMINANCE);
    double least = fmax(0.25 * whole.base * side * side / (s->columns * s->rows), no_light);
    for (int t = 0; t < num; t++) {
        int x = t % columns * side, y = t / columns * side;
        struct sums tile = sum_of(s, x, y, side, side, CHANNEL_LUMINANCE);
        struct interval i = interval_of(&tile, fmax(tile.base, least), z);
        if (out->relative != NULL)
            out->relative[t] = i.value;
        if (interval_distance(&i) > worst) {
            worst = interval_distance(&i);
            out->tile = i;
            out->tile_x = x * s->cell;
            out->tile_y = y * s->cell;
        }
    }
    out->tiles = num;
    return true;
}

static void score(const struct rubric_check *c, struct result *out)
{
    const struct difference *d = &out->agreement;
    out->share = score_share(&c->tile, &d->tile);
    out->chance = score_chance(&c->tile, &d->tile);
    for (int k = 0; k < NUM_CHANNELS; k++) {
        out->share = fmin(out->share, score_share(&c->image, &d->image[k]));
        out->chance = fmin(1, out->chance + score_chance(&c->image, &d->image[k]));
    }
    grade_checks_tell(d, out->seen, sizeof out->seen);
}

/* For checks of kind exact: share of the lit cells that are wrong; 1 if none is lit. */
static double share_off(const struct cells *s)
{
    static const double allowed_sd = 6, codes = 2e-3;
    int lit = 0, off = 0;
    for (int i = 0; i < s->columns * s->rows; i++) {
        bool is_lit = false, is_off = false;
        for (int k = 3 * i; k < 3 * i + 3; k++) {
            is_lit |= s->expected[k] > codes || s->seen[k] > codes;
            is_off |= fabs(s->seen[k] - s->expected[k]) > allowed_sd * sqrt(s->var[k]) + codes;
        }
        lit += is_lit;
        off += is_lit && is_off;
    }
    return lit > 0 ? (double)off / lit : 1;
}

/* Has the bug made the image black, in a part that nothing else shows to be right? */
static bool is_blind(const struct carry *w, const struct rubric_check *c, const struct cells *s)
{
    return (c->kind == CHECK_EQUAL || c->kind == CHECK_GROWTH) && s->light < black * s->lit &&
           !w->is_right[c->part];
}

/* *is_judged: false where the check stays as it is: kind noise, an image without a view, or one that shows nothing. */
static bool judge(const struct carry *w, const struct rubric_check *c, int bugs, struct result *out,
                  bool *is_judged, struct err *e)
{
    const int images = c->kind == CHECK_GROWTH ? 1 : c->num_images;
    *is_judged = c->kind != CHECK_NOISE;
    for (int k = 0; k < images; k++)
        *is_judged = *is_judged && rubric_bugs_can_observe(w->g, w->with, c->images[k]);
    if (!*is_judged)
        return true;
    if (c->kind == CHECK_RATES)
        return grade_checks_rates(w->g, w->with, c, out, e);
    struct cells *cells = calloc(1, sizeof *cells);
    bool ok = cells != NULL || err_set(e, "out of memory");
    for (int k = 0; ok && k < images; k++)
        ok = add_image(w, c->images[k], k == 0 ? 1 : -1, bugs, cells, e);
    if (ok && is_blind(w, c, cells)) {
        *is_judged = false;
    } else if (ok && c->kind == CHECK_EXACT) {
        double off = share_off(cells);
        const struct interval i = {off, off, off, 0};
        out->share = score_share(&c->share, &i);
        out->chance = 0;
        snprintf(out->seen, sizeof out->seen, "%.2f %% of the cells differ", 100 * off);
    } else if (ok) {
        ok = measure(cells, w->g->alpha, &out->agreement, e);
        if (ok)
            score(c, out);
        if (ok && c->kind == CHECK_GROWTH && out->share > 0)
            grade_checks_growth(w->g, c, out);
    }
    free(cells);
    return ok;
}

static void tell(const struct carry *w, int bugs, struct result *out)
{
    snprintf(out->carried, sizeof out->carried,
             "held against images with what has been paid before:");
    for (int k = 0; k < w->num; k++)
        if (bugs >> k & 1)
            text_append(out->carried, sizeof out->carried, "%s %s (Part %s)",
                        k > 0 && bugs == 3 ? ";" : "", w->g->bugs->catalogue.bug[w->bug[k]].what,
                        w->g->r->part[w->paid[k]].number);
}

static bool carry_check(const struct carry *w, int check, struct result *result, struct err *e)
{
    const struct rubric_check *c = &w->g->r->check[check];
    int bugs = 0;
    bool is_judged = false, is_shown = false;
    for (int k = 0; k < w->num; k++)
        if (w->paid[k] != c->part) {
            bugs |= 1 << k;
            is_shown |= shows(w, w->bug[k], c);
        }
    if (!is_shown || result->share == 1 || !result->judged)
        return true;
    struct result other = *result;
    other.agreement = (struct difference){0};
    if (!judge(w, c, bugs, &other, &is_judged, e))
        return false;
    if (!is_judged || other.share <= result->share) {
        result_free(&other);
        return true;
    }
    other.more = 0;
    result_free(result);
    *result = other;
    tell(w, bugs, result);
    return true;
}

bool carried_by_name(const struct grading *g, int with, const struct diagnosis *found,
                     struct result *result, bool paid[RUBRIC_PARTS], struct err *e)
{
    struct carry w = {.g = g, .with = with};
    bool lost = false;
    for (int i = 0; i < g->r->num_checks; i++)
        lost |= result[i].share != 1;
    if (!lost) /* the deviations of the diagnosis leave all points, so that nothing was paid */
        return true;
    find_payer(&w, found, 0, result);
    if (found->candidate[0].second >= 0)
        find_payer(&w, found, 1, result);
    for (int k = 0; k < w.num; k++)
        paid[w.paid[k]] = true;
    for (int i = 0; i < g->r->num_checks; i++)
        w.is_right[g->r->check[i].part] |= result[i].share == 1 && g->r->check[i].points > 0;
    bool ok = true;
    for (int i = 0; ok && i < g->r->num_checks; i++)
        ok = carry_check(&w, i, &result[i], e);
    return ok;
}
