/* The test of one region of a claim (tools/docs/background/verdict.md, "One region"), and texts about regions. */
#ifndef ASSAY_REGION_H
#define ASSAY_REGION_H

#include "compare.h"
#include "pyramid.h"

/* What all regions of one claim share. */
struct judge {
    struct compare_options opt;
    int width, height;
    double mean_b;                /* luminance of the image B */
    double floor;                 /* lower bound of the unit of relative quantities, radiance */
    double event[NUM_CHANNELS];   /* brightness of the brightest kind of single observation seen */
    bool is_pooled;               /* each pixel has the skewness of the whole image (noise_estimate.h) */
    bool exact[2];                /* A, B are closed forms */
    bool may_miss[2];             /* A, B: the other is one, or far longer, and shows what this one missed */
    double n_min;                 /* fewest observations of any pixel; INFINITY if both are exact */
    double share[NUM_STATISTICS]; /* of alpha */
    /* Per statistic: */
    double z_guard[NUM_STATISTICS];   /* normal critical value at which skewness is judged */
    size_t num_tests[NUM_STATISTICS]; /* set once known: for mdb */
};

/* A region's sums in the form the test needs. Sums over pixels, not means. */
struct measured {
    double d;         /* A - B */
    double unit;      /* of relative quantities */
    double margin;    /* relative */
    double tolerance; /* what float32 arithmetic and rounded files may do to d */
    double v;         /* variance of d */
    double v_margin; /* variance of A - (1 + margin) B: for every test and interval with a margin */
    double dof;
    double dof_normal; /* as for a normal distribution; predicts the mean of t^2 better under heavy tails */
    double skew;       /* of d: |g| plus one standard error */
    double skew_around; /* the same with the surroundings' skewness; INFINITY: not determined */
    double t_guard;     /* critical value at which skewness is judged */
    double log10_alike; /* of the cell */
    /* One side (not a closed form) shows no noise where the other does. Its few samples may all
     * have been alike by chance, as where roulette ends one path in twenty, and its mean may be off
     * for that reason. */
    bool silent;
    /* This d could come from bright samples that one side has missed and the other, a closed form or far
     * longer, has not: it is the darker one. A sum with weights may be changed either way. */
    bool may_have_missed;
    double event_weight; /* largest weight of one observation in d; 1 for a region */
    bool noise_free;     /* the standard error is within that of float32 arithmetic */
    int statistic;       /* by which it is tested */
};

struct measured region_measure(const struct judge *j, const struct cell *cell, struct rect r);

/* A quick test: if true, region_is_normal() is false by skewness alone, as for most small regions. False
 * says nothing. */
bool region_is_skewed(const struct judge *j, const struct cell *cell);
/* The same for region_testable(). */
bool region_is_hopeless(const struct judge *j, const struct cell *cell, int statistic);
/* region_t() of a single pixel, and its relative difference, as by region_measure() but faster. */
double region_pixel_t(const struct judge *j, const struct cell *cell, double *relative);

/* The same for sums over the image with weights w, which may be negative: unit = sum |w| unit, size =
 * sum |w| max(A, B), largest: the most that |w| makes of a pixel's j->event. A bias inside the margin of a tile in
 * each pixel is inside the margin of this. */
struct measured region_measure_weighted(const struct judge *j, const struct cell *cell, double unit,
                                        double size, double largest);

/* Fills m->skew_around: the skewness that this region would have with the ratio of third cumulant
 * to variance of a larger region around it. A small region can look symmetric by luck, because its
 * few samples missed the rare bright ones; its mean is then too low. Not needed for the whole
 * image, nor where the region's own skewness already forbids a test. */
void region_look_around(const struct judge *j, struct measured *m, const struct cell *around);

/* Two-sided log10 p of Student's t, raised by the factor that skewness may cause at t; a larger t is no likelier than
 * a smaller one, so that it has the least p of these. skew 0: as it is; INFINITY: 0, as t then says nothing. */
double region_raised_log10_p(double t, double dof, double skew);
/* Is a p trusted at the critical value x, if it is raised where *raised is set? These are the rules below. */
bool region_skew_is_testable(double skew, double x, bool *raised);

/* region_is_normal(): the region is not silent, and its skewness factor |g| x^3 / 3 is at most 0.2
 * at the critical value x. region_testable(): silent regions pass, too, and so do factors up to 4
 * with |g| x <= 0.3, if the skewness of the surroundings is within these bounds as well.
 * region_log10_p() raises p to make up for both. */
bool region_is_normal(const struct judge *j, const struct measured *m);
bool region_testable(const struct judge *j, const struct measured *m);

/* How far |d| lies beyond margin and tolerance, in standard errors; at most 0 if it does not. */
double region_excess_t(const struct measured *m);

/* Two-sided log10 p of the hypothesis |bias| <= margin. The skewness factor raises it where the
 * guard asks for that. For a silent region, and for one that may have missed them, it is at least the probability
 * that bright samples which would explain the difference were all missed. */
double region_log10_p(const struct judge *j, const struct measured *m, int channel);

/* The normal equivalent of that probability; INFINITY where nothing can have been missed. */
double region_missed_z(const struct judge *j, const struct measured *m, int channel);

/* The normal equivalent of that p, accurate to about 3 %, for a region with noise: for ranking only. */
double region_rank(const struct judge *j, const struct measured *m);

/* Two-sided log10 p of "no bias", raised by the skew factor. */
double region_log10_p_equal(const struct judge *j, const struct measured *m, int channel);

/* difference / std_error, within +-1e9 where there is no noise. */
double region_t(const struct measured *m);

/* The relative bias that is found with a probability of 95 %, at most region_mdb_none; for a testable region. */
double region_mdb(const struct judge *j, const struct measured *m, int channel);

extern const double region_smallest_log10_p; /* -1e6 */
/* The mdb of a region that no test covers: 1e6. */
extern const double region_mdb_none;

/* "1.05 %" or, where no test covers it, "nothing"; returns text. */
const char *region_mdb_text(double mdb, char text[32]);

/* The end of the interval that is further from 0. */
double region_reach(const struct region *r);

extern const char *const channel_name[NUM_CHANNELS];

/* "the image (red)" or "16 x 16 pixels at 32,48 (luminance)". */
void region_name(int width, int height, struct rect r, int channel, char *text, size_t size);

/* Fills all of a struct region except mdb and log10_p_equal, which are 0. */
struct region region_fill(const struct judge *j, const struct cell *cell, struct rect r,
                          int channel);

#endif
