/* What an engine's driver gets to do its part of reference_render(). */
#ifndef ASSAY_JOB_H
#define ASSAY_JOB_H

#include "../renderer/camera.h"
#include "reference.h"

struct reference_job {
    const struct suite_scene *suite;
    const struct suite_reference *ref;
    const struct reference_options *opt;
    const struct scene *scene;   /* loaded from suite->dae */
    const struct camera *camera; /* for suite->width x suite->height */
    const char *dir;             /* empty working directory of this job */
};

/* Seed of replicate k >= 0: 31 bits, well spread, never 0, and another one for each k. */
uint32_t replicate_seed(uint32_t seed, int k);

/* Each fills *out (unit "replicate", or "exact" where the engine's answer has no noise) and adds to
 * the manifest: "version", "binary_sha256", "command", "settings" (object), "seeds" (array). Each
 * fails with one line if the engine cannot express the scene at all. */
bool cycles_render(const struct reference_job *job, struct moments *out, json_t *manifest,
                   struct err *e) __attribute__((warn_unused_result));
bool povray_render(const struct reference_job *job, struct moments *out, json_t *manifest,
                   struct err *e) __attribute__((warn_unused_result));

#endif
