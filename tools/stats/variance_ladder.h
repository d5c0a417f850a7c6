/* The variance of an engine's pixel values, over the image and over each tile, with confidence
 * intervals that assume nothing about the distribution of the noise, only that pixels are
 * independent. Values are relative (convergence_rate.h: each is divided by a
 * unit of its own). Of pixel p, channels c and K >= 3 replicates k with seeds of their own:
 *
 *   between  d_k = sum_c (x_kc - m_c)^2 / u_c^2, V_p = sum_k d_k / (3 (K-1))       m: their mean
 *            variance of V_p: the delete-one jackknife over replicates, sum (d_k - mean d)^2 K / (9 (K-1) (K-2)^2)
 *            [EfronStein81], too large rather than too small on average: 2/(K-2) instead of 2/(K-1) for a normal law
 *   within   d_k = sum_c M2_kc / ((n-1) u_c^2), V_p = sum_k d_k / (3 K)            of renders that hold their moments
 *            variance of V_p: sum (d_k - mean d)^2 / (9 K (K-1))
 *
 * An area's V is the mean of V_p, its variance W / pixels^2 with W = sum w_p over those of pixels. The degrees of freedom
 * are Satterthwaite's, 2 W^2 / Var W, with Var W <= sum E[w_p^2], whatever the law: 2 W^2 / sum w_p^2, so that where one
 * firefly is the whole uncertainty the interval says little. Both are unbiased; "within" is the variance of one sample. */
#ifndef ASSAY_VARIANCE_LADDER_H
#define ASSAY_VARIANCE_LADDER_H

#include "convergence_rate.h"

/* A relative variance up to this, 1e-6 (0.1 % of the value), counts as rounding of float32, not noise. */
extern const double variance_ladder_none;

/* Tiles as in reports: what is left at the border is a tile of its own if it is half a tile or more. */
struct variance_map {
    int tiles_x, tiles_y;
    struct estimate image, *tile; /* V itself, not its logarithm */
};
void variance_map_free(struct variance_map *m);
/* The tile of pixel (x, y). */
int variance_map_tile(const struct variance_map *m, int x, int y, int side);

/* K consecutive images of unit->size / 3 pixels, `width` per row. Fails if some of them, but not all, are the same bit
 * for bit: a seed without effect. The caller calls variance_map_free(). */
NODISCARD bool variance_ladder_between(const float *images, int count,
                                       const struct converge_reference *unit, int width, int tile,
                                       struct variance_map *out, struct err *e);
/* K >= 2 renders of unit "sample"; fails if a pixel has fewer than two samples or an M3 that is impossible for
 * non-negative samples. */
NODISCARD bool variance_ladder_within(const struct moments *render, int count,
                                      const struct converge_reference *unit, int tile,
                                      struct variance_map *out, struct err *e);

/* ln of an estimate of V > 0, by the delta rule. */
struct estimate variance_ladder_log(struct estimate v);

/* Is V what it should be? */
struct variance_claim {
    enum verdict verdict;
    double ratio, lo, hi; /* V over what it should be, and its interval at 1 - 2 alpha */
    double margin;
};
/* How far an unchanged variance may seem to be from a record with this estimate if `share` (0 to 1) of the record's
 * observations are taken again: the half width of the difference's interval at an alpha of 1e-6, plus the deviation
 * that chance exceeds in 1 of 1e6 runs. */
double variance_ladder_reach(struct estimate record, double share);
/* The margin that is attainable against a record of this V: by variance_ladder_reach(), at least `least`, at most 300
 * %. */
double variance_ladder_margin(struct estimate record, double share, double least);
/* A run's estimate of the same engine, with the degrees of freedom that the record lets us expect if
 * those are more: a firefly in a run enlarges its standard error and also reduces its own degrees of
 * freedom, and so would count twice. */
struct estimate variance_ladder_expect(struct estimate run, struct estimate record, double share);

/* Two one-sided tests at alpha of V / wanted <= 1 + margin; if `both`, of >= 1/(1 + margin) too.
 * DIFFERENT if the interval lies outside, EQUIVALENT if inside, else INCONCLUSIVE, or, at the
 * largest margin, NO DIFFERENCE FOUND: no better margin was attainable. If `wanted` has no noise, V must have
 * none: then ratio is V itself, and the margin is variance_ladder_none. */
struct variance_claim variance_ladder_judge(struct estimate v, struct estimate wanted,
                                            double margin, bool both, double alpha);

#endif
