/* A picture: tiles from a queue, rendered by threads, into moments. */
#ifndef ASSAY_RENDER_H
#define ASSAY_RENDER_H

#include "integrator.h"
#include "moments.h"
#include "progress.h"

struct render_options {
    struct integrator_options integrator;
    int x, y, width, height; /* the cell of the full picture to render; origin at the top left */
    uint32_t first_sample;   /* sample numbers first_sample .. first_sample + num_samples - 1 */
    uint32_t num_samples;    /* per pixel (the most, if adaptive) */
    int threads;
    /* The assignment's adaptive rule: after every `batch` samples a pixel stops if 1.96 s/sqrt(n)
     * <= tolerance * mean of its illuminance. 0: off. Biased by design: it averages the samples
     * that it stopped on. */
    int adaptive_batch;
    double adaptive_tolerance;
};

struct render_stats {
    struct bvh_stats rays;
    double samples; /* over all pixels */
    double wall_seconds, cpu_seconds;
};

/* Renders the cell into *out (one path each, unit "sample", or "stratified" unless the sampler is
 * the independent one; the caller frees). The result depends
 * only on scene, camera and options, never on threads. */
bool render(const struct scene *s, const struct camera *c, const struct bvh *bvh,
            const struct render_options *opt, struct progress *progress, struct moments *out,
            struct render_stats *stats, struct err *e) __attribute__((warn_unused_result));

#endif
