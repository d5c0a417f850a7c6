/* A film stored for resuming: IMAGE.state beside the image. It has all sums in double (the image has
 * only float32), the render_id, and a SHA-256 of everything. Valid for the kind of machine and the
 * version of the program that wrote it. */
#ifndef ASSAY_CHECKPOINT_H
#define ASSAY_CHECKPOINT_H

#include "renderer/transport/film.h"
#include "render_id.h"

#include <stdio.h>

/* Writes the state; the file appears by rename. */
NODISCARD bool checkpoint_write(const char *path, const struct render_id *id, const struct film *f,
                                struct err *e);

/* Fills a film that film_alloc() made. Fails with a line on a missing or damaged file, and on one of
 * another render, naming the first thing that differs. */
NODISCARD bool checkpoint_read(const char *path, const struct render_id *id, struct film *f,
                               struct err *e);

/* A state that is read by rows, to assemble an image that is larger than memory. */
struct checkpoint {
    FILE *f; /* NULL: closed */
    char path[4096];
    int width, height;
    bool first_hits, has_target;
    uint32_t num_samples; /* film.num_samples */
    long body;            /* where it begins */
};
/* Opens a state and reads it once, to check that it is intact and of that render. checkpoint_close() it. */
NODISCARD bool checkpoint_open(struct checkpoint *s, const char *path, const struct render_id *id,
                               int width, int height, bool first_hits, struct err *e);
/* Reads rows y .. y+num-1 into a film that is at least as wide, at its pixel (at_x, at_y); the target too if the film
 * has one. Leaves film.num_samples alone. */
NODISCARD bool checkpoint_rows(struct checkpoint *s, int y, int num, struct film *f, int at_x,
                               int at_y, struct err *e);
/* Closes the file until checkpoint_rows() needs it again, so that any number of states can be read in turn. */
void checkpoint_close(struct checkpoint *s);

#endif
