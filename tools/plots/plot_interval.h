/* A claim's interval and the p-values of its tiles, as inline SVG coloured by the page's style sheet. */
#ifndef ASSAY_PLOT_INTERVAL_H
#define ASSAY_PLOT_INTERVAL_H

#include <jansson.h>
#include <stdio.h>

/* The interval of a claim's relative difference beside the margin: a band for the margin, a line
 * for the interval, a dot for the estimate. What lies outside the drawing ends in an arrow head. */
void plot_interval(FILE *f, const json_t *claim);

/* A histogram of the p-values of a claim's tiles. */
struct p_histogram {
    int num_tiles; /* with a p-value */
    int bins;
    double expected;         /* per bin, if all p-values were uniform */
    int band_low, band_high; /* central 99 % of Binomial(num_tiles, 1/bins) */
    int below_5_percent;     /* tiles with p < 0.05 */
};

/* Bins the p-values of the claim's tiles (tile_log10_p); with num_tiles 0 the rest is 0, too. plot_p_values() draws
 * them and needs at least one. */
struct p_histogram plot_p_histogram(const json_t *claim, int count[20]);
void plot_p_values(FILE *f, const struct p_histogram *h, const int count[20]);

#endif
