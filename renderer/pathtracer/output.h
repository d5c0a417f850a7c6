/* What a render leaves: images, its state, a summary. */
#ifndef ASSAY_OUTPUT_H
#define ASSAY_OUTPUT_H

#include "render_id.h"

struct output {
    const struct options *opt;
    const struct render_id *id;
    const struct scene *scene;
    char accel[160]; /* what the rays are traced with, in words */
    const char *
        ranges; /* "0:4,4:9": sums of these sample ranges were added up; NULL: single samples */
    int argc;
    char **argv;
};

/* Writes all images of the options, each by rename, and beside each PNG of an adaptive render its
 * sampling rates (X.png -> X_rate.png). stats may be NULL while rendering goes on. */
NODISCARD bool output_images(const struct output *o, const struct film *f,
                             const struct render_stats *stats, struct err *e);

/* Checks, before the render starts, that all these files, the state and the heat map can be written. */
NODISCARD bool output_check(const struct output *o, struct err *e);

/* For a film that output_images() could not write, for the reason in *e: writes all images as rescued-PID-NAME beside
 * the first image, else in the current directory, else in TMPDIR or /tmp, and adds to the line where they are. Always
 * false. */
bool output_rescue(const struct output *o, const struct film *f, const struct render_stats *stats,
                   struct err *e);

/* output_images() for a film that is never in memory as a whole: it is given from the top as films of whole rows, a
 * multiple of IMAGE_BAND (image.h) at a time except for the last. Images are bit for bit those of the whole film. */
struct output_writer;
/* num_samples: film.num_samples of the whole. NULL with a line on failure. */
NODISCARD struct output_writer *output_open(const struct output *o, int width, int height,
                                            uint32_t num_samples, const struct render_stats *stats,
                                            struct err *e);
NODISCARD bool output_rows(struct output_writer *w, const struct film *band, struct err *e);
/* Both free the writer; the images appear with close. */
NODISCARD bool output_close(struct output_writer *w, struct err *e);
void output_abandon(struct output_writer *w);

/* IMAGE.state beside the first image, or beside `image` if that is not NULL. */
enum { CHECKPOINT_PATH = 4096 };
NODISCARD bool output_state_path(const struct output *o, const char *image,
                                 char path[CHECKPOINT_PATH], struct err *e);

/* The assignment's colours of a sampling rate n/most: blue (0) through green (1/2) to red (1). */
void rate_colour(double rate, uint8_t rgb8[3]);

/* Prints the image mean with its standard error on stdout, the cost and the files written on stderr. */
void output_print_summary(const struct output *o, const struct film *f,
                          const struct render_stats *stats);

/* Prints on stderr how far the render came, and the command that resumes it. */
void output_print_how_to_resume(const struct output *o, const struct film *f);

#endif
