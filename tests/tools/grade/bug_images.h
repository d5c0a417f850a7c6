/* Submissions made of what the catalogue of a rubric's bugs says: flat cells of the right mean and of the effect of one or
 * two bugs, normal noise of as much as a render of ours has, written as PNG by the assignment's curve and read back. So a test
 * by them is about codes, clipping and noise; what real programs give is measured by tests/studies/grading/real.sh. */
#ifndef ASSAY_TESTS_BUG_IMAGES_H
#define ASSAY_TESTS_BUG_IMAGES_H

#include "tools/grade/rubric_bugs.h"

#include <gsl/gsl_rng.h>

struct bug_images {
    gsl_rng *rng;
    struct suite suite;
    struct rubric *rubric;
    struct answer_key *
        answers; /* flat cells too; with several deviations the light grows by up to 30 % from left to right */
    struct rubric_bugs bugs;
    double apart; /* of two bugs: 0 where their factors multiply, 1 where what they add adds up */
};

/* False, with nothing said, where the rubric has mistakes or no catalogue. */
bool bug_images_start(struct bug_images *b, const char *rubric);
void bug_images_end(struct bug_images *b);

/* The bug's number in the catalogue. Fails the test if there is no bug of that name. */
int bug_images_number(const struct bug_images *b, const char *name);

/* Images with the deviations of a set and with bugs (-1: none). noise: variance over ours. Freed with bug_images_take_back(). */
struct submitted_images *bug_images_hand_in(const struct bug_images *b, int set, int bug,
                                            int second, double noise);
void bug_images_take_back(const struct bug_images *b, struct submitted_images *h);

#endif
