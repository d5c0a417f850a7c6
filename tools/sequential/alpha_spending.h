/* Group-sequential testing: one claim is judged at several looks with growing numbers of samples,
 * and alpha spending keeps its error rate. How the alpha of a run is divided among its claims:
 * tools/validate/validate.c.
 *
 * Sizes of the looks, in units of the scene's declared samples, and what part of the claim's alpha each
 * may spend, are constants: nothing in the images changes them. With alpha_l = share_l alpha, compare.h
 * bounds the chance of a wrong DIFFERENT, and of a wrong EQUIVALENT, at look l by alpha_l. Whatever the
 * rule by which looks end (decided, the time is over, someone loses patience), a wrong verdict needs one
 * look to be wrong, so its chance is at most sum_l alpha_l <= alpha: the union bound, for any
 * dependence between looks. They share samples, so it is far from equality; the printed alpha is a
 * bound [Pocock77, LanDeMets83: spending; here without their joint law, which no heavy tail keeps].
 *
 *     size    1/64  1/16  1/4  1/2    1    2     4      8
 *     share    2 %   4 %  6 %  8 %  60 %  10 %   5 %  2.5 %   alpha_spending_open: 97.5 %
 *              2 %   4 %  6 %  8 %  80 %                      alpha_spending_declared
 *                                  100 %                      alpha_spending_single
 *
 * Most is spent at the declared size: that is what the scene's margins were planned for. The small
 * looks are for what is far off or was planned too long, the large ones for what was planned too short.
 *
 * Two stages (two_stage.h): look l flags at sqrt(alpha_l) on one pair of streams of samples and confirms at
 * sqrt(alpha_l) on another, of fresh seeds, at the same size. Both streams grow from look to look, but
 * never touch: P(flagged and confirmed at look l) <= alpha_l, and the union bound goes on as above. */
#ifndef ASSAY_ALPHA_SPENDING_H
#define ASSAY_ALPHA_SPENDING_H

#include "tools/compare/compare.h"

enum { NUM_LOOKS = 8, LOOK_DECLARED = 4 };

struct alpha_spending {
    double share[NUM_LOOKS]; /* 0: no look */
};
extern const struct alpha_spending alpha_spending_single, alpha_spending_declared,
    alpha_spending_open;

/* The number of observations of a side at a look, if `declared` are declared; 0 if that is fewer than
 * `least`, for which no error rates were measured. From LOOK_DECLARED on it is never 0; at most 2^24. */
int alpha_spending_count(int look, int declared, int least);

/* The observations so far of A and B at this look: stage 0, or stage 1 of fresh seeds (exact sides are
 * the same). False with a line if there are none. */
typedef bool (*alpha_spending_pair)(void *ctx, int stage, const struct moments **a,
                                    const struct moments **b, struct err *e);

/* One look. opt->alpha is that of the whole claim; share[look] > 0; stages 1 or 2. *stage tells which
 * pair out is of. DIFFERENT and EQUIVALENT are final, the others are not. Fails as compare_moments()
 * and pair() do, and if the fresh pair is the first pair again. */
NODISCARD bool alpha_spending_judge(const struct alpha_spending *q, int look, int stages,
                                    const struct compare_options *opt, alpha_spending_pair pair,
                                    void *ctx, struct comparison *out, int *stage, struct err *e);

#endif
