/* What the assignment's rule of stopping does to the samples of a program that are noisier than ours. */
#ifndef ASSAY_STOPPING_RULE_H
#define ASSAY_STOPPING_RULE_H

#include "difference.h"
#include "tools/submission/rubric.h"

/* The rule: after every `batch` samples of a pixel stop if 1.96 sqrt(var/n) <= tolerance mean. It is biased: a pixel whose first
 * batch is black by chance stays black. By how much, and after how many samples it stops, depends on mean, variance and shape of the
 * samples. Mean and variance are known: those of our samples, and kappa, the noise of the student's image over what
 * ours would have at the counts of its rate image, tile by tile (difference.h). The shape is not, so several are tried: no
 * fluctuation; a sample c or c + a with c = 0, which is the shape that is black most often; and rarer, higher a over a
 * brighter c. Each by simulation (8 runs), with kappa at both ends of its interval. */
enum stopping_kind {
    STOPS_RIGHTLY,
    STOPS_BY_ONE_SIGMA, /* sqrt(var/n) <= tolerance mean */
    STOPS_BY_ABSOLUTE,  /* 1.96 sqrt(var/n) <= tolerance */
    STOPS_BY_N,         /* 1.96 sqrt(var)/n <= tolerance mean */
    STOPS_BY_SIGMA,     /* 1.96 sqrt(var) <= tolerance mean */
    STOPS_NEVER,
    NUM_STOPPING_KINDS
};

struct stopping {
    double least, most; /* samples a pixel on average, over all these */
    double *low, *high; /* of each tile: relative bias, low <= 0 <= high; NULL: not asked for */
};

/* s: the student's, with its expected variance; right: the reference, m: of ours without stopping. False: no memory. */
NODISCARD bool stopping_rule_range(const struct rubric_image *p, const struct submitted_image *s,
                                   const struct submitted_image *right, const struct moments *m,
                                   const unsigned char *use, struct stopping *out, struct err *e);
/* The rule of a program with this bug of the catalogue. */
enum stopping_kind stopping_rule_of(const char *bug);

/* How many samples s takes by each rule, if it has the light and the noise that it shows, whatever its other mistakes: the mean
 * of each tile is its own, and kappa holds its variance against ours at the right image. m as above. Fails where
 * too little of the image says something. */
NODISCARD bool stopping_rule_samples(const struct rubric_image *p, const struct submitted_image *s,
                                     const struct moments *m,
                                     struct stopping out[NUM_STOPPING_KINDS], struct err *e);
void stopping_rule_free(struct stopping *s);

#endif
