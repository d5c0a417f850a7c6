/* What the library's files share. */
#ifndef ASSAY_LIBRARY_INTERNAL_H
#define ASSAY_LIBRARY_INTERNAL_H

#include "assay.h"
#include "tools/input/input.h"

/* A caller's side, converted to one that compare_job.h takes. */
struct library_side {
    const char *name;           /* its name or its path; borrowed */
    struct input_memory memory; /* of a side without a path */
    struct moments moments;
};

/* Checks what compare_moments() does not: that sizes and counts make sense, and that the numbers of images are
 * finite. Copies the data, as three channels. name: used if the side has none. Fails with a line that begins with
 * the name. The caller calls library_side_close(), even after a failure. */
NODISCARD bool library_side_open(struct library_side *out, const struct assay_side *side,
                                 const char *name, struct err *e);
void library_side_close(struct library_side *s);

/* Returns ok; copies to error, unless NULL, the line of a failure, or "" if ok. */
bool library_told(bool ok, const struct err *e, char error[ASSAY_ERROR_SIZE]);

#endif
