/* Many lights: chooses one by an estimate of what it sends to a place with a normal, as [Conty18],
 * from a list of clusters, not a tree. A cluster has a sphere around its lights and a cone around
 * the directions in which they shine, and is taken in proportion to its weight: bounds on the
 * cosines at both ends times its value over the falloff to its centre. So lights behind a surface,
 * and lamps that turn their backs, are not taken, and all that can send some light are. Within a
 * cluster lights are taken by their value. light_choice_simd.h chooses. */
#ifndef ASSAY_LIGHT_CHOICE_H
#define ASSAY_LIGHT_CHOICE_H

#include "renderer/base/err.h"
#include "renderer/math/vec.h"

#include <stdint.h>

/* What the weight of a light, or of several, is made of. */
struct light_bounds {
    bool near; /* the sphere is around the light; else infinitely far, around its unit direction */
    vec3 centre; /* of the sphere */
    float radius;
    vec3 axis;        /* of the cone, unit: surfaces' normals, or what spots shine along */
    float angle;      /* half of it, 0 to pi */
    float reach;      /* cosine beyond which nothing is sent off the cone: lamps 0 */
    float even;       /* share of what is sent that does not fall with the cosine at the light */
    float falloff[3]; /* value/(f[0] + f[1] d + f[2] d^2) arrives at the distance d */
    double value;     /* 0: is never chosen */
};

/* No more clusters than this; with as many lights or less each is one. */
enum { MOST_CLUSTERS = 32 };

struct light_clusters; /* opaque; const once made */

/* Of n lights, 2^23 at most; NULL if out of memory. Uses b for itself, and does not refer to it. */
NODISCARD struct light_clusters *light_clusters_build(struct light_bounds *b, uint32_t n);
void light_clusters_free(struct light_clusters *t);

#endif
