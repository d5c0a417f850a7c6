/* Path guiding: the directions from which diffuse surfaces get their indirect light are learned from a pilot
 * render, and paths are sent there more often, with their throughput divided by how much more often. This changes
 * no mean. The pilot has random numbers of its own and is the same for every share of an image: given the pilot,
 * samples are as independent as the sampler's numbers.
 *
 * What is learned is a density over the unit square from which a direction's two random numbers come (primary sample
 * space [Guo18]), for each cell of a grid over the scene and each class of normals: the square is cut into 8 x 8
 * bins, and the probability of a bin is in proportion to the root of the mean of L^2 over its directions, L being what
 * a path gathered after the bounce over its throughput: of all densities that are constant in each bin, the one with
 * the least variance. So the density of a direction is that of bsdf_simd.h times that of its bin, and stratified
 * numbers stay stratified.
 * Weights of multiple importance sampling use the unguided density on both sides, so they still add up to 1. */
#ifndef ASSAY_GUIDE_H
#define ASSAY_GUIDE_H

#include "integrator.h"

enum {
    GUIDE_SAMPLES = 4,     /* of the pilot, per pixel of the camera's image .. */
    GUIDE_PATHS = 1 << 18, /* .. and at most so many */
    GUIDE_SIDE = 8,        /* bins along a side of the square */
    GUIDE_CELLS = 8,       /* along each axis of the scene */
    GUIDE_CLASSES = 12,    /* of normals: largest component, its sign, sign of z; two never occur */
    GUIDE_PLACES = GUIDE_CELLS * GUIDE_CELLS * GUIDE_CELLS * GUIDE_CLASSES,
    GUIDE_BINS = GUIDE_SIDE * GUIDE_SIDE,
    GUIDE_ROWS = 1 + GUIDE_SIDE, /* of a place's table */
    GUIDE_VERTICES = 4           /* of a path that teach */
};

struct guide {
    vec3 low, cells_per_unit; /* the grid */
    /* Of each place GUIDE_ROWS rows of GUIDE_SIDE numbers: first the cumulative probabilities of the square's columns,
     * then, for each column, those of its bins. */
    float *table;
    /* The pilot's. */
    double paths;
    struct bvh_stats rays;
};

/* What one batch of the pilot notes at each vertex of the paths, by slot. */
struct guide_notes {
    int32_t bin[GUIDE_VERTICES][BATCH_ROOM]; /* GUIDE_BINS place + bin; -1: nothing */
    /* Sum of the channels of what the path has gathered by then, and of its throughput after the bounce. */
    float before[GUIDE_VERTICES][BATCH_ROOM], throughput[GUIDE_VERTICES][BATCH_ROOM];
};

/* Renders the pilot on `threads` threads, with the same result on any number of them. `it` must be prepared, without a
 * guide. The caller frees it. NULL with a line if out of memory. */
NODISCARD struct guide *guide_learn(const struct integrator *it, int threads, struct err *e);
void guide_free(struct guide *g);

/* Turns the sums over a place's bins of L^2 and of directions into its table. */
void guide_tabulate(const double sum[GUIDE_BINS], const double count[GUIDE_BINS],
                    float table[GUIDE_ROWS * GUIDE_SIDE]);

#endif
