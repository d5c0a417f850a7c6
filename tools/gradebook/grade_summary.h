/* What a page of grades says first of a submission: where the points went, what is wrong. */
#ifndef ASSAY_GRADE_SUMMARY_H
#define ASSAY_GRADE_SUMMARY_H

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

/* May it be seen now? Staff see all checks. */
bool grade_summary_shows(const json_t *check, bool staff);

/* The named bug with what it is called where, or where what is wrong shows; nothing where nothing is. */
void grade_summary_bug(FILE *f, const json_t *grade);

/* A bar for each part, as long as it is worth, and links (#check-NAME) to the checks that lost points. */
void grade_summary_parts(FILE *f, const json_t *grade, bool staff);

/* The last lines of dir/ID/build_log; unfolded where it could not be built. */
void grade_summary_build_log(FILE *f, const char *dir, const json_t *grade);

#endif
