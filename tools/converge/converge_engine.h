/* Renders the images that `assay converge` judges: K replicates of one engine at one number of
 * samples, as plain images. */
#ifndef ASSAY_CONVERGE_ENGINE_H
#define ASSAY_CONVERGE_ENGINE_H

#include "reference/external/engine_description.h"
#include "reference/store/reference_render.h"
#include "renderer/base/progress.h"

/* pathtracer: independent samples, the only engine whose slope must be -1/2. pathtracer-sobol: our
 * stratified sampler. The others are stratified within a replicate or, with a subgrid (engine_table.h), render k x k
 * points of a pixel on a regular grid with shared directions; k^2 then counts as samples per pixel. */
enum converge_engine {
    CONVERGE_PATHTRACER,
    CONVERGE_SOBOL,
    CONVERGE_REFERENCES, /* the first of engine_table.h, and so on */
    CONVERGE_NUM_ENGINES = CONVERGE_REFERENCES + NUM_ENGINES_WITH_GOLDENS,
    CONVERGE_OWN = CONVERGE_NUM_ENGINES, /* converge_render_own() */
    CONVERGE_DESCRIBED                   /* the first of the job's descriptions, and so on */
};
extern const char *const converge_engine_names[]; /* of those before CONVERGE_OWN; end with NULL */

enum { CONVERGE_MAX_REPLICATES = 4096, CONVERGE_MAX_RUNGS = 16, CONVERGE_MAX_DESCRIBED = 8 };

struct converge_job {
    const struct suite_scene *scene; /* width and height are those of the images to render */
    const char *pathtracer;          /* the program */
    const char *dir;                 /* for temporary files; exists */
    const char *share_dir;           /* where cycles.py is */
    const struct engine *described;  /* any renderers; they have replicates ("mean" or "moments") */
    uint32_t seed;
    int threads;
    double timeout_s; /* of one process */
    int replicates;
};

/* Progress, updated after every image; Cycles and POV-Ray deliver all images at once. */
struct converge_progress {
    struct progress *progress;
    double before, each, total; /* work: before this rung, of one image, of the whole ladder */
};

/* Part of the error line about an engine whose images have no noise. */
#define CONVERGE_NO_NOISE "no noise at all"

/* Fills images (replicates x width x height x 3 floats, one replicate after the other) with images
 * whose seeds are a function of (seed, engine, rung, replicate) and differ from one another. *cpu_s is
 * the CPU time of one replicate, its share of the engine's start included. *version (NULL where the
 * engine does not say) is a new string, free() it. Fails where an engine cannot express the scene, where
 * its answer has no noise, and on a number of samples it cannot render. */
NODISCARD bool converge_render(const struct converge_job *job, enum converge_engine engine,
                               int rung, int spp, float *images, double *cpu_s, char **version,
                               const struct converge_progress *progress, struct err *e);

/* One long run of our independent sampler with a seed of its own: moments over samples. */
NODISCARD bool converge_render_own(const struct converge_job *job, int spp, struct moments *out,
                                   struct err *e);

#endif
