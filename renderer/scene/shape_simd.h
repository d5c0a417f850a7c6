/* Geometry of hits, by lanes. */
#ifndef ASSAY_SHAPE_SIMD_H
#define ASSAY_SHAPE_SIMD_H

#include "renderer/math/vec_simd.h"

/* Unit geometric normal of a triangle with edges e1 and e2 from its first corner. */
INLINE vec3v triangle_normal(vec3v e1, vec3v e2)
{
    return normalizev(crossv(e1, e2));
}

/* Unit shading normal at (u, v), interpolated between those of three corners and turned to the side of ng. */
INLINE vec3v interpolate_normals(vec3v n0, vec3v n1, vec3v n2, vec3v ng, vf u, vf v)
{
    vec3v ns = madv(madv(scalev(n0, 1 - u - v), u, n1), v, n2);
    vf l = vf_sqrt(dotv(ns, ns));
    ns = v3_select(vf_lt(vf_set(0), l), scalev(ns, 1 / l), ng);
    return v3_negate_if(vf_lt(dotv(ns, ng), vf_set(0)), ns);
}

/* The place o + t d on a sphere, and the unit normal there. out: normal_out of struct sphere. */
INLINE vec3v sphere_place(vec3v centre, vf radius, vf out, vec3v o, vec3v d, vf t, vec3v *normal)
{
    vec3v n = normalizev(subv(madv(o, t, d), centre));
    *normal = scalev(n, out);
    /* Back onto the sphere: the hit of a distant ray is off by its own rounding. */
    return madv(centre, radius, n);
}

/* p, moved off its surface by eps to the side into which direction w (of any length) leaves, so that a ray from there
 * does not hit the same flat primitive again. */
INLINE vec3v leave_surface(vec3v p, vec3v ng, vf eps, vec3v w)
{
    return madv(p, vf_select(vf_lt(dotv(w, ng), vf_set(0)), -eps, eps), ng);
}

#endif
