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
    float per_area;   /* 1 over the area of the parallelogram */
    float slack;      /* of FLAT_SLACK, 1 or more: that of a thin face */
    int32_t prim[2];  /* for u + v < 1, and above */
    bool is_triangle; /* prim[0] alone */
};

/* Words of the record of a room's side: u + v - 1 of its wall, then that wall's per_area and prim[], as integers'
 * bits; -1: no wall. */
enum { SIDE_DIAGONAL = 0, SIDE_PER_AREA = 4, SIDE_PRIM = 5, SIDE_WORDS = 8 };

struct small_scene {
    int num_corners, num_edges, num_triangles, num_spheres, num_faces;
    float corner[FLAT_CORNERS][3];
    uint8_t edge[FLAT_EDGES][2]; /* its two corners */
    struct {
        uint8_t corner[3];
        uint8_t edge[3]; /* opposite each corner: twice its number, plus one if it runs backwards */
    } triangle[WIDE_FLAT];
    float sphere[WIDE_FLAT][4];       /* centre, radius */
    struct flat_face face[WIDE_FLAT]; /* the walls of the room last */
    /* The box around the triangles, if it is nowhere thinner than reach/4 and faces fill at least four of its sides, to
     * ROOM_TOLERANCE reach, as the walls of a Cornell box do: of these walls a ray from inside meets the one where it
     * leaves the box, or none, and a ray that also ends inside meets none. */
    int num_walls; /* 0: no room */
    float low[3], high[3];
    float side[6][SIDE_WORDS];      /* 2 axis + 1 if low */
    float row[WIDE_FLAT][FLAT_ROW]; /* of a triangle: its corners, one after the other */
    int32_t number[WIDE_FLAT]; /* of each triangle, then of each sphere, in the scene; ascending */
    float reach;               /* largest coordinate of a corner */
    bool quick;                /* the quick form is filled and precise enough */
};

/* Bounds on the differences between the quick form and the exact test. u and v (barycentric coordinates):
 * FLAT_ERROR m^2 per_area / |normal.d|, m being the largest coordinate of corners and origin; twice the sum
 * of the roundings of rows, products and sums in both, and of a fourth corner that is off by
 * 8 FLT_EPSILON m. t: FLAT_SLACK m / |normal.d|; the quick form's own roundings come to 14 FLT_EPSILON, those
 * of the exact test to 1 in no_self_intersection of tests/renderer/bvh/test_bvh.c. FLAT_SLACK has to be below
 * the 32 FLT_EPSILON by which rays are moved off a surface, or that surface would always be in doubt. The exact test's
 * error grows with m over the face's shorter side: the slack of a face thinner than m / FLAT_THIN grows likewise. */
#define FLAT_ERROR (512 * FLT_EPSILON)
#define FLAT_SLACK (16 * FLT_EPSILON)
#define FLAT_THIN  12
/* So much of the reach may the fourth corner of a parallelogram be off, and a wall from its side of the room. */
#define FLAT_TOLERANCE (8 * FLT_EPSILON)
#define ROOM_TOLERANCE (4 * FLT_EPSILON)

/* Fills *f with up to WIDE_FLAT primitives of a scene; prim[] must ascend. */
void small_scene_fill(const struct scene *s, const uint32_t *prim, int num, struct small_scene *f);

#endif
