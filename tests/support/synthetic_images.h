/* Many synthetic images of one law, cheaply: pixels are put together from a library of blocks of n
 * draws, picked at random with replacement, while every image renews some of the blocks. Two images
 * of one library are exchangeable, so equal means hold between them exactly, and against the library's
 * mean; the law's own mean it has only up to 1/sqrt(blocks) of a block's standard deviation. */
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
/* Every pixel of `merge` blocks, so n = merge * l->n; the channels are one and the same (grey) or
 * independent. No pixel has the very numbers of `other`'s, unless it has no noise: that would be a
 * seed used twice. NULL: no such image. */
void library_image(struct library *l, int merge, bool is_grey, const struct moments *other,
                   struct moments *m);

#endif
