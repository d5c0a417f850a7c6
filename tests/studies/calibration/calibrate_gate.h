/* False alarms of the procedures around one comparison: two stages with fresh seeds (tools/sequential/two_stage.h),
 * and the permutation test of replicates (tools/exact/permutation.h). */
#ifndef ASSAY_CALIBRATE_GATE_H
#define ASSAY_CALIBRATE_GATE_H

#include "calibrate_check.h"
#include "calibrate_pairs.h"

#include <stddef.h>

/* 16 x 16 pixels, tiles of 8, n observations on both sides, margins 0, alternately grey and not. The
 * second stage is a fresh pair. */
struct stages_cell {
    enum law law;
    int n;
    double alpha; /* of the claim; each stage has its root */
    uint64_t seed;
};
struct stages_result {
    char name[64];
    double alpha, pairs, flagged, different;
};
NODISCARD bool stages_run(struct work *w, const struct stages_cell *cell, size_t pairs,
                          size_t blocks, struct stages_result *out, struct err *e);
double stages_cost(const struct stages_cell *cell, size_t pairs);
/* Flagged with at most the root of alpha, DIFFERENT with at most alpha. */
void stages_check(const struct stages_result *r, struct checks *c);

/* 6 replicates of 8 x 8 grey pixels on each side, each pixel one draw of the law; regions from 2 x 2
 * pixels up. The smallest p is 2/924. */
struct permutation_cell {
    enum law law;
    int draws; /* above 0: instead one image of 16 x 16 on each side, each pixel the mean of as many draws, judged by flips of
                  pixels (tools/exact/sign_flip.h) */
    uint64_t seed;
};
enum { NUM_PERMUTATION_LEVELS = 3 };
extern const double
    permutation_level[2][NUM_PERMUTATION_LEVELS]; /* 0.1, 0.05, 0.01; of flips 0.01, 1e-3, 1e-4 */
struct permutation_result {
    char name[64];
    bool is_flips;
    double pairs, rejected[NUM_PERMUTATION_LEVELS];
};
NODISCARD bool permutations_run(struct work *w, const struct permutation_cell *cell, size_t pairs,
                                struct permutation_result *out, struct err *e);
double permutations_cost(size_t pairs);
void permutations_check(const struct permutation_result *r, struct checks *c);

#endif
