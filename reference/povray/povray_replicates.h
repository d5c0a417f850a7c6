/* The images of one POV-Ray reference, POV-Ray's command line for each, and how they are folded into moments.
 * Image t (replicate_images.h) is window t for t < POVRAY_WINDOWS. Each later image is what one replicate adds: the
 * difference of its pair (povray_replicate_parts.h), summed over all passes. */
#ifndef ASSAY_POVRAY_REPLICATES_H
#define ASSAY_POVRAY_REPLICATES_H

#include "reference/replicates/engine_driver.h"
#include "povray_replicate_parts.h"

struct povray_replicates {
    const struct reference_job *job;
    struct povray_passes plan;
    int replicates; /* 0 where the image has no noise */
    size_t size;    /* floats in an image */
};

/* Fails where povray_passes() does. */
NODISCARD bool povray_replicates(const struct reference_job *job, struct povray_replicates *out,
                                 struct err *e);
struct povray_image povray_replicates_window(const struct povray_replicates *s, int j, int pass);
struct povray_image povray_replicates_replicate(const struct povray_replicates *s, int i, int pass,
                                                bool indirect);

enum { POVRAY_ARGS = 16 /* of the engine's command line, NULL included */ };
/* Fills argv, NULL-terminated; it points into `text` and at `program`. */
void povray_command_line(const struct povray_replicates *s, const char *program,
                         const struct povray_image *p, char text[4][32],
                         const char *argv[POVRAY_ARGS]);

/* The driver's fold(), see struct engine_driver. */
NODISCARD bool povray_fold(const struct reference_job *job, const struct replicate_images *images,
                           const json_t *said, struct moments *out, json_t *manifest,
                           struct err *e);

#endif
