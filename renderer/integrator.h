/* The light transport estimators, over batches of paths in stages: generate, intersect, shade,
 * connect, scatter. One path is one sample of its pixel's radiance,
 * independent of the others if the sampler is. */
#ifndef ASSAY_INTEGRATOR_H
#define ASSAY_INTEGRATOR_H

#include "batch.h"
#include "bvh.h"
#include "camera.h"
#include "light.h"
#include "sampler.h"

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
    LIGHTS_ONE   /* light_samples times one light, chosen by power */
};

/* How paths end before max_bounces, without changing a mean [Arvo90]. */
enum roulette_kind {
    ROULETTE_OFF,
    ROULETTE_THROUGHPUT, /* from the third vertex on: survive with the largest component of the
                            throughput, 1 at most */
    ROULETTE_FIXED       /* from the second vertex on: survive with the same probability each time,
                            as in the assignment */
};

struct integrator_options {
    enum integrator_kind kind;
    enum direct_kind direct;
    int max_bounces;   /* 0: emission seen directly, 1: + direct light, ... */
    int first_bounce;  /* light with fewer bounces is left out */
    int light_samples; /* per area light and vertex; hemisphere: directions per area light, of which
                          no more than MANY_LIGHTS count */
    enum many_lights many_lights;
    enum roulette_kind roulette;
    float survival; /* ROULETTE_FIXED: 0 < survival <= 1 */
    struct sampler sampler;
    bool first_hits; /* fill the batch's `first`; changes nothing else */
};

struct integrator {
    struct integrator_options opt;
    const struct scene *scene;
    const struct camera *camera;
    const struct bvh *bvh;
    const struct light_table *lights;
};

/* The working memory of one thread. In: lanes 0 .. num_lanes-1 of pixel (number in the full
 * picture, row 0 at the top) and sample. Out: radiance and, if asked for, first. */
struct batch {
    uint32_t pixel[BATCH_LANES], sample[BATCH_LANES];
    struct rgbs radiance;
    struct first_hits first;
    struct rgbs throughput;
    float pdf_w[BATCH_LANES]; /* of the ray's direction; 0 for camera rays and after a delta lobe,
                                 whose emitters nothing else finds */
    float eta2[BATCH_LANES];  /* what the throughput is divided by for being inside glass */
    struct rays ray, shadow;
    struct hits hit, shadow_hit;
    struct rgbs shadow_light; /* what the shadow ray brings if nothing is in between */
    bool occluded[BATCH_LANES];
    struct vec3s p, ng, ns, wo; /* of the hit; normals turned to the side of wo */
    float eps[BATCH_LANES];
    bool front[BATCH_LANES];
    uint32_t material[BATCH_LANES];
    uint16_t active[BATCH_LANES], shadow_lane[BATCH_LANES];
    struct light_choice choice[BATCH_LANES];
    uint16_t diffuse[BATCH_LANES]; /* those of active that light sampling serves */
    struct bvh_stats stats;
};

void integrate(const struct integrator *it, struct batch *b, int num_lanes);

extern const char *const integrator_kind_names[]; /* end with NULL */
extern const char *const direct_kind_names[];

#endif
