/* Light sampling (next event estimation): choosing a light, sampling a point on it as seen from a
 * shading point, and the density of both. Triangles are sampled uniformly by area: pdf_a = 1/area,
 * converted to pdf_w = pdf_a d^2 / cos_l at the receiver [Veach97 8.2]. A sphere seen from outside
 * is sampled uniformly over the cone that it subtends [Shirley96]. In a textured light a triangle
 * is chosen in proportion to its area times (0.1 + 0.9 L/mean), L its mean luminance and mean that
 * of the light, so that no part is left out; within the triangle the sample is uniform.
 *
 * A new kind of light: enum light_kind (scene.h), scene.c, light.c, light_simd.h; its reader in
 * collada_light.c; then the references (reference/README.md, "What to touch"). */
#ifndef ASSAY_LIGHT_H
#define ASSAY_LIGHT_H

#include "renderer/math/ray_batch.h"
#include "renderer/scene/scene.h"
#include "renderer/scene/shape.h"

/* With more lights than this, a sample goes to one of them chosen by place, not to each. */
enum { MANY_LIGHTS = 16 };

struct light_table; /* per-scene tables for choosing lights and triangles; opaque */

/* NULL on failure (out of memory, more lights than DISCRETE_MOST). Refers to the scene. */
NODISCARD struct light_table *light_table_build(const struct scene *s, struct err *e);
void light_table_free(struct light_table *t);

/* A light and the probability with which it was chosen; 0: none. */
struct light_choice {
    uint32_t light;
    float probability;
};

/* One light for the place p with the unit normal n, in proportion to about the irradiance (its
 * luminance) that comes from it (light_choice.h); never one that sends nothing to that side.
 * only_delta: among the delta lights alone. 0 <= u < 1. */
struct light_choice light_choose(const struct light_table *t, bool only_delta, vec3 p, vec3 n,
                                 float u);
/* The probability that light_choose(t, false, ..) has for light l there. */
float light_choice_probability(const struct light_table *t, uint32_t l, vec3 p, vec3 n);
/* How many are no delta lights. */
uint32_t light_count_areas(const struct light_table *t);

struct light_sample {
    vec3 wi;         /* unit, from the point to the light */
    float distance;  /* to the sampled place; INFINITY for directional lights and the environment */
    rgb radiance;    /* arriving along wi; for delta lights irradiance on a plane facing wi */
    uint32_t sphere; /* primitive number of the light if it is a sphere seen from outside, which a
                        shadow ray then has to ignore; else NO_HIT */
    float pdf_w;     /* per steradian; 0: this sample brings no light */
    bool delta;      /* pdf_w is then 1 and no BSDF sample can find the light */
};

/* One sample of light number l as seen from p, where the unit normal is n: what the environment
 * goes by. u in [0,1)^4. */
struct light_sample light_sample_direction(const struct light_table *t, uint32_t l, vec3 p, vec3 n,
                                           const float u[4]);

/* The density with which light l (an area light) would have sampled the place `hit` of primitive
 * prim, found from p along unit wi at distance d. The environment has environment_pdf_w(). */
float light_pdf_w(const struct light_table *t, uint32_t l, uint32_t prim, vec3 p, vec3 wi, float d,
                  const struct surface *hit);

static inline bool light_is_delta(const struct light *l)
{
    return l->kind == LIGHT_POINT || l->kind == LIGHT_SPOT || l->kind == LIGHT_DIRECTIONAL;
}

#endif
