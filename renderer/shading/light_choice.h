/* Many lights: chooses one by an estimate of what it sends to a place with a normal, as in [Conty18]
 * but from a list of clusters instead of a tree. A cluster has a sphere around its lights and a cone
 * around the directions in which they shine. It is chosen in proportion to its weight: its value
 * times bounds on the cosines at both ends, divided by the falloff to its centre. So lights behind a
 * surface, and lamps that face away, are never chosen; all that can send some light may be. Within a
 * cluster lights are chosen in proportion to their value. light_choice_simd.h makes the choice. */
#ifndef ASSAY_LIGHT_CHOICE_H
#define ASSAY_LIGHT_CHOICE_H

#include "renderer/base/err.h"
#include "renderer/math/vec.h"

#include <stdint.h>

/* What the weight of one or several lights is computed from. */
struct light_bounds {
    bool near; /* the sphere is around the light; else, infinitely far, around its unit direction */
    vec3 centre; /* of the sphere */
    float radius;
    vec3 axis;        /* of the cone, unit: surfaces' normals, or what spots shine along */
    float angle;      /* half of it, 0 to pi */
    float reach;      /* least cosine to the cone at which light is sent; lamps: 0 */
    float even;       /* share of what is sent that does not fall with the cosine at the light */
    float falloff[3]; /* value/(f[0] + f[1] d + f[2] d^2) arrives at the distance d */
    double value;     /* 0: is never chosen */
};

/* Largest number of clusters; up to as many lights are clusters of their own. */
enum { MOST_CLUSTERS = 32 };

struct light_clusters; /* opaque; const once made */

/* Clusters n lights, 2^23 at most. Overwrites b[], but keeps no reference to it. NULL if out of memory. */
NODISCARD struct light_clusters *light_clusters_build(struct light_bounds *b, uint32_t n);
void light_clusters_free(struct light_clusters *t);

#endif
