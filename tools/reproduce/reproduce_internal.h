/* What the kinds of files that are made again (reproduce.h) share. */
#ifndef ASSAY_REPRODUCE_INTERNAL_H
#define ASSAY_REPRODUCE_INTERNAL_H

#include "reproduce.h"

/* out->command, of NULL-terminated words. False with a line out of memory. */
bool reproduced_command(struct reproduced *out, const char *const *word, struct err *e)
    __attribute__((warn_unused_result));

/* Whether what `path` was made of, its `what` ("scene"), is here, with the SHA-256 of `then`. otherwise: what to do where it is not, "" or
 * "give --scene, or ". */
bool reproduce_input(const char *path, const char *what, const char *file, const char *then,
                     const char *otherwise, struct err *e) __attribute__((warn_unused_result));

/* Counts the bytes of `path`, and those that are others in `again` or that only one of the two has, and tells the first of these by
 * its line and place. */
bool reproduce_bytes(const char *path, const char *again, struct reproduced *out, struct err *e)
    __attribute__((warn_unused_result));

/* Copies `from` to opt->keep, by rename, if there is one. */
bool reproduce_keep(const char *from, const struct reproduce_options *opt, struct err *e)
    __attribute__((warn_unused_result));

#endif
