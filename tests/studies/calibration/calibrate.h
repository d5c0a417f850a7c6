/* The calibration as a whole: what is measured, how often, from which seeds; its results.
 * tests/studies/calibration/make_calibration.c runs it, tests/studies/calibration/test_calibration.c a short version. */
#ifndef ASSAY_CALIBRATE_H
#define ASSAY_CALIBRATE_H

#include "calibrate_gate.h"
#include "calibrate_power.h"
#include "calibrate_render.h"
#include "calibrate_synthetic.h"

enum {
    MAX_SYNTHETIC = 32,
    MAX_RENDER = 24,
    MAX_TAIL = 12,
    MAX_POWER = 8,
    MAX_COVER = 20,
    MAX_MARGIN = 12,
    MAX_STAGES = 8,
    MAX_PERMUTATION = 12
};

struct settings {
    size_t blocks; /* of a library */
    int num_synthetic, num_render, num_tail, num_power, num_cover, num_margin;
    int num_stages, num_permutation;
    struct synthetic_cell synthetic[MAX_SYNTHETIC];
    size_t synthetic_pairs[NUM_LEVELS];
    struct render_cell render[MAX_RENDER];
    size_t render_pairs; /* of each cell */
    struct synthetic_cell tail[MAX_TAIL];
    size_t tail_regions[MAX_TAIL];
    struct power_cell power[MAX_POWER];
    size_t power_pairs;
    struct cover_cell cover[MAX_COVER];
    size_t cover_pairs;
    struct margin_cell margin[MAX_MARGIN];
    size_t margin_pairs;
    struct stages_cell stages[MAX_STAGES];
    size_t stages_pairs;
    struct permutation_cell permutation[MAX_PERMUTATION];
    size_t permutation_pairs;
};

/* Those of the published page with every number of pairs times `share` (1: the page itself). */
struct settings settings_published(double share);
/* The few that `make check` has time for. */
struct settings settings_short(void);
/* SHA-256 over everything in it, lower-case hex. */
void settings_hash(const struct settings *s, char hex[65]);

struct results {
    struct null_result synthetic[MAX_SYNTHETIC], render[MAX_RENDER];
    struct tail_result tail[MAX_TAIL];
    struct power_result power[MAX_POWER];
    struct cover_result cover[MAX_COVER];
    struct margin_result margin[MAX_MARGIN];
    struct stages_result stages[MAX_STAGES];
    struct permutation_result permutation[MAX_PERMUTATION];
};

/* Runs all of it. w->total is raised by what is to come. `scenes`: the suite's directory. */
NODISCARD bool calibrate(struct work *w, const struct settings *s, const char *scenes,
                         enum weakness weakness, struct results *out, struct err *e);
double calibrate_cost(const struct settings *s);
/* Every acceptance line of the results. */
void calibrate_check(const struct settings *s, const struct results *r, struct checks *c);

/* What the short version says of the tester as it is and of each weakened one. */
struct weak_results {
    struct checks checks[NUM_WEAKNESSES];
};

/* The page: writes README.md and the plots into `dir`, which it makes. `command` made them, all: calibrate_check(). */
NODISCARD bool page_write(const char *dir, const char *command, const struct settings *s,
                          const struct results *r, const struct checks *all,
                          const struct weak_results *weak, struct err *e);

/* The plots alone: false_alarms.svg, statistics.svg, tail.svg, power.svg. */
NODISCARD bool page_draw(const char *dir, const struct settings *s, const struct results *r,
                         struct err *e);

#endif
