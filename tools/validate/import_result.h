/* import_check() for a suite, and what it found for people and for exit codes. */
#ifndef ASSAY_IMPORT_RESULT_H
#define ASSAY_IMPORT_RESULT_H

#include "reference/import_check/import_check.h"

#include <jansson.h>
#include <stdio.h>

/* Of the scenes named; of all if none is. *reports: as import_check(). Fails on an unknown name. */
bool import_result_check_suite(const struct suite *suite, const char *const *only, int num_only,
                               const struct import_options *opt, json_t **reports, struct err *e)
    __attribute__((warn_unused_result));
/* One line per scene, then the sum. */
void import_result_print(FILE *f, const json_t *reports);
/* 0: all agree; else 3 if any could not be judged, else 1. */
int import_result_exit_code(const json_t *reports);

#endif
