/* Lamps: emitters that can be expressed as POV-Ray light sources, as they reflect nothing and emit from
 * one side. Sample points of such a surface become spotlights with a cosine lobe. */
#ifndef ASSAY_POVRAY_LAMP_H
#define ASSAY_POVRAY_LAMP_H

#include "renderer/scene/scene.h"

enum povray_lamp_kind {
    POVRAY_RECTANGLE, /* two triangles that form a parallelogram */
    POVRAY_BALL,      /* a sphere that emits to the outside */
    POVRAY_MESH       /* triangles */
};

struct povray_lamp {
    enum povray_lamp_kind kind;
    rgb radiance;
    float area;
    vec3 corner, edge1, edge2; /* rectangle */
    vec3 normal;               /* rectangle: unit, to the side that emits */
    uint32_t first, count;     /* mesh: triangles; ball: index of the sphere, 1 */
};

/* Is the light a lamp? If so, fills *out. */
bool povray_lamp(const struct scene *s, const struct light *l, struct povray_lamp *out);

/* n points on a ball or mesh, uniform over its area, and the unit normals there. Evenly spread: for
 * a ball a spiral of golden angles, for a mesh equal steps of area with golden-ratio places in the
 * triangle. shift, three numbers in [0,1), moves the whole set; if it is uniformly random, so is every
 * point. */
void povray_lamp_points(const struct scene *s, const struct povray_lamp *l, const double shift[3],
                        int n, vec3 *p, vec3 *normal);

#endif
