/* The bug's name in a student's feedback: by the images that were graded (rubric_bugs.h), and by the views of `assay
 * diagnose`, rendered by a submission in the sandbox, for programs that can write our moments (rubric.h: diagnose). */
#ifndef ASSAY_GRADE_DIAGNOSE_H
#define ASSAY_GRADE_DIAGNOSE_H

#include "tools/grade/mistake.h"

#include <jansson.h>

struct grade_diagnosis {
    struct catalogue catalogue;
    const struct suite *suite;
    struct rubric *rubric; /* its images are the views */
    char stage[512];       /* their scenes */
};

/* r has a `diagnose` command. stage: a directory to be made below the sandbox's. The suite has to outlive it. */
NODISCARD bool grade_diagnose_open(const struct rubric *r, const char *catalogue_dir,
                                   const struct suite *suite, const char *stage,
                                   struct grade_diagnosis *out, struct err *e);
void grade_diagnose_close(struct grade_diagnosis *d);

/* By the images that were graded, in the form of tools/docs/formats/grades.md ("diagnosis"). "with": name of the deviations on
 * top of which the bug was found. JSON null where there is no image. */
json_t *grade_diagnose_by_images(const struct rubric_bugs *b, const struct rubric *r,
                                 const struct mistake *m);

/* The same form, "correct" too, or an "error" where a view could not be made. Chance of accusing a right program: alpha. A
 * new reference; NULL out of memory. May be called from several threads. */
json_t *grade_diagnose_of(const struct grade_diagnosis *d, const struct sandbox *box,
                          const struct submission *s, const char *work, uint64_t seed, int threads,
                          double alpha);

#endif
