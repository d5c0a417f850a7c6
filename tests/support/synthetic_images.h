/* Many synthetic images of one law, cheaply: pixels are composed from a library of blocks of n
 * draws, picked at random with replacement; library_renew() replaces blocks. Two images of one
 * library are exchangeable, so their expected means are exactly equal, and equal to library_mean();
 * that differs from the law's mean by about 1/sqrt(blocks) of a block's standard deviation. */
#ifndef ASSAY_TESTS_SYNTHETIC_IMAGES_H
#define ASSAY_TESTS_SYNTHETIC_IMAGES_H

#include "simulate.h"

/* Sums of (x - 1)^k over the draws of a block: they add, and 1 is every law's mean. */
struct block {
    double s1, s2, s3;
};

struct library {
    enum law law;
    int n; /* draws of a block */
    size_t num, next;
    struct block *block;
    double sum; /* of all s1 */
    uint64_t state;
};

/* Fails only out of memory. Release with library_free(). */
NODISCARD bool library_init(struct library *l, enum law law, int n, size_t num, uint64_t seed,
                            struct err *e);
void library_free(struct library *l);
/* Draws `num` blocks anew, the oldest first. */
void library_renew(struct library *l, size_t num);
/* What every pixel's mean is expected to be, given the library. */
double library_mean(const struct library *l);
/* Fills *m with pixels of `merge` blocks each, so n = merge * l->n; the channels are equal
 * (is_grey) or independent. No pixel has the very values of `other`'s, unless it has no noise: that
 * would be a seed used twice. other NULL: no such image. */
void library_image(struct library *l, int merge, bool is_grey, const struct moments *other,
                   struct moments *m);

#endif
