/* `assay grade`: many submissions by one rubric, each into a directory of its own, whatever they do. */
#ifndef ASSAY_GRADE_BATCH_H
#define ASSAY_GRADE_BATCH_H

#include "appeals.h"
#include "grade_diagnose.h"
#include "tools/grade/grade_checks.h"

#include <jansson.h>

struct grade_job {
    const struct rubric *rubric;
    const struct answer_key *answers;
    const struct sandbox *sandbox;
    const char *stage;       /* submission_stage() */
    const char *build_cache; /* that everybody can read (submission_build()); NULL: none */
    const char *out;         /* OUT/ID/grade.json and what else there is of it */
    const char *const *path; /* of the submissions */
    const char *const *word; /* grade_options_words(), for "command" of a grade; NULL: not said */
    int num, jobs, threads;
    double alpha;                            /* of one check */
    const struct rubric_bugs *bugs;          /* NULL: bugs are not named by the images */
    const struct grade_diagnosis *diagnosis; /* NULL: nor by more of them */
    uint64_t seed;
    bool again; /* also those that have been graded already, and run anew what has been run */
    const char *
        before; /* OUT of a run before this one, maybe the same: its images are judged anew where nothing that decides them
                         * changed, and what changed in points is "before" of a grade */
    const struct appeals *appeals; /* NULL: none */
    void (*done)(void *ctx, int num, const char *id,
                 const json_t *grade); /* one at a time; may be NULL */
    void *ctx;
};

/* OUT/ID/grade.json, and a grade below: tools/docs/formats/grades.md. Texts of programs are in it: whoever shows them has to
 * escape them. */

/* Grades all, `jobs` at a time. A submission that cannot be graded for our trouble has "trouble"; the others go
 * on. Fails only where nothing can be written. Two submissions of the same id are an error. *grades: a new array, in
 * the order of path. */
bool grade_batch_run(const struct grade_job *job, json_t **grades, struct err *e)
    __attribute__((warn_unused_result));

/* What is made of the grades, without the submissions: of the class, OUT/grades.json, the array, grades.csv, junit.xml, grades.tap
 * and index.html, the page for staff; of each submission, OUT/ID/results.json as Gradescope reads it, index.html, and staff.html with
 * the references (r, a: NULL, none). The pages need no other file to be read. */
bool grade_write(const char *out, const struct rubric *r, const struct answer_key *a,
                 const json_t *grades, struct err *e) __attribute__((warn_unused_result));

#endif
