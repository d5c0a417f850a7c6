/* A private temporary directory of one run, below $TMPDIR or /tmp. */
#ifndef ASSAY_TEMP_DIR_H
#define ASSAY_TEMP_DIR_H

#include "renderer/base/err.h"

struct temp_dir {
    char path[512];
    int lock; /* held for as long as it is in use [flock(2)] */
};

/* Makes $TMPDIR/assay-NAME-HOST.XXXXXX, mode 0700, and locks it. First removes those of the same name, host and user that killed
 * runs have left, as far as possible. The caller calls temp_dir_close(); until then no other such process removes it. */
NODISCARD bool temp_dir_open(struct temp_dir *d, const char *name, struct err *e);

/* Removes it, with all that is in it; false with a line if that fails. Does nothing if it is closed or zero. */
bool temp_dir_close(struct temp_dir *d, struct err *e);

#endif
