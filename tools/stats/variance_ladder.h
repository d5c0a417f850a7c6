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

/* A variance up to this is rounding of float32, not noise: 1e-5 of the value, as compare.c has it. */
extern const double variance_ladder_none;

/* Tiles as of reports: what is left of one at the border is one of its own from half a tile on. */
struct variance_map {
    int tiles_x, tiles_y;
    struct estimate image, *tile; /* V itself, not its logarithm */
};
void variance_map_free(struct variance_map *m);
/* The tile of pixel (x, y). */
int variance_map_tile(const struct variance_map *m, int x, int y, int side);

/* K images one after the other, rows of `width` pixels (of unit->size / 3). Fails where two are the same bit by bit
 * and yet not all are: a seed without effect. */
NODISCARD bool variance_ladder_between(const float *images, int count,
                                       const struct converge_reference *unit, int width, int tile,
                                       struct variance_map *out, struct err *e);
/* K renders of unit "sample"; fails where a pixel holds fewer than two, or an M3 that no samples of
 * 0 and more can have. */
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
/* Half width of the interval of a difference to a record that was estimated like this, when `share` (0 to 1) of its
 * observations are taken again, at an alpha of 1e-6, and how far chance moves that in 1 of 1e6 runs. */
double variance_ladder_reach(struct estimate record, double share);
/* The margin that can be had against a record of this V: `least`, or what it reaches, at most 300 %. */
double variance_ladder_margin(struct estimate record, double share, double least);
/* An estimate of a run of the same engine: with the degrees of freedom that the record makes
 * expect, if they are more. One firefly in a run makes its standard error large and its own degrees
 * of freedom few, one too often of the two. */
struct estimate variance_ladder_expect(struct estimate run, struct estimate record, double share);

/* Two one-sided tests at alpha of V / wanted <= 1 + margin; if `both`, of >= 1/(1 + margin) too.
 * DIFFERENT if the interval lies outside, EQUIVALENT if inside, else INCONCLUSIVE, or, at the
 * largest margin, NO DIFFERENCE FOUND: more could not be promised. A `wanted` without noise wants
 * none: then ratio is V itself, the margin variance_ladder_none. */
struct variance_claim variance_ladder_judge(struct estimate v, struct estimate wanted,
                                            double margin, bool both, double alpha);

#endif
