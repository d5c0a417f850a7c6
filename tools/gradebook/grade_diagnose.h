/* The bug's name in a student's feedback. */
#ifndef ASSAY_GRADE_DIAGNOSE_H
#define ASSAY_GRADE_DIAGNOSE_H

#include "tools/grade/mistake.h"

#include <jansson.h>

/* By the images that were graded, in the form of tools/docs/formats/grades.md ("diagnosis"). "with": name of the deviations on
 * top of which the bug was found. JSON null where there is no image. */
json_t *grade_diagnose_by_images(const struct rubric_bugs *b, const struct rubric *r,
                                 const struct mistake *m);

#endif
