/* A catalogue of known bugs made: what it says of patches, and its files. */
#ifndef ASSAY_TESTS_CATALOGUE_WRITE_H
#define ASSAY_TESTS_CATALOGUE_WRITE_H

#include "tools/diagnose/catalogue.h"

/* manifest.json last, so that a catalogue is whole or not there. */
bool catalogue_write(const char *dir, const struct catalogue *c, struct err *e)
    __attribute__((warn_unused_result));

/* The header lines and the hash of a patch; the bug's name is the file's. Fails if a line is missing. */
bool catalogue_bug_of_patch(const char *path, struct bug *out, struct err *e)
    __attribute__((warn_unused_result));

/* Holds the catalogue against the patches of a directory, and of another (NULL: none): fails, naming the first, if one has no
 * entry, has changed since, or is gone. */
bool catalogue_current(const struct catalogue *c, const char *patch_dir, const char *other_dir,
                       struct err *e) __attribute__((warn_unused_result));

#endif
