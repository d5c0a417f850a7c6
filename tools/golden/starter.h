/* A suite folder to begin with: `assay init`. */
#ifndef ASSAY_STARTER_H
#define ASSAY_STARTER_H

#include "renderer/base/err.h"

/* Copies share_dir/starter and one of our scenes into dir, which is made. In the files @NAME@ becomes the last part
 * of dir's path, @BIN@ the directory of this program, both quoted for a shell. Fails before it writes anything if one
 * of the files exists; after another failure what was written is removed. */
NODISCARD bool starter_write(const char *dir, const char *share_dir, struct err *e);
/* Removes the files that starter_write() wrote, and dir and dir/scenes if they are empty then. */
void starter_remove(const char *dir);

#endif
