/* Shared by rubric.c, which reads statements, and rubric_check.c, which checks the whole. */
#ifndef ASSAY_RUBRIC_INTERNAL_H
#define ASSAY_RUBRIC_INTERNAL_H

#include "rubric.h"

void rubric_mistake(struct rubric_mistakes *m, int line, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Reports what is missing or does not fit together, once all lines are read, and sets defaults,
 * image.suite and set[]. */
void rubric_check_whole(struct rubric *r, const struct suite *suite, struct rubric_mistakes *m);

#endif
