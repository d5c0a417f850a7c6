/* Sampling the lights from a point, and the density of doing so. Areas are sampled uniformly (pdf_a
 * = 1/area, turned into pdf_w = pdf_a d^2 / cos_l at the receiver [Veach97 8.2]); a sphere seen
 * from outside, uniformly over the cone it subtends [Shirley96]. */
#ifndef ASSAY_LIGHT_H
#define ASSAY_LIGHT_H

#include "batch.h"
#include "scene.h"
#include "shape.h"

struct light_table; /* per-scene tables for choosing triangles; opaque */

/* NULL on failure (out of memory). Refers to the scene. */
struct light_table *light_table_build(const struct scene *s, struct err *e)
    __attribute__((warn_unused_result));
void light_table_free(struct light_table *t);

struct light_sample {
    vec3 wi;         /* unit, from the point to the light */
    float distance;  /* to the sampled place; INFINITY for directional lights */
    rgb radiance;    /* arriving along wi; for delta lights irradiance on a plane facing wi */
    uint32_t sphere; /* primitive number of the light if it is a sphere seen from outside, which a
                        shadow ray then has to ignore; else NO_HIT */
    float pdf_w;     /* per steradian; 0: this sample brings no light */
    bool delta;      /* pdf_w is then 1 and no BSDF sample can find the light */
};

/* One sample of light number l as seen from p. u in [0,1)^3. */
struct light_sample light_sample_direction(const struct light_table *t, uint32_t l, vec3 p,
                                           const float u[3]);

/* The density with which light l (not a delta light) would have sampled the place `hit`, found from
 * p along unit wi at distance d. */
float light_pdf_w(const struct light_table *t, uint32_t l, vec3 p, vec3 wi, float d,
                  const struct surface *hit);

static inline bool light_is_delta(const struct light *l)
{
    return l->kind == LIGHT_POINT || l->kind == LIGHT_DIRECTIONAL;
}

/* Emitted radiance towards w (any length) of material m at a surface with geometric normal ng. */
static inline rgb emitted_radiance(const struct material *m, vec3 ng, vec3 w)
{
    return m->radiance_both_sides || dot(ng, w) > 0 ? m->radiance : grey(0);
}

#endif
