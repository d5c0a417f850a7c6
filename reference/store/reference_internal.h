/* What reference_render() and the parts of reference_part.c have in common. */
#ifndef ASSAY_REFERENCE_INTERNAL_H
#define ASSAY_REFERENCE_INTERNAL_H

#include "reference_render.h"
#include "reference/external/engine_bindings.h"

/* Calls act() with the scene open and a new directory below opt->work_dir, which is removed on success and kept on
 * failure. */
NODISCARD bool
reference_in_directory(const struct suite_scene *scene, const struct suite_reference *ref,
                       const struct reference_options *opt,
                       bool (*act)(const struct reference_job *job, void *ctx, struct err *e),
                       void *ctx, struct err *e);

/* Adds what every reference's manifest says. */
void reference_describe(const struct suite_scene *scene, const struct suite_reference *ref,
                        const struct reference_options *opt, const struct timing *t,
                        const struct moments *m, json_t *manifest);

#endif
