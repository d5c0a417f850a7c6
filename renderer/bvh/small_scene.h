/* A list instead of a tree: for scenes of few primitives, and for the few largest primitives of
 * others. It has two forms. Exact: corners and edges that triangles share bit for bit are stored
 * once, so that each is transformed into a ray's coordinates once. Quick: planes with two in-plane
 * coordinates; two triangles that form a parallelogram share one plane. It tells which triangle a
 * ray hits, unless rounding could change the answer. */
#ifndef ASSAY_SMALL_SCENE_H
#define ASSAY_SMALL_SCENE_H

#include "bvh_wide.h"

#include <float.h>

enum { FLAT_CORNERS = 3 * WIDE_FLAT, FLAT_EDGES = 3 * WIDE_FLAT, FLAT_ROW = 16 };

/* normal.p = offset on the plane; u = u_row.p + u_row[3], v likewise; 0 to 1 inside. */
struct flat_face {
    float normal[3], offset, u_row[4], v_row[4];
    float per_area;   /* 1 over that of the parallelogram of u and v */
    int32_t prim[2];  /* where u + v < 1, and beyond */
    bool is_triangle; /* prim[0] alone */
};

struct small_scene {
    int num_corners, num_edges, num_triangles, num_spheres, num_faces;
    float corner[FLAT_CORNERS][3];
    uint8_t edge[FLAT_EDGES][2]; /* its two corners */
    struct {
        uint8_t corner[3];
        uint8_t edge[3]; /* opposite each corner: twice its number, plus one if it runs backwards */
    } triangle[WIDE_FLAT];
    float sphere[WIDE_FLAT][4]; /* centre, radius */
    struct flat_face face[WIDE_FLAT];
    float row[WIDE_FLAT][FLAT_ROW]; /* of a triangle: its corners, one after the other */
    int32_t number[WIDE_FLAT]; /* of each triangle, then of each sphere, in the scene; ascending */
    float reach;               /* largest coordinate of a corner */
    bool quick;                /* the quick form is there, and of use */
};

/* How far the quick form's u and v and the exact test's barycentric coordinates are apart, at most:
 * FLAT_ERROR m^2 per_area / |normal.d|, where no coordinate of corners and origin is above m. Twice the
 * sum of the roundings of rows, products and sums of both, and of a fourth corner that is
 * 8 FLT_EPSILON m off. Of t: FLAT_SLACK m / |normal.d|; the quick form's own roundings come to 14, those
 * of the exact test to 1 in the self-hit test of tests/renderer/bvh/test_bvh.c. It has to be less than the 32 by
 * which rays are moved off the surface that they leave, or that would always be in doubt. */
#define FLAT_ERROR (512 * FLT_EPSILON)
#define FLAT_SLACK (16 * FLT_EPSILON)

/* Of up to WIDE_FLAT primitives of a scene, in ascending order. */
void small_scene_fill(const struct scene *s, const uint32_t *prim, int num, struct small_scene *f);

#endif
