/* The assignment's stopping rule of adaptive sampling: its bias and its number of samples, for a program
 * whose samples are noisier than ours. */
#ifndef ASSAY_STOPPING_RULE_H
#define ASSAY_STOPPING_RULE_H

#include "difference.h"
#include "tools/submission/rubric.h"

/* The rule: after every `batch` samples of a pixel stop if 1.96 sqrt(var/n) <= tolerance mean. It is
 * biased: a pixel whose first batch is black by chance stays black. Bias and number of samples depend on
 * mean, variance and shape of the distribution of samples. Mean and variance are known: those of our
 * samples, times kappa, the noise of the student's image over what ours would have at the counts of its
 * rate image, tile by tile (difference.h). The shape is not known, so several are simulated: no
 * fluctuation; samples c or c + a with c = 0, the shape that is black most often; and rarer, higher a
 * over a brighter c. Each in 8 runs, with kappa at both ends of its interval. */
enum stopping_kind {
    STOPS_RIGHTLY,
    STOPS_BY_ONE_SIGMA, /* sqrt(var/n) <= tolerance mean */
    STOPS_BY_ABSOLUTE,  /* 1.96 sqrt(var/n) <= tolerance */
    STOPS_BY_N,         /* 1.96 sqrt(var)/n <= tolerance mean */
    STOPS_BY_SIGMA,     /* 1.96 sqrt(var) <= tolerance mean */
    STOPS_AT_ONCE,      /* after the first batch, whatever its noise */
    STOPS_NEVER,
    NUM_STOPPING_KINDS
};

struct stopping {
    double least, most; /* mean samples a pixel, over all shapes and kappas */
    double *low, *high; /* of each tile: relative bias, low <= 0 <= high; NULL: not asked for */
};

/* s: the student's image with its expected variance; right: the reference; m: a render of ours that
 * does not stop. False: out of memory; else the caller frees *out with stopping_rule_free(). */
NODISCARD bool stopping_rule_range(const struct rubric_image *p, const struct submitted_image *s,
                                   const struct submitted_image *right, const struct moments *m,
                                   const unsigned char *use, struct stopping *out, struct err *e);
/* The rule of a program with this bug of the catalogue. */
enum stopping_kind stopping_rule_of(const char *bug);

/* How many samples s takes by each rule, given the light and the noise that it shows, whatever its other
 * mistakes: each tile has its own mean, and kappa compares its variance with ours at the right image. m
 * as above. Fails only out of memory (where too little can be compared kappa is 1); out[].low and high
 * stay NULL. */
NODISCARD bool stopping_rule_samples(const struct rubric_image *p, const struct submitted_image *s,
                                     const struct moments *m,
                                     struct stopping out[NUM_STOPPING_KINDS], struct err *e);
void stopping_rule_free(struct stopping *s);

#endif
