/* From an interval and the rubric's margins to points. */
#ifndef ASSAY_SCORE_H
#define ASSAY_SCORE_H

#include "difference.h"
#include "tools/submission/rubric.h"

/* Points as a share of what the check is worth: 1 where the interval comes within margin.full of 0,
 * 0 where it stays margin.none away, linear between. */
double score_share(const struct margin *m, const struct interval *i);

/* A noisy image has a wide interval, which comes near 0 whatever is wrong. While half its width is
 * more than margin.none, the share says nothing. Returns the factor by which the samples have to
 * grow to change that; 0 if the share is decided. blur: the part of half the width that more
 * samples do not reduce. */
double score_more(const struct margin *m, const struct interval *i, double blur);

/* Where no more samples can be had, width costs points: 1 up to margin.none, 0 from twice that. */
double score_width(const struct margin *m, const struct interval *i);

/* The probability that a fresh run of the same program gets another share, if the estimate is the
 * truth; 1 where the share lies between 0 and 1. For a program that is within margin.full the
 * interval itself ensures, whatever the noise, that less than all points have a probability of at
 * most alpha. */
double score_chance(const struct margin *m, const struct interval *i);

/* The interval of a quantity that costs nothing above 0: it ends as far above 0 as below it at most, or its width would
 * cost. */
struct interval score_at_least(struct interval i);

/* The share of the points where `wrong` of `num` pixels are wrong, an exact count. num 0: all are
 * wrong. */
double score_pixels(const struct margin *m, double wrong, double num);

/* The share that makes a hundredth of a point the least that a check worth `points` can lose, as pages
 * write no more digits: "8.00 of 8" beside a mistake would contradict itself. */
double score_round(double share, double points);

#endif
