/* `assay grade`: grades many submissions by one rubric, each into its own directory, whatever they
 * do. */
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
    /* Called after each submission, one call at a time; num: how many are done. */
    void (*done)(const struct grade_settings *s, int num, const json_t *grade);
};

/* A grade, below, is the content of OUT/ID/grade.json (tools/docs/formats/grades.md). It holds
 * texts of programs: whoever shows them has to escape them. */

/* Grades all, `jobs` at a time. A submission that we fail to grade has "trouble"; the others go on.
 * Fails only on an id that is no name or occurs twice, if OUT cannot be made, and out of memory.
 * *grades: a new array, in the order of job->s->submission. */
NODISCARD bool grade_batch_run(const struct grade_job *job, json_t **grades, struct err *e);

/* Is it the name of a file of the class? No submission can have it, as their folders are beside. */
bool grade_writes_file(const char *name);
/* Writes what follows from the grades: for the class OUT/grades.json (the array), grades.csv,
 * junit.xml and index.html (for staff); for each submission OUT/ID/results.json as Gradescope reads
 * it, index.html, and staff.html, which shows the references (r, a NULL: none). A page needs no
 * other file to be viewed. */
NODISCARD bool grade_write(const char *out, const struct rubric *r, const struct answer_key *a,
                           const json_t *grades, struct err *e);

#endif
