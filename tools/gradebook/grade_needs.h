/* What staff have to look at before a grade goes out. */
#ifndef ASSAY_GRADE_NEEDS_H
#define ASSAY_GRADE_NEEDS_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

/* Does a grade (tools/docs/formats/grades.md) need staff? text: a line that says why, or "". */
bool grade_needs(const json_t *grade, char *text, size_t size);
/* What is wrong with all of it, in two words: "not graded", "not built", "printed its usage", "no image"; NULL where nothing is. */
const char *grade_state(const json_t *grade);
/* Is a check, or any check of a grade, provisional? Its points are kept until staff have looked. */
bool grade_is_provisional(const json_t *object);
/* Has a check all its points? */
bool grade_is_full(const json_t *check);
/* Does an image that could be compared differ from what it should be? Not one that only takes too long. */
bool grade_differs(const json_t *grade);

#endif
