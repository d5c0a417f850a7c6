/* Sets of rays: camera rays tile by tile, as in the renderer; cosine-distributed rays from their hits; shadow
 * rays from there to one light. */
#ifndef ASSAY_BENCH_SETS_H
#define ASSAY_BENCH_SETS_H

#include "renderer/math/ray_batch.h"
#include "bench_scenes.h"

/* Rays in batches, all full but the last. */
struct ray_set {
    struct rays *batch;
    size_t num_rays;
};

struct answer_key {
    struct hits *hit;              /* by batch */
    bool (*occluded)[BATCH_LANES]; /* by batch */
};

static inline size_t ray_set_batches(const struct ray_set *s)
{
    return (s->num_rays + BATCH_LANES - 1) / BATCH_LANES;
}

static inline int ray_set_size(const struct ray_set *s, size_t b)
{
    size_t left = s->num_rays - b * BATCH_LANES;
    return left < BATCH_LANES ? (int)left : BATCH_LANES;
}

/* Empty, with room for what the functions below make; free batch, hit, occluded. */
struct ray_set ray_set_new(void);
struct answer_key answers_new(void);

/* From the scene's own camera, or from outside at `size` (half the diagonal) about the middle. */
void ray_set_camera(const struct bench_scene *of, vec3 middle, float size, struct ray_set *out);
/* Rays that start where those of `in` hit: one in a cosine-distributed direction (bounce may be NULL), and one
 * to the light. */
void ray_set_go_on(const struct scene *s, const struct ray_set *in, const struct answer_key *a,
                   float size, vec3 light, uint32_t seed, struct ray_set *bounce,
                   struct ray_set *shadow);
/* How many rays of a set have another answer. */
size_t ray_set_different(const struct ray_set *s, bool shadow, const struct answer_key *a,
                         const struct answer_key *b, float size);

#endif
