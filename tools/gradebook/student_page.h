/* Pages of grades, for a student and of a class, and their plots. */
#ifndef ASSAY_STUDENT_PAGE_H
#define ASSAY_STUDENT_PAGE_H

#include "reference/base/json_node.h"

#include <jansson.h>
#include <stdio.h>

enum { GRADE_TILE = 8, GRADE_SHOWN = 384 /* width of an image on the page */ };

/* Of one grade.json (grade_batch.h); its images are in dir/ID. */
bool student_page(FILE *f, const char *dir, const json_t *grade, struct err *e)
    __attribute__((warn_unused_result));

/* A check's tiles. Red: too bright, blue: too dark, full colour from 50 %; grey: not compared. Of `exact`: the share of
 * pixels that differ. width, height: of the image. */
void grade_plot_difference(FILE *f, const json_t *check, double width, double height);

/* A check's intervals against its margins, each over that beyond which there are no points. Nothing where there are
 * none. */
void grade_plot_intervals(FILE *f, const json_t *check);

/* Of the whole class, for staff. Fails only out of memory. */
bool class_page(FILE *f, const json_t *grades, struct err *e) __attribute__((warn_unused_result));

#endif
