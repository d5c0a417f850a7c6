/* Submissions that have the same noise: for staff to look at, never worth points. Programs with random numbers of
 * their own err independently of each other, even if both are right or share an idea; a copy, or an image rendered by
 * somebody else's program, has the errors of its original, retouched or not. So has a program with the same fixed seed
 * that follows the same text to the letter.
 *
 * An image less its reference in blocks of 2 x 2 pixels, green: the three differences that are orthogonal to the mean (Haar
 * details), in which what differs smoothly hardly shows. P = sum over the three of A times B, less what both have of the
 * reference's noise. If A and B are independent, E[P] = 0, blocks are independent, and the distribution of P is
 * symmetric, as that of a difference of similar pixels is; then T = sum P / sqrt(sum P^2) exceeds x with a probability
 * of at most exp(-x^2/2) [Efron69]. Two images with the same noise have T of about 0.6 times the square root of the
 * number of blocks. */
#ifndef ASSAY_SAME_NOISE_H
#define ASSAY_SAME_NOISE_H

#include "tools/grade/grade_checks.h"

#include <jansson.h>

enum { SAME_NOISE_FEWEST = 150 }; /* blocks that two images have to have in common */

struct noise_print {
    int blocks;
    float *detail; /* 3 per block; NAN: not used */
    float *shared; /* per block: what the reference's noise adds to P */
};

/* The noise print of an image of spp samples, whose reference is m. A block is used if none of its
 * pixels is near the clipping point (submitted_image.h) and noise like ours is at least a code
 * wide: finer noise is rounded alike in all images. An image with less than a quarter of our noise
 * gets no blocks. False: out of memory. The caller frees with same_noise_free(). */
NODISCARD bool same_noise_of(const struct submitted_image *s, const struct moments *m, double spp,
                             struct noise_print *out, struct err *e);
void same_noise_free(struct noise_print *n);

/* T of "the reference m is in this image", with whatever noise added. twin: a render like m of another seed. In the same
 * details, P = sum of (s - (m + twin)/2) times (m - twin): whatever s is, if it was made without m, exchanging m and twin
 * changes only the sign of P, in each block by itself, so that the bound below is exact; with m in s, E[P] is the variance
 * of its details. NAN where fewer than SAME_NOISE_FEWEST blocks have noise that is not clipped. */
double same_noise_copy_t(const struct submitted_image *s, const struct moments *m,
                         const struct moments *twin);

/* T, NAN where fewer than SAME_NOISE_FEWEST blocks are used in both. */
double same_noise_t(const struct noise_print *a, const struct noise_print *b);
/* What T has to exceed for a chance of alpha over `tests` of them. */
double same_noise_bound(double tests, double alpha);

/* Compares each submission with the reference, and every pair of a class, by the images in out/ID
 * that cost neither of them points in an `equal` check (a bug that both have would not be noise);
 * at most ALPHA false alarms a class on average for each of the two. A grade with the noise of
 * others gets "alike": [{"id": , "picture": , "t": , "bound": }], the first such image of each
 * other; one with the reference's noise gets "copied": [{"picture": , "t": , "bound": }], also
 * without "picture" for all its images together (T summed over the root of their number, for which
 * the same bound holds). */
#define SAME_NOISE_ALPHA 1e-3
NODISCARD bool same_noise(const char *out, const struct rubric *r, const struct answer_key *a,
                          json_t *grades, struct err *e);

#endif
