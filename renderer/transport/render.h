/* Renders an image into a film: passes over the whole image, each a few samples per pixel; threads take tiles from a
 * queue. */
#ifndef ASSAY_RENDER_H
#define ASSAY_RENDER_H

#include "film.h"
#include "integrator.h"
#include "renderer/image/moments.h"
#include "renderer/base/progress.h"

struct render_options {
    struct integrator_options integrator;
    int x, y, width, height; /* the cell of the full image to render; origin at the top left */
    uint32_t first_sample;   /* sample numbers first_sample .. first_sample + num_samples - 1 */
    uint32_t num_samples;    /* per pixel (the most, if adaptive) */
    int threads;
    /* The assignment's adaptive rule: after every adaptive_batch samples a pixel stops if 1.96
     * s/sqrt(n) <= adaptive_tolerance * mean of its luminance. 0: off. Biased by design: it averages
     * the samples that it stopped on. */
    int adaptive_batch;
    double adaptive_tolerance;
    /* The unbiased mode: `pilot_samples` samples of a pixel, from random numbers of their own, decide how
     * many samples it gets, so many that the same interval would be within the tolerance, but no fewer
     * than the pilot had and no more than pilot_max; then that many are averaged, without the
     * pilot's. 0: off. */
    uint32_t pilot_samples, pilot_max;
    double pilot_tolerance;
};

enum render_end {
    RENDER_DONE,  /* every sample asked for */
    RENDER_TIME,  /* max_seconds are over */
    RENDER_ERROR, /* max_error is reached */
    RENDER_ASKED  /* asked_to_stop() said so */
};

/* When to stop early, and what to do meanwhile. A stop falls between two passes, so all pixels have
 * seen the same sample numbers. */
struct render_control {
    double max_seconds; /* 0: no limit. At least one pass is rendered */
    /* Stop when film_relative_error() <= max_error, looked at after every 16 samples of all pixels,
     * whatever the machine. 0: no limit. */
    double max_error;
    double write_every; /* seconds between calls of write(); 0: none */
    /* Called between passes; a failure ends the render. */
    bool (*write)(void *arg, const struct film *f, struct err *e);
    bool (*asked_to_stop)(void *arg); /* several times a second; NULL: never */
    void *arg;
};

struct render_stats {
    struct bvh_stats rays;
    double samples; /* over all pixels, the pilot's too */
    double wall_seconds, cpu_seconds;
    enum render_end end;
};

/* Renders the cell into a film of its size, going on after the film->num_samples that it holds. The
 * result depends only on scene, camera, options and, if it stops early, on the number of samples by
 * then; never on threads or on how often it was stopped. A pilot that is stopped leaves nothing and
 * starts again. control may be NULL. */
NODISCARD bool render_film(const struct scene *s, const struct camera *c, const struct bvh *bvh,
                           const struct render_options *opt, const struct render_control *control,
                           struct progress *progress, struct film *film, struct render_stats *stats,
                           struct err *e);

/* The same from the start, without control. *out: moments over single paths; the caller frees them. */
NODISCARD bool render(const struct scene *s, const struct camera *c, const struct bvh *bvh,
                      const struct render_options *opt, struct progress *progress,
                      struct moments *out, struct render_stats *stats, struct err *e);

#endif
