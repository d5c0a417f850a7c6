/* What the library's files share. */
#ifndef ASSAY_LIBRARY_INTERNAL_H
#define ASSAY_LIBRARY_INTERNAL_H

#include "assay.h"
#include "tools/input/input.h"

/* A side as the library's caller gives it, made one that compare_job.h takes. */
struct library_side {
    const char *name;           /* or the path */
    struct input_memory memory; /* of a side without a path */
    struct moments moments;
};

/* Checks what compare_moments() does not: that sizes and counts make sense and numbers of images are finite. Copies, as three
 * channels. `name`: where the side has none. Fails with a line that begins with the name. The caller closes, also after a failure. */
NODISCARD bool library_side_open(struct library_side *out, const struct assay_side *side,
                                 const char *name, struct err *e);
void library_side_close(struct library_side *s);

/* Returns ok, with the line of a failure for the caller, who may not want it (NULL), else an empty one. */
bool library_told(bool ok, const struct err *e, char error[ASSAY_ERROR_SIZE]);

#endif
