/* Batches of paths in structure-of-arrays layout; one lane holds one path. The stages of the integrator (generate,
 * intersect, shade, connect, scatter) each run over a list of lanes. */
#ifndef ASSAY_RAY_BATCH_H
#define ASSAY_RAY_BATCH_H

#include "vec.h"

#include <stdint.h>

/* Rows are longer than a batch: vectors may read and write a little past its end, and rows of 1024
 * bytes would all map to the same few sets of the L1 cache. */
enum { BATCH_LANES = 256, BATCH_ROOM = BATCH_LANES + 16 };

#define NO_HIT UINT32_MAX

struct vec3s {
    float x[BATCH_ROOM], y[BATCH_ROOM], z[BATCH_ROOM];
};

struct rgbs {
    float r[BATCH_ROOM], g[BATCH_ROOM], b[BATCH_ROOM];
};

struct rays {
    struct vec3s o, d;
    float tmin[BATCH_ROOM], tmax[BATCH_ROOM];
    /* Occlusion only: primitive number of a sphere that is not tested, or NO_HIT. At the rim of a
     * spherical light its distance does not tell whether a shadow ray has already reached it. */
    uint32_t ignore[BATCH_ROOM];
};

struct hits {
    float t[BATCH_ROOM], u[BATCH_ROOM], v[BATCH_ROOM];
    uint32_t prim[BATCH_ROOM];
};

/* What camera rays met, for the layers beside the image (aov.h). */
struct first_hits {
    float depth[BATCH_ROOM];     /* from the plane through the eye, along the viewing axis */
    struct vec3s normal;         /* shading normal as the scene has it, world space */
    struct rgbs albedo;          /* see first_hits_record() */
    uint32_t object[BATCH_ROOM]; /* object number; NO_HIT: nothing met, the rest is not set */
};

static inline vec3 vec3s_get(const struct vec3s *a, int i)
{
    return (vec3){a->x[i], a->y[i], a->z[i]};
}
static inline void vec3s_set(struct vec3s *a, int i, vec3 v)
{
    a->x[i] = v.x;
    a->y[i] = v.y;
    a->z[i] = v.z;
}
static inline rgb rgbs_get(const struct rgbs *a, int i)
{
    return (rgb){a->r[i], a->g[i], a->b[i]};
}
static inline void rgbs_set(struct rgbs *a, int i, rgb v)
{
    a->r[i] = v.r;
    a->g[i] = v.g;
    a->b[i] = v.b;
}
static inline ray rays_get(const struct rays *a, int i)
{
    return (ray){vec3s_get(&a->o, i), vec3s_get(&a->d, i), a->tmin[i], a->tmax[i]};
}
static inline void rays_set(struct rays *a, int i, ray r)
{
    vec3s_set(&a->o, i, r.o);
    vec3s_set(&a->d, i, r.d);
    a->tmin[i] = r.tmin;
    a->tmax[i] = r.tmax;
}

#endif
