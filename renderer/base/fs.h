/* Files that appear whole or not at all, and the few path helpers the programs share. */
#ifndef ASSAY_FS_H
#define ASSAY_FS_H

#include "err.h"

#include <limits.h>
#include <stdio.h>

/* A path composed from parts. A longer one is cut at PATH_MAX characters, which is still too long for the system: every
 * use of it fails instead of touching another file. */
struct path {
    char s[PATH_MAX + 1];
};
struct path fs_path(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* A file under construction: written beside its final place, renamed by out_commit(). */
struct out_file {
    FILE *f;
    char path[4096];
    char temp[4096 + 32];
};

/* Opens path's temporary sibling for writing (binary). */
NODISCARD bool out_open(struct out_file *o, const char *path, struct err *e);
/* Flushes, syncs, closes and renames; on failure the temporary is gone and the old file untouched.
 */
NODISCARD bool out_commit(struct out_file *o, struct err *e);
/* Closes and removes the temporary. */
void out_abandon(struct out_file *o);
/* Checks, before hours of work, that a file can be written at path: false with a line if not, or for a directory.
 * Leaves nothing behind. */
NODISCARD bool out_check(const char *path, struct err *e);

/* Opens a regular file or a directory for reading. NULL with errno: ENOTSUP for a FIFO (would block) or a device (may not end).
 * The caller closes it. */
FILE *fs_open(const char *path);
/* The same, but a file descriptor; -1 with errno on failure. */
int fs_open_fd(const char *path);

/* mkdir -p. */
NODISCARD bool fs_make_dirs(const char *path, struct err *e);
/* mkdir -p of the directory part of path. */
NODISCARD bool fs_make_parent_dirs(const char *path, struct err *e);
/* rm -r of a directory that we made; it may be missing. Follows no link in it, even if others change it meanwhile. */
NODISCARD bool fs_remove_tree(const char *path, struct err *e);

/* Copies a file; the copy has mode 0644. */
NODISCARD bool fs_copy(const char *from, const char *to, struct err *e);
/* The last component of `path`: a pointer into it. */
const char *fs_base(const char *path);
/* The file `name` in the directory of the file `path`. */
struct path fs_beside_file(const char *path, const char *name);

/* The file `name` beside the running program (in libassay.so: beside the library), or in the current directory if that
 * is not known. */
struct path fs_beside_program(const char *name);

#endif
