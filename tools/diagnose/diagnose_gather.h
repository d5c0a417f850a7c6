/* What there is to look at: clues for diagnose.h, from a program, a finished validation, or one image. */
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

/* At most catalogue->num_views of them, in clue[]; the number in *num. */

/* Renders every view with `program`. */
NODISCARD bool diagnose_gather_program(const struct diagnose_gather_options *opt,
                                       const char *program, struct observation *clue, int *num,
                                       struct err *e);

/* Of the images and claims of consistency of a results.json by `assay validate`; of one with --engine, that engine's
 * images, of which only the means are held against bugs, as its noise may rightly be another, and they may lie off by the
 * claims' margins. Views that it has no image of, or of another shape, are left out and appended to `skipped` as {"view": , "reason": }. Fails
 * if none is left. */
NODISCARD bool diagnose_gather_results(const struct diagnose_gather_options *opt, const char *path,
                                       struct observation *clue, int *num, json_t *skipped,
                                       struct err *e);

/* One moments image of the view of that name. */
NODISCARD bool diagnose_gather_image(const struct diagnose_gather_options *opt, const char *view,
                                     const char *path, struct observation *clue, struct err *e);

#endif
