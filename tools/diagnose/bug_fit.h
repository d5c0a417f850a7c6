/* How well a known bug, or two of them at once, explain images: likelihood, and what is left. Formulas and reasons:
 * tools/docs/background/diagnosis.md. */
#ifndef ASSAY_BUG_FIT_H
#define ASSAY_BUG_FIT_H

#include "diagnose.h"

struct tally {
    double log_likelihood;
    double chi2, chi2_mean, cells; /* of what is left; its mean if that is noise */
    double fact;                   /* the largest z^2 of a fact */
    double left,
        all; /* in the same weights: what is left, and without the bug; of a view 0 where it is noise */
};

struct bug_fit {
    const struct catalogue *c;
    const struct observation *clue;
    int num_clues;
    double clip;           /* radiance of the brightest code; 0: none */
    struct tally *correct; /* of each clue, without a bug; NULL: made anew */
    bool
        states_error; /* set after the start: strengths are those without the noise of the stored effect */
};

/* How well an effect is known to be the same at another size, and what floats, stored and rendered, are good for: relative. */
extern const double bug_fit_model_error, bug_fit_rounding;
/* Standard deviations by which what is left may exceed its mean and still be noise. */
extern const double bug_fit_largest_excess;

/* Clues and catalogue have to outlive it. The caller ends it. */
NODISCARD bool bug_fit_start(const struct catalogue *c, const struct observation *clue,
                             int num_clues, double clip, struct bug_fit *out, struct err *e);
void bug_fit_end(struct bug_fit *f);

/* What two bugs do to a view: where each changes a cell by a factor, the product of both; with `adds`, where the correct image
 * is dark, or where both add more than twice its light, the sum. Half the difference between the two is a standard deviation. second -1: `bug` alone. NULL: nothing at all; else the
 * catalogue's, or *room. */
const struct effect *bug_fit_effect(const struct view *v, int bug, int second, bool adds,
                                    double clip, struct effect *room);

/* The hypothesis at this strength of its effect. */
struct candidate bug_fit_at(const struct bug_fit *f, int bug, int second, double amplitude);
/* The directed statistic over all views. */
double bug_fit_t(const struct bug_fit *f, const struct candidate *c);
/* The strength that fits best: least squares with the weights of "correct"; refined to the largest likelihood from there. */
double bug_fit_amplitude(const struct bug_fit *f, int bug);
double bug_fit_refine(const struct bug_fit *f, int bug, double at);

/* Is the effect there, and at its full strength: of two bugs each, where the other is taken for granted? */
bool bug_fit_is_full(const struct bug_fit *f, const struct candidate *c);
/* The largest share of its difference that a view keeps where what is left, in cells or a fact, is no noise, and which view; -1
 * and 0: none. */
double bug_fit_worst(const struct bug_fit *f, const struct candidate *c, int *clue);

/* One view by a candidate; NULL: without a bug. */
struct tally bug_fit_view(const struct bug_fit *f, int clue, const struct candidate *candidate);

#endif
