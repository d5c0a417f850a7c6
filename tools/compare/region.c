#include "region.h"

#include "tools/stats/distributions.h"

#include <math.h>
#include <stdio.h>

static const double skew_limit = 0.2;       /* of ln p, where a p must be trusted as it is */
static const double skew_limit_widened = 1; /* of ln p, where the interval makes up for it */
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

static struct measured measure(const struct cell *cell, double unit, double size, double margin,
                               int statistic)
{
    struct measured m = {.d = cell->a - cell->b,
                         .unit = unit,
                         .margin = margin,
                         .tolerance = float_tolerance * size + cell->tolerance,
                         .log10_alike = cell->log10_alike,
                         .statistic = statistic};
    m.v = cell->va + cell->vb;
    m.v_margin = cell->va + (1 + m.margin) * (1 + m.margin) * cell->vb;
    m.noise_free = m.v <= pow(float_tolerance * size, 2);
    if (!m.noise_free) {
        m.dof = stats_dof(m.v, cell->var_v);
        m.dof_normal = stats_dof(m.v, cell->var_v_normal);
        m.skew = (fabs(cell->k3) + sqrt(cell->var_k3)) / (m.v * sqrt(m.v));
    }
    return m;
}

struct measured region_measure(const struct judge *j, const struct cell *cell, struct rect r)
{
    return measure(cell, fmax(cell->b, j->floor * r.width * r.height), fmax(cell->a, cell->b),
                   margin_of(j, r), is_image(j, r) ? STATISTIC_IMAGE : STATISTIC_PYRAMID);
}

struct measured region_measure_weighted(const struct judge *j, const struct cell *cell, double unit,
                                        double size)
{
    return measure(cell, unit, size, j->opt.margin_tile, STATISTIC_MATCHED_FILTER);
}

/* ln of the factor by which a tail probability at x may be off [Shao99]. */
static double skew_factor(const struct measured *m, double x)
{
    return m->skew * x * x * x / 3;
}

bool region_testable(const struct judge *j, const struct measured *m)
{
    double z = j->z_guard[m->statistic];
    if (m->noise_free)
        return true;
    /* t is beyond z: most small regions fail already there. */
    return skew_factor(m, z) <= skew_limit && skew_factor(m, stats_t_of_z(z, m->dof)) <= skew_limit;
}

double region_excess_t(const struct measured *m)
{
    return (fabs(m->d) - m->margin * m->unit - m->tolerance) / sqrt(m->v_margin);
}

/* log10 of the chance that observations as bright as any seen would all have been missed, if they
 * were just frequent enough to make up for the excess: each adds event/n, so excess n/event are
 * expected. */
static double log10_p_missed(const struct judge *j, double excess, int channel)
{
    if (excess <= 0)
        return 0;
    return fmax(region_smallest_log10_p, -excess * j->n_min / (j->event[channel] * log(10)));
}

/* Of a region without noise, for |d| beyond what is no difference by `excess`. Two tests where a law
 * for both sides can be asked for. */
static double log10_p_noise_free(const struct judge *j, const struct measured *m, double excess,
                                 int channel)
{
    double missed = log10_p_missed(j, excess, channel);
    if (excess <= 0 || m->log10_alike == 0)
        return missed;
    return fmin(0, log10(2) + fmin(missed, m->log10_alike));
}

double region_log10_p(const struct judge *j, const struct measured *m, int channel)
{
    if (m->noise_free)
        return log10_p_noise_free(j, m, fabs(m->d) - m->margin * m->unit - m->tolerance, channel);
    return fmax(region_smallest_log10_p, stats_t_log10_p(fmax(0, region_excess_t(m)), m->dof));
}

double region_log10_p_equal(const struct judge *j, const struct measured *m, int channel)
{
    double excess = fmax(0, fabs(m->d) - m->tolerance);
    if (m->noise_free)
        return log10_p_noise_free(j, m, excess, channel);
    double t = excess / sqrt(m->v);
    /* Beyond x = 1/g the expansion behind the factor has turned round. */
    double factor = skew_factor(m, fmin(t, 1 / m->skew)) / log(10);
    return fmin(0, fmax(region_smallest_log10_p, stats_t_log10_p(t, m->dof) + factor));
}

double region_t(const struct measured *m)
{
    if (m->noise_free)
        return fabs(m->d) <= m->tolerance ? 0 : copysign(largest_t, m->d);
    return fmin(largest_t, fmax(-largest_t, m->d / sqrt(m->v)));
}

double region_mdb(const struct judge *j, const struct measured *m, int channel)
{
    double tests = (double)j->num_tests[m->statistic], reach;
    double level = j->opt.alpha * j->share[m->statistic] / tests;
    if (m->noise_free)
        reach = m->log10_alike + log10(2) <= log10(level)
                    ? 0
                    : j->event[channel] / j->n_min * -log(level);
    else
        reach = sqrt(m->v_margin) *
                (stats_t_quantile(level / 2, m->dof) + stats_t_quantile(0.05, m->dof));
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

/* Half the width of the 1 - 2 alpha interval, in standard errors. alpha is first divided by the
 * factor that skewness may put on it; false if that factor is too large to be trusted. */
static bool half_width(const struct judge *j, const struct measured *m, double *x)
{
    double factor = 0;
    for (int i = 0; i < 4; i++) {
        *x = stats_t_quantile(j->opt.alpha * exp(-factor), fmax(least_dof, m->dof));
        factor = fmin(skew_limit_widened, skew_factor(m, *x));
    }
    return factor < skew_limit_widened && m->dof >= least_dof;
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
    if (!m.noise_free) {
        double x;
        out.ci_valid = half_width(j, &m, &x);
        half += x * sqrt(m.v_margin);
    }
    out.ci_lo = (m.d - half) / m.unit;
    out.ci_hi = (m.d + half) / m.unit;
    return out;
}
