/* From the tests and intervals of a claim to its verdict, with the sentence that says why. */
#ifndef ASSAY_VERDICT_H
#define ASSAY_VERDICT_H

#include "compare.h"

/* For compare.c. Fills verdict, reason and extra_factor; everything else in c, except the maps' pixels, must be filled.
 * `tiles` are the luminance regions of the tiles_x x tiles_y reporting tiles. */
void verdict_decide(struct comparison *c, const struct compare_options *opt,
                    const struct region *tiles);

/* Does a statistic's smallest p reject at its share of alpha? */
bool verdict_rejects(const struct comparison *c, int statistic, double alpha);

/* "p = 3e-05"; anything smaller than 1e-12 is "p < 1e-12". */
struct verdict_p {
    char s[24];
} verdict_p(double log10_p);

/* The largest extra_factor; it means "this or more". */
extern const double verdict_largest_factor;
/* What extra_factor says: "about 2.5 times the samples would decide", or what else can be done. is_near_margin: what
 * reaches over its margin is a difference that is not noise. */
void verdict_more_samples(double factor, const char *of_what, bool is_near_margin, char text[128]);
/* That, of a comparison that is INCONCLUSIVE. */
bool verdict_is_near_margin(const struct comparison *c);

#endif
