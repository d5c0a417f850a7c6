/* The QQ plot of a claim's p-values, and the curve of its power. */
#ifndef ASSAY_PLOT_POWER_H
#define ASSAY_PLOT_POWER_H

#include "renderer/base/err.h"

#include <jansson.h>
#include <stdio.h>

/* Central 95 % interval of the i-th smallest of n uniform p-values: quantiles of Beta(i, n + 1 - i),
 * i in 1..n. */
void plot_qq_band(int i, int n, double *low, double *high);

/* Writes a <figure> of the tiles' p-values against uniform ones, with their 95 % band; nothing for fewer than 4
 * tiles with noise. Fails only if out of memory. */
NODISCARD bool plot_qq(FILE *f, const json_t *claim, struct err *e);

/* The power of the image statistic alone: the probability that a true relative bias of the image's mean comes
 * out DIFFERENT, Phi((bias - margin)/SE - c), c the critical value of its tests and SE such that this is 95 % at
 * the MDB (tools/docs/background/verdict.md, 7). The other statistics only add to it. */
struct power {
    double margin, error, critical; /* error: SE, 0: not known; critical: c */
};
struct power power_of(const json_t *claim);
double power_at(const struct power *p, double bias);

/* Writes a <figure> of that curve with margin and MDB marked; nothing if error is 0. */
void plot_power(FILE *f, const json_t *claim);

#endif
