/* A film kept for going on with it: PICTURE.state beside the picture. All sums in double to the last
 * bit, which the float32 of the picture do not have; whose render it is; and a SHA-256 of the lot.
 * Valid on the kind of machine and the version of the program that wrote it. */
#ifndef ASSAY_STATE_H
#define ASSAY_STATE_H

#include "film.h"
#include "identity.h"

/* Appears by rename. */
bool state_write(const char *path, const struct identity *id, const struct film *f, struct err *e)
    __attribute__((warn_unused_result));

/* Fills a film that film_alloc() made. Fails with a line on a missing or damaged file, and on one of
 * another render, naming the first thing that differs. */
bool state_read(const char *path, const struct identity *id, struct film *f, struct err *e)
    __attribute__((warn_unused_result));

#endif
