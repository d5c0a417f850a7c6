/* What is made of grades, made again (reproduce.h): the tables and pages of a class and of each submission. */
#ifndef ASSAY_REPRODUCE_CLASS_H
#define ASSAY_REPRODUCE_CLASS_H

#include "reproduce.h"

/* Whether a file is one of those (grade_batch.h), by its name and by what lies beside it: grades.json or grade.json. */
bool reproduce_is_of_class(const char *path);

/* Makes it of the grades again, into `dir`, which exists, and compares bytes. False if the grades or a picture that is shown cannot be
 * read. */
bool reproduce_class(const char *path, const struct reproduce_options *opt, const char *dir,
                     struct reproduced *out, struct err *e) __attribute__((warn_unused_result));

#endif
