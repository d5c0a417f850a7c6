#include "rubric_bugs.h"

#include "renderer/base/fs.h"
#include "renderer/base/sha256.h"
#include "tools/diagnose/bug_fit.h"
#include "tools/images/tone_curve.h"
#include "rate_image.h"

#include <gsl/gsl_cdf.h>
#include <gsl/gsl_randist.h>
#include <gsl/gsl_sort.h>
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* How well the mean of noise that is cut off is known where a program is noisier than ours: of the clipping point. */
static const double clip_error = 0.02;

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

static const struct rubric_check *rates_check(const struct rubric *r, int image)
{
    for (int i = 0; i < r->num_checks; i++)
        if (r->check[i].kind == CHECK_RATES && r->check[i].images[0] == image)
            return &r->check[i];
    return NULL;
}

bool rubric_bugs_counts(const struct rubric *r, int image)
{
    return rates_check(r, image) != NULL;
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

bool rubric_bugs_key(const struct rubric *r, int image, int set, char name[128], char key[65],
                     struct err *e)
{
    const struct rubric_image *p = &r->image[image];
    char text[4096], path[8192], scene[65], environment[65] = "";
    snprintf(name, 128, set > 0 ? "%s@%.70s" : "%s", p->name, r->set[set].name);
    for (char *c = strstr(name, ", "); c != NULL; c = strstr(c, ", ")) {
        *c = '+';
        memmove(c + 1, c + 2, strlen(c + 2) + 1);
    }
    if (p->suite != NULL)
        snprintf(path, sizeof path, "%s", p->suite->dae);
    else
        snprintf(path, sizeof path, "%s/%s", r->dir, p->scene);
    if (!sha256_file(path, scene, e))
        return false;
    snprintf(path, sizeof path, "%s/%s", r->dir, p->environment);
    if (p->environment[0] != '\0' && !sha256_file(path, environment, e))
        return false;
    const char *options = p->reference_options[0] != '\0' ? p->reference_options : p->options;
    snprintf(text, sizeof text, "%s %s %s %d %d %d %d %d %s %s %s", r->curve, scene, environment,
             p->width, p->height, p->spp, p->lights, p->bounces, options,
             rubric_bugs_counts(r, image) ? p->options : "", r->set[set].words);
    sha256_text(text, key);
    return true;
}

/* The side of a cell: the smallest that makes at most SIGNATURE_SIDE of them each way. */
static int cell_of(const struct rubric_image *p)
{
    int longer = p->width > p->height ? p->width : p->height;
    int cell = (longer + SIGNATURE_SIDE - 1) / SIGNATURE_SIDE;
    while (cell < longer && (p->width % cell != 0 || p->height % cell != 0))
        cell++;
    return cell;
}

static bool start(const struct rubric_image *p, struct signature *s, struct err *e)
{
    *s = (struct signature){.cell = cell_of(p)};
    if (p->width % s->cell != 0 || p->height % s->cell != 0)
        return err_set(e, "image '%s': %d x %d is not of whole cells, at most %d each way", p->name,
                       p->width, p->height, SIGNATURE_SIDE);
    s->columns = p->width / s->cell;
    s->rows = p->height / s->cell;
    s->n = (double)p->spp * s->cell * s->cell;
    for (int f = 0; f < NUM_FACTS; f++)
        s->fact[f] = s->fact_sd[f] = NAN;
    return true;
}

/* The first of the three values of the cell that pixel p lies in. */
static size_t cell_at(const struct signature *s, size_t p)
{
    size_t width = (size_t)s->columns * (size_t)s->cell, cell = (size_t)s->cell;
    return 3 * (p / width / cell * (size_t)s->columns + p % width / cell);
}

double rubric_bugs_clip(const struct rubric *r)
{
    struct curve curve;
    struct err ignored;
    double lo, hi;
    if (!tone_curve_parse(r->curve, &curve, &ignored)) /* looked at with the rubric */
        return INFINITY;
    tone_curve_bin(&curve, 255, 255, &lo, &hi);
    return lo;
}

/* E[min(X, clip)] of a normal X. */
static double clipped_mean(double mean, double sd, double clip)
{
    double z = sd > 0 ? (clip - mean) / sd : mean < clip ? INFINITY : -INFINITY;
    if (fabs(z) > 8)
        return fmin(mean, clip);
    return clip - sd * (z * gsl_cdf_ugaussian_P(z) + gsl_ran_ugaussian_pdf(z));
}

bool rubric_bugs_sight(const struct rubric *r, int image, const struct moments *m,
                       struct signature *out, struct err *e)
{
    const struct rubric_image *p = &r->image[image];
    bool counts = rubric_bugs_counts(r, image);
    double clip = rubric_bugs_clip(r), sum = 0, squares = 0, pixels = (double)p->width * p->height;
    if (!start(p, out, e))
        return false;
    if (m->width != p->width || m->height != p->height)
        return err_set(e, "image '%s': a render of %d x %d pixels", p->name, m->width, m->height);
    double area = (double)out->cell * out->cell;
    for (size_t i = 0; i < (size_t)pixels; i++) {
        double taken = m->n[i] * fmax(1, m->spp);
        sum += taken;
        squares += taken * taken;
        for (size_t c = 0; c < 3; c++) {
            size_t k = 3 * i + c;
            double sd = submitted_image_expected_sd(m, k, counts ? taken : p->spp);
            double below = sd > 0 ? gsl_cdf_ugaussian_P((clip - m->mean[k]) / sd) : 1;
            out->mean[cell_at(out, i) + c] += clipped_mean(m->mean[k], sd, clip) / area;
            out->var[cell_at(out, i) + c] +=
                sd * sd * (counts ? 1 : p->spp / taken) * below / (area * area);
        }
    }
    double taken = sum / pixels;
    if (!counts) {
        out->n = taken * area;
    } else {
        out->fact[FACT_SAMPLES] = log(taken / p->spp);
        out->fact_sd[FACT_SAMPLES] =
            sqrt(fmax(0, squares / pixels - taken * taken) / pixels) / taken;
    }
    return true;
}

/* ---- a student's image */

/* What a cell of it says. */
struct seen {
    double sum, square, rounding, tolerance; /* of the differences from the reference */
    bool clipped;
};

/* Pixels that are masked are taken to be right. */
static void fill_cells(const struct rubric *r, const struct submitted_image *s,
                       const struct moments *m, double clip, struct signature *out,
                       struct seen *cells)
{
    for (size_t i = 0; i < (size_t)s->width * (size_t)s->height; i++)
        for (size_t c = 0; c < 3; c++) {
            size_t k = 3 * i + c, j = cell_at(out, i) + c;
            double right = fmin(m->mean[k], clip);
            double value = rubric_masks(r, s->width, s->height, i) ? right : fmin(s->mean[k], clip);
            out->mean[j] += value / (out->cell * out->cell);
            cells[j].sum += value - right;
            cells[j].square += pow(value - right, 2);
            cells[j].rounding += s->rounding[k];
            cells[j].tolerance += s->tolerance[k];
            cells[j].clipped |= value >= clip || right >= clip;
        }
}

/* The variance of its pixels over that of ours: the median over the cells, as a bug makes pixels of one cell differ too. */
static double noise_of(const struct signature *s, const struct signature *correct,
                       const struct seen *cells)
{
    double ratio[SIGNATURE_VALUES], pixels = (double)s->cell * s->cell;
    size_t num = 0;
    for (int j = 0; j < 3 * s->columns * s->rows; j++) {
        double ours = correct->var[j] * correct->n / s->n * pixels,
               rounding = cells[j].rounding / pixels;
        double scatter = (cells[j].square - cells[j].sum * cells[j].sum / pixels) / (pixels - 1);
        if (ours > 2 * rounding && ours > 0)
            ratio[num++] = (scatter - rounding) / ours;
    }
    if (num < 10)
        return 1;
    gsl_sort(ratio, 1, num);
    return fmax(1, gsl_stats_median_from_sorted_data(ratio, 1, num));
}

/* By how much the mean of rounded values may be off: half a bin where all are the same; noise of variance v dithers
 * it away by exp(-2 pi^2 v / bin^2). */
static double bias_of_codes(double half_bin, double v)
{
    return half_bin > 0 ? half_bin * exp(-M_PI * M_PI * v / (2 * half_bin * half_bin)) : 0;
}

static bool sight_of_student(const struct rubric *r, int image, const struct submitted_image *s,
                             const struct moments *m, const struct signature *correct,
                             struct signature *out, struct err *e)
{
    struct seen cells[SIGNATURE_VALUES] = {0};
    if (!start(&r->image[image], out, e))
        return false;
    double clip = rubric_bugs_clip(r), pixels = (double)out->cell * out->cell;
    fill_cells(r, s, m, clip, out, cells);
    double kappa = noise_of(out, correct, cells);
    for (int j = 0; j < 3 * out->columns * out->rows; j++) {
        double noise = kappa * correct->var[j] * correct->n / out->n;
        out->var[j] = noise + cells[j].rounding / (pixels * pixels) +
                      pow(bias_of_codes(cells[j].tolerance / pixels, noise * pixels), 2) +
                      (cells[j].clipped ? pow(clip_error * clip, 2) : 0);
    }
    return true;
}

static bool count_samples(const struct rubric *r, int image, const struct answer_key *a,
                          const struct made *made, struct signature *s, struct err *e)
{
    const struct rubric_image *p = &r->image[image];
    struct rate_image rates;
    struct err why;
    if (made->rates[0] == '\0')
        return true;
    if (!rate_image_read(made->rates, p->width, p->height, p->spp, rates_check(r, image)->batch,
                         a->of[0][image].as_asked.n, &rates, &why)) /* its check has said so */
        return !err_is_of_memory(&why) || err_set(e, "%s", why.msg);
    s->fact[FACT_SAMPLES] = log(rates.mean / p->spp);
    s->fact_sd[FACT_SAMPLES] = rates.sd;
    return true;
}

bool rubric_bugs_can_observe(const struct rubric_bugs *b, const struct submitted_images *h, int set,
                             int image)
{
    return b->view[set][image] >= 0 && h->image[image].mean != NULL;
}

bool rubric_bugs_observe(const struct rubric_bugs *b, const struct rubric *r,
                         const struct answer_key *a, const struct submitted_images *h, int set,
                         int image, struct observation *out, struct err *e)
{
    const struct view *v = &b->catalogue.view[b->view[set][image]];
    const struct answer *answer = &a->of[rubric_bugs_set(a, set, image)][image];
    *out = (struct observation){.view = v, .is_consistent = true};
    return sight_of_student(r, image, &h->image[image], &answer->m, &v->correct, &out->seen, e) &&
           (!rubric_bugs_counts(r, image) ||
            count_samples(r, image, a, &h->made[image], &out->seen, e));
}

static bool look(const struct rubric_bugs *b, const struct rubric *r, const struct answer_key *a,
                 const struct submitted_images *h, int set, struct observation *clue, int *num,
                 struct err *e)
{
    *num = 0;
    for (int i = 0; i < r->num_images; i++)
        if (rubric_bugs_can_observe(b, h, set, i) &&
            !rubric_bugs_observe(b, r, a, h, set, i, &clue[(*num)++], e))
            return false;
    return true;
}

bool rubric_bugs_diagnose(const struct rubric_bugs *b, const struct rubric *r,
                          const struct answer_key *a, const struct submitted_images *h, int set,
                          double alpha, const char *without, struct diagnosis *found, int *with,
                          struct err *e)
{
    double clip = rubric_bugs_clip(r);
    struct diagnose_options opt = {.alpha = alpha,
                                   .without = without,
                                   .by_likelihood = true,
                                   .clip = isfinite(clip) ? clip : 0};
    struct observation *clue = calloc((size_t)r->num_images, sizeof *clue);
    bool ok = clue != NULL || err_set(e, "out of memory");
    double best = -INFINITY;
    *found = (struct diagnosis){0};
    *with = set;
    for (int k = 0; ok && k < r->num_sets && !(*with == set && found->num_named > 0); k++) {
        int num, tried = k == 0 ? set : k <= set ? k - 1 : k; /* `set` first */
        struct diagnosis other;
        ok = look(b, r, a, h, tried, clue, &num, e);
        if (!ok || num == 0)
            break;
        ok = diagnose(&b->catalogue, clue, num, &opt, &other, e);
        double likelihood = ok && other.num_named > 0
                                ? other.log_likelihood + other.candidate[0].log_likelihood
                                : -INFINITY;
        if (ok && (k == 0 || likelihood > best)) {
            /* Other deviations with a bug have to be likelier than these with none: a bug may be such a deviation. */
            best =
                k == 0 ? other.log_likelihood + diagnose_bound(&b->catalogue, alpha) : likelihood;
            *found = other;
            *with = tried;
        }
    }
    if (ok && (found->num_named == 0 || found->candidate[0].excess > bug_fit_largest_excess)) {
        int num;
        opt.pairs = true;
        ok = look(b, r, a, h, *with, clue, &num, e) &&
             (num == 0 || diagnose(&b->catalogue, clue, num, &opt, found, e));
    }
    free(clue);
    return ok;
}

/* ---- the catalogue */

static bool find_views(const struct rubric *r, const struct answer_key *a, struct rubric_bugs *b,
                       struct err *e)
{
    for (int k = 0; k < r->num_sets; k++)
        for (int i = 0; i < r->num_images; i++) {
            char name[128], key[65];
            int first = rubric_bugs_set(a, k, i);
            b->view[k][i] = -1;
            if (!rubric_bugs_sees(r, i) || (first > 0 && r->set[first].words[0] == '\0'))
                continue; /* or a deviation that renders of ours cannot have */
            if (!rubric_bugs_key(r, i, first, name, key, e))
                return false;
            const struct view *v = catalogue_view(&b->catalogue, name);
            if (v == NULL || strcmp(v->scene_sha256, key) != 0)
                return err_set(
                    e,
                    "%s: bugs: '%s' has no view '%s', or of another image: make rubric-bugs, or leave out 'bugs'",
                    r->path, r->bugs, name);
            b->view[k][i] = (int)(v - b->catalogue.view);
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
