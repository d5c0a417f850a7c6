#include "region.h"

#include "tools/stats/distributions.h"

#include <gsl/gsl_poly.h>
#include <math.h>
#include <stdio.h>

static const double skew_limit = 0.2;       /* skewness factor, in ln p, up to which a p is used as it is */
static const double skew_limit_raised = 4;  /* the same where p is raised by it */
static const double largest_gx = 0.3;       /* limit of |g| x there, as the next term has (g x)^2 */
static const double skew_limit_widened = 1; /* the same where an interval's tail is lowered by it */
static const double skew_limit_scaled = 32; /* the same where the interval is scaled by it, too */
static const double least_dof = 0.2;        /* below, the end of an interval is beyond any double */
static const double largest_t = 1e9;
const double region_smallest_log10_p = -1e6;
const double region_mdb_none = 1e6;
const char *const channel_name[NUM_CHANNELS] = {"red", "green", "blue", "luminance"};

static bool is_image(const struct judge *j, struct rect r)
{
    return r.width == j->width && r.height == j->height;
}

static double clipped_area(double side, const struct judge *j)
{
    return fmin(side, j->width) * fmin(side, j->height);
}

/* margin_global for the image, margin_tile up to a tile, between them linear in the logarithm of
 * the area. */
static double margin_of(const struct judge *j, struct rect r)
{
    const struct compare_options *opt = &j->opt;
    if (is_image(j, r))
        return opt->margin_global;
    if (r.width < 2 * opt->tile &&
        r.height < 2 * opt->tile) /* a tile at the border may be larger */
        return opt->margin_tile;
    double area = log((double)r.width * r.height), tile = log(clipped_area(opt->tile, j));
    double image = log((double)j->width * j->height);
    double f = fmin(1, fmax(0, (area - tile) / (image - tile)));
    return opt->margin_tile + f * (opt->margin_global - opt->margin_tile);
}

static double skew_of(const struct cell *cell, double v)
{
    return (fabs(cell->k3) + sqrt(cell->var_k3)) / (v * sqrt(v));
}

static struct measured measure(const struct judge *j, const struct cell *cell, double unit,
                               double size, double margin, int statistic)
{
    struct measured m = {.d = cell->a - cell->b,
                         .unit = unit,
                         .margin = margin,
                         .tolerance = float_tolerance * size + cell->tolerance,
                         .skew_around = INFINITY,
                         .log10_alike = cell->log10_alike,
                         .event_weight = 1,
                         .statistic = statistic};
    m.v = cell->va + cell->vb;
    m.v_margin = cell->va + (1 + m.margin) * (1 + m.margin) * cell->vb;
    m.noise_free = m.v <= pow(float_tolerance * size, 2);
    if (!m.noise_free) {
        m.dof = stats_dof(m.v, cell->var_v);
        m.dof_normal = stats_dof(m.v, cell->var_v_normal);
        m.skew = skew_of(cell, m.v);
        m.t_guard = stats_t_of_z(j->z_guard[statistic], m.dof);
    }
    return m;
}

struct measured region_measure(const struct judge *j, const struct cell *cell, struct rect r)
{
    struct measured m =
        measure(j, cell, fmax(cell->b, j->floor * r.width * r.height), fmax(cell->a, cell->b),
                margin_of(j, r), is_image(j, r) ? STATISTIC_IMAGE : STATISTIC_PYRAMID);
    if (is_image(j, r) || j->is_pooled)
        m.skew_around = m.skew;
    double least = pow(float_tolerance * fmax(cell->a, cell->b), 2);
    m.silent = !m.noise_free && !j->is_pooled &&
               ((cell->va <= least && !j->exact[0]) || (cell->vb <= least && !j->exact[1]));
    m.may_have_missed = (j->may_miss[0] && m.d < 0) || (j->may_miss[1] && m.d > 0);
    return m;
}

struct measured region_measure_weighted(const struct judge *j, const struct cell *cell, double unit,
                                        double size, double largest)
{
    struct measured m = measure(j, cell, unit, size, j->opt.margin_tile, STATISTIC_MATCHED_FILTER);
    m.may_have_missed = j->may_miss[0] || j->may_miss[1];
    m.event_weight = largest / j->event[CHANNEL_LUMINANCE];
    return m;
}

/* ln of the factor by which a tail probability at x may be off [Shao99]. */
static double skew_factor(double skew, double x)
{
    return skew * x * x * x / 3;
}

static double larger(double a, double b)
{
    return a > b ? a : b;
}

/* Does the skewness factor exceed `limit` at the normal critical value x? Student's critical value
 * is larger, so the true factor is, too. Most regions exceed the limit by so much that squares
 * decide it, without a square root. */
static bool is_beyond(const struct cell *cell, double x, double limit)
{
    const double v = cell->va + cell->vb, of_one = skew_factor(1, x),
                 least = float_tolerance * larger(cell->a, cell->b);
    if (!(v > least * least))
        return false;
    return (v > 1e-90 && (cell->k3 * cell->k3 + cell->var_k3) * of_one * of_one >
                             1.001 * limit * limit * v * v * v) ||
           skew_factor(skew_of(cell, v), x) > limit;
}

bool region_is_skewed(const struct judge *j, const struct cell *cell)
{
    const double a = j->z_guard[STATISTIC_IMAGE], b = j->z_guard[STATISTIC_PYRAMID];
    return is_beyond(cell, a < b ? a : b, skew_limit);
}

bool region_is_hopeless(const struct judge *j, const struct cell *cell, int statistic)
{
    return is_beyond(cell, j->z_guard[statistic], skew_limit_raised);
}

/* Is the skewness factor within `limit`, and |g| x within gx? t_guard is the larger critical value except for
 * rounding. */
static bool is_within(const struct judge *j, const struct measured *m, double skew, double limit,
                      double gx)
{
    return skew_factor(skew, j->z_guard[m->statistic]) <= limit &&
           skew_factor(skew, m->t_guard) <= limit && skew * m->t_guard <= gx;
}

static bool is_unskewed(const struct judge *j, const struct measured *m)
{
    return m->noise_free || is_within(j, m, m->skew, skew_limit, INFINITY);
}

bool region_is_normal(const struct judge *j, const struct measured *m)
{
    return !m->silent && is_unskewed(j, m);
}

void region_look_around(const struct judge *j, struct measured *m, const struct cell *around)
{
    double v = around->va + around->vb;
    if (!m->noise_free && !j->is_pooled && is_within(j, m, m->skew, skew_limit_raised, largest_gx))
        m->skew_around = skew_of(around, v) * sqrt(v / m->v);
}

bool region_testable(const struct judge *j, const struct measured *m)
{
    return is_unskewed(j, m) ||
           is_within(j, m, fmax(m->skew, m->skew_around), skew_limit_raised, largest_gx);
}

/* How far |d| lies beyond margin and tolerance. */
static double excess_of(const struct measured *m)
{
    return fabs(m->d) - m->margin * m->unit - m->tolerance;
}

double region_excess_t(const struct measured *m)
{
    return excess_of(m) / sqrt(m->v_margin);
}

/* log10 of the chance that observations as bright as any seen would all have been missed, if they
 * were just frequent enough to make up for the excess: each adds event/n, so excess n/event are
 * expected. */
static double log10_p_missed(const struct judge *j, const struct measured *m, double excess,
                             int channel)
{
    if (excess <= 0)
        return 0;
    double each = j->event[channel] * m->event_weight / j->n_min;
    return fmax(region_smallest_log10_p, -excess / (each * log(10)));
}

/* log10 p of a region without noise whose |d| exceeds margin and tolerance by `excess`. If
 * log10_alike is known there are two tests, and the smaller p is doubled. */
static double log10_p_noise_free(const struct judge *j, const struct measured *m, double excess,
                                 int channel)
{
    double missed = log10_p_missed(j, m, excess, channel);
    if (excess <= 0 || m->log10_alike == 0)
        return missed;
    return fmin(0, log10(2) + fmin(missed, m->log10_alike));
}

/* ln of the factor by which skewness may raise the p of t; constant beyond x = 1/g, where the expansion fails. */
static double skew_at(double skew, double t)
{
    return skew_factor(skew, fmin(t, 1 / skew));
}

/* The skewness by which p is raised; 0 where p is used as it is. */
static double skew_of_p(const struct judge *j, const struct measured *m)
{
    return is_unskewed(j, m) ? 0 : fmax(m->skew, m->skew_around);
}

/* Where the raised p of t is least. Far out ln p of t falls by (dof + 1) t/(dof + t^2), and that of the factor grows by
 * skew t^2, which is more in the end. */
static double t_of_least_p(double dof, double skew)
{
    double root[3];
    if (!(skew > 0) || isinf(dof))
        return INFINITY;
    gsl_poly_solve_cubic(0, dof, -(dof + 1) / skew, &root[0], &root[1], &root[2]);
    return root[0];
}

static double log10_p_at(double dof, double t, double skew)
{
    return stats_t_log10_p(t, dof) + skew_at(skew, t) / log(10);
}

double region_raised_log10_p(double t, double dof, double skew)
{
    if (isinf(skew))
        return 0;
    const double least = t_of_least_p(dof, skew);
    double log10_p = log10_p_at(dof, t, skew);
    if (least < t)
        log10_p = fmin(log10_p, log10_p_at(dof, least, skew));
    return fmin(0, fmax(region_smallest_log10_p, log10_p));
}

bool region_skew_is_testable(double skew, double x, bool *raised)
{
    *raised = skew_factor(skew, x) > skew_limit;
    return !*raised || (skew_factor(skew, x) <= skew_limit_raised && skew * x <= largest_gx);
}

double region_log10_p(const struct judge *j, const struct measured *m, int channel)
{
    double excess = excess_of(m);
    if (m->noise_free)
        return log10_p_noise_free(j, m, excess, channel);
    double log10_p = region_raised_log10_p(fmax(0, region_excess_t(m)), m->dof, skew_of_p(j, m));
    return m->silent || m->may_have_missed ? fmax(log10_p, log10_p_missed(j, m, excess, channel))
                                           : log10_p;
}

double region_missed_z(const struct judge *j, const struct measured *m, int channel)
{
    if (!m->may_have_missed)
        return INFINITY;
    double log10_p = log10_p_missed(j, m, excess_of(m), channel);
    return log10_p < -300 ? INFINITY : stats_normal_quantile(pow(10, log10_p) / 2);
}

static double rank_at(const struct measured *m, double t, double skew)
{
    const double z = stats_z_of_t(t, m->dof);
    return z * z - 2 * skew_at(skew, t);
}

double region_rank(const struct judge *j, const struct measured *m)
{
    const double skew = skew_of_p(j, m), t = fmax(0, region_excess_t(m)),
                 least = t_of_least_p(m->dof, skew);
    const double rank = rank_at(m, t, skew);
    return sqrt(fmax(0, least < t ? fmax(rank, rank_at(m, least, skew)) : rank));
}

double region_log10_p_equal(const struct judge *j, const struct measured *m, int channel)
{
    double excess = fmax(0, fabs(m->d) - m->tolerance);
    if (m->noise_free)
        return log10_p_noise_free(j, m, excess, channel);
    const double skew = isinf(m->skew_around) ? m->skew : fmax(m->skew, m->skew_around);
    double log10_p = region_raised_log10_p(excess / sqrt(m->v), m->dof, skew);
    return m->may_have_missed ? fmax(log10_p, log10_p_missed(j, m, excess, channel)) : log10_p;
}

double region_t(const struct measured *m)
{
    if (m->noise_free)
        return fabs(m->d) <= m->tolerance ? 0 : copysign(largest_t, m->d);
    return fmin(largest_t, fmax(-largest_t, m->d / sqrt(m->v)));
}

double region_pixel_t(const struct judge *j, const struct cell *cell, double *relative)
{
    const double size = larger(cell->a, cell->b), least = float_tolerance * size;
    struct measured m = {.d = cell->a - cell->b,
                         .tolerance = float_tolerance * size + cell->tolerance,
                         .v = cell->va + cell->vb};
    m.noise_free = m.v <= least * least;
    *relative = m.d / larger(cell->b, j->floor);
    return region_t(&m);
}

/* *x: the quantile of alpha divided by the factor that skewness may cause; false if that factor is too
 * large to be trusted. */
static bool raised_quantile(double skew, double alpha, double dof, double limit, double *x)
{
    double factor = 0, last = -1;
    for (int i = 0; i < 4 && factor != last; i++) {
        last = factor;
        *x = stats_t_quantile(alpha * exp(-factor), dof);
        factor = fmin(limit, skew_factor(skew, *x));
    }
    return factor < limit;
}

double region_mdb(const struct judge *j, const struct measured *m, int channel)
{
    double tests = (double)j->num_tests[m->statistic], reach, x = 0;
    double level = j->opt.alpha * j->share[m->statistic] / tests;
    double missed = j->event[channel] / j->n_min * -log(level);
    if (m->noise_free) {
        reach = m->log10_alike + log10(2) <= log10(level) ? 0 : missed;
    } else {
        raised_quantile(skew_of_p(j, m), level / 2, m->dof, 2 * skew_limit_raised, &x);
        reach = sqrt(m->v_margin) * (x + stats_t_quantile(0.05, m->dof));
        if (m->silent || j->may_miss[0] || j->may_miss[1])
            reach = fmax(reach, missed);
    }
    return fmin(region_mdb_none, m->margin + (m->tolerance + reach) / m->unit);
}

const char *region_mdb_text(double mdb, char text[32])
{
    if (mdb < 10)
        snprintf(text, 32, "%.3g %%", 100 * mdb);
    else if (mdb < region_mdb_none)
        snprintf(text, 32, "more than 1000 %%");
    else
        snprintf(text, 32, "nothing");
    return text;
}

double region_reach(const struct region *r)
{
    return fmax(fabs(r->ci_lo), fabs(r->ci_hi));
}

/* Half the width of the 1 - 2 alpha interval, in standard errors. Beyond the factor e that a tail is lowered by, the
 * expansion is no guide; the normal quantile is multiplied by the skewness factor f^(5/4) instead (verdict.md: what that
 * was found to cover), unless skewness is but pooled. *scale: how many times as wide that is, or 1. */
static bool half_width(const struct judge *j, const struct measured *m, double *width,
                       double *scale)
{
    const double alpha = j->opt.alpha;
    *scale = 1;
    if (raised_quantile(m->skew, alpha, fmax(least_dof, m->dof), skew_limit_widened, width))
        return m->dof >= least_dof;
    const double z = stats_normal_quantile(alpha * exp(-1)), factor = skew_factor(m->skew, z);
    *scale = fmax(1, z * pow(factor, 1.25) / *width);
    *width *= *scale;
    return !j->is_pooled && factor <= skew_limit_scaled && m->dof >= least_dof;
}

/* About how many times the samples would bring the skewness factor at x well within `limit`, to half of it, and |g| x within
 * half of gx. */
static double samples_for(double skew, double x, double limit, double gx)
{
    double beyond = fmax(skew_factor(skew, x) / limit, skew * x / gx);
    return beyond > 1 ? 4 * beyond * beyond : 1;
}

void region_name(int width, int height, struct rect r, int channel, char *text, size_t size)
{
    if (r.width == width && r.height == height)
        snprintf(text, size, "the image (%s)", channel_name[channel]);
    else
        snprintf(text, size, "%d x %d pixels at %d,%d (%s)", r.width, r.height, r.x, r.y,
                 channel_name[channel]);
}

struct region region_fill(const struct judge *j, const struct cell *cell, struct rect r,
                          int channel)
{
    struct measured m = region_measure(j, cell, r);
    double pixels = (double)r.width * r.height, half = m.tolerance;
    struct region out = {
        .x = r.x,
        .y = r.y,
        .width = r.width,
        .height = r.height,
        .channel = channel,
        .mean_a = cell->a / pixels,
        .mean_b = cell->b / pixels,
        .difference = m.d / m.unit,
        .std_error = sqrt(m.v) / m.unit,
        .dof = isinf(m.dof) ? 0 : m.dof,
        .t = region_t(&m),
        .log10_p = region_log10_p(j, &m, channel),
        .ci_valid = true,
        .margin = m.margin,
    };
    out.ci_scale = out.unskew_interval = out.unskew_test = 1;
    if (!m.noise_free) {
        double width;
        out.ci_valid = half_width(j, &m, &width, &out.ci_scale);
        half += width * sqrt(m.v_margin);
        if (!out.ci_valid)
            out.unskew_interval =
                samples_for(m.skew, stats_normal_quantile(j->opt.alpha * exp(-1)),
                            j->is_pooled ? skew_limit_widened : skew_limit_scaled, INFINITY);
        out.unskew_test =
            samples_for(m.skew, j->z_guard[m.statistic], skew_limit_raised, largest_gx);
    }
    out.ci_lo = (m.d - half) / m.unit;
    out.ci_hi = (m.d + half) / m.unit;
    return out;
}
