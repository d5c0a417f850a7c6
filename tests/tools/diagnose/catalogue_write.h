/* A catalogue of known bugs made: what it says of patches, and its files. */
#ifndef ASSAY_TESTS_CATALOGUE_WRITE_H
#define ASSAY_TESTS_CATALOGUE_WRITE_H

#include "tools/diagnose/catalogue.h"

/* manifest.json last, so that a catalogue is whole or not there. */
NODISCARD bool catalogue_write(const char *dir, const struct catalogue *c, struct err *e);

/* The header lines and the hash of a patch; the bug's name is the file's. Fails if a line is missing. */
NODISCARD bool catalogue_bug_of_patch(const char *path, struct bug *out, struct err *e);

/* Holds the catalogue against the patches of a directory, and of another (NULL: none): fails, naming the first, if one has no
 * entry, has changed since, or is gone. */
NODISCARD bool catalogue_current(const struct catalogue *c, const char *patch_dir,
                                 const char *other_dir, struct err *e);

#endif
