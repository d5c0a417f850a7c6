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
    double *mean, *scale;   /* pixels: local, of both sides */
    double *own;     /* pixels: standard error of A - B that the renders state; 0: not known */
    double *work[2]; /* pixels */
    double
        *sum[2]; /* (width + 1)(height + 1): of score and of square, of all above and to the left */
};

/* width, height and num are set. Fails only out of memory. Release with sheet_free(). */
NODISCARD bool sheet_alloc(struct sheet *s, struct err *e);
void sheet_free(struct sheet *s);

/* The channel's values, in the middles of cells of filter x filter pixels. */
void sheet_load(struct sheet *s, const struct sign_flip_images *in, int filter, int channel);

/* score, its square, and their sums. */
void sheet_score(struct sheet *s, enum sign_flip_score score);

/* The same as they are to be expected of the level, after it has been scored, where A is brighter by the part `change`
 * and the noise as it is, whatever its signs. */
void sheet_expect(struct sheet *s, double change);

/* Do neighbours look as if they shared noise? Products of scores next to each other, less the block's mean, in blocks of 8 x 8 pixels
 * of which a fifth at least has the other sign, so that there is noise and not only a difference: by independent noise every
 * other block's sum is positive, by a filter nearly all are. */
bool sheet_shares_noise(const struct sheet *s);

/* Of score (0) or its square (1). */
double sheet_sum(const struct sheet *s, int which, struct rect r);
/* Of the sum over all pixels: a window's part that is smaller may be rounding. */
extern const double sheet_lost_digits;

/* All windows of one size; there is a last one at each border, the step to it may be shorter. */
struct windows {
    int width, height, step, nx, ny;
};
size_t windows_num(const struct windows *w);
struct rect windows_rect(const struct windows *w, const struct sheet *s, size_t i);

#endif
