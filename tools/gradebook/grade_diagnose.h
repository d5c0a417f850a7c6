/* The bug's name in a student's feedback. */
#ifndef ASSAY_GRADE_DIAGNOSE_H
#define ASSAY_GRADE_DIAGNOSE_H

#include "tools/grade/mistake.h"

#include <jansson.h>

/* "diagnosis" of a grade (tools/docs/formats/grades.md). "with": name of the deviations on top of
 * which the bug was found. {"error"} where the diagnosis failed; JSON null where no image was
 * looked at. A new reference. */
json_t *grade_diagnose_by_images(const struct rubric_bugs *b, const struct rubric *r,
                                 const struct mistake *m);

#endif
