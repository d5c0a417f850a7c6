/* The images of a grade's page, embedded in it: encoded anew, so that no byte of a student's file
 * reaches a browser. */
#ifndef ASSAY_GRADE_IMAGES_H
#define ASSAY_GRADE_IMAGES_H

#include "renderer/image/moments.h"

#include <jansson.h>
#include <stdio.h>

enum { GRADE_TILE = 8, GRADE_SHOWN = 384 /* width of an image on the page */ };

/* Writes the student's image and the pixels around the tile [x, y], enlarged (tile NULL or JSON
 * null: none). For staff (curve not NULL) also the reference, if there is one, by that tone curve
 * (tone_curve.h), and the difference pixel by pixel. Writes nothing if the file cannot be read. */
NODISCARD bool grade_images(FILE *f, const char *path, const char *name, const json_t *tile,
                            const struct moments *reference, const char *curve, struct err *e);

#endif
