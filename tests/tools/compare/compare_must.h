/* What the tests of comparisons share. */
#ifndef ASSAY_TESTS_COMPARE_MUST_H
#define ASSAY_TESTS_COMPARE_MUST_H

#include "tools/compare/compare.h"
#include "tests/support/own.h"
#include "tests/support/simulate.h"
#include "tests/support/test.h"

/* The comparison of a with b, to be freed by the caller; fails the test if it cannot be made. */
static inline struct comparison compare(const struct moments *a, const struct moments *b,
                                        struct compare_options opt)
{
    struct comparison c;
    struct err e;
    MUST(compare_moments(a, b, &opt, &c, &e));
    return c;
}

/* Fills both sides with n samples a pixel of the law, of mean 1, the same law and mean on both. */
static inline void simulate_pair(struct moments *a, struct moments *b, enum law law, int n,
                                 bool is_grey, uint64_t *seed)
{
    simulate(a, law, 1, n, is_grey, seed);
    simulate(b, law, 1, n, is_grey, seed);
}

#endif
