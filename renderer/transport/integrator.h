/* Path tracing: estimators of light transport over batches of paths, in stages: generate, intersect, shade, connect,
 * scatter. One path is one sample of its pixel's radiance, independent of the others if the sampler is. */
#ifndef ASSAY_INTEGRATOR_H
#define ASSAY_INTEGRATOR_H

#include "renderer/base/isa.h"
#include "renderer/bvh/bvh.h"
#include "renderer/math/ray_batch.h"
#include "renderer/math/sampler.h"
#include "renderer/scene/camera.h"
#include "renderer/shading/light.h"

enum integrator_kind {
    INTEGRATE_PATHS,
    INTEGRATE_NORMALS /* (n + 1)/2 of the shading normal first seen; black where nothing is */
};

/* How light that arrives directly from an emitter is found at every vertex. All have the same mean;
 * delta lights are always sampled. */
enum direct_kind {
    DIRECT_HEMISPHERE, /* uniform directions, the assignment's -H */
    DIRECT_LIGHT,      /* points on the lights, directions of the environment */
    DIRECT_BSDF,       /* only what the path itself runs into */
    DIRECT_MIS         /* lights and path, power heuristic [Veach97 9.2] */
};

/* Which lights a vertex samples. All have the same mean. */
enum many_lights {
    LIGHTS_AUTO, /* all up to MANY_LIGHTS of them, else one */
    LIGHTS_ALL,  /* light_samples of each; one of each delta light */
    LIGHTS_ONE   /* light_samples samples, each of a light chosen for the vertex */
};

/* How paths end before max_bounces, without changing a mean [Arvo90]. */
enum roulette_kind {
    ROULETTE_OFF,
    ROULETTE_THROUGHPUT, /* from the third vertex on: survive with the largest component of the
                            throughput, with Sobol 4 times that, 1 at most */
    ROULETTE_FIXED       /* from the second vertex on: survive with the same probability each time,
                            as in the assignment */
};

struct integrator_options {
    enum integrator_kind kind;
    enum direct_kind direct;
    int max_bounces;   /* 0: emission seen directly, 1: + direct light, ... */
    int first_bounce;  /* light with fewer bounces is left out */
    int light_samples; /* per area light and vertex; hemisphere: directions per area light, for at
                          most MANY_LIGHTS of these */
    enum many_lights many_lights;
    enum roulette_kind roulette;
    float survival; /* ROULETTE_FIXED: 0 < survival <= 1 */
    struct sampler sampler;
    bool guiding;    /* send bounces where a pilot found light (guide.h) */
    bool first_hits; /* fill the batch's `first`; changes nothing else */
    enum isa
        isa; /* of the stages; ISA_SCALAR: one path at a time. Every choice gives the same bits */
};

/* ROULETTE_THROUGHPUT: survival probability divided by the largest component of the throughput. Much roulette would
 * undo the gain of Sobol points, so with them the longer paths of a higher probability pay. */
static inline float roulette_factor(const struct integrator_options *o)
{
    return o->sampler.kind == SAMPLER_INDEPENDENT ? 1 : 4;
}

struct integrator {
    struct integrator_options opt;
    const struct scene *scene;
    const struct camera *camera;
    const struct bvh *bvh;
    const struct light_table *lights;
    const struct guide *guide; /* NULL: none */
    /* The stages; and the scene for them, NULL: not needed. */
    const struct integrator_simd *stages;
    const struct scene_simd *records;
};

/* The working memory of one thread. In: lanes 0 .. num_lanes-1 of pixel (number in the full
 * image, row 0 at the top) and sample. Out: radiance and, if asked for, first. */
struct batch {
    uint32_t pixel[BATCH_ROOM], sample[BATCH_ROOM];
    struct rgbs radiance;
    struct first_hits first;
    struct rgbs throughput;
    float pdf_w[BATCH_ROOM]; /* of the ray's direction; 0 for camera rays and after a delta lobe:
                                 no other technique finds the emitters that these hit */
    float eta2[BATCH_ROOM];  /* product of the refractions' eta^2, by which throughput is divided */
    struct rays ray, shadow;
    struct hits hit, shadow_hit;
    struct rgbs shadow_light; /* what the shadow ray brings if nothing is in between */
    bool occluded[BATCH_ROOM];
    struct vec3s p, ng, ns, wo; /* of the hit; normals turned to the side of wo */
    /* At the start of the ray: ns, if lights or sky are sampled by it, and the total weight of the light clusters. */
    struct vec3s from_n;
    float from_weight[BATCH_ROOM];
    float eps[BATCH_ROOM];
    bool front[BATCH_ROOM];
    uint32_t material[BATCH_ROOM];
    uint16_t active[BATCH_ROOM], shadow_lane[BATCH_ROOM];
    uint32_t choice[BATCH_ROOM]; /* the light */
    float choice_probability[BATCH_ROOM], choice_weight[BATCH_ROOM];
    /* Paths that go on are kept side by side. slot: the lane of `pixel` and `radiance` to which a path belongs. */
    uint32_t slot[BATCH_ROOM], slot_pixel[BATCH_ROOM], slot_sample[BATCH_ROOM];
    float numbers[4][BATCH_ROOM]; /* random numbers, in rows of LANES paths for one purpose */
    struct rgbs gathered, reflectance;
    struct guide_notes *notes; /* NULL: not the pilot */
    int32_t bits[BATCH_ROOM];  /* of the material's record */
    /* One element per LANES paths, a bit for each. */
    uint16_t goes_on[BATCH_ROOM], shadow_bits[BATCH_ROOM], shadow_first[BATCH_ROOM];
    struct bvh_stats stats;
};

void integrator_run(const struct integrator *it, struct batch *b, int num_lanes);

/* True if a vertex samples lights chosen for its place instead of every light. */
static inline bool chooses_light(const struct integrator *it)
{
    switch (it->opt.many_lights) {
    case LIGHTS_AUTO: break;
    case LIGHTS_ALL: return false;
    case LIGHTS_ONE: return true;
    }
    return it->scene->num_lights > MANY_LIGHTS;
}

/* Fills it->stages and it->records as it->opt.isa asks, for the scene in *it; false if out of
 * memory or if the machine lacks the instructions. integrator_free() afterwards, in either case. */
NODISCARD bool integrator_prepare(struct integrator *it, struct err *e);
void integrator_free(struct integrator *it);

extern const char *const integrator_kind_names[]; /* end with NULL */
extern const char *const direct_kind_names[];

#endif
