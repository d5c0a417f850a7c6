/* Pages of grades, for a student, for staff and of a class, and their plots. Each is one file that
 * loads nothing else. */
#ifndef ASSAY_STUDENT_PAGE_H
#define ASSAY_STUDENT_PAGE_H

#include "tools/grade/grade_checks.h"

#include <jansson.h>
#include <stdio.h>

/* The student's page of what he may see of his grade (student_view()), with images in dir/ID: lost points first; no
 * references, nothing meant for staff. left_out: there are checks that he may not see yet. Fails only out of memory. */
NODISCARD bool student_page(FILE *f, const char *dir, const json_t *view, bool left_out,
                            struct err *e);

/* May the student see the check now (its `visibility`)? */
bool student_view_shows(const json_t *check);

/* The grade (tools/docs/formats/grades.md) as if the rubric had only the checks that the student may see: their
 * points, by part and in all, and what is said of the mistake from their images alone ("for_student"). The same where
 * all may be seen. A new reference, which shares members with `grade`. */
json_t *student_view(const json_t *grade);

/* The page of one grade (grade_batch.h) for staff: everything, beside the references if rubric and answers are given (NULL: they are not). */
NODISCARD bool student_page_for_staff(FILE *f, const char *dir, const struct rubric *r,
                                      const struct answer_key *a, const json_t *grade,
                                      struct err *e);

/* Parts of a page (grade_summary.c). The named bug with its place in the assignment, or else where the mistake shows; nothing if
 * neither is known. */
void grade_summary_bug(FILE *f, const json_t *grade);

/* A bar for each part, its length in proportion to the points, and links (#check-NAME) to the
 * checks that lost some. */
void grade_summary_parts(FILE *f, const json_t *grade);

/* The last 8 KiB of the build's log (grade's "build_log" in dir/ID), unfolded if the build failed;
 * nothing without a log. */
void grade_summary_build_log(FILE *f, const char *dir, const json_t *grade);

/* A check's tiles. Red: too bright, blue: too dark, full colour from 50 %; grey: not compared. Of `exact`: the share of
 * pixels that differ. width, height: of the image. */
void grade_plot_difference(FILE *f, const json_t *check, double width, double height);

/* A check's intervals against its margins. Nothing where there are none. */
void grade_plot_intervals(FILE *f, const json_t *check);

/* The page of the whole class, for staff: what needs them comes first. Fails only out of memory. */
NODISCARD bool class_page(FILE *f, const json_t *grades, struct err *e);

#endif
