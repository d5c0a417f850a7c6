/* One hash for a file or for all that is in a directory. */
#ifndef ASSAY_HASH_TREE_H
#define ASSAY_HASH_TREE_H

#include "renderer/base/err.h"

/* Of a file: its SHA-256, lower-case hex. Of a directory: the SHA-256 of the lines "KIND HASH NAME" of its entries, sorted by
 * name; directories are hashed in the same way, links by their target. `except`: a name in
 * the top directory that is left out; NULL: none. Fails with a line on what cannot be read. */
NODISCARD bool hash_tree(const char *path, const char *except, char hex[65], struct err *e);

#endif
