/* Gathers observations ("clues") for diagnose.h from a program, a finished validation, or one image. */
#ifndef ASSAY_DIAGNOSE_GATHER_H
#define ASSAY_DIAGNOSE_GATHER_H

#include "diagnose.h"

#include <jansson.h>

struct diagnose_gather_options {
    const struct catalogue *catalogue;
    const struct suite *suite;
    double alpha; /* of the diagnosis; claims of consistency get their share of it */
    uint64_t seed;
    int threads;
    double timeout_s;
    const char *work_dir; /* for images while they are read; made and removed by the caller */
};

/* The first two write at most catalogue->num_views observations to clue[], and their number to *num. */

/* Renders every view with `program`. */
NODISCARD bool diagnose_gather_program(const struct diagnose_gather_options *opt,
                                       const char *program, struct observation *clue, int *num,
                                       struct err *e);

/* The reason of a view that is skipped as its scene was not judged. */
#define DIAGNOSE_NO_IMAGE "no image"

/* From the images and claims of consistency in a results.json of `assay validate`; with --engine, from that engine's
 * images, of which only the means are compared with bugs, as its noise may rightly differ, and which may be off by the
 * claims' margins. Views without an image, or with one of another shape, are left out and appended to `skipped` as
 * {"view": , "reason": }, and so are scenes that are DIFFERENT and of which no view was looked at. Fails if no view
 * is left. */
NODISCARD bool diagnose_gather_results(const struct diagnose_gather_options *opt, const char *path,
                                       struct observation *clue, int *num, json_t *skipped,
                                       struct err *e);

/* From one moments image of the view of that name. */
NODISCARD bool diagnose_gather_image(const struct diagnose_gather_options *opt, const char *view,
                                     const char *path, struct observation *clue, struct err *e);

#endif
