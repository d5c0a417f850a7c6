/* The images of a page of grades, as part of the page: encoded anew, so that nothing of a student's file reaches a browser. */
#ifndef ASSAY_GRADE_IMAGES_H
#define ASSAY_GRADE_IMAGES_H

#include "renderer/image/moments.h"

#include <jansson.h>
#include <stdio.h>

enum { GRADE_TILE = 8, GRADE_SHOWN = 384 /* width of an image on the page */ };

/* The student's file, and the pixels around the tile (x, y), enlarged; tile: JSON null, none. For staff (curve not NULL) the reference,
 * if there is one, by that tone curve (tone_curve.h), and the difference pixel by pixel. Nothing of a file that cannot be read. */
NODISCARD bool grade_images(FILE *f, const char *path, const char *name, const json_t *tile,
                            const struct moments *reference, const char *curve, struct err *e);

#endif
