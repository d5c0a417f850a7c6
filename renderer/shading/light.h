/* Light sampling (next event estimation, light_simd.h): choosing a light, sampling a point on it as seen from a
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

#include "renderer/scene/scene.h"

/* With more lights than this, a vertex samples lights chosen for its place instead of every light. */
enum { MANY_LIGHTS = 16 };

struct light_table; /* per-scene tables for choosing lights and triangles */

/* NULL on failure (out of memory, more lights than DISCRETE_MOST). The scene must outlive the table. */
NODISCARD struct light_table *light_table_build(const struct scene *s, struct err *e);
void light_table_free(struct light_table *t);

/* Number of lights that are not delta lights: area lights and the environment. */
uint32_t light_count_areas(const struct light_table *t);

static inline bool light_is_delta(const struct light *l)
{
    return l->kind == LIGHT_POINT || l->kind == LIGHT_SPOT || l->kind == LIGHT_DIRECTIONAL;
}

#endif
