/* Many pairs distributed as jobs, and their counts, which depend neither on the order nor on the number of threads.
 * */
#ifndef ASSAY_CALIBRATE_PAIRS_H
#define ASSAY_CALIBRATE_PAIRS_H

#include "work.h"
#include "tests/support/synthetic_images.h"

enum { PAIR_COUNTS = 6 };

/* The pairs first .. end-1, which are part number `part`; adds to count[]. */
typedef bool pairs_part(void *arg, int part, size_t first, size_t end, double count[PAIR_COUNTS],
                        struct err *e);
/* All pairs in parts of `each`, at `cost` CPU milliseconds in all; sets count[] to what they counted together. */
NODISCARD bool pairs_run(struct work *w, size_t pairs, size_t each, double cost, pairs_part *part,
                         void *arg, double count[PAIR_COUNTS], struct err *e);

/* The seed of a part of a cell. */
uint64_t pairs_seed(uint64_t seed, int part);

/* Large n are sums of blocks of 64. */
static inline int pairs_block(int n)
{
    return n < 64 ? n : 64;
}

/* Synthetic images of side x side pixels, those of a part from a library of its own. */
struct synthetic_pairs {
    enum law law;
    int n, side;
    bool is_exact; /* B, into which the pair puts the exact mean */
    size_t blocks;
    uint64_t seed;
    int first_part; /* number of the first part, for its seed */
    uint64_t (*seed_of)(uint64_t seed, int part);
    bool (*pair)(void *arg, struct library *l, size_t i, struct moments *a, struct moments *b,
                 double count[PAIR_COUNTS], struct err *e);
    void *arg;
};
NODISCARD bool synthetic_pairs_run(struct work *w, const struct synthetic_pairs *of, size_t pairs,
                                   size_t each, double cost, double count[PAIR_COUNTS],
                                   struct err *e);

#endif
