/* `assay grade`: many submissions by one rubric, each into a directory of its own, whatever they do. */
#ifndef ASSAY_GRADE_BATCH_H
#define ASSAY_GRADE_BATCH_H

#include "appeals.h"
#include "grade_diagnose.h"
#include "grade_options.h"
#include "tools/grade/grade_checks.h"

#include <jansson.h>

struct grade_job {
    const struct rubric *rubric;
    const struct answer_key *answers;
    const struct sandbox *sandbox;
    const char *stage;       /* submission_stage() */
    const char *build_cache; /* that everybody can read (submission_build()); NULL: none */
    const char *const *word; /* grade_options_words(), for "command" of a grade; NULL: not said */
    const struct grade_settings
        *s; /* submissions, how many at a time, where OUT/ID/grade.json goes, .. */
    const struct rubric_bugs *bugs; /* NULL: bugs are not named */
    const struct appeals *appeals;  /* NULL: none */
    /* One at a time. */
    void (*done)(const struct grade_settings *s, int num, const json_t *grade);
};

/* OUT/ID/grade.json, and a grade below: tools/docs/formats/grades.md. Texts of programs are in it: whoever shows them has to
 * escape them. */

/* Grades all, `jobs` at a time. A submission that we fail to grade has "trouble"; the others go
 * on. Fails only where nothing can be written. Two submissions of the same id are an error. *grades: a new array, in
 * the order of path. */
NODISCARD bool grade_batch_run(const struct grade_job *job, json_t **grades, struct err *e);

/* What is made of the grades, without the submissions: of the class, OUT/grades.json, the array, grades.csv, junit.xml and
 * index.html, the page for staff; of each submission, OUT/ID/results.json as Gradescope reads it, index.html, and staff.html with
 * the references (r, a: NULL, none). The pages need no other file to be read. */
NODISCARD bool grade_write(const char *out, const struct rubric *r, const struct answer_key *a,
                           const json_t *grades, struct err *e);

#endif
