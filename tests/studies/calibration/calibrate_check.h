/* The acceptance lines of a calibration. A rate's line fails only if its Clopper-Pearson interval of
 * 99.9 % lies wholly on the wrong side; a line that asks for proof fails unless it lies wholly on the
 * right one. */
#ifndef ASSAY_CALIBRATE_CHECK_H
#define ASSAY_CALIBRATE_CHECK_H

#include <stdbool.h>

enum { MAX_CHECKS = 2048 };

struct check {
    char what[192]; /* "exponential, 64 and 64: gate at 0.01: 12 of 2000" */
    bool holds;
};

struct checks {
    struct check item[MAX_CHECKS];
    int num, failed;
};

/* Of one tail: the interval of 99.9 % has two. */
extern const double check_tail;

/* Each adds a line. k of n, n > 0. */
void check_at_most(struct checks *c, double k, double n, double rate, const char *fmt, ...)
    __attribute__((format(printf, 5, 6)));
void check_at_least(struct checks *c, double k, double n, double rate, const char *fmt, ...)
    __attribute__((format(printf, 5, 6)));
void check_proves_at_most(struct checks *c, double k, double n, double rate, const char *fmt, ...)
    __attribute__((format(printf, 5, 6)));
void check_proves_at_least(struct checks *c, double k, double n, double rate, const char *fmt, ...)
    __attribute__((format(printf, 5, 6)));
/* Any other condition. */
void check_that(struct checks *c, bool holds, const char *fmt, ...)
    __attribute__((format(printf, 3, 4)));

/* "holds" if all lines from number `from` on hold, else "**does not hold**". */
const char *checks_word(const struct checks *c, int from);

#endif
