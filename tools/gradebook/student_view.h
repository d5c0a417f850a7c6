/* What a student may see of a grade now. */
#ifndef ASSAY_STUDENT_VIEW_H
#define ASSAY_STUDENT_VIEW_H

#include <jansson.h>
#include <stdbool.h>

/* May the student see the check now (its `visibility`)? */
bool student_view_shows(const json_t *check);

/* The grade (tools/docs/formats/grades.md) as if the rubric had only the checks that the student may see: their
 * points, by part and in all, and what is said of the mistake from their images alone ("for_student"). The same where
 * all may be seen. A new reference, which shares members with `grade`; NULL: out of memory. */
json_t *student_view(const json_t *grade);

#endif
