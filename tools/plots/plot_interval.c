#include "plot_interval.h"

#include "tools/html/html.h"
#include "tools/results/results.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#include <gsl/gsl_cdf.h>

void plot_interval(FILE *f, const json_t *claim)
{
    enum { WIDTH = 150, HEIGHT = 22, MIDDLE = WIDTH / 2 };
    double d = member_number(claim, "difference");
    double lo = json_number_value(json_array_get(json_object_get(claim, "ci"), 0));
    double hi = json_number_value(json_array_get(json_object_get(claim, "ci"), 1));
    double margin = member_number(claim, "margin_global");
    /* All of the interval if it is no wider than 3 margins; otherwise the margin must stay visible.
     */
    double reach = fmax(fabs(lo), fabs(hi));
    double range = margin > 0 ? fmin(fmax(reach, margin) * 1.15, 3 * margin) : reach * 1.15;
    if (!(range > 0))
        range = 1;
    double scale = (MIDDLE - 8) / range;
    double x0 = MIDDLE + scale * fmax(lo, -range), x1 = MIDDLE + scale * fmin(hi, range);

    fprintf(f,
            "<svg class=\"interval\" viewBox=\"0 0 %d %d\" width=\"%d\" height=\"%d\" role=\"img\" "
            "aria-label=\"difference %s, interval from %s to %s, margin %s\">",
            WIDTH, HEIGHT, WIDTH, HEIGHT, html_percent_prose(d).s, html_percent_prose(lo).s,
            html_percent_prose(hi).s, html_percent_plain(margin).s);
    if (margin > 0)
        fprintf(f, "<rect class=\"margin\" x=\"%.1f\" y=\"1\" width=\"%.1f\" height=\"%d\"/>",
                MIDDLE - scale * margin, 2 * scale * margin, HEIGHT - 2);
    fprintf(f, "<path class=\"zero\" d=\"M%d 1V%d\"/>", MIDDLE, HEIGHT - 1);
    if (hi > -range && lo < range)
        fprintf(f, "<path class=\"ci\" d=\"M%.1f %dH%.1f\"/>", x0, HEIGHT / 2, x1);
    if (lo < -range)
        fprintf(f, "<path class=\"arrow\" d=\"M8 %dl8 -5v10z\"/>", HEIGHT / 2);
    else if (lo < range)
        fprintf(f, "<path class=\"ci\" d=\"M%.1f %dv8\"/>", x0, HEIGHT / 2 - 4);
    if (hi > range)
        fprintf(f, "<path class=\"arrow\" d=\"M%d %dl-8 -5v10z\"/>", WIDTH - 8, HEIGHT / 2);
    else if (hi > -range)
        fprintf(f, "<path class=\"ci\" d=\"M%.1f %dv8\"/>", x1, HEIGHT / 2 - 4);
    if (fabs(d) <= range)
        fprintf(f, "<circle class=\"dot\" cx=\"%.1f\" cy=\"%d\" r=\"3.5\"/>", MIDDLE + scale * d,
                HEIGHT / 2);
    fputs("</svg>", f);
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
    for (size_t i = 0; i < json_array_size(log10_p); i++) {
        const json_t *v = json_array_get(log10_p, i);
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

/* 1, 2 or 5 times a power of ten: the distance of at most 5 ticks up to `top`. */
static int tick_step(int top)
{
    for (int decade = 1;; decade *= 10) {
        static const int digit[] = {1, 2, 5};
        for (size_t i = 0; i < 3; i++)
            if (digit[i] * decade * 5 >= top)
                return digit[i] * decade;
    }
}

void plot_p_values(FILE *f, const struct p_histogram *h, const int count[20])
{
    enum { LEFT = 44, TOP = 8, PLOT_WIDTH = 300, PLOT_HEIGHT = 150, BOTTOM = TOP + PLOT_HEIGHT };
    assert(h->num_tiles > 0);
    int top = h->band_high + 1;
    for (int b = 0; b < h->bins; b++)
        top = count[b] > top ? count[b] : top;
    double unit = (double)PLOT_HEIGHT / top, bar = (double)PLOT_WIDTH / h->bins;

    fprintf(
        f,
        "<svg class=\"plot\" text-anchor=\"middle\" viewBox=\"0 0 %d %d\" role=\"img\" aria-label=\"Histogram of %d tile "
        "p-values in %d bins; %d tiles are below 0.05, %.1f would be expected\">",
        LEFT + PLOT_WIDTH + 14, BOTTOM + 40, h->num_tiles, h->bins, h->below_5_percent,
        0.05 * h->num_tiles);
    fprintf(f, "<rect class=\"band\" x=\"%d\" y=\"%.1f\" width=\"%d\" height=\"%.1f\"/>", LEFT,
            BOTTOM - unit * h->band_high, PLOT_WIDTH, unit * (h->band_high - h->band_low));
    for (int b = 0; b < h->bins; b++)
        if (count[b] > 0)
            fprintf(f,
                    "<rect class=\"bar\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\">"
                    "<title>p from %.2f to %.2f: %d tiles</title></rect>",
                    LEFT + bar * b + 1, BOTTOM - unit * count[b], bar - 2, unit * count[b],
                    (double)b / h->bins, (double)(b + 1) / h->bins, count[b]);
    fprintf(f, "<path class=\"expected\" d=\"M%d %.1fh%d\"/>", LEFT, BOTTOM - unit * h->expected,
            PLOT_WIDTH);
    fprintf(f, "<path class=\"axis\" d=\"M%d %dV%dH%d\"/>", LEFT, TOP, BOTTOM, LEFT + PLOT_WIDTH);
    int step = tick_step(top);
    fputs("<g text-anchor=\"end\">", f);
    for (int v = 0; v <= top; v += step)
        fprintf(f, "<text x=\"%d\" y=\"%.0f\">%d</text>", LEFT - 6, BOTTOM - unit * v + 4, v);
    fputs("</g>", f);
    for (int i = 0; i <= 4; i++)
        fprintf(f, "<text x=\"%d\" y=\"%d\">%g</text>", LEFT + PLOT_WIDTH * i / 4, BOTTOM + 16,
                i / 4.0);
    fprintf(f,
            "<text x=\"%d\" y=\"%d\">p-value of a tile</text>"
            "<text transform=\"translate(11 %d) rotate(-90)\">number of tiles</text></svg>",
            LEFT + PLOT_WIDTH / 2, BOTTOM + 34, TOP + PLOT_HEIGHT / 2);
}
