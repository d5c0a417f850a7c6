/* An engine's driver: what reference_render() hands to it, and what it has to implement. */
#ifndef ASSAY_ENGINE_DRIVER_H
#define ASSAY_ENGINE_DRIVER_H

#include "replicate_images.h"
#include "reference/suite/suite.h"
#include "renderer/image/moments.h"

struct reference_options {
    uint32_t seed; /* replicate k's own seed is a hash of (seed, k) */
    /* k of the first of the ref->replicates: the next one continues an earlier call, a number beyond all
     * that have been used gives fresh replicates. */
    int first_replicate;
    int threads;
    double timeout_s; /* of one engine process; it is killed (whole process group) after that */
    const char
        *work_dir; /* exists; gets one sub-directory per scene and engine, removed on success */
    const char *share_dir; /* where cycles.py is */
    /* NULL, or called with each replicate (RGB, 3 floats a pixel) in their order, by the calling
     * thread; not where the engine's answer is exact. */
    void (*on_replicate)(void *ctx, int k, const float *pixels_rgb);
    void *on_replicate_ctx;
};

struct reference_job {
    const struct suite_scene *suite;
    const struct suite_reference *ref;
    const struct reference_options *opt;
    const struct scene *scene;   /* loaded from suite->dae */
    const struct camera *camera; /* for suite->width x suite->height */
    const char *dir;             /* empty working directory of this job */
};

/* Seed of replicate k >= 0: 31 bits, well spread, never 0, and different for each k. */
uint32_t replicate_seed(uint32_t seed, int k);

/* An engine. Rendering and folding share nothing but the images and the object `said`, so that they can run on
 * different machines. Each fails with one line if the engine cannot express the scene at all. */
struct engine_driver {
    const char *const *scripts; /* the scripts in share_dir that it runs, NULL at the end; or NULL */
    const char *prefix;         /* of an image's file, replicate_images_path() */
    bool below_zero;            /* images are differences and may be negative */
    /* How many images the fold takes. */
    bool (*count)(const struct reference_job *job, int *num, struct err *e);
    /* Renders images first .. last-1 into files of job->dir, numbered from 0. Adds to `said` what the manifest needs
     * and only the engine knows: "version", "binary_sha256" and more. */
    bool (*render)(const struct reference_job *job, int first, int last, json_t *said,
                   struct err *e);
    /* Folds all images, in their order, into *out (unit "replicate", or "exact" if the engine's result has no noise);
     * adds to the manifest "version", "binary_sha256", "command", "settings" (object), "seeds" (array), and
     * "independence". Calls opt->on_replicate. */
    bool (*fold)(const struct reference_job *job, const struct replicate_images *images,
                 const json_t *said, struct moments *out, json_t *manifest, struct err *e);
    /* Writes to path what determines the images besides program, scripts and settings of the suite; reference_key()
     * hashes it. */
    bool (*write_key)(const struct reference_job *job, const char *path, struct err *e);
};

/* The driver of each engine with goldens, in reference/NAME/NAME_driver.c. */
#define ENGINE_DRIVER(name, ...) extern const struct engine_driver name##_driver;
ENGINES_WITH_GOLDENS(ENGINE_DRIVER)
#undef ENGINE_DRIVER

/* Counts, renders and folds all images on this machine. */
NODISCARD bool engine_driver_render(const struct engine_driver *driver,
                                    const struct reference_job *job, struct moments *out,
                                    json_t *manifest, struct err *e);

/* The start's date (UTC) and, once stopped, the elapsed wall and CPU seconds, of this process and all children waited
 * for. */
struct timing {
    char date[32];
    double wall_s, cpu_s;
};
struct timing timing_start(void);
void timing_stop(struct timing *t);

#endif
