#include "input_checks.h"

#include "variance_ratio.h"

#include <gsl/gsl_sort.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double floor_fraction =
    0.05; /* of the mean luminance of what the lamps of B shine upon (mean_without_lamps()) */
static const double brightest = 10; /* times that mean, as which a pixel counts there at most */
/* So many times the other side's paths show what it has missed. With fewer, the longer side's own skewness
 * keeps regions of rare events from being tested (measured: 256 times no false DIFFERENT, 1024 times half). */
static const double far_longer = 256;

static bool check_options(const struct compare_options *opt, struct err *e)
{
    if (!(opt->alpha > 0 && opt->alpha < 0.5))
        return err_set(e, "alpha is %g, must lie in (0, 0.5)", opt->alpha);
    if (!(opt->margin_global >= 0 && opt->margin_global <= opt->margin_tile &&
          opt->margin_tile < 1))
        return err_set(e, "margins %g (image) and %g (tile): must be 0 <= image <= tile < 1",
                       opt->margin_global, opt->margin_tile);
    if ((opt->margin_global == 0) != (opt->margin_tile == 0))
        return err_set(e, "margins %g (image) and %g (tile): both or none must be 0",
                       opt->margin_global, opt->margin_tile);
    if (!(opt->margin_variance >= 0) || isinf(opt->margin_variance))
        return err_set(e, "margin of the variance is %g, must be 0 or more", opt->margin_variance);
    return opt->tile >= 1 || err_set(e, "tile side is %d, must be 1 or more", opt->tile);
}

static bool check_pixel(const struct moments *m, size_t p, bool exact, struct err *e)
{
    int x = (int)(p % (size_t)m->width), y = (int)(p / (size_t)m->width);
    double n = moments_n(m, p);
    if (!(n >= (exact ? 1 : 3)) || isinf(n))
        return err_set(e, "pixel %d,%d has %g observations, at least 3 are needed", x, y, n);
    for (size_t i = 3 * p; i < 3 * p + 3; i++) {
        double mean = moments_mean(m, i), m2 = moments_m2(m, i), m3 = moments_m3(m, i);
        if (isnan(mean) || isnan(m2) || isnan(m3))
            return err_set(e, "pixel %d,%d is not a number", x, y);
        if (isinf(mean) || isinf(m2) || isinf(m3))
            return err_set(e, "pixel %d,%d is infinite", x, y);
        if (m2 < 0)
            return err_set(e, "pixel %d,%d has a negative sum of squares %g", x, y, m2);
        if (exact && m2 != 0)
            return err_set(e, "pixel %d,%d is called exact but has variance", x, y);
    }
    return true;
}

/* Checks one side and gathers what it contributes to the judge; *observed: its observations. `event`: the typical
 * brightness of an observation that matters, E[x^2]/E[x]; for something rarely seen, its brightness when seen. */
static bool check_side(const struct moments *m, struct judge *j, double *observed, struct err *e)
{
    bool exact = moments_is_exact(m), replicates = strcmp(m->unit, "replicate") == 0;
    if (strcmp(m->unit, "stratified") == 0)
        return err_set(e,
                       "its samples depend on each other (--sampler sobol), so its variance is "
                       "unknown: compare directories of 16 renders each, made with --seed 1 to 16");
    if (!exact && !replicates && !moments_noise_is_unknown(m) && strcmp(m->unit, "sample") != 0)
        return err_set(e, "unknown unit '%s' of an observation", m->unit);
    bool varies = false;
    size_t pixels = (size_t)m->width * (size_t)m->height;
    for (size_t p = 0; p < pixels; p++) {
        if (!check_pixel(m, p, exact, e))
            return false;
        double n = moments_n(m, p);
        *observed += n;
        if (!exact && n < j->n_min)
            j->n_min = n;
        for (size_t c = 0; c < 3; c++) {
            double mean = moments_mean(m, 3 * p + c), m2 = moments_m2(m, 3 * p + c);
            varies = varies || m2 > 0;
            double event = mean > 0 ? mean + m2 / (n * mean) : 0;
            if (event > j->event[c])
                j->event[c] = event;
        }
    }
    if (replicates && !varies)
        return err_set(e, "%g replicates without any variance: was the seed ignored?",
                       moments_n(m, 0));
    return true;
}

/* Refuses the same seeds on both sides: their observations are the same, so that no difference could show. */
static bool check_shared(const struct moments *a, const struct moments *b, struct err *e)
{
    if (moments_is_exact(a) || moments_is_exact(b) || moments_noise_is_unknown(a))
        return true;
    size_t pixels = (size_t)a->width * (size_t)a->height, shared = variance_ratio_shared(a, b);
    if (shared > 0)
        return err_set(
            e,
            "A and B hold the same observations in %zu of %zu pixels: rendered with the same seed, or copied?",
            shared, pixels);
    return true;
}

/* Does b hold so many more paths that it shows what a may have missed? */
static bool is_far_longer(const struct moments *b, double observed_b, const struct moments *a,
                          double observed_a)
{
    if (moments_is_exact(a) || moments_noise_is_unknown(a))
        return false;
    if (moments_is_exact(b))
        return true;
    if (a->spp > 0 && b->spp > 0)
        return observed_b * b->spp >= far_longer * observed_a * a->spp;
    return strcmp(a->unit, b->unit) == 0 && observed_b >= far_longer * observed_a;
}

/* Shares of alpha. The share of a statistic that does not apply goes to the others in proportion. What compares a pixel
 * with those around it does not apply where these share its noise.
 * This depends on options and the kind of input only: if it depended on the data, the data would
 * choose among tests. */
static void set_shares(const struct moments *a, const struct moments *b, struct judge *j)
{
    static const double part[NUM_STATISTICS] = {.25, .40, .10, .15, .10};
    bool pixels = j->width * j->height > 1, noise_a = !moments_is_exact(a);
    bool noise_b = !moments_is_exact(b), known = !moments_noise_is_unknown(a) &&
                                                 !moments_noise_is_unknown(b) &&
                                                 !(a->sharing > 1) && !(b->sharing > 1);
    bool applies[NUM_STATISTICS] = {
        [STATISTIC_IMAGE] = true,
        [STATISTIC_PYRAMID] = pixels,
        [STATISTIC_CHI_SQUARE] = pixels && known && (noise_a || noise_b),
        [STATISTIC_MATCHED_FILTER] = pixels && known && (noise_a || noise_b),
        [STATISTIC_VARIANCE] = j->opt.margin_variance > 0 && known && noise_a && noise_b,
    };
    double sum = 0;
    for (int s = 0; s < NUM_STATISTICS; s++)
        sum += applies[s] ? part[s] : 0;
    for (int s = 0; s < NUM_STATISTICS; s++)
        j->share[s] = applies[s] ? part[s] / sum : 0;
}

/* The mean of values, which it sorts, in which none counts as more than ten times that mean. Otherwise a lamp in view,
 * a thousand times as bright in one pixel of fifty, would be the unit of all that it shines upon, whose errors would
 * count for little. If much more than a tenth of the image is that bright, it is what the image shows; so is a thing
 * smaller than that before a black background. */
static double mean_without_lamps(double *value, size_t num, double sum)
{
    const double mean = sum / (double)num;
    double lit = mean, last = INFINITY;
    size_t dimmer = num;
    gsl_sort(value, 1, num);
    /* Each step may be small, and there may be hundreds: what is too bright for one is too bright for all after it. */
    while (lit < 0.99 * last) {
        const double limit = brightest * lit;
        while (dimmer > 0 && value[dimmer - 1] > limit)
            sum -= value[--dimmer];
        if (dimmer == 0 || !(value[dimmer - 1] > 0))
            return mean;
        last = lit;
        lit = (sum + limit * (double)(num - dimmer)) / (double)num;
        if (!(lit > 0))
            return last;
    }
    return lit;
}

/* *mean: of the luminance; *lit: without lamps. */
static bool mean_luminance(const struct moments *m, double *mean, double *lit, struct err *e)
{
    const size_t pixels = (size_t)m->width * (size_t)m->height;
    double *l = malloc(pixels * sizeof *l), most = 0, sum = 0;
    if (l == NULL)
        return err_set(e, "out of memory for the luminance of %zu pixels", pixels);
    for (size_t p = 0; p < pixels; p++) {
        l[p] = 0;
        for (size_t c = 0; c < 3; c++)
            l[p] += luminance_weight[c] * moments_mean(m, 3 * p + c);
        most = fmax(most, l[p]);
        sum += l[p];
    }
    *mean = *lit = sum / (double)pixels;
    if (*mean > 0 && most > brightest * *mean)
        *lit = mean_without_lamps(l, pixels, sum);
    free(l);
    return true;
}

bool input_checks_run(const struct moments *a, const struct moments *b,
                      const struct compare_options *opt, struct judge *j, struct err *e)
{
    if (a->width != b->width || a->height != b->height)
        return err_set(e, "A is %d x %d pixels, B is %d x %d", a->width, a->height, b->width,
                       b->height);
    if (!check_options(opt, e))
        return false;
    *j = (struct judge){.opt = *opt, .width = a->width, .height = a->height, .n_min = INFINITY};
    j->is_pooled = moments_noise_is_unknown(a);
    j->exact[0] = moments_is_exact(a);
    j->exact[1] = moments_is_exact(b);
    set_shares(a, b, j);
    double observed[2] = {0, 0};
    if (!check_side(a, j, &observed[0], e))
        return err_prefix(e, "A");
    if (!check_side(b, j, &observed[1], e))
        return err_prefix(e, "B");
    j->may_miss[0] = !opt->is_paired && is_far_longer(b, observed[1], a, observed[0]);
    j->may_miss[1] = !opt->is_paired && is_far_longer(a, observed[0], b, observed[1]);
    if (!check_shared(a, b, e))
        return false;
    for (int c = 0; c < 3; c++)
        j->event[CHANNEL_LUMINANCE] += luminance_weight[c] * j->event[c];
    if (!mean_luminance(b, &j->mean_b, &j->floor, e))
        return false;
    j->floor *= floor_fraction;
    return j->mean_b > 0 || err_set(e, "B is black: relative differences have no unit");
}
