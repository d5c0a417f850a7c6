/* Which of a rubric's variants a class gets: one is drawn at random when its references are first made, and
 * recorded beside them, so that all submissions, also later ones, are asked for the same images. */
#ifndef ASSAY_RUBRIC_VARIANT_H
#define ASSAY_RUBRIC_VARIANT_H

#include "rubric.h"

/* *variant: 1 to r->variants; 0 if the rubric has none. references: a directory, made if need be, whose
 * file "variant" says which. If there is no such file, it is written: with `asked`, or a random one if that
 * is 0. Fails if the file has another variant than is asked for, or one that does not exist. */
NODISCARD bool rubric_variant_draw(const char *references, const struct rubric *r, int asked,
                                   int *variant, struct err *e);

/* Draws and reads the rubric again as that variant, where it has any. */
NODISCARD bool rubric_variant_read(const char *references, const struct suite *suite, int asked,
                                   struct rubric *r, struct rubric_mistakes *m, struct err *e);

#endif
