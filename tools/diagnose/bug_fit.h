/* How well a known bug, or two of them at once, explain images: likelihood, and what is left. Formulas and reasons:
 * tools/docs/background/diagnosis.md. */
#ifndef ASSAY_BUG_FIT_H
#define ASSAY_BUG_FIT_H

#include "diagnose.h"

struct tally {
    double log_likelihood;
    double chi2, chi2_mean, cells; /* chi-square of the residual; its mean if that is noise; number of values */
    double fact;                   /* the largest z^2 of a fact */
    double left,
        all; /* weighted squared residual with and without the bug; of a view, 0 if it is within noise */
};

struct bug_fit {
    const struct catalogue *c;
    const struct observation *clue;
    int num_clues;
    double clip;           /* radiance of the brightest code; 0: none */
    struct tally *correct; /* of each clue, without a bug; NULL: computed when needed */
    bool
        states_error; /* set by the caller after the start: strengths are corrected for the stored effects' noise */
};

/* Relative errors: of an effect at another image size, and of floats, stored or rendered. */
extern const double bug_fit_model_error, bug_fit_rounding;
/* Standard deviations by which the residual's chi-square may exceed its mean and still be noise. */
extern const double bug_fit_largest_excess;

/* Clues and catalogue have to outlive it. The caller ends it. */
NODISCARD bool bug_fit_start(const struct catalogue *c, const struct observation *clue,
                             int num_clues, double clip, struct bug_fit *out, struct err *e);
void bug_fit_end(struct bug_fit *f);

/* The effect of two bugs on a view: the product of the factors by which they change a cell; with `adds`, in dark cells,
 * and where each adds more than twice the correct light, the sum of their changes. Half the difference between product
 * and sum counts as a standard deviation. second -1: `bug` alone. Returns NULL if there is no effect, else the
 * catalogue's effect or *room. */
const struct effect *bug_fit_effect(const struct view *v, int bug, int second, bool adds,
                                    double clip, struct effect *room);

/* Evaluates a hypothesis at this strength of its effect. */
struct candidate bug_fit_at(const struct bug_fit *f, int bug, int second, double amplitude);
/* The directed statistic over all views. */
double bug_fit_t(const struct bug_fit *f, const struct candidate *c);
/* The strength that fits best, by least squares with the weights of "correct"; and, from `at`, by maximum
 * likelihood. */
double bug_fit_amplitude(const struct bug_fit *f, int bug);
double bug_fit_refine(const struct bug_fit *f, int bug, double at);

/* Is the effect there at its full strength? Of two bugs: that of each, given the other? */
bool bug_fit_is_full(const struct bug_fit *f, const struct candidate *c);
/* Among views whose residual, in cells or in a fact, is more than noise: the largest share of the difference that
 * remains, and in *clue that view. 0 and -1 if there is none. */
double bug_fit_worst(const struct bug_fit *f, const struct candidate *c, int *clue);

/* The tally of one view under a candidate; NULL: without a bug. */
struct tally bug_fit_view(const struct bug_fit *f, int clue, const struct candidate *candidate);

#endif
