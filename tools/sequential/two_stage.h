/* Two stages: DIFFERENT only if a second, fresh pair of renders confirms what the first pair showed.
 *
 * Stage 1 tests everything at sqrt(alpha). What it flags, at most one test of each statistic (its
 * smallest p; image and pyramid count as one), is tested again on the second pair: the same region in
 * the same channel with the same sign, or the same named test, at sqrt(alpha) divided by the number
 * flagged. Both pairs are independent, so equal renderers are called DIFFERENT with a chance of at
 * most sqrt(alpha)^2, and no tail of any law has to be known further out than sqrt(alpha).
 *
 * A wrong EQUIVALENT has the chance alpha over both stages together: each may say it at alpha/2.
 *
 *     two_stage_first(a, b, opt, &first, e)        DIFFERENT means: flagged; any other verdict is final
 *     .. render A and B again, both with seeds never used before ..
 *     two_stage_confirm(&first, a2, b2, opt, &second, e)            second->verdict is the claim's
 */
#ifndef ASSAY_TWO_STAGE_H
#define ASSAY_TWO_STAGE_H

#include "tools/compare/compare.h"

/* sqrt(alpha): the level of one stage. */
double two_stage_alpha(double alpha);

/* Stage 1. opt->alpha is that of the whole claim. Where nothing is flagged, out is the comparison at
 * alpha/2, and its verdict is final; else it is the one at sqrt(alpha),
 * and DIFFERENT. Its mdb is then no bound of what two stages miss; that of the unflagged one is
 * (for alpha up to 1e-2), as alpha/2 is stricter than two stages. Fails as compare_moments() does. */
NODISCARD bool two_stage_first(const struct moments *a, const struct moments *b,
                               const struct compare_options *opt, struct comparison *out,
                               struct err *e);

/* Stage 2, for a `first` that is DIFFERENT by two_stage_first() (same opt). Both a2 and b2 must have been
 * observed afresh, unless exact: a stored reference used in both stages puts its own noise into
 * both. second: the comparison of the second pair at alpha/2 with the claim's verdict: DIFFERENT if
 * confirmed; else what the second pair says by itself, where DIFFERENT (at another place, which
 * needs another fresh pair) becomes INCONCLUSIVE. Its reason tells of both stages. */
NODISCARD bool two_stage_confirm(const struct comparison *first, const struct moments *a2,
                                 const struct moments *b2, const struct compare_options *opt,
                                 struct comparison *second, struct err *e);

/* Fails with a line if the second observation of a side has the very numbers of the first (the seed
 * was ignored, or the file is the same), other than exact ones, or another size or unit. */
NODISCARD bool two_stage_check_fresh(const struct moments *first, const struct moments *again,
                                     struct err *e);

#endif
