/* A suite folder to begin with: `assay init`. */
#ifndef ASSAY_STARTER_H
#define ASSAY_STARTER_H

#include "renderer/base/err.h"

/* Copies share/starter and one of our scenes into dir, which is made; @NAME@ in a file becomes the last part of dir's path,
 * @BIN@ the directory of this program, quoted for a shell. Fails, before anything is written, where one of the files is there. */
NODISCARD bool starter_write(const char *dir, const char *share_dir, struct err *e);

#endif
