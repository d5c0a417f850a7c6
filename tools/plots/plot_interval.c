#include "plot_interval.h"

#include "plot.h"

#include "tools/html/html.h"
#include "tools/results/results.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#include <gsl/gsl_cdf.h>

void plot_interval(FILE *f, const json_t *claim)
{
    double d = member_number(claim, "difference"), lo = member_end(claim, "ci", 0),
           hi = member_end(claim, "ci", 1), margin = member_number(claim, "margin_global");
    /* All of the interval if it reaches no further than 3 margins; else the margin must stay visible. */
    double reach = fmax(fabs(lo), fabs(hi));
    double range = margin > 0 ? fmin(fmax(reach, margin) * 1.15, 3 * margin) : reach * 1.15;
    if (!(range > 0))
        range = 1;
    struct plot p = {.f = f,
                     .style = "interval",
                     .left = 8,
                     .top = 1,
                     .width = 134,
                     .height = 20,
                     .right = 8,
                     .bottom = 1,
                     .x = {.lo = -range, .hi = range},
                     .y = {.lo = -10, .hi = 10}};
    char text[320];
    snprintf(text, sizeof text, "difference %s, interval from %s to %s, margin %s",
             html_percent_prose(d).s, html_percent_prose(lo).s, html_percent_prose(hi).s,
             html_percent_plain(margin).s);
    plot_open(&p, "%s", text);
    html_print(f, "<title>%s</title>", text);
    if (margin > 0)
        plot_bar(&p, "margin", -margin, -10, margin, 10, NULL);
    plot_segment(&p, "zero", 0, -10, 0, 10);
    if (hi > -range && lo < range)
        plot_segment(&p, "ci", lo, 0, hi, 0);
    if (lo < -range)
        plot_arrow(&p, false, 0, "%s", text);
    else if (lo < range)
        plot_segment(&p, "ci", lo, -4, lo, 4);
    if (hi > range)
        plot_arrow(&p, true, 0, "%s", text);
    else if (hi > -range)
        plot_segment(&p, "ci", hi, -4, hi, 4);
    if (fabs(d) <= range)
        plot_point(&p, 0, d, 0, "%s", text);
    plot_close(&p);
}

/* Smallest k with P(X <= k) >= q, X ~ Binomial(n, p). */
static int binomial_quantile(double q, int n, double p)
{
    int k = 0;
    while (k < n && gsl_cdf_binomial_P((unsigned)k, p, (unsigned)n) < q)
        k++;
    return k;
}

struct p_histogram plot_p_histogram(const json_t *claim, int count[20])
{
    struct p_histogram h = {0};
    const json_t *log10_p = json_object_get(claim, "tile_log10_p");
    memset(count, 0, 20 * sizeof *count);
    for (size_t i = 0; i < json_array_size(log10_p); i++)
        h.num_tiles += json_is_number(json_array_get(log10_p, i));
    if (h.num_tiles == 0)
        return h;
    h.bins = h.num_tiles >= 200 ? 20 : 10;
    json_each(v, log10_p) {
        if (!json_is_number(v))
            continue;
        double p = pow(10, fmin(json_number_value(v), 0));
        int bin = (int)(p * h.bins);
        count[bin < h.bins ? bin : h.bins - 1]++;
        h.below_5_percent += p < 0.05;
    }
    h.expected = (double)h.num_tiles / h.bins;
    h.band_low = binomial_quantile(0.005, h.num_tiles, 1.0 / h.bins);
    h.band_high = binomial_quantile(0.995, h.num_tiles, 1.0 / h.bins);
    return h;
}

void plot_p_values(FILE *f, const struct p_histogram *h, const int count[20])
{
    assert(h->num_tiles > 0);
    int top = h->band_high + 1;
    for (int b = 0; b < h->bins; b++)
        top = count[b] > top ? count[b] : top;
    struct plot p = plot_sized(f, 300, 150);
    p.x = (struct plot_axis){.label = "p-value of a tile", .hi = 1, .step = 0.25};
    p.y = (struct plot_axis){.label = "number of tiles", .hi = top, .step = top < 5 ? 1 : 0};
    plot_open(&p,
              "Histogram of %d tile p-values in %d bins; %d tiles are below 0.05, %.1f would be "
              "expected",
              h->num_tiles, h->bins, h->below_5_percent, 0.05 * h->num_tiles);
    plot_bar(&p, "band", 0, h->band_low, 1, h->band_high, "99 %% of bins: %d to %d tiles",
             h->band_low, h->band_high);
    for (int b = 0; b < h->bins; b++) {
        double from = (double)b / h->bins, to = (double)(b + 1) / h->bins;
        if (count[b] > 0)
            plot_bar(&p, "bar", from + 1.0 / 300, 0, to - 1.0 / 300, count[b],
                     "p from %.2f to %.2f: %d tiles", from, to, count[b]);
    }
    plot_segment(&p, "expected", 0, h->expected, 1, h->expected);
    plot_close(&p);
}
