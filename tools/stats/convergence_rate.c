#include "convergence_rate.h"

#include "distributions.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The darkest unit, as a share of the reference's mean; as in input_checks.c. */
#define DARK_SHARE 0.05

void convergence_rate_reference_free(struct converge_reference *r)
{
    free(r->unit);
    free(r->mean);
    free(r->var);
    *r = (struct converge_reference){0};
}

/* Mean and variance of value c of the small image's pixel (x, y), a mean over shrink x shrink
 * pixels; *n is the smallest count of observations among them. */
static bool box_value(const struct moments *m, int shrink, int x, int y, int c, double *mean,
                      double *var, double *n, struct err *e)
{
    double area = (double)shrink * shrink;
    *mean = *var = 0;
    *n = INFINITY;
    for (int j = y * shrink; j < (y + 1) * shrink; j++)
        for (int i = x * shrink; i < (x + 1) * shrink; i++) {
            size_t p = (size_t)j * (size_t)m->width + (size_t)i;
            double v = moments_var_of_mean(m, p, c);
            if (!isfinite(v))
                return err_set(e, "the reference does not tell its own noise at pixel %d,%d", i, j);
            *mean += m->mean[3 * p + (size_t)c] / area;
            *var += v / (area * area);
            *n = fmin(*n, m->n[p]);
        }
    return true;
}

bool convergence_rate_reference_init(struct converge_reference *r, const struct moments *m,
                                     int shrink, struct err *e)
{
    assert(shrink > 0);
    if (m->width % shrink != 0 || m->height % shrink != 0)
        return err_set(e, "an image of %d x %d pixels cannot be made %d times smaller", m->width,
                       m->height, shrink);
    if (m->sharing > 1 && shrink > 1)
        return err_set(e, "an image whose pixels share samples cannot be made smaller");
    /* Such moments have variances that are larger by this factor than those of their pixels. */
    const double sharing = fmax(1, m->sharing);
    int width = m->width / shrink, height = m->height / shrink;
    size_t size = 3 * (size_t)width * (size_t)height;
    *r = (struct converge_reference){.size = size};
    r->unit = malloc(size * sizeof *r->unit);
    r->mean = malloc(size * sizeof *r->mean);
    r->var = malloc(size * sizeof *r->var);
    double *n = malloc(size * sizeof *n), scale = 0;
    if (r->unit == NULL || r->mean == NULL || r->var == NULL || n == NULL) {
        err_set(e, "out of memory for the reference");
        goto fail;
    }
    for (size_t i = 0; i < size; i++) {
        size_t p = i / 3;
        if (!box_value(m, shrink, (int)(p % (size_t)width), (int)(p / (size_t)width), (int)(i % 3),
                       &r->mean[i], &r->var[i], &n[i], e))
            goto fail;
        scale += r->mean[i] / (double)size;
    }
    if (!(scale > 0)) {
        err_set(e, "the reference is black");
        goto fail;
    }
    double pixel_sd = 0;
    for (size_t i = 0; i < size; i++) {
        r->unit[i] = fmax(r->mean[i], DARK_SHARE * scale);
        r->mean[i] /= r->unit[i];
        r->var[i] /= r->unit[i] * r->unit[i] * sharing;
        r->noise += r->var[i] / (double)size;
        /* (mean - truth)^2 scatters by 2 v^2, the estimate of v by 2 v^2/(n-1). */
        if (r->var[i] > 0)
            pixel_sd += r->var[i] * sqrt(2 + 2 / (n[i] - 1));
        if (i % 3 == 2) {
            r->noise_var += sharing * pixel_sd * pixel_sd / ((double)size * (double)size);
            pixel_sd = 0;
        }
    }
    free(n);
    return true;
fail:
    free(n);
    convergence_rate_reference_free(r);
    return false;
}

struct interval estimate_interval(struct estimate x, double alpha)
{
    if (!(x.se < INFINITY))
        return (struct interval){-INFINITY, INFINITY};
    double t = stats_t_quantile(alpha / 2, x.dof);
    return (struct interval){x.value - t * x.se, x.value + t * x.se};
}

/* Standard error of an estimate from its values without each of the n observations. */
static double jackknife_se(const double *without, int n)
{
    double mean = 0, sum = 0;
    for (int k = 0; k < n; k++)
        mean += without[k] / n;
    for (int k = 0; k < n; k++)
        sum += (without[k] - mean) * (without[k] - mean);
    return sqrt((n - 1.0) / n * sum);
}

/* An estimate from n replicates and, independently of them, from something whose variance is known. */
static struct estimate with_variance(double value, double se, int n, double more)
{
    double v = se * se, dof = stats_dof(v + more, 2 * v * v / (n - 1));
    return (struct estimate){value, sqrt(v + more), dof};
}

static bool check_distinct(const float *images, int count, size_t size, struct err *e)
{
    for (int k = 1; k < count; k++)
        for (int j = 0; j < k; j++)
            if (memcmp(images + (size_t)j * size, images + (size_t)k * size,
                       size * sizeof *images) == 0)
                return err_set(e, "replicates %d and %d are the same image: the seed has no effect",
                               j, k);
    return true;
}

/* Sums over the values of a rung's images: |x_k - r|^2, |x_k - m|^2 and (x_k - r)(m - r) of each
 * replicate, |m - r|^2 of their mean. */
struct sums {
    double *to_ref, *to_mean, *along;
    double mean_to_ref;
    double cross; /* variance of 2 (bias x error of the reference), channels fully correlated */
};

static void add_sums(struct sums *s, const float *images, int count,
                     const struct converge_reference *ref)
{
    double pixel_sd = 0;
    for (size_t i = 0; i < ref->size; i++) {
        double m = 0;
        for (int k = 0; k < count; k++)
            m += (double)images[(size_t)k * ref->size + i] / (count * ref->unit[i]);
        double d = m - ref->mean[i];
        s->mean_to_ref += d * d;
        for (int k = 0; k < count; k++) {
            double x = images[(size_t)k * ref->size + i] / ref->unit[i], dx = x - ref->mean[i];
            s->to_ref[k] += dx * dx;
            s->to_mean[k] += (x - m) * (x - m);
            s->along[k] += dx * d;
        }
        pixel_sd += 2 * fabs(d) * sqrt(ref->var[i]);
        if (i % 3 == 2) {
            s->cross += pixel_sd * pixel_sd;
            pixel_sd = 0;
        }
    }
}

/* The three estimates, each with all replicates and without each of them. */
static bool estimate_rung(const struct sums *s, int count, const struct converge_reference *ref,
                          double *without, struct rung *out, struct err *e)
{
    double K = count, N = (double)ref->size, to_ref = 0, to_mean = 0;
    for (int k = 0; k < count; k++) {
        to_ref += s->to_ref[k];
        to_mean += s->to_mean[k];
    }
    double more = ref->noise_var + s->cross / (N * N);
    if (!(to_mean > 0))
        return err_set(e, "no noise at all: there is nothing that could converge");

    for (int k = 0; k < count; k++) {
        /* The mean of the others is m - (x_k - m)/(K-1). */
        double left = to_mean - K / (K - 1) * s->to_mean[k];
        if (!(left > 0))
            return err_set(e, "only replicate %d has any noise", k);
        without[k] = log(left / (N * (K - 2)));
    }
    out->log_variance =
        (struct estimate){log(to_mean / (N * (K - 1))), jackknife_se(without, count), K - 1};

    double mse = to_ref / (N * K) - ref->noise;
    for (int k = 0; k < count; k++) {
        double left = (to_ref - s->to_ref[k]) / (N * (K - 1)) - ref->noise;
        if (!(left > 0) || !(mse > 0))
            return err_set(e, "the reference is noisier than this image: its RMS noise is %.3g %%",
                           100 * sqrt(ref->noise));
        without[k] = log(left);
    }
    out->log_mse = with_variance(log(mse), jackknife_se(without, count), count, more / (mse * mse));

    /* |sum of x_k - r|^2 = K^2 |m - r|^2; without one of them, by the binomial formula. */
    double all = K * K * s->mean_to_ref;
    for (int k = 0; k < count; k++) {
        double pairs = all - 2 * K * s->along[k] + s->to_ref[k] - (to_ref - s->to_ref[k]);
        without[k] = pairs / (N * (K - 1) * (K - 2)) - ref->noise;
    }
    out->bias2 = with_variance((all - to_ref) / (N * K * (K - 1)) - ref->noise,
                               jackknife_se(without, count), count, more);
    return true;
}

bool convergence_rate_rung(const float *images, int count, double spp,
                           const struct converge_reference *ref, struct rung *out, struct err *e)
{
    assert(count >= 3);
    if (!check_distinct(images, count, ref->size, e))
        return false;
    double *buffer = calloc(4 * (size_t)count, sizeof *buffer);
    if (buffer == NULL)
        return err_set(e, "out of memory");
    struct sums s = {
        .to_ref = buffer, .to_mean = buffer + count, .along = buffer + 2 * (size_t)count};
    *out = (struct rung){.spp = spp, .replicates = count};
    add_sums(&s, images, count, ref);
    bool ok = estimate_rung(&s, count, ref, buffer + 3 * (size_t)count, out, e);
    free(buffer);
    return ok;
}

/* The coefficient of rung i's ln MSE in the slope. */
static double slope_coefficient(const struct rung *rung, int num, int i)
{
    double mean_v = 0, sw = 0, sx = 0, sxx = 0;
    for (int k = 0; k < num; k++)
        mean_v += rung[k].log_mse.se * rung[k].log_mse.se / num;
    for (int k = 0; k < num; k++) {
        double w = 1 / (rung[k].log_mse.se * rung[k].log_mse.se + mean_v);
        sw += w;
        sx += w * log(rung[k].spp);
    }
    for (int k = 0; k < num; k++) {
        double w = 1 / (rung[k].log_mse.se * rung[k].log_mse.se + mean_v);
        sxx += w * pow(log(rung[k].spp) - sx / sw, 2);
    }
    double se = rung[i].log_mse.se, w = 1 / (se * se + mean_v);
    /* 1/2: ln RMSE is half of ln MSE. */
    return 0.5 * w * (log(rung[i].spp) - sx / sw) / sxx;
}

struct estimate convergence_rate_slope(const struct rung *rung, int num)
{
    assert(num >= 2);
    double slope = 0, v = 0, dof = INFINITY;
    for (int i = 0; i < num; i++) {
        double c = slope_coefficient(rung, num, i), se = rung[i].log_mse.se;
        slope += c * rung[i].log_mse.value;
        v += c * c * se * se;
        dof = fmin(dof, rung[i].log_mse.dof);
    }
    return (struct estimate){slope, sqrt(v), dof};
}

double convergence_rate_slope_dof(const struct rung *rung, int num)
{
    double v = 0, var = 0;
    for (int i = 0; i < num; i++) {
        double one = pow(slope_coefficient(rung, num, i) * rung[i].log_mse.se, 2);
        v += one;
        var += 2 * one * one / rung[i].log_mse.dof;
    }
    return stats_dof(v, var);
}

enum verdict convergence_rate_slope_verdict(struct estimate slope, double alpha, double half_width)
{
    struct interval i = estimate_interval(slope, alpha);
    if (i.lo > -0.5 || i.hi < -0.5)
        return VERDICT_DIFFERENT;
    return (i.hi - i.lo) / 2 > half_width ? VERDICT_INCONCLUSIVE : VERDICT_EQUIVALENT;
}

enum verdict convergence_rate_slope_at_most(struct estimate slope, double alpha, double half_width)
{
    struct interval i = estimate_interval(slope, alpha);
    if (i.lo > -0.5)
        return VERDICT_DIFFERENT;
    return i.hi > -0.5 + half_width ? VERDICT_INCONCLUSIVE : VERDICT_EQUIVALENT;
}

struct interval convergence_rate_floor(const struct rung *r, double alpha)
{
    struct interval i = estimate_interval(r->bias2, 2 * alpha);
    return (struct interval){sqrt(fmax(0, i.lo)), sqrt(fmax(0, i.hi))};
}

enum verdict convergence_rate_floor_verdict(const struct rung *r, double margin, double alpha)
{
    struct interval i = convergence_rate_floor(r, alpha);
    if (i.lo > margin)
        return VERDICT_DIFFERENT;
    return i.hi <= margin ? VERDICT_EQUIVALENT : VERDICT_INCONCLUSIVE;
}

struct estimate convergence_rate_log_ratio(const struct rung *a, const struct rung *b)
{
    double va = a->log_variance.se * a->log_variance.se;
    double vb = b->log_variance.se * b->log_variance.se;
    return (struct estimate){a->log_variance.value - b->log_variance.value, sqrt(va + vb),
                             stats_welch_dof(va, a->replicates, vb, b->replicates)};
}

struct cost convergence_rate_cost(const struct rung *rung, int num)
{
    assert(num >= 2);
    double sw = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, rest = 0;
    for (int i = 0; i < num; i++) {
        double w = 1 / (rung[i].cpu_s * rung[i].cpu_s);
        sw += w;
        sx += w * rung[i].spp;
        sy += w * rung[i].cpu_s;
    }
    double mx = sx / sw, my = sy / sw;
    for (int i = 0; i < num; i++) {
        double w = 1 / (rung[i].cpu_s * rung[i].cpu_s), dx = rung[i].spp - mx;
        sxx += w * dx * dx;
        sxy += w * dx * (rung[i].cpu_s - my);
    }
    double b = sxy / sxx, a = my - b * mx;
    for (int i = 0; i < num; i++)
        rest += pow((rung[i].cpu_s - a - b * rung[i].spp) / rung[i].cpu_s, 2);
    double se = num > 2 ? sqrt(rest / (num - 2) / sxx) : INFINITY;
    return (struct cost){a, {b, se, num > 2 ? num - 2 : 1}};
}

struct estimate convergence_rate_log_efficiency(const struct rung *r, const struct cost *c)
{
    double b = c->per_spp.value;
    if (!(b > 0))
        return (struct estimate){NAN, INFINITY, 1};
    double vv = r->log_variance.se * r->log_variance.se, vt = pow(c->per_spp.se / b, 2);
    double var = 2 * vv * vv / r->log_variance.dof + 2 * vt * vt / c->per_spp.dof;
    return (struct estimate){-r->log_variance.value - log(b * r->spp), sqrt(vv + vt),
                             vt < INFINITY ? stats_dof(vv + vt, var) : 1};
}
