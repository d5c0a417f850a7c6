/* The scores of sign_flip.h, pixel by pixel, and their sums. Used by sign_flip.c only. */
#ifndef ASSAY_SIGN_FLIP_SCORE_H
#define ASSAY_SIGN_FLIP_SCORE_H

#include "sign_flip.h"

/* What is judged: one pixel in filter_width^2 of every pair of renders, in one channel. */
struct sheet {
    int width, height, num;
    size_t pixels, values;  /* values: num x pixels */
    double *a, *b;          /* values; the one allocation begins at a */
    double *score, *square; /* values */
    double *mean, *scale;   /* pixels: local mean of both sides, local scale of d */
    double *own;     /* pixels: standard error of A - B that the renders state; 0: not known */
    double *work[2]; /* pixels */
    double
        *sum[2]; /* (width + 1)(height + 1): summed-area tables of score and of square */
};

/* width, height and num are set. Fails only out of memory. Release with sheet_free(). */
NODISCARD bool sheet_alloc(struct sheet *s, struct err *e);
void sheet_free(struct sheet *s);

/* Loads the channel's values at the centres of cells of filter x filter pixels, and their local mean. */
void sheet_load(struct sheet *s, const struct sign_flip_images *in, int filter, int channel);

/* Computes the scores, their squares, and the sums of both. */
void sheet_score(struct sheet *s, enum sign_flip_score score);

/* The same, as expected for the level if A is brighter by the fraction `change` and the noise is as seen, over both of
 * its signs. The level must have been scored before. */
void sheet_expect(struct sheet *s, double change);

/* Do neighbours, or the pixels of a row or column (line_noise.h), look as if they shared noise? Of neighbours it sums
 * products of adjacent scores, minus the block's mean, in blocks of 8 x 8 pixels of which at least a fifth has the other
 * sign, so that there is noise and not only a difference: with independent noise half of the blocks' sums are positive,
 * with a filter nearly all. Fails only out of memory. */
NODISCARD bool sheet_shares_noise(const struct sheet *s, bool *shares, struct err *e);

/* Sum over r of the scores (which = 0) or their squares (1). */
double sheet_sum(const struct sheet *s, int which, struct rect r);
/* A window's sum of squares below this share of the image's may be nothing but rounding. */
extern const double sheet_lost_digits;

/* All windows of one size; the last one touches the right or lower border, so the step to it may be shorter. */
struct windows {
    int width, height, step, nx, ny;
};
size_t windows_num(const struct windows *w);
struct rect windows_rect(const struct windows *w, const struct sheet *s, size_t i);

#endif
