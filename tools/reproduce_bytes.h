/* Text files made again (reproduce.h), byte by byte. */
#ifndef ASSAY_REPRODUCE_BYTES_H
#define ASSAY_REPRODUCE_BYTES_H

#include "reproduce.h"

#include <stddef.h>

/* The name of a file without its directories, and the path of another beside it. */
const char *base_of(const char *path);
void beside_file(const char *path, const char *name, char *out, size_t size);

/* Counts the bytes of `path`, and those that are others in `again` or that only one of the two has, and tells the first of these by
 * its line and place. */
bool reproduce_bytes(const char *path, const char *again, struct reproduced *out, struct err *e)
    __attribute__((warn_unused_result));

/* Copies `from` to opt->keep, by rename, if there is one. */
bool reproduce_keep(const char *from, const struct reproduce_options *opt, struct err *e)
    __attribute__((warn_unused_result));

#endif
