/* Tests against known kinds of error (tools/docs/background/verdict.md, "Directed"), for channel_sweep.h. */
#ifndef ASSAY_MATCHED_FILTER_H
#define ASSAY_MATCHED_FILTER_H

#include "error_modes.h"
#include "region.h"

/* Sums over pixels and channels with weights w = d/v. */
struct matched_sums {
    struct cell cell; /* w A and w B, as if they were a region */
    double unit;      /* |w| unit of B */
    double size;      /* |w| max(A, B) */
    double largest;   /* not a sum: the most that |w| makes of the judge's event in one pixel */
};
struct matched_filter {
    struct error_modes modes;
    double *row; /* a change of one row */
    struct matched_sums sums[NUM_ERROR_MODES];
};

/* Fails only out of memory. Release with matched_filter_free(). */
NODISCARD bool matched_filter_open(const struct moments *a, const struct moments *b,
                                   struct matched_filter *out, struct err *e);
void matched_filter_free(struct matched_filter *f);

/* Adds rows y .. y+rows-1, in order. root[0] and root[1] get the root of pyramid_build() for A's and B's pixels. */
void matched_filter_add(const struct judge *j, struct matched_filter *f, int y, int rows,
                        double *const root[2]);

/* After all rows: tests the directions that apply to this size of image, and counts the tests in j->num_tests. *log10_p
 * is the smallest p (0 if none could be tested), *found its direction. */
void matched_filter_test(struct judge *j, const struct matched_filter *f,
                         enum error_mode_kind *found, double *log10_p);

#endif
