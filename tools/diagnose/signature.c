#include "signature.h"

#include "tools/stats/distributions.h"

#include <gsl/gsl_sf_psi.h>
#include <math.h>
#include <string.h>

/* Standard deviation of the change of ln(variance of a sample) with another size of pixels. */
static const double other_size = 0.35;

static bool check(const struct moments *m, int columns, struct err *e)
{
    int cell = m->width / columns;
    if (m->width % columns != 0 || m->height % cell != 0 || m->height / cell > SIGNATURE_SIDE)
        return err_set(
            e,
            "%d x %d pixels: the width has to be a multiple of %d, and the height of the "
            "%dth of the width",
            m->width, m->height, columns, columns);
    if (strcmp(m->unit, "sample") != 0 && strcmp(m->unit, "replicate") != 0)
        return err_set(e, "an image of unit '%s' does not state its error", m->unit);
    size_t pixels = (size_t)m->width * (size_t)m->height;
    for (size_t p = 0; p < pixels; p++)
        if (!(m->n[p] >= 2))
            return err_set(e, "pixel %zu has %g observations, at least 2 are needed", p, m->n[p]);
    return true;
}

static void add_pixel(const struct moments *m, size_t p, int cell_at, struct signature *s)
{
    double n = m->n[p], pixels = (double)s->cell * s->cell;
    for (int c = 0; c < 3; c++) {
        size_t i = 3 * p + (size_t)c;
        int at = 3 * cell_at + c;
        s->mean[at] += m->mean[i] / pixels;
        s->var[at] += m->m2[i] / (n * (n - 1)) / (pixels * pixels);
        if (n > 2)
            s->k3[at] += m->m3[i] / (n * (n - 1) * (n - 2)) / (pixels * pixels * pixels);
        s->spread[cell_at] += m->m2[i] / (n - 1) / pixels;
    }
}

/* Sets n and FACT_SAMPLES; all pixels have the same number of samples unless the render is adaptive. */
static void set_samples(const struct moments *m, double asked, struct signature *s)
{
    size_t pixels = (size_t)m->width * (size_t)m->height;
    double sum = 0, squares = 0;
    for (size_t p = 0; p < pixels; p++)
        sum += m->n[p];
    double mean = sum / (double)pixels;
    for (size_t p = 0; p < pixels; p++)
        squares += pow(m->n[p] - mean, 2);
    s->n = mean * s->cell * s->cell;
    for (int f = 0; f < NUM_FACTS; f++)
        s->fact[f] = s->fact_sd[f] = NAN;
    if (asked > 0) {
        s->fact[FACT_SAMPLES] = log(mean / asked);
        s->fact_sd[FACT_SAMPLES] = sqrt(squares) / (double)pixels / mean;
    }
}

bool signature_of(const struct moments *m, int columns, double asked, struct signature *out,
                  struct err *e)
{
    if (!check(m, columns, e))
        return false;
    *out = (struct signature){0};
    out->columns = columns;
    out->cell = m->width / columns;
    out->rows = m->height / out->cell;
    for (int y = 0; y < m->height; y++)
        for (int x = 0; x < m->width; x++)
            add_pixel(m, (size_t)y * (size_t)m->width + (size_t)x,
                      y / out->cell * out->columns + x / out->cell, out);
    set_samples(m, asked, out);
    return true;
}

double signature_mean(const struct signature *s)
{
    double sum[3] = {0}; /* per channel: independent chains of additions, which run in parallel */
    for (int i = 0; i < 3 * s->columns * s->rows; i += 3)
        for (int k = 0; k < 3; k++)
            sum[k] += s->mean[i + k];
    return (sum[0] + sum[1] + sum[2]) / (3 * s->columns * s->rows);
}

struct signature signature_average(const struct signature *s, int num)
{
    struct signature a = s[0];
    int cells = a.columns * a.rows;
    double variance = pow(a.fact_sd[FACT_SAMPLES], 2);
    for (int k = 1; k < num; k++) {
        for (int i = 0; i < 3 * cells; i++) {
            a.mean[i] += s[k].mean[i];
            a.var[i] += s[k].var[i];
            a.k3[i] += s[k].k3[i];
        }
        for (int i = 0; i < cells; i++)
            a.spread[i] += s[k].spread[i];
        a.n += s[k].n;
        a.fact[FACT_SAMPLES] += s[k].fact[FACT_SAMPLES];
        variance += pow(s[k].fact_sd[FACT_SAMPLES], 2);
    }
    double n = num;
    for (int i = 0; i < 3 * cells; i++) {
        a.mean[i] /= n;
        a.var[i] /= n * n;
        a.k3[i] /= n * n * n;
    }
    for (int i = 0; i < cells; i++)
        a.spread[i] /= n;
    a.fact[FACT_SAMPLES] /= n;
    a.fact_sd[FACT_SAMPLES] = sqrt(variance) / n;
    return a;
}

void signature_set_stated_error(struct signature *s, double pixels, double lo, double hi,
                                double image, int renders, double alpha)
{
    bool same = !(pixels > 0);
    s->fact[FACT_PIXELS] = same ? SIGNATURE_SAME : log(pixels);
    s->fact_sd[FACT_PIXELS] =
        same ? 0 : log(hi / lo) / (2 * stats_t_quantile(alpha / 2, renders - 1));
    /* Where all images are the same, their sums have nothing to say. The logarithm of chi^2/(K-1) has
     * the variance trigamma((K-1)/2). */
    s->fact[FACT_IMAGE] = same || !(image > 0) ? NAN : log(image);
    s->fact_sd[FACT_IMAGE] = sqrt(gsl_sf_psi_1((renders - 1) / 2.0));
}

void signature_set_spread(struct signature *s, const struct signature *correct)
{
    double sum = 0, sum_correct = 0, squares = 0;
    int cells = s->columns * s->rows;
    for (int i = 0; i < cells; i++) {
        sum += s->spread[i];
        sum_correct += correct->spread[i];
    }
    if (!(sum > 0 && sum_correct > 0)) {
        s->fact[FACT_SPREAD] = s->fact_sd[FACT_SPREAD] = NAN;
        return;
    }
    for (int i = 0; i < cells; i++)
        squares += pow(s->spread[i] - sum / sum_correct * correct->spread[i], 2);
    s->fact[FACT_SPREAD] = log(sum / sum_correct);
    s->fact_sd[FACT_SPREAD] = hypot(sqrt(squares) / sum, s->cell == correct->cell ? 0 : other_size);
}

struct signature signature_as_noisy_as(const struct signature *s, const struct signature *correct)
{
    struct signature out = *s;
    double ratio = correct->n / s->n;
    for (int i = 0; i < 3 * s->columns * s->rows; i++) {
        double var = correct->var[i] * ratio, k3 = correct->k3[i] * ratio * ratio;
        out.var[i] = fmax(out.var[i], var);
        if (fabs(k3) > fabs(out.k3[i]))
            out.k3[i] = k3;
    }
    return out;
}

bool signature_moments(const struct signature *s, struct moments *out, struct err *e)
{
    if (!moments_alloc(out, s->columns, s->rows, e))
        return false;
    double n = fmax(3, round(s->n));
    for (int i = 0; i < s->columns * s->rows; i++)
        out->n[i] = n;
    for (int i = 0; i < 3 * s->columns * s->rows; i++) {
        out->mean[i] = s->mean[i];
        out->m2[i] = s->var[i] * n * (n - 1);
        out->m3[i] = s->k3[i] * n * (n - 1) * (n - 2);
    }
    return true;
}
