/* Which known bug explains these images? Method, formulas and limits: tools/docs/background/diagnosis.md. */
#ifndef ASSAY_DIAGNOSE_H
#define ASSAY_DIAGNOSE_H

#include "catalogue.h"

enum { DIAGNOSE_CANDIDATES = 8 };

/* One look at the tested renderer. */
struct observation {
    const struct view *view;
    struct signature seen; /* with the facts that are known */
    bool is_consistent; /* false: a claim of consistency came out DIFFERENT at its share of alpha */
    double
        margin; /* relative: how far another program may differ from ours by convention; 0: not at all */
};

struct diagnose_options {
    double alpha; /* bounds the chance that a correct renderer is accused of anything */
    const char
        *without; /* a bug to leave out of the hypotheses, as if it were not known; NULL: none */
    bool
        by_likelihood; /* no other test shows that something is wrong, as for images that state no
                        * error. A bug must then exceed "correct" by diagnose_bound() and explain
                        * what stands out from noise */
    bool pairs;  /* with by_likelihood: if no single bug explains the images, two at once */
    double clip; /* radiance at which images are clipped; 0: none */
};

enum finding { FINDING_CORRECT, FINDING_BUG, FINDING_UNKNOWN };

struct candidate {
    int bug, second;       /* second: at the same time; -1: none */
    double amplitude;      /* 1: its full effect; else the factor that fits best */
    double log_likelihood; /* natural logarithm, over that of "correct" */
    double
        explained; /* of the part of the difference from the correct renderer that stands out from
                    * noise: the share that this candidate explains, at most 1; NAN if nothing
                    * stands out */
    double excess; /* chi^2 of the residual minus its expectation, in standard deviations */
};

/* How a bug explains one view. */
struct evidence {
    double t;                /* directed statistic, 0 where the bug does nothing here */
    double log_lead;         /* log likelihood over "correct" of this view alone */
    double explained;        /* as of a candidate, of this view alone; NAN where nothing differs */
    int x, y, columns, rows; /* the square of 4 x 4 cells that says most, in cells */
    double change;           /* the difference there, relative to the correct mean there */
};

struct diagnosis {
    enum finding finding;
    char gate[320]; /* what showed that the renderer is wrong, or why it is not called wrong */
    double log10_p; /* of the most telling test, times the number of tests */
    struct candidate candidate[DIAGNOSE_CANDIDATES]; /* most likely first; none if CORRECT */
    int num_candidates;
    double t;            /* directed statistic of the first over all views */
    double largest_lead; /* of any bug at full strength over "correct", natural logarithm */
    double
        log_likelihood; /* of "correct": to compare catalogues with the same cells */
    int num_named; /* the first so many explain the images and cannot be told apart; 0 unless FINDING_BUG */
    double probability; /* of those together, among all known bugs, equally likely beforehand */
};

/* clues: at least one, of views of c, each seen at most once and independent of each other. */
NODISCARD bool diagnose(const struct catalogue *c, const struct observation *clue, int num_clues,
                        const struct diagnose_options *opt, struct diagnosis *out, struct err *e);

struct evidence diagnose_evidence(const struct catalogue *c, const struct observation *clue,
                                  const struct candidate *candidate);

/* The log likelihood over "correct" that a bug has to reach: ln(number of bugs / alpha). */
double diagnose_bound(const struct catalogue *c, double alpha);

#endif
