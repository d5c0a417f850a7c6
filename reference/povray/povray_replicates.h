/* All pictures of one reference by POV-Ray. Picture t of replicate_images.h is window t for t < POVRAY_WINDOWS, and for the rest what a
 * replicate adds: all passes of a window, or those of a replicate's pair (povray_replicate_parts.h), added. */
#ifndef ASSAY_POVRAY_REPLICATES_H
#define ASSAY_POVRAY_REPLICATES_H

#include "reference/replicates/engine_driver.h"
#include "povray_replicate_parts.h"

struct povray_set {
    const struct reference_job *job;
    struct povray_plan plan;
    int replicates; /* 0 where the picture has no noise */
    size_t size;    /* floats in a picture */
};

/* Fails where povray_plan() does. */
bool povray_set(const struct reference_job *job, struct povray_set *out, struct err *e)
    __attribute__((warn_unused_result));
struct povray_image povray_set_window(const struct povray_set *s, int j, int pass);
struct povray_image povray_set_replicate(const struct povray_set *s, int i, int pass,
                                         bool indirect);

enum { POVRAY_ARGS = 16 /* of the engine's command line, NULL included */ };
/* In text that belongs to the caller. */
void povray_command_line(const struct povray_set *s, const char *program,
                         const struct povray_image *p, char text[4][32],
                         const char *argv[POVRAY_ARGS]);

/* As struct driver has it. */
bool povray_fold(const struct reference_job *job, const struct replicate_images *pictures,
                 const json_t *said, struct moments *out, json_t *manifest, struct err *e)
    __attribute__((warn_unused_result));

#endif
