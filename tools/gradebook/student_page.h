/* Pages of grades, for a student, for staff and of a class, and their plots. One file each, nothing from elsewhere. */
#ifndef ASSAY_STUDENT_PAGE_H
#define ASSAY_STUDENT_PAGE_H

#include "tools/grade/grade_checks.h"

#include <jansson.h>
#include <stdio.h>

/* Of one grade.json (grade_batch.h), whose images are in dir/ID: what was lost first. For the student: only checks that are visible
 * now, no references, nothing that is staff's. */
NODISCARD bool student_page(FILE *f, const char *dir, const json_t *grade, struct err *e);

/* The same for staff: everything, beside the references if rubric and answers are given (NULL: they are not). */
NODISCARD bool student_page_for_staff(FILE *f, const char *dir, const struct rubric *r,
                                      const struct answer_key *a, const json_t *grade,
                                      struct err *e);

/* What a page says first. May a check be seen now? Staff see all. */
bool grade_summary_shows(const json_t *check, bool staff);

/* The named bug with what it is called where, or where what is wrong shows; nothing where nothing is. */
void grade_summary_bug(FILE *f, const json_t *grade);

/* A bar for each part, as long as it is worth, and links (#check-NAME) to the checks that lost points. */
void grade_summary_parts(FILE *f, const json_t *grade, bool staff);

/* The last lines of dir/ID/build_log; unfolded where it could not be built. */
void grade_summary_build_log(FILE *f, const char *dir, const json_t *grade);

/* A check's tiles. Red: too bright, blue: too dark, full colour from 50 %; grey: not compared. Of `exact`: the share of
 * pixels that differ. width, height: of the image. */
void grade_plot_difference(FILE *f, const json_t *check, double width, double height);

/* A check's intervals against its margins. Nothing where there are none. */
void grade_plot_intervals(FILE *f, const json_t *check);

/* Of the whole class, for staff: what needs them first. Fails only out of memory. */
NODISCARD bool class_page(FILE *f, const json_t *grades, struct err *e);

#endif
