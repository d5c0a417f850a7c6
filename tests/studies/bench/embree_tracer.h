/* A path tracer as one writes it on Embree in an afternoon: one ray at a time, one function, no vectors of
 * its own. The light transport is that of `pathtracer --direct light -l 1` on diffuse scenes: cosine
 * directions, one point on each area light at every vertex, roulette from the third vertex on, whose survival
 * probability is the largest component of the throughput, box filter. The expected image is ours; nothing else is
 * shared but camera_ray(). */
#ifndef ASSAY_EMBREE_TRACER_H
#define ASSAY_EMBREE_TRACER_H

#include "renderer/scene/camera.h"

struct embree_tracer;

/* Refers to the scene, which must outlive it. Fails on materials that are not diffuse and on lights that are
 * not triangles. */
NODISCARD struct embree_tracer *embree_tracer_new(const struct scene *s, struct err *e);
void embree_tracer_free(struct embree_tracer *t);

/* Means of spp paths a pixel, of up to `depth` bounces as -m counts them; 3 floats a pixel. */
void embree_tracer_render(const struct embree_tracer *t, const struct camera *c, int depth, int spp,
                          uint32_t seed, float *rgb_out);

#endif
