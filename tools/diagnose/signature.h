/* What a diagnosis sees of a scene's image: means over a coarse grid of cells, their uncertainty, and a
 * few facts about the noise.
 *
 * A cell is a square of pixels; across an image there are at most SIGNATURE_SIDE cells, a number that is fixed for
 * each scene, so images of any size whose sides are whole numbers of cells can be compared with each other,
 * as long as they show the same field of view. Cells are numbered row by row from the top left; each has three channels, RGB. */
#ifndef ASSAY_SIGNATURE_H
#define ASSAY_SIGNATURE_H

#include "renderer/image/moments.h"
#include "tools/stats/stated_error.h"

enum {
    SIGNATURE_SIDE = 16,
    SIGNATURE_CELLS = SIGNATURE_SIDE * SIGNATURE_SIDE,
    SIGNATURE_VALUES = 3 * SIGNATURE_CELLS
};

/* Logarithms of ratios that are 1 for an image made as asked by a renderer that states its error correctly. */
enum fact {
    FACT_SAMPLES, /* samples in a pixel over samples asked for */
    FACT_SPREAD,  /* variance of one sample over that of the correct renderer */
    FACT_PIXELS,  /* R of stated_error.h */
    FACT_IMAGE,   /* S of stated_error.h */
    NUM_FACTS
};

struct signature {
    int columns, rows, cell; /* cell: its side in pixels; of an average, the first one's */
    double mean[SIGNATURE_VALUES];
    double var[SIGNATURE_VALUES]; /* of the mean */
    double k3[SIGNATURE_VALUES];  /* third cumulant of the mean */
    double
        spread[SIGNATURE_CELLS]; /* variance of one sample, sum over channels, mean over pixels */
    double n;                    /* samples in a cell, mean over cells; of an average their sum */
    double fact[NUM_FACTS];      /* NAN: not known */
    double fact_sd[NUM_FACTS];
};

/* columns: cells across, at most SIGNATURE_SIDE. asked: samples per pixel that were asked for; 0: not known. Fails on
 * sides that are not whole numbers of cells, on pixels with fewer than 2 observations, and on moments that do not state
 * an error ("stratified", "exact"). FACT_SAMPLES is known if `asked` is. */
NODISCARD bool signature_of(const struct moments *m, int columns, double asked,
                            struct signature *out, struct err *e);

/* The mean over cells and channels. */
double signature_mean(const struct signature *s);

/* The average of num >= 1 independent signatures of one shape, as of one longer render; FACT_SAMPLES is
 * averaged, the other facts are those of the first. */
struct signature signature_average(const struct signature *s, int num);

/* FACT_PIXELS and FACT_IMAGE from R with its 1 - alpha interval and S over `renders` images. Two images
 * that are the same have R = 0, kept as a logarithm of SIGNATURE_SAME. */
#define SIGNATURE_SAME (-10.0)
void signature_set_stated_error(struct signature *s, double pixels, double lo, double hi,
                                double image, int renders, double alpha);

/* FACT_SPREAD of s against the correct renderer's: log ratio of the sums of `spread`, its standard deviation
 * from the residuals of the cells (ratio estimator). Unknown where either has no spread. If pixels have another
 * size, it is known only to about a third, as the variance of a sample depends on how much a pixel covers. */
void signature_set_spread(struct signature *s, const struct signature *correct);

/* s with at least the variance and the third cumulant that means of the correct renderer have at as many samples: a render
 * that happens to miss rare bright samples states less of both than is true of it. */
struct signature signature_as_noisy_as(const struct signature *s, const struct signature *correct);

/* The same as moments over cells, for compare_moments(): n, M2 and M3 such that the variance and the third
 * cumulant of the mean are those of the signature. The caller frees them. */
NODISCARD bool signature_moments(const struct signature *s, struct moments *out, struct err *e);

#endif
