/* Synthetic null pairs, 16 x 16 pixels with tiles of 8, alternately grey and with independent channels
 * (synthetic_images.h), and the tails of single regions far out. */
#ifndef ASSAY_CALIBRATE_SYNTHETIC_H
#define ASSAY_CALIBRATE_SYNTHETIC_H

#include "calibrate_null.h"
#include "calibrate_pairs.h"

struct synthetic_cell {
    enum law law;
    int n_a, n_b; /* n_b = 0: the exact mean. Multiples of 64 where above 64 */
    uint64_t seed;
};
extern const char *const law_name[];

/* "exponential, 64 and 1024". */
void synthetic_name(const struct synthetic_cell *cell, char *text, size_t size);

/* pairs[l] pairs at each level; `blocks` of the library. The result depends on neither threads nor
 * machine. */
NODISCARD bool synthetic_run(struct work *w, const struct synthetic_cell *cell,
                             enum weakness weakness, const size_t pairs[NUM_LEVELS], size_t blocks,
                             struct null_result *out, struct err *e);
/* About CPU milliseconds of it. */
double synthetic_cost(const struct synthetic_cell *cell, const size_t pairs[NUM_LEVELS]);

/* Regions of 64 pixels in one channel, one p each, as region.h has it: those that the guard lets pass
 * at 1e-6, and how many of them have p <= 1e-4, 1e-5, 1e-6. */
struct tail_result {
    char name[64];
    double regions, tested, rejected[3];
};
extern const double tail_level[3];
NODISCARD bool tail_run(struct work *w, const struct synthetic_cell *cell, size_t regions,
                        size_t blocks, struct tail_result *out, struct err *e);
double tail_cost(const struct synthetic_cell *cell, size_t regions);
/* The guard lets a region pass if its p is right within a factor of e^0.2: its rate is at most that
 * many times the level. */
void tail_check(const struct tail_result *r, struct checks *c);

#endif
