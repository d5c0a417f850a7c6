/* Drawings of what a claim's p-values and its power are: the QQ plot and the power curve. */
#ifndef ASSAY_PLOT_POWER_H
#define ASSAY_PLOT_POWER_H

#include "renderer/base/err.h"

#include <jansson.h>
#include <stdio.h>

/* The i-th smallest of n uniform p-values lies within these with 95 %: quantiles of Beta(i, n + 1 - i),
 * i in 1..n. */
void plot_qq_band(int i, int n, double *low, double *high);

/* <figure> of the tiles' p-values against those that uniform ones would have, with its band; nothing for
 * fewer than 4 tiles with noise. Fails only out of memory. */
NODISCARD bool plot_qq(FILE *f, const json_t *claim, struct err *e);

/* The chance that a bias of the image's mean (relative) comes out DIFFERENT, by the statistic of the image
 * alone: Phi((bias - margin)/SE - c), c the normal quantile at the level of its tests, SE from the MDB, which
 * is where this is 95 % (tools/docs/background/verdict.md, 7). The other statistics only add to it. */
struct power {
    double margin, error, critical; /* error 0: not known */
};
struct power power_of(const json_t *claim);
double power_at(const struct power *p, double bias);

/* <figure> of that curve with margin and MDB marked; nothing where it is not known. */
void plot_power(FILE *f, const json_t *claim);

#endif
