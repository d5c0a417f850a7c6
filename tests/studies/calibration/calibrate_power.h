/* What the tester finds: power against the printed MDB, coverage of its intervals, and EQUIVALENT where
 * the bias is just outside the margin. Synthetic images of one library a job (synthetic_images.h). */
#ifndef ASSAY_CALIBRATE_POWER_H
#define ASSAY_CALIBRATE_POWER_H

#include "calibrate_check.h"
#include "calibrate_tester.h"
#include "calibrate_pairs.h"

#include <stddef.h>

/* Images of side x side pixels, tiles of half that, n observations on both sides, alpha 1e-3. The bias
 * is that of all pixels or of the first tile, in units of the MDB printed for pairs without one. */
struct power_cell {
    const char *name;
    enum law law;
    int n, side;
    bool is_grey, one_tile;
    bool is_short; /* only at 0.9, 1 and 1.1 of the MDB */
    double margin_global, margin_tile;
    uint64_t seed;
};
enum { POWER_POINTS = 10 };
extern const double power_bias[POWER_POINTS]; /* ascending; holds 0.9, 1 and 1.1 */

struct power_result {
    char name[64];
    bool is_grey;
    double mdb;                 /* mean of those printed, relative */
    double pairs;               /* at each bias */
    double found[POWER_POINTS]; /* DIFFERENT */
};
NODISCARD bool power_run(struct work *w, const struct power_cell *cell, enum weakness weakness,
                         size_t pairs, size_t blocks, struct power_result *out, struct err *e);
double power_cost(const struct power_cell *cell, size_t pairs);
/* The bias, in units of the MDB, at which 95 % are found, interpolated in the normal quantile of the rate; 0 if not
 * reached. */
double power_95(const struct power_result *r);
/* A bias of the MDB is found in at least 95 %; 1.1 of it is proved to be and 0.9 of it not to be, so
 * that the bias found with 95 % is within 10 % of the MDB. Colour: the last is not asked, as the MDB
 * is an upper bound where the channels are independent. */
void power_check(const struct power_result *r, struct checks *c);

/* Images of 16 x 16 pixels, tiles of 8. Coverage: equal means; the first tile's noise (sd) is a hundred times
 * that of the others, so that its interval reaches furthest and is the one printed. */
struct cover_cell {
    enum law law;
    int n_a, n_b; /* n_b = 0: the exact mean. Multiples of 64 where above 64 */
    double alpha; /* intervals of 1 - 2 alpha */
    uint64_t seed;
};
struct cover_result {
    char name[64];
    double alpha, pairs;
    double valid[2], missed[2]; /* image, tile: with an interval, and with one that 0 is not in */
};
NODISCARD bool cover_run(struct work *w, const struct cover_cell *cell, enum weakness weakness,
                         size_t pairs, size_t blocks, struct cover_result *out, struct err *e);
double cover_cost(const struct cover_cell *cell, size_t pairs);
/* Neither misses more often than 2 alpha. */
void cover_check(const struct cover_result *r, struct checks *c);

/* EQUIVALENT, bias just outside the margin: of the image, or of one tile. */
struct margin_cell {
    enum law law;
    int n;
    double alpha, margin_global, margin_tile;
    uint64_t seed;
};
struct margin_result {
    char name[64];
    double alpha, pairs;
    double equivalent[3]; /* image outside, tile outside, no bias */
    double different[2];  /* the first two: wrong as well, the bias is at the edge */
};
NODISCARD bool margin_run(struct work *w, const struct margin_cell *cell, enum weakness weakness,
                          size_t pairs, size_t blocks, struct margin_result *out, struct err *e);
double margin_cost(const struct margin_cell *cell, size_t pairs);
void margin_check(const struct margin_result *r, struct checks *c);

#endif
