/* What a render leaves: pictures, its state, a summary. */
#ifndef ASSAY_OUTPUT_H
#define ASSAY_OUTPUT_H

#include "identity.h"

struct output {
    const struct options *opt;
    const struct identity *id;
    const struct scene *scene;
    char accel[160]; /* what the rays are traced with, in words */
    int argc;
    char **argv;
};

/* All pictures of the options, each by rename, and beside each PNG of an adaptive render its sampling
 * rates (X.png -> X_rate.png). stats may be NULL while rendering goes on. */
bool output_pictures(const struct output *o, const struct film *f, const struct render_stats *stats,
                     struct err *e) __attribute__((warn_unused_result));

/* PICTURE.state beside the first picture, or beside `picture` if that is not NULL. */
enum { STATE_PATH = 4096 };
bool output_state_path(const struct output *o, const char *picture, char path[STATE_PATH],
                       struct err *e) __attribute__((warn_unused_result));

/* The assignment's colours of a sampling rate n/most: blue (0) through green (1/2) to red (1). */
void rate_colour(double rate, uint8_t rgb8[3]);

/* The image mean with its standard error, on stdout; what it cost, on stderr. */
void print_summary(const struct output *o, const struct film *f, const struct render_stats *stats);

/* On stderr: how far the render came, and the command that goes on with it. */
void print_how_to_resume(const struct output *o, const struct film *f);

#endif
