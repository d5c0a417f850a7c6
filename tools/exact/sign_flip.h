/* "Has the law of any pixel changed?" between two versions of one program, from as few as one render a side.
 *
 * H0: pixel p of A and of B are two independent draws of one law (its own in each pixel), and pixels are independent.
 * Then, given the unordered pairs {a_p, b_p}, which of the two is A's is a fair coin in every pixel, all channels
 * together: exchanging them flips the sign of any score s_p that is odd in the exchange, and |s_p| may depend on the
 * unordered pairs of all pixels. Whatever the law (fireflies, codes of a PNG, 1 sample a pixel), over any window
 *   T = sum s_p / sqrt(sum s_p^2) = sum a_p e_p,  a_p >= 0,  sum a_p^2 = 1,  e_p = +-1 with probability 1/2 each, and
 *   P(T >= t) <= c Q(t), c = 1/(4 Q(sqrt 2)) = 3.178, Q the tail of the normal law       [BentkusDzindzalieta15, theorem 1.1],
 *   P(T >= t) <= e^(K(l) - l t) E, K(l) = sum ln cosh(l a_p), for any l >= 0, where
 *     E = min(1, e^(r (r/2 - w)) Q(r - w) + 1.12 sum a_p^3 (1 - h_p^4) / v^(3/2)), h_p = tanh(l a_p), v = sum a_p^2 (1 - h_p^2),
 *     r = l sqrt v, w = (sum a_p h_p - t)/sqrt v.
 * The second is the saddle point's with its error: under signs of chance (1 + h_p)/2, P(T >= t) = e^(K - l t) times the mean of
 * e^(-l (T - t)) where T >= t, at most 1 [Chernoff52], and by parts within twice the distance of the law of T from the normal of
 * the same mean and variance, which is at most 0.56 sum E|X - EX|^3 / v^(3/2) [Shevtsova10]. Both hold for every t and all
 * a_p, so the p below is no approximation at any level; the smaller is taken.
 *
 * Scores of the difference d = a - b, with f(x) = x/(1 + x^2/8), the score of Student's law with 8 degrees of freedom, so that a
 * firefly weighs less than a pixel [Lange89], and "around" for the mean over 9 x 9 pixels:
 *   level   sqrt(m/s) f(d/s), in R, G, B and luminance; m the radiance around, s the geometric mean of |d| around.
 *           Where the renders state the error e of their difference, e^(3/4) s^(1/4) for s, and the pixel's own m.
 *   mean    d itself, in the same: sees what only rare bright samples show
 *   spread  f(v/s), of v = |a - m| - |b - m| in luminance: noise that has changed, with s of |v|
 * Over squares of sides 4, 6, 8, 11, 16, .. up to the image, an eighth of their side apart, so that a region need not
 * lie on any grid. Bonferroni with shares: 0.6 for the level, 0.25 the mean, 0.15 the spread; 0.6 of each for luminance;
 * equal parts for each side. Sides whose windows have too few pixels to reach alpha are left out. */
#ifndef ASSAY_SIGN_FLIP_H
#define ASSAY_SIGN_FLIP_H

#include "tools/compare/pyramid.h"

/* 3 numbers a pixel. The k-th of A and of B make a pair. */
struct sign_flip_images {
    int num, width, height;
    float *const *a, *const *b; /* num renders each */
    const float *error; /* standard error of A - B as both renders state it, of num = 1; or NULL */
};

struct sign_flip_options {
    double alpha; /* for the MDB, and for which sizes of windows are left out */
    int filter_width; /* pixels less than this apart in x and in y may share noise: one in filter_width^2 is judged.
                         1: all; 0: all, and a check whether they share noise */
    int tile; /* side, pixels: for mdb_tile */
};

enum sign_flip_score { SIGN_FLIP_LEVEL, SIGN_FLIP_MEAN, SIGN_FLIP_SPREAD, NUM_SIGN_FLIP_SCORES };
extern const char *const sign_flip_score_name[NUM_SIGN_FLIP_SCORES];

struct sign_flip {
    double log10_p;    /* of all tests together: the smallest p divided by its share; at most 0 */
    int width, height; /* of the images */
    bool
        shares_noise; /* filter_width 0: neighbours look as if they shared noise, and then p means nothing */
    size_t num_tests;  /* windows, channels and scores */
    size_t num_pixels; /* judged, each with a coin for each pair of renders */
    /* Of the test with the smallest p: */
    enum sign_flip_score score;
    struct rect rect;
    int channel; /* 0..2 RGB, 3 luminance */
    double t;
    double difference; /* of the means there, over that of B */
    double larger;     /* share of its differing pixels in which A is larger */
    /* The relative change of the level that is found with about 95 %, of the image and of the worst
     * window of a tile's side; region_mdb_none where none is. To first order. */
    double mdb_global, mdb_tile;
};

/* Fails with a line where no pixel of any pair differs, and out of memory. */
NODISCARD bool sign_flip_test(const struct sign_flip_images *in,
                              const struct sign_flip_options *opt, struct sign_flip *out,
                              struct err *e);

/* log10 of the bound on P(|sum of s e| >= |sum of s|), s of num > 0 numbers, not all 0; at most 0. */
double sign_flip_log10_p(const double *s, size_t num);

#endif
