/* Ray-triangle and ray-sphere intersection. */
#ifndef ASSAY_SHAPE_H
#define ASSAY_SHAPE_H

#include "scene.h"

/* Corners p[corner][axis]: the intersection permutes the axes. */
struct triangle {
    float p[3][3];
};

/* The shear into a frame in which the ray starts at the origin and runs along axis kz, that of its
 * largest component. */
struct shear {
    float o[3], sx, sy, sz;
    int kx, ky, kz;
};

struct shear shape_shear(const ray *r);

/* [Woop13]. s must be the shear of r, whose tmin and tmax may have changed since. If r meets the
 * triangle inside (tmin, tmax): true, with distance t and barycentric coordinates (u, v) of the
 * second and third vertex. Both sides are hit, and edges count. Where triangles that share an edge or
 * a vertex bit for bit surround it, a ray through it hits at least one of them: no ray slips through
 * a closed mesh. */
bool triangle_intersect(const struct triangle *tri, const ray *r, const struct shear *s, float *t,
                        float *u, float *v);

/* Nearest hit inside (tmin, tmax), with the origin outside or inside the sphere. The quadratic is
 * solved without cancellation [Haines19, "Precision improvements for ray/sphere intersection"]. */
bool sphere_intersect(const struct sphere *s, const ray *r, float *t);

/* Geometry of a hit. */
struct surface {
    vec3 p;    /* on the primitive */
    vec3 ng;   /* geometric normal, unit, to the front (emitting) side */
    vec3 ns;   /* shading normal, unit, on the side of ng */
    float eps; /* how far p may be off the primitive: a few float steps of its coordinates */
};

/* prim, t, (u, v) as returned by the intersection. */
struct surface surface_at(const struct scene *s, uint32_t prim, const ray *r, float t, float u,
                          float v);

#endif
