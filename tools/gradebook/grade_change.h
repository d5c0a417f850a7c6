/* What changed from an earlier grade, by another rubric or a decision of staff. */
#ifndef ASSAY_GRADE_CHANGE_H
#define ASSAY_GRADE_CHANGE_H

#include <jansson.h>
#include <stddef.h>

/* "before" of a grade (tools/docs/formats/grades.md) that had been `old`; NULL where neither its points, checks nor their sum changed, or old is NULL. A new
 * reference. */
json_t *grade_change(const json_t *old, const json_t *grade);

/* "4.00 of 10 before; cornell 0.00, now 6.00; sum 2.00, not asked now": one line; "" where nothing changed. */
void grade_change_text(const json_t *grade, char *out, size_t size);

#endif
