#include "rubric_bugs.h"

#include "judging.h"

#include "renderer/base/fs.h"
#include "renderer/base/sha256.h"
#include "tools/diagnose/bug_fit.h"
#include "tools/submission/rate_image.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool rubric_bugs_sees(const struct rubric *r, int image)
{
    bool sees = false;
    for (int i = 0; i < r->num_checks; i++) {
        const struct rubric_check *c = &r->check[i];
        bool shows = c->kind == CHECK_EQUAL || c->kind == CHECK_EXACT || c->kind == CHECK_RATES ||
                     c->kind == CHECK_SUM || c->kind == CHECK_AGREE;
        for (int k = 0; shows && k < c->num_images; k++)
            sees |= c->images[k] == image;
    }
    return sees && r->image[image].reference == REFERENCE_OURS;
}

int rubric_bugs_set(const struct answer_key *a, int set, int image)
{
    const struct moments *m = &a->of[set][image].m, *first = &a->of[0][image].m;
    if (m->width == 0)
        return 0;
    size_t size = 3 * (size_t)m->width * (size_t)m->height * sizeof *m->mean;
    for (int k = 0; k < set; k++) {
        const struct moments *other = &a->of[k][image].m;
        other = other->width > 0 ? other : first;
        if (memcmp(m->mean, other->mean, size) == 0)
            return k;
    }
    return set;
}

bool rubric_bugs_measures(const struct rubric *r, int set)
{
    bool single = set == 0;
    for (int i = 0; i < r->num_accepted; i++)
        single |= strcmp(r->set[set].name, r->accept[i].name) == 0;
    return single;
}

bool rubric_bugs_key(const struct rubric *r, int set, int image, char name[128], char key[65],
                     struct err *e)
{
    const struct rubric_image *p = &r->image[image];
    char text[4096], scene[65], environment[65] = "";
    if (!sha256_file(rubric_scene(r, p).s, scene, e) ||
        (p->environment[0] != '\0' &&
         !sha256_file(fs_path("%s/%s", r->dir, p->environment).s, environment, e)))
        return false;
    const char *options = p->reference_options[0] != '\0' ? p->reference_options : p->options;
    const char *words = r->set[set].words;
    snprintf(text, sizeof text, "%s %s %s %d %d %d %d %d %s %s%s%s", r->curve, scene, environment,
             p->width, p->height, p->spp, p->lights, p->bounces, options,
             rubric_sight_counts(r, image) ? p->options : "", words[0] != '\0' ? " " : "", words);
    snprintf(name, 128, "%s%s%.70s", p->name, set > 0 ? "@" : "", r->set[set].name);
    sha256_text(text, key);
    return true;
}

bool rubric_bugs_can_observe(const struct grading *g, int set, int image)
{
    return g->bugs->view[set][image] >= 0 && g->h->image[image].mean != NULL;
}

bool rubric_bugs_observe(const struct grading *g, int set, int image, struct observation *out,
                         struct err *e)
{
    const struct view *v = &g->bugs->catalogue.view[g->bugs->view[set][image]];
    struct answer right = g->a->of[rubric_bugs_set(g->a, set, image)][image];
    right.as_asked = *answer_key_counts(g->a, set, image);
    *out = (struct observation){.view = v, .is_consistent = true};
    return rubric_sight_of_student(g->r, image, g->h, &right, &v->correct, &out->seen, e);
}

/* What is seen of a submission with one set of deviations. */
struct sights {
    int num, bugs;
    struct observation clue[RUBRIC_IMAGES];
    struct view own[RUBRIC_IMAGES]; /* of images with a check of rates; else effect is NULL */
};

static void forget(struct sights *s)
{
    for (int k = 0; k < s->num; k++) {
        for (int b = 0; s->own[k].effect != NULL && b < s->bugs; b++)
            free(s->own[k].effect[b]);
        free(s->own[k].effect);
    }
    *s = (struct sights){0};
}

/* Log odds of how far the mean count has come from one batch to all samples. Uncertainty of a
 * program's noise shifts it about equally everywhere, while the mean count itself saturates at both
 * ends. */
static double progress(const struct rubric_image *p, double taken)
{
    double batch = rubric_option(p, "-a", 0), end = 0.05 * (p->spp - batch);
    return log((fmax(0, taken - batch) + end) / (fmax(0, p->spp - taken) + end));
}

/* Expected FACT_SAMPLES of a rule: all counts within its range are equally likely, so `seen` is
 * clamped to it. One that looks at no noise takes exactly one batch; where that is seen, others may have taken it too. */
static void set_samples(const struct rubric_image *p, enum stopping_kind kind,
                        const struct stopping *s, double seen, double *fact, double *fact_sd)
{
    static const double ends =
        4; /* standard deviations in half the range: 3.3 of kappa, the shapes widen it (stopping_rule.c) */
    double lo = progress(p, s->least), hi = progress(p, s->most);
    const double least_sd = kind == STOPS_AT_ONCE && seen > hi + 1e-6 ? 0 : 0.1;
    fact[FACT_SAMPLES] = fmin(fmax(seen, lo), hi);
    fact_sd[FACT_SAMPLES] = hypot((hi - lo) / 2 / ends, least_sd);
}

/* Is so much of the image clipped that its light and noise are unknown? */
static bool is_clipped(const struct submitted_image *s)
{
    static const double most = 0.05;
    size_t values = 3 * (size_t)s->width * (size_t)s->height, clipped = 0;
    for (size_t i = 0; i < values; i++)
        clipped += s->clipped[i];
    return (double)clipped > most * (double)values;
}

/* Effect of dividing a pixel's sum by all samples wherever it stopped, from the counts in the
 * program's own rate image. */
static bool expect_mean_over_all(const struct rubric_image *p, const char *rates,
                                 const struct signature *correct, struct effect *mine,
                                 struct err *e)
{
    struct err why;
    double *count = calloc((size_t)p->width * (size_t)p->height, sizeof *count);
    if (count == NULL)
        return err_set(e, "out of memory");
    bool known = rate_image_counts(rates, p, count, &why);
    for (int i = 0; known && i < correct->columns * correct->rows; i++) {
        int x0 = i % correct->columns * correct->cell, y0 = i / correct->columns * correct->cell;
        double taken = 0;
        for (int k = 0; k < correct->cell * correct->cell; k++)
            taken += count[(y0 + k / correct->cell) * p->width + x0 + k % correct->cell];
        double share = taken / ((double)p->spp * correct->cell * correct->cell);
        for (int c = 3 * i; c < 3 * i + 3; c++)
            mine->mean[c] = (float)((share - 1) * correct->mean[c]);
    }
    free(count);
    return known || !err_is_of_memory(&why) || err_set(e, "%s", why.msg);
}

/* Given the program's own light and noise, the number of samples depends on its stopping rule
 * alone: counts that each rule takes with these replace the catalogue's, which were measured with
 * our light and noise. */
static bool expect_samples(const struct grading *g, int set, int image, struct sights *s,
                           struct err *e)
{
    const struct catalogue *c = &g->bugs->catalogue;
    struct stopping by[NUM_STOPPING_KINDS] = {0};
    struct observation *clue = &s->clue[s->num - 1];
    struct view *own = &s->own[s->num - 1];
    const struct rubric_image *p = &g->r->image[image];
    struct err why;
    if (isnan(clue->seen.fact[FACT_SAMPLES]))
        return true;
    if (is_clipped(&g->h->image[image]))
        clue->seen.fact[FACT_SAMPLES] = NAN;
    else if (!judging_samples(g, set, image, by, &why)) {
        clue->seen.fact[FACT_SAMPLES] = NAN;
        return !err_is_of_memory(&why) || err_set(e, "%s", why.msg);
    }
    if (isnan(clue->seen.fact[FACT_SAMPLES]))
        return true;
    double taken = p->spp * exp(clue->seen.fact[FACT_SAMPLES]),
           sd = taken * clue->seen.fact_sd[FACT_SAMPLES];
    clue->seen.fact[FACT_SAMPLES] = progress(p, taken);
    clue->seen.fact_sd[FACT_SAMPLES] = (progress(p, taken + sd) - progress(p, taken - sd)) / 2;
    *own = *clue->view;
    own->effect = calloc((size_t)c->num_bugs, sizeof(struct effect *));
    if (own->effect == NULL)
        return err_set(e, "out of memory");
    set_samples(p, STOPS_RIGHTLY, &by[STOPS_RIGHTLY], clue->seen.fact[FACT_SAMPLES],
                own->correct.fact, own->correct.fact_sd);
    for (int k = 0; k < c->num_bugs; k++) {
        const struct effect *plain = clue->view->effect[k];
        enum stopping_kind kind = stopping_rule_of(c->bug[k].name);
        if (plain == NULL && kind == STOPS_RIGHTLY)
            continue;
        struct effect *mine = calloc(1, sizeof *mine);
        if (mine == NULL)
            return err_set(e, "out of memory");
        if (plain != NULL)
            *mine = *plain;
        own->effect[k] = mine;
        for (int f = 0; plain == NULL && f < NUM_FACTS; f++)
            mine->fact[f] = mine->fact_sd[f] = NAN;
        set_samples(p, kind, &by[kind], clue->seen.fact[FACT_SAMPLES], mine->fact, mine->fact_sd);
        if (strcmp(c->bug[k].name, "adaptive_mean_over_all") == 0 &&
            !expect_mean_over_all(p, g->h->made[image].rates, &own->correct, mine, e))
            return false;
    }
    clue->view = own;
    return true;
}

/* The part of the first check of an image. */
static int part_of(const struct rubric *r, int image)
{
    int part = -1;
    for (int i = 0; i < r->num_checks && part < 0; i++)
        for (int k = 0; k < r->check[i].num_images; k++)
            part = r->check[i].images[k] == image ? r->check[i].part : part;
    return part;
}

/* part -1: at the images of all. */
static bool look(const struct grading *g, int set, int part, struct sights *out, struct err *e)
{
    forget(out);
    out->bugs = g->bugs->catalogue.num_bugs;
    for (int i = 0; i < g->r->num_images; i++)
        if ((part < 0 || part_of(g->r, i) == part) && rubric_bugs_can_observe(g, set, i) &&
            (!rubric_bugs_observe(g, set, i, &out->clue[out->num++], e) ||
             (rubric_sight_counts(g->r, i) && !expect_samples(g, set, i, out, e))))
            return false;
    return true;
}

/* Diagnoses the images (part -1: all) with the set of deviations that makes them likeliest. Tries
 * `first`, and then the others, unless `only`, or a single bug already explains the images with
 * `first`. */
static bool likeliest_set(const struct grading *g, int first, bool only, int part,
                          const struct diagnose_options *opt, struct sights *seen,
                          struct diagnosis *found, int *with, struct err *e)
{
    const struct catalogue *c = &g->bugs->catalogue;
    double best = -INFINITY;
    bool ok = true;
    for (int k = 0; ok && k < g->r->num_sets && (k == 0 || !only); k++) {
        int tried = k == 0 ? first : k <= first ? k - 1 : k;
        struct diagnosis other;
        ok = look(g, tried, part, seen, e);
        if (!ok || seen->num == 0)
            break;
        ok = diagnose(c, seen->clue, seen->num, opt, &other, e);
        bool told =
            ok && other.num_named > 0 && (!opt->pairs || k == 0 || other.candidate[0].second >= 0);
        double likelihood =
            told ? other.log_likelihood + other.candidate[0].log_likelihood : -INFINITY;
        if (!ok || (k > 0 && !(likelihood > best)))
            continue;
        /* Another set with a bug has to beat this set without one, as a bug may resemble a
         * deviation; with two bugs it has to beat this set with one, too. */
        best = told ? likelihood
                    : other.log_likelihood + (opt->pairs ? fmax(0, other.largest_lead) : 0) +
                          diagnose_bound(c, g->alpha);
        *found = other;
        *with = tried;
        only = only || (told && k == 0 && !opt->pairs);
    }
    return ok;
}

static struct diagnose_options options_of(const struct grading *g)
{
    double clip = rubric_sight_clip(g->r);
    return (struct diagnose_options){
        .alpha = g->alpha, .by_likelihood = true, .clip = isfinite(clip) ? clip : 0};
}

/* Takes the names back if one of the bugs would be seen in an image that is right. */
static bool ask_right_images(const struct grading *g, int set, const bool *right,
                             struct diagnosis *found, struct err *e)
{
    const struct catalogue *c = &g->bugs->catalogue;
    struct observation clue;
    for (int i = 0; i < g->r->num_images && found->num_named > 0; i++) {
        /* Counts follow the noise of the program, and not the bug alone. */
        if (!right[i] || rubric_sight_counts(g->r, i) || !rubric_bugs_can_observe(g, set, i))
            continue;
        if (!rubric_bugs_observe(g, set, i, &clue, e))
            return false;
        for (int k = 0; k < found->num_named; k++)
            if (diagnose_evidence(c, &clue, &found->candidate[k]).log_lead <
                -diagnose_bound(c, g->alpha))
                found->num_named = 0;
    }
    return true;
}

bool rubric_bugs_diagnose_part(const struct grading *g, int set, int part, const bool *right,
                               struct diagnosis *found, struct err *e)
{
    static const double black = 0.01; /* of the right image's mean */
    struct diagnose_options opt = options_of(g);
    struct sights *seen = calloc(1, sizeof *seen);
    *found = (struct diagnosis){0};
    if (seen == NULL)
        return err_set(e, "out of memory");
    opt.alpha /= g->r->num_parts;
    int with = set;
    bool ok = likeliest_set(g, set, false, part, &opt, seen, found, &with, e);
    for (int k = 0; k < seen->num; k++)
        if (signature_mean(&seen->clue[k].seen) <
            black * signature_mean(&seen->clue[k].view->correct))
            *found = (struct diagnosis){0};
    ok = ok && ask_right_images(g, with, right, found, e);
    forget(seen);
    free(seen);
    return ok;
}

bool rubric_bugs_diagnose(const struct grading *g, int set, const char *without,
                          struct diagnosis *found, int *with, struct err *e)
{
    struct diagnose_options opt = options_of(g);
    opt.without = without;
    struct sights *seen = calloc(1, sizeof *seen);
    *found = (struct diagnosis){0};
    *with = set;
    if (seen == NULL)
        return err_set(e, "out of memory");
    bool ok = likeliest_set(g, set, false, -1, &opt, seen, found, with, e);
    /* Two bugs at once: with the set of the single bug that was named, else with any set. */
    opt.pairs = true;
    ok = ok && likeliest_set(g, *with, found->num_named > 0, -1, &opt, seen, found, with, e);
    forget(seen);
    free(seen);
    return ok;
}

/* ---- the catalogue */

/* Signature of the correct image; for images with a check of rates, of a render that stops as the
 * program is asked to. */
static bool correct_of(const struct rubric *r, const struct answer *own, int image,
                       struct signature *out, struct err *e)
{
    bool counts = rubric_sight_counts(r, image) && own->as_asked.width > 0;
    return rubric_sight_of_render(r, image, counts, counts ? &own->as_asked : &own->m, out, e);
}

/* Effect of a bug on top of deviations: that on the image `from`, scaled in each cell by
 * to/from. */
static struct effect *derived(const struct effect *e, const struct signature *from,
                              const struct signature *to)
{
    double least = 1e-3 * signature_mean(from);
    struct effect *out = malloc(sizeof *out);
    if (out == NULL)
        return NULL;
    *out = *e;
    for (int i = 0; i < 3 * from->columns * from->rows; i++) {
        double factor = from->mean[i] > least ? to->mean[i] / from->mean[i] : 1;
        out->mean[i] = (float)(factor * (double)e->mean[i]);
        out->var[i] = (float)(factor * factor * (double)e->var[i]);
    }
    for (int f = 0; f < NUM_FACTS; f++)
        out->fact[f] += to->fact[f] - from->fact[f];
    return out;
}

/* The set to derive from: the last one with a view that is contained in this one; else 0. */
static int from_set(const struct rubric *r, const struct rubric_bugs *b, int set, int image)
{
    int from = 0;
    for (int k = 1; k < set; k++)
        if (b->view[k][image] >= 0 && strstr(r->set[set].words, r->set[k].words) != NULL)
            from = k;
    return from;
}

static bool derive_view(const struct rubric *r, const struct answer_key *a, int set, int image,
                        struct rubric_bugs *b, struct err *e)
{
    struct catalogue *c = &b->catalogue;
    struct view *more = realloc(c->view, ((size_t)c->num_views + 1) * sizeof *more);
    if (more == NULL)
        return err_set(e, "out of memory");
    c->view = more;
    struct view *v = &c->view[c->num_views];
    const struct view *plain = &c->view[b->view[from_set(r, b, set, image)][image]];
    *v = *plain;
    v->effect = calloc((size_t)c->num_bugs, sizeof(struct effect *));
    if (v->effect == NULL)
        return err_set(e, "out of memory");
    b->view[set][image] = c->num_views++;
    if (!correct_of(r, &a->of[set][image], image, &v->correct, e))
        return false;
    for (int k = 0; k < c->num_bugs; k++)
        if (plain->effect[k] != NULL &&
            (v->effect[k] = derived(plain->effect[k], &plain->correct, &v->correct)) == NULL)
            return err_set(e, "out of memory");
    return true;
}

static bool find_view(const struct rubric *r, int set, int image, struct rubric_bugs *b,
                      struct err *e)
{
    char name[128], key[65];
    if (!rubric_bugs_key(r, set, image, name, key, e))
        return false;
    const struct view *v = catalogue_view(&b->catalogue, name);
    if (v == NULL && set > 0)
        return true;
    if (v == NULL || strcmp(v->scene_sha256, key) != 0)
        return err_set(
            e,
            "%s: bugs: '%s' has no view '%s', or of another image: make rubric-bugs, or leave out 'bugs'",
            r->path, r->bugs, name);
    b->view[set][image] = (int)(v - b->catalogue.view);
    return true;
}

static bool find_views(const struct rubric *r, const struct answer_key *a, struct rubric_bugs *b,
                       struct err *e)
{
    for (int k = 0; k < r->num_sets; k++)
        for (int i = 0; i < r->num_images; i++) {
            int first = rubric_bugs_set(a, k, i);
            b->view[k][i] = k > 0 && first < k ? b->view[first][i] : -1;
            if (!rubric_bugs_sees(r, i) || first < k)
                continue;
            if ((rubric_bugs_measures(r, k) && !find_view(r, k, i, b, e)) ||
                (b->view[k][i] < 0 && !derive_view(r, a, k, i, b, e)))
                return false;
        }
    return true;
}

bool rubric_bugs_open(const struct rubric *r, const struct answer_key *a, struct rubric_bugs *out,
                      struct err *e)
{
    *out = (struct rubric_bugs){0};
    if (!catalogue_read(fs_path("%s/%s", r->dir, r->bugs).s, &out->catalogue, e))
        return false;
    if (find_views(r, a, out, e))
        return true;
    rubric_bugs_close(out);
    return false;
}

void rubric_bugs_close(struct rubric_bugs *b)
{
    catalogue_free(&b->catalogue);
    *b = (struct rubric_bugs){0};
}
