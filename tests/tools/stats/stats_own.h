/* Shared by the tests of convergence and of variances. RNG and REFERENCE declare variables freed at the end of their
 * block. */
#ifndef ASSAY_TESTS_STATS_OWN_H
#define ASSAY_TESTS_STATS_OWN_H

#include "tools/stats/convergence_rate.h"

#include <gsl/gsl_rng.h>

static inline void stats_own_free_rng(gsl_rng **rng)
{
    gsl_rng_free(*rng);
}
#define RNG __attribute__((cleanup(stats_own_free_rng))) gsl_rng
#define REFERENCE                                                                                  \
    __attribute__((cleanup(convergence_rate_reference_free))) struct converge_reference

static inline gsl_rng *new_rng(unsigned long seed)
{
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    gsl_rng_set(rng, seed);
    return rng;
}

#endif
