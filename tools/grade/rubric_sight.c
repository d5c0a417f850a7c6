#include "rubric_sight.h"

#include "tools/images/tone_curve.h"
#include "tools/submission/rate_image.h"

#include <gsl/gsl_cdf.h>
#include <gsl/gsl_randist.h>
#include <gsl/gsl_sort.h>
#include <gsl/gsl_statistics_double.h>
#include <math.h>

const double rubric_sight_masked = 1e6;
/* Standard error of the mean of clipped noise, as a share of the clipping point: a program's noise
 * differs from ours. */
static const double clip_error = 0.02;
/* A rate image is not used if more than this share of its pixels stands for no whole number of
 * batches. */
static const double most_odd = 0.05;

static const struct rubric_check *rates_check(const struct rubric *r, int image)
{
    for (int i = 0; i < r->num_checks; i++)
        if (r->check[i].kind == CHECK_RATES && r->check[i].images[0] == image)
            return &r->check[i];
    return NULL;
}

bool rubric_sight_counts(const struct rubric *r, int image)
{
    return rates_check(r, image) != NULL;
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

double rubric_sight_clip(const struct rubric *r)
{
    struct curve curve;
    struct err ignored;
    double lo, hi;
    if (!tone_curve_parse(r->curve, &curve, &ignored)) /* cannot fail: the rubric was checked */
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

bool rubric_sight_of_render(const struct rubric *r, int image, bool as_asked,
                            const struct moments *m, struct signature *out, struct err *e)
{
    const struct rubric_image *p = &r->image[image];
    bool counts = as_asked && rubric_sight_counts(r, image);
    double clip = rubric_sight_clip(r), sum = 0, squares = 0, pixels = (double)p->width * p->height;
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

/* Sums over the pixels of a cell, in one channel. */
struct seen {
    double sum, square, rounding, tolerance; /* of the differences from the reference */
    bool clipped, masked;
};

static void fill_cells(const struct rubric *r, const struct submitted_image *s,
                       const struct moments *m, double clip, struct signature *out,
                       struct seen *cells)
{
    for (size_t i = 0; i < (size_t)s->width * (size_t)s->height; i++)
        for (size_t c = 0; c < 3; c++) {
            size_t k = 3 * i + c, j = cell_at(out, i) + c;
            double right = fmin(m->mean[k], clip);
            double value = fmin(s->mean[k], clip);
            cells[j].masked |= rubric_masks(r, s->width, s->height, i);
            out->mean[j] += value / (out->cell * out->cell);
            cells[j].sum += value - right;
            cells[j].square += pow(value - right, 2);
            cells[j].rounding += s->rounding[k];
            cells[j].tolerance += s->tolerance[k];
            cells[j].clipped |= value >= clip || right >= clip;
        }
}

/* Variance of its pixels over that of ours, at least 1: the median over cells, as a bug also
 * scatters the pixels of a cell. */
static double noise_of(const struct signature *s, const struct signature *correct,
                       const struct seen *cells)
{
    double ratio[SIGNATURE_VALUES], pixels = (double)s->cell * s->cell;
    size_t num = 0;
    for (int j = 0; j < 3 * s->columns * s->rows; j++) {
        double ours = correct->var[j] * correct->n / s->n * pixels,
               rounding = cells[j].rounding / pixels;
        double scatter = (cells[j].square - cells[j].sum * cells[j].sum / pixels) / (pixels - 1);
        if (ours > 2 * rounding && ours > 0 && !cells[j].masked)
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

static bool count_samples(const struct rubric *r, int image, const struct answer *right,
                          const struct made *made, struct signature *s, struct err *e)
{
    const struct rubric_image *p = &r->image[image];
    struct rate_image rates;
    struct err why;
    if (!rate_image_read(made->rates, p, rates_check(r, image)->batch, &right->as_asked, &rates,
                         &why)) /* its check has said so */
        return !err_is_of_memory(&why) || err_set(e, "%s", why.msg);
    if (rates.odd > most_odd * rates.pixels) /* its counts are not credible */
        return true;
    s->fact[FACT_SAMPLES] = log(rates.mean / p->spp);
    s->fact_sd[FACT_SAMPLES] = rates.sd;
    return true;
}

bool rubric_sight_of_student(const struct rubric *r, int image, const struct submitted_images *h,
                             const struct answer *right, const struct signature *correct,
                             struct signature *out, struct err *e)
{
    const struct submitted_image *s = &h->image[image];
    struct seen cells[SIGNATURE_VALUES] = {0};
    if (!start(&r->image[image], out, e))
        return false;
    double clip = rubric_sight_clip(r), pixels = (double)out->cell * out->cell;
    if (s->spp > 0) /* of several runs */
        out->n = s->spp * pixels;
    fill_cells(r, s, &right->m, clip, out, cells);
    double kappa = noise_of(out, correct, cells);
    for (int j = 0; j < 3 * out->columns * out->rows; j++) {
        double noise = kappa * correct->var[j] * correct->n / out->n;
        out->var[j] = noise + cells[j].rounding / (pixels * pixels) +
                      pow(bias_of_codes(cells[j].tolerance / pixels, noise * pixels), 2) +
                      (cells[j].clipped ? pow(clip_error * clip, 2) : 0);
        if (cells[j].masked) {
            out->mean[j] = correct->mean[j];
            out->var[j] = rubric_sight_masked;
        }
    }
    return !rubric_sight_counts(r, image) ||
           count_samples(r, image, right, &h->made[image], out, e);
}
