/* Does a renderer waste samples? The noise that it states is compared with the closed form of its estimator's
 * noise (reference/truth/truth_noise.h) for the number of samples that was asked for:
 *
 *   ratio = spp sum var(mean) / sum V
 *
 * var(mean) = M2/(n(n-1)) as stated, V the variance of one sample, sums over pixels and channels. 1 for a
 * renderer that takes all its samples by its documented estimator; 2 if every other sample is skipped or
 * thrown away. Whether the statement itself holds is asked by stated_error.h. */
#ifndef ASSAY_SAMPLE_EFFICIENCY_H
#define ASSAY_SAMPLE_EFFICIENCY_H

#include "reference/suite/suite.h"
#include "renderer/image/moments.h"

struct sample_efficiency {
    enum verdict verdict;
    char reason[256];
    double ratio, lo, hi; /* 1 - alpha interval */
};

/* Of num >= 4 independent renders of the same size with spp samples asked for; variance: 3 numbers a
 * pixel. The interval of ln ratio is Student's, from the spread between renders. DIFFERENT if it
 * lies outside [1/(1 + margin), 1 + margin], EQUIVALENT if inside, else INCONCLUSIVE. alpha as of
 * stated_error_judge(). Fails where a pixel has less than two samples, and where nothing has noise. */
NODISCARD bool sample_efficiency_judge(const struct moments *render, int num, int spp,
                                       const double *variance, double margin, double alpha,
                                       struct sample_efficiency *out, struct err *e);

#endif
