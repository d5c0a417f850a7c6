/* Null pairs of real renders: two images of one scene of the suite from disjoint seeds, by the
 * renderer in this process. */
#ifndef ASSAY_CALIBRATE_RENDER_H
#define ASSAY_CALIBRATE_RENDER_H

#include "calibrate_null.h"
#include "calibrate_pairs.h"

struct render_cell {
    const char *scene; /* of the suite */
    int side, spp;     /* side x side pixels, spp samples on both sides */
    int replicates;    /* 0: B is like A; else B is that many replicates of spp samples each */
    uint64_t seed;     /* its seeds are (seed << 32) + 0 .. 2^32 - 1 */
};

/* The suite in `scenes` ("reference/scenes"). Every pair runs at all levels. */
NODISCARD bool render_run(struct work *w, const char *scenes, const struct render_cell *cell,
                          enum weakness weakness, size_t pairs, struct null_result *out,
                          struct err *e);
double render_cost(const struct render_cell *cell, size_t pairs);

#endif
