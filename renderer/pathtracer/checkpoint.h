/* A film kept for going on with it: IMAGE.state beside the image. All sums in double to the last
 * bit, which the float32 of the image do not have; whose render it is; and a SHA-256 of the lot.
 * Valid on the kind of machine and the version of the program that wrote it. */
#ifndef ASSAY_CHECKPOINT_H
#define ASSAY_CHECKPOINT_H

#include "renderer/transport/film.h"
#include "render_id.h"

#include <stdio.h>

/* Appears by rename. */
NODISCARD bool checkpoint_write(const char *path, const struct render_id *id, const struct film *f,
                                struct err *e);

/* Fills a film that film_alloc() made. Fails with a line on a missing or damaged file, and on one of
 * another render, naming the first thing that differs. */
NODISCARD bool checkpoint_read(const char *path, const struct render_id *id, struct film *f,
                               struct err *e);

/* A state read by rows, for putting together an image that is larger than memory. */
struct checkpoint {
    FILE *f; /* NULL: closed */
    char path[4096];
    int width, height;
    bool first_hits, has_target;
    uint32_t num_samples; /* film.num_samples */
    long body;            /* where it begins */
};
/* Reads all of it once, to see that it is whole and of that render. */
NODISCARD bool checkpoint_open(struct checkpoint *s, const char *path, const struct render_id *id,
                               int width, int height, bool first_hits, struct err *e);
/* Rows y .. y+num-1 into a film that is at least as wide, from its pixel (at_x, at_y) on; the target too if the
 * film has one. Not film.num_samples. */
NODISCARD bool checkpoint_rows(struct checkpoint *s, int y, int num, struct film *f, int at_x,
                               int at_y, struct err *e);
/* Gives the file back, until checkpoint_rows() wants it again: so any number of states can be read in turn. */
void checkpoint_close(struct checkpoint *s);

#endif
