/* One run at a time in a directory of outputs: two would remove and rename each other's files. */
#ifndef ASSAY_DIR_LOCK_H
#define ASSAY_DIR_LOCK_H

#include "renderer/base/err.h"

#include <sys/types.h>

struct dir_lock {
    int fd;    /* of DIR/.assay-lock, which names the process; 0: no lock is held */
    bool made; /* dir_lock_take() created the directory */
    char path[4096];
};

/* Makes the directory and locks it. If another run holds the lock, fails after two seconds with a line that names that process and
 * its host. The lock ends with the process, however that ends. Where the file system cannot lock (some network ones) it
 * succeeds all the same. The caller calls dir_lock_release(), which removes a directory that was made here and is still empty;
 * a zero lock may be released, too. */
NODISCARD bool dir_lock_take(struct dir_lock *l, const char *dir, struct err *e);
void dir_lock_release(struct dir_lock *l);

#endif
