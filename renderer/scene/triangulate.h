/* Splits simple polygons into triangles. */
#ifndef ASSAY_TRIANGULATE_H
#define ASSAY_TRIANGULATE_H

#include "renderer/math/mat4.h"

#include <stddef.h>
#include <stdint.h>

enum triangulate_result {
    TRIANGULATE_OK,
    TRIANGULATE_FLAT,    /* all vertices on a line: the triangles have no area */
    TRIANGULATE_CROSSED, /* its edges cross each other: a fan from p[0] */
    TRIANGULATE_MEMORY   /* out of memory: index is not set */
};

/* Splits the polygon p[0..n-1] (n >= 3, convex or not, about planar, either winding, holes joined
 * to the rim by a double edge) into n-2 triangles whose corners index[0..3(n-2)-1] are numbers of
 * vertices, wound as the polygon. Works in the plane of the polygon's vector area by ear clipping
 * [Meisters75]; O(n^2) for most, so callers bound n. Triangles without area occur where vertices
 * lie on a line. */
enum triangulate_result triangulate(const dvec3 *p, uint32_t n, uint32_t *index);

#endif
