/* The parts of the calibration's page. */
#ifndef ASSAY_CALIBRATE_PAGE_H
#define ASSAY_CALIBRATE_PAGE_H

#include "calibrate.h"

/* What the short version says of the tester as it is and of each weakened one. */
struct weak_results {
    struct checks checks[NUM_WEAKNESSES];
};

/* Writes README.md and the plots into `dir`, which it makes. `command` made them. */
bool page_write(const char *dir, const char *command, const struct settings *s,
                const struct results *r, const struct weak_results *weak, struct err *e)
    __attribute__((warn_unused_result));

/* The plots alone: false_alarms.svg, statistics.svg, tail.svg, power.svg. */
bool page_draw(const char *dir, const struct settings *s, const struct results *r, struct err *e)
    __attribute__((warn_unused_result));

#endif
