/* Which of a rubric's variants a class gets: one is drawn when its references are made first, and kept beside them, so that every
 * submission, and everyone again, is asked for the same. */
#ifndef ASSAY_RUBRIC_VARIANT_H
#define ASSAY_RUBRIC_VARIANT_H

#include "rubric.h"

/* From 1 to r->variants; 0 where it has none. references: a directory, made if need be, whose file "variant" says which; where there
 * is none it is written: `asked`, or a random one if that is 0. Fails if another one was drawn than is asked for, or than there is. */
NODISCARD bool rubric_variant_draw(const char *references, const struct rubric *r, int asked,
                                   int *variant, struct err *e);

/* Reads it again as that variant, where the rubric has any. */
NODISCARD bool rubric_variant_read(const char *references, const struct suite *suite, int asked,
                                   struct rubric *r, struct rubric_mistakes *m, struct err *e);

#endif
