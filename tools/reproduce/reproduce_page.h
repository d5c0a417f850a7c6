/* Pages and JUnit files made again (reproduce.h). */
#ifndef ASSAY_REPRODUCE_PAGE_H
#define ASSAY_REPRODUCE_PAGE_H

#include "reproduce.h"

#include <jansson.h>

/* Whether a file is HTML or JUnit's XML, by how it begins. */
bool reproduce_is_page(const char *path);

/* Makes it again into `dir`, which exists, and compares bytes: what validate and converge write, of the results.json beside it and of
 * the file that --converge named; what compare writes, by comparing again; a history, of the results in and below its directory. The
 * date, machine and version of a page are facts that it states. False if it cannot be judged: it does not say how it was made, files that are gone. */
bool reproduce_page(const char *path, const struct reproduce_options *opt, const char *dir,
                    struct reproduced *out, struct err *e) __attribute__((warn_unused_result));

/* The first half: {"command": , ...}, what its elements <meta name="assay:NAME" content="TEXT"> say (report.h); NULL with a line where
 * there is no command. To be given back with json_decref(). */
json_t *reproduce_page_origin(const char *path, struct err *e) __attribute__((warn_unused_result));

#endif
