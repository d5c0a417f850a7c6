/* Sums of one comparison over square regions of all sizes, in one channel: what the tests of
 * compare.h are made of. Level sides are 1, 2, 4, .. below the reporting tile, then tile, 2 tile,
 * 4 tile, .. until one region is the image: dyadic if the tile is a power of two. Regions at the
 * right and lower border are what is left; what is left of tiles is half a tile or more, a narrower
 * strip belonging to the tile beside it. */
#ifndef ASSAY_PYRAMID_H
#define ASSAY_PYRAMID_H

#include "renderer/image/moments.h"
#include "tools/images/luminance.h"

enum { CHANNEL_LUMINANCE = 3, NUM_CHANNELS = 4 };
/* The relative difference that two engines' float32 arithmetic may cause in the same value. */
extern const double float_tolerance;

/* One side's mean in one pixel (or the sum of such means over a region), as an estimate. */
struct pixel_estimate {
    double mean;
    double v;     /* its estimated variance, M2/(n(n-1)); 0 if exact */
    double k3;    /* its third cumulant, M3/(n(n-1)(n-2)) */
    double var_v; /* variance of v: the larger of 2 v^2/(n-1) (normal) and k3^2/v (Cauchy-Schwarz:
                      the covariance of mean and variance is k3) */
    double var_v_normal; /* variance of v if normal: 2 v^2/(n-1) */
    double var_k3;       /* variance of k3 if normal, 6 v^3/((n-1)(n-2)) */
    double tolerance;    /* of the mean, from rounded numbers (moments.h) */
};

/* Channel 3 is luminance, whose variance the moments do not hold: the bound for any correlation of
 * the channels, v = (sum w_c sqrt v_c)^2, is used, and k3 = (sum w_c cbrt k3_c)^3. Both are exact
 * if the channels are perfectly correlated. n must be >= 3 unless exact. */
struct pixel_estimate pyramid_pixel_estimate(const struct moments *m, size_t pixel, int channel);

/* From the moments of any sum of a pixel's channels. v = 0: no noise. */
static inline struct pixel_estimate pyramid_estimate_from(double mean, double v, double k3, double n)
{
    double normal = 2 * v * v / (n - 1), skewed = k3 * k3 / v,
           sixth = 6 * v * v * v / ((n - 1) * (n - 2)), most = normal > skewed ? normal : skewed;
    struct pixel_estimate est = {.mean = mean, .v = v, .k3 = k3};
    est.var_v_normal = v > 0 ? normal : 0;
    est.var_v = v > 0 ? most : 0;
    est.var_k3 = v > 0 ? sixth : 0;
    return est;
}

/* Sums over the pixels of a region, or of their products with weights. */
struct cell {
    double a, b;   /* means of A and B */
    double va, vb; /* their variances */
    double k3;     /* third cumulant of A - B */
    double var_v;  /* variance of va + vb */
    double var_v_normal;
    double var_k3;    /* variance of k3 */
    double tolerance; /* of a and b together, from rounded numbers */
    /* Of one pixel with all observations of A alike, all of B alike, and the two different: log10 of an upper
     * bound of the probability of that if both follow one distribution. 0 for other pixels and regions. */
    double log10_alike;
};

struct pyramid_level {
    int side, nx, ny;
    struct cell *cell; /* ny rows of nx */
};

enum { PYRAMID_LEVELS = 40 };
struct pyramid {
    int width, height;
    int num_levels;
    int tile_level; /* its side is the reporting tile */
    struct pyramid_level level[PYRAMID_LEVELS];
    struct cell *cells; /* of all levels */
    size_t room;        /* number of cells allocated */
};

/* Reporting tiles along `length` pixels, at least 1: the last has from 1/2 to 3/2 of a tile's pixels, or all. */
int pyramid_tiles(int length, int tile);

/* The levels of an image, without cells. tile >= 1; it is limited to the image's longer side. */
struct pyramid pyramid_levels(int width, int height, int tile);

/* a and b have one size; *p is zero, or was built before, and its memory is reused. root: of luminance, sum w_c cbrt
 * k3_c for both sides' pixels, which is most of the work, if known; else NULL. Fails only out of memory. Release with
 * pyramid_free(). */
NODISCARD bool pyramid_build(const struct moments *a, const struct moments *b, int channel,
                             double *const root[2], int tile, struct pyramid *p, struct err *e);
void pyramid_free(struct pyramid *p);

/* The same in two parts, in less memory. An image is cut from the top into bands of this many rows, the last of up to
 * twice as many: pyramid_build() of a band makes all levels below the tiles, and two more, as in the image's
 * pyramid. */
int pyramid_band(const struct pyramid *levels);
/* Allocates the levels from the tiles, which become level 0, upwards, zeroed. The caller fills the tiles' cells;
 * pyramid_sum_up() makes the other levels from them. Fails and is released as above. */
NODISCARD bool pyramid_above(const struct pyramid *levels, struct pyramid *out, struct err *e);
void pyramid_sum_up(struct pyramid *above);

void pyramid_add_pixel(struct cell *dst, const struct pixel_estimate *a, const struct pixel_estimate *b);

/* Number of regions over all levels. */
size_t pyramid_regions(const struct pyramid *p);
/* The pixels of region i of a level. */
struct rect {
    int x, y, width, height;
};
struct rect pyramid_rect(const struct pyramid *p, int level, size_t i);
/* The region of level `coarse` in which region i of level `fine` lies; the finer side divides the other. */
size_t pyramid_parent(const struct pyramid *p, int fine, int coarse, size_t i);
/* The same for the region in column x and row y of a finer level, whose side is that of `coarse` over `factor`. */
static inline size_t pyramid_around(const struct pyramid_level *coarse, int factor, int x, int y)
{
    int column = x / factor, row = y / factor;
    column = column < coarse->nx ? column : coarse->nx - 1;
    row = row < coarse->ny ? row : coarse->ny - 1;
    return (size_t)row * (size_t)coarse->nx + (size_t)column;
}

#endif
