/* A scene of few primitives without a tree. Corners and edges that triangles share bit for bit are there
 * once, so that each is taken to a ray once: a box of ten triangles has eight corners, not thirty. */
#ifndef ASSAY_WIDE_FLAT_H
#define ASSAY_WIDE_FLAT_H

#include "bvh_wide.h"

enum { FLAT_CORNERS = 3 * WIDE_FLAT, FLAT_EDGES = 3 * WIDE_FLAT };

struct wide_flat {
    int num_corners, num_edges, num_triangles, num_spheres;
    float corner[FLAT_CORNERS][3];
    uint8_t edge[FLAT_EDGES][2]; /* its two corners */
    struct {
        uint8_t corner[3];
        uint8_t edge[3]; /* opposite each corner: twice its number, plus one if it runs backwards */
    } triangle[WIDE_FLAT];
    float sphere[WIDE_FLAT][4]; /* centre, radius */
};

/* Of a scene of up to WIDE_FLAT primitives. */
void wide_flat_fill(const struct scene *s, struct wide_flat *f);

#endif
